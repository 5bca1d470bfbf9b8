// Drives: NMT, state, commands, mode, statusword, EMCYs of every node.
import { act } from "./app.js";
import { element, say, table } from "./elements.js";
import { machineOn } from "./machine.js";
import { stateDiagram } from "./states.js";

const PREVIEW = 190; // height of the machine beside what to do next

const COMMANDS = ["Shutdown", "Switch on", "Enable operation", "Quick stop", "Disable voltage", "Fault reset"];
const NMT = ["Start", "Stop", "Enter pre-operational", "Reset node", "Reset communication"];

export function drives(place) {
  const cards = new Map();
  const grid = element("div", { class: "cards" });
  const first = next();
  place.replaceChildren(first.section, grid);
  return {
    close: first.close,
    take(told) {
      first.take(told);
      for (const node of told.nodes) {
        if (!cards.has(node.id)) {
          cards.set(node.id, card(node));
          grid.append(cards.get(node.id).section);
        }
        cards.get(node.id).take(node, told.pen.allowed);
      }
    },
  };
}

// What a person may do next, beside the machine as it moves.
function next() {
  const kept = localStorage.getItem("next") ?? "open";
  const stage = element("div", { class: "stage", "data-is": "preview" });
  const list = element("ul");
  const details = element("details", { open: kept === "open" },
    element("summary", {}, "What to do next"), element("div", { class: "first" }, list, stage));
  let picture = null, allowed = null;
  details.addEventListener("toggle", () => localStorage.setItem("next", details.open ? "open" : "closed"));
  return {
    section: element("section", {}, details),
    close: () => picture?.close(),
    take(told) {
      if (told.pen.allowed !== allowed) {
        allowed = told.pen.allowed;
        list.replaceChildren(...suggestions(allowed, told.motion !== null));
      }
      if (told.geoms === null || !details.open) return;
      picture ??= machineOn(stage, PREVIEW);
      if (picture.why === "") picture.take(told.geoms);
    },
  };
}

function suggestions(allowed, emulated) {
  const view = (name) => element("a", { href: `#${name}` }, name);
  const code = (text) => element("code", {}, text);
  const command = allowed ? "Stop the motion above, then command a drive by the buttons of its card; write its parameters in "
    : "To command drives, write parameters and strike faults, start ";
  return [
    ["Each card is a drive: its present state is filled in. ", view("scope"), " draws position, torque or any other object over time, ", view("machine"), " shows the axes, ", view("bus"), " the frames."],
    allowed ? [command, view("parameters"), "."] : [command, code("drivetwin panel --allow-writes"), "."],
    ...(emulated && allowed ? [["Take a drive's torque away in ", view("faults"), " and see what the controller does; measure loops and gains in ", view("commissioning"), "."]] : []),
    ["To look at drives of your own: ", code("drivetwin panel --bus can0 --profile servoone"), "; it only reads."],
    ...(emulated ? [["Other programs join this machine's bus by the name in the head of this page."]] : []),
  ].map((words) => element("li", {}, ...words));
}

function card(first) {
  const [diagram, mark] = stateDiagram();
  const title = element("h2", {}, `${first.id} ${first.name}`);
  const silent = element("p", { class: "bad", hidden: true });
  const state = element("b");
  const nmt = element("span"), mode = element("span"), position = element("span", { class: "big", "data-is": "position" });
  const register = element("span"), torque = element("span", { class: "soft", "data-is": "torque" });
  const button = (what, name) => element("button", { "data-name": name, onclick: () => act(what, { node: first.id, name }) }, name);
  const commands = COMMANDS.map((name) => button("command", name));
  const services = NMT.map((name) => button("nmt", name));
  const word = element("h3", {}, "Statusword");
  const bits = element("ul", { class: "bits" });
  const emergencies = element("div");
  let shown = "";
  const section = element("section", { "data-node": first.id }, title, silent,
    element("p", {}, position, " ", torque),
    element("p", {}, state, " · NMT ", nmt, " · mode ", mode, " · error register ", register),
    diagram,
    element("div", { class: "row" }, ...commands),
    word, bits,
    element("h3", {}, "EMCY"), emergencies,
    element("details", {}, element("summary", {}, "NMT commands"), element("div", { class: "row" }, ...services)));
  return {
    section,
    take(node, allowed) {
      silent.hidden = node.silent === "";
      say(silent, node.silent);
      say(state, node.state ?? "state unknown");
      state.className = node.state?.startsWith("Fault") ? "bad" : "";
      mark(node.state);
      say(nmt, node.nmt);
      say(mode, `${node.mode ?? ""} ${node.mode_name}`);
      say(register, node.register ?? "unknown");
      say(position, where(node));
      say(torque, node.torque === null ? "" : `${fixed(node.torque, 2)} ${node.torque_unit}`);
      for (const each of commands) {
        each.disabled = !allowed || !node.commands.includes(each.dataset.name);
        each.title = allowed ? "" : "needs --allow-writes";
      }
      for (const each of services) each.disabled = !allowed;
      say(word, node.statusword === null ? "Statusword" : `Statusword ${node.statusword.toString(16).padStart(4, "0")}h`);
      takeBits(bits, node);
      const now = JSON.stringify(node.emergencies);
      if (now !== shown) {
        shown = now;
        emergencies.replaceChildren(history(node.emergencies));
      }
    },
  };
}

function where(node) {
  if (node.joint !== null) return `${fixed(node.joint, 4)} ${node.unit}`;
  return node.position === null ? "position unknown" : `${node.position} position units`;
}

function takeBits(bits, node) {
  if (bits.children.length !== node.bits.length) bits.replaceChildren(...node.bits.map(() => element("li")));
  node.bits.forEach((name, bit) => {
    const set = node.statusword !== null && (node.statusword >> bit) & 1;
    say(bits.children[bit], `${bit} ${name}`);
    bits.children[bit].classList.toggle("set", Boolean(set));
  });
}

function history(emergencies) {
  if (emergencies.length === 0) return element("p", { class: "soft" }, "none");
  const clock = (since) => (since === null ? "before" : new Date(since * 1000).toLocaleTimeString());
  return table(["time", "code", "meaning", "register"],
    emergencies.slice(0, 12).map((each) => [clock(each.since), each.code, each.words, each.register ?? ""]));
}

// Without a sign before nothing but zeros.
const fixed = (value, digits) => value.toFixed(digits).replace(/^-(0\.0*)$/, "$1");
