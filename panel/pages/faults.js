// Faults: each by hand, what was struck, and what drives and controller did then.
import { act, refused } from "./app.js";
import { element, say, table } from "./elements.js";

export function faults(place) {
  const kind = element("select", { "aria-label": "Fault" });
  const summary = element("p", { class: "soft" });
  const fields = element("div", { class: "row" });
  const strike = element("button", { "data-is": "strike" }, "Strike");
  const struck = element("div", { "data-is": "struck" });
  const events = element("div", { class: "list", "data-is": "events" });
  const controller = element("p", { "data-is": "controller" });
  let kinds = null, asked = false, allowed = false, nodes = [], shownStruck = "", shownEvents = "";

  place.replaceChildren(
    element("section", {}, element("h2", {}, "Strike a fault"), element("div", { class: "row" }, kind, strike), summary, fields),
    element("section", {}, element("h2", {}, "Struck"), struck),
    element("section", {}, element("h2", {}, "What happened"), controller, events));
  kind.addEventListener("change", form);
  strike.addEventListener("click", () => {
    const told = { fault: kind.value };
    let seconds = null;
    for (const field of fields.querySelectorAll("[name]")) {
      if (field.value === "") continue;
      if (field.name === "for") seconds = Number(field.value.replace(",", "."));
      else told[field.name] = field.value;
    }
    if (Number.isNaN(seconds)) refused(new Error("for: expected seconds, such as 0.5"));
    else act("strike", { told, seconds });
  });

  async function load() {
    asked = true;
    kinds = await act("faults") ?? null;
    asked = kinds !== null;
    if (!asked) return;
    kind.replaceChildren(...Object.keys(kinds).map((name) => element("option", { value: name }, name)));
    kind.value = "sto" in kinds ? "sto" : kind.value;
    form();
    allow();
  }

  // Only what is known can be struck.
  function allow() {
    strike.disabled = !allowed || kinds === null;
  }

  function form() {
    const chosen = kinds[kind.value];
    if (chosen === undefined) return;
    say(summary, chosen.summary);
    const more = chosen.lasts ? [["for", { meaning: "how long it lasts", expected: "seconds of the machine's time; empty: until it is ended", needed: false, default: null }]] : [];
    fields.replaceChildren(...[...Object.entries(chosen.parameters), ...more].map(([name, told]) => entry(name, told, nodes)));
  }

  return {
    take(told) {
      nodes = told.nodes;
      if (!asked && told.emulated) load();
      if (!told.emulated) say(summary, "Faults are struck in an emulator, and this panel has started none: drivetwin panel --emulate scara");
      allowed = told.pen.allowed && told.emulated;
      allow();
      strike.title = told.pen.allowed ? "" : "needs --allow-writes";
      say(controller, told.motion === null ? "" : told.motion.runs ? "The controller runs." : `The controller has ended: ${told.motion.said}`);
      const now = JSON.stringify([told.struck, told.pen.allowed]);
      if (now !== shownStruck) {
        shownStruck = now;
        struck.replaceChildren(told.struck.length === 0 ? element("p", { class: "soft" }, "nothing yet")
          : table(["at", "fault", "parameters", ""], told.struck.map((one) => [`${one.at.toFixed(3)} s`, one.told.fault, parameters(one.told), ending(one, told.pen.allowed)])));
      }
      const happened = JSON.stringify(told.events);
      if (happened !== shownEvents) {
        shownEvents = happened;
        const first = told.struck[0]?.at;
        const since = (time) => (first === undefined || time < first ? "" : `+${(time - first).toFixed(3)} s`);
        events.replaceChildren(table(["time", "since the fault", "who", "drive", "what"],
          told.events.map((one) => [`${one.time.toFixed(3)} s`, since(one.time), one.who, one.node, one.words])));
      }
    },
  };
}

function entry(name, told, nodes) {
  const value = told.default ?? "";
  const label = `${name}${told.needed ? "" : " (may be empty)"}`;
  const field = name === "node"
    ? element("select", { name }, ...nodes.map((each) => element("option", { value: each.id }, `${each.id} ${each.name}`)), element("option", { value: "all" }, "all"))
    : element("input", { name, size: 10, value, title: `${told.meaning}; ${told.expected}` });
  return element("label", { class: "field" }, element("span", { class: "soft" }, label), field, element("span", { class: "soft small" }, `${told.meaning}; ${told.expected}`));
}

const parameters = (told) => Object.entries(told).filter(([name]) => name !== "fault").map(([name, value]) => `${name} ${value}`).join(", ");

function ending(one, allowed) {
  if (one.ended !== null) return `ended at ${one.ended.toFixed(3)} s`;
  if (!one.lasts) return "";
  return element("button", { "data-is": "end", disabled: !allowed, onclick: () => act("end", { told: one.told }) }, "End it");
}
