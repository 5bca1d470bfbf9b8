// What the scope shows and waits for: channels, window, trigger, pre-trigger, XY. Every page sees the same instrument.
import { act } from "./app.js";
import { address, element, say } from "./elements.js";

const QUANTITIES = ["position", "velocity", "torque"];

export function scopeBar(set, runs) {
  const select = (label, ...options) => element("select", { "aria-label": label }, ...options);
  const option = (value, text = value) => element("option", { value }, text);
  const run = element("button", { "data-is": "run" });
  const node = select("Drive or truth");
  const object = element("input", { list: "objects", placeholder: "6077, 606C, torque …", "aria-label": "Object" });
  const objects = element("datalist", { id: "objects" });
  const add = element("button", {}, "Add channel");
  const chips = element("div", { class: "row", "data-is": "channels" });
  const windows = select("Window");
  const pre = select("Before the trigger", ...[0, 0.1, 0.2, 0.5, 0.8].map((share) => option(share, `${100 * share} % before`)));
  const kind = select("Trigger", option("", "no trigger"), option("rises"), option("falls"), option("state", "enters the state"));
  const on = select("Trigger channel");
  const level = element("input", { size: 8, value: "0", "aria-label": "Level" });
  const state = select("State");
  const apply = element("button", {}, "Set");
  const xs = select("X"), ys = select("Y");
  let told = null, listed = "", choices = Promise.resolve([]), editing = false; // a trigger that is being entered stays until it is set

  // One after the other: `more` says, from what is set then, what changes; `known` is what it waits for.
  let last = Promise.resolve();
  function send(more, known = undefined) {
    last = last.then(async () => {
      const found = await known;
      const wanted = { ...told.set, ...more(told.set, found) };
      if (await set(wanted) !== undefined) told.set = wanted;
    });
    return last;
  }

  // The objects of the drive that is chosen now: adding a channel waits for them.
  async function list() {
    const these = node.value.startsWith("truth") ? QUANTITIES.map((name) => ({ name, key: `${node.value}:${name}` })) : numbers(Number(node.value));
    choices = Promise.resolve(these);
    const mine = choices;
    const names = (await mine).map((each) => option(each.name));
    if (mine === choices) objects.replaceChildren(...names);
  }

  function chosen(among, entered) {
    const words = entered.trim().toLowerCase();
    return among.find((each) => each.name.toLowerCase() === words) ?? among.find((each) => words !== "" && each.name.toLowerCase().includes(words));
  }

  node.addEventListener("change", list);
  add.addEventListener("click", () => {
    const [where, words, among] = [node.value, object.value, choices];
    object.value = "";
    send(({ channels }, these) => ({ channels: [...channels, chosen(these, words)?.key ?? `${where}:${words}`] }), among);
  });
  windows.addEventListener("change", () => {
    const window = Number(windows.value);
    send(() => ({ window }));
  });
  apply.addEventListener("click", () => {
    const trigger = kind.value === "" ? null : { channel: on.value, kind: kind.value, level: Number(level.value), state: kind.value === "state" ? state.value : "" };
    const share = Number(pre.value);
    editing = false;
    send(() => ({ trigger, pre: share }));
  });
  for (const each of [kind, on, level, state, pre]) each.addEventListener("input", () => { editing = true; });
  for (const each of [xs, ys]) each.addEventListener("change", () => {
    const [x, y] = [xs.value, ys.value];
    if (x === "" && y === "") send(() => ({ xy: null }));
    else if (x !== "" && y !== "") send(() => ({ xy: [x, y] }));
  });
  kind.addEventListener("change", shape);
  run.addEventListener("click", () => runs(run.textContent === "Run"));

  function shape() {
    on.hidden = kind.value === "";
    level.hidden = kind.value === "" || kind.value === "state";
    state.hidden = kind.value !== "state";
  }
  shape();

  function remove(key) {
    send(({ channels, trigger, xy }) => ({
      channels: channels.filter((each) => each !== key),
      trigger: trigger?.channel === key ? null : trigger,
      xy: xy?.includes(key) ? null : xy,
    }));
  }

  function renew() {
    const keys = told.channels.map((each) => option(each.key, each.label));
    const { trigger, xy } = told.set, entered = [on.value, state.value], over = [xs.value, ys.value];
    on.replaceChildren(...keys.map((each) => each.cloneNode(true)));
    xs.replaceChildren(option("", "X: none"), ...keys.map((each) => each.cloneNode(true)));
    ys.replaceChildren(option("", "Y: none"), ...keys.map((each) => each.cloneNode(true)));
    [xs.value, ys.value] = (over[0] === "") !== (over[1] === "") ? over : xy ?? ["", ""]; // one of two is still being entered
    windows.replaceChildren(...told.windows.map((each) => option(each, `${each} s`)));
    windows.value = told.set.window;
    state.replaceChildren(...told.states.map((each) => option(each)));
    if (editing) {
      if (told.channels.some((each) => each.key === entered[0])) on.value = entered[0];
      if (told.states.includes(entered[1])) state.value = entered[1];
    } else {
      [kind.value, pre.value] = [trigger?.kind ?? "", told.set.pre];
      if (trigger !== null) [on.value, level.value, state.value] = [trigger.channel, trigger.level, trigger.state || state.value];
      shape();
    }
    const out = (each) => element("button", { title: "take it away", onclick: () => remove(each.key) }, `${each.label} ✕`);
    chips.replaceChildren(...told.channels.map(out));
  }

  return {
    run,
    section: element("section", {},
      element("h2", {}, "Channels"),
      chips, element("div", { class: "row" }, node, object, objects, add),
      element("div", { class: "row" }, windows, kind, on, level, state, pre, apply),
      element("div", { class: "row" }, ys, element("span", {}, "over"), xs)),
    take(now) {
      told = now;
      say(run, now.state === "stopped" || now.state === "triggered" ? "Run" : "Stop");
      if (node.children.length === 0) {
        node.replaceChildren(...now.nodes.map((each) => option(each.id, `${each.id} ${each.name}`)), ...now.truths.map((axis) => option(`truth:${axis}`, `truth: ${axis}`)));
        list();
      }
      const names = JSON.stringify([now.set, now.channels.map((each) => each.label)]);
      if (names !== listed) {
        listed = names;
        renew();
      }
    },
  };
}

// The objects of a drive that are numbers, by the key that the scope knows them by.
async function numbers(node) {
  const objects = await act("objects", { node }) ?? [];
  return objects.filter((each) => each.low !== null).map((each) => ({
    name: `${address(each.index, each.subindex)} ${each.object} ${each.name === each.object ? "" : each.name}`.trim(),
    key: `${node}:${address(each.index, each.subindex).replace("h", "")}`,
  }));
}
