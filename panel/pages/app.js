// The page: which view is open, what the head says, and the theme.
import { bus } from "./bus.js";
import { commissioning } from "./commissioning.js";
import { drives } from "./drives.js";
import { element, say } from "./elements.js";
import { faults } from "./faults.js";
import { machine } from "./machine.js";
import { parameters } from "./parameters.js";
import { run } from "./run.js";
import { scope } from "./scope.js";
import { ask, connect, hear, watch } from "./wire.js";

const VIEWS = { run, drives, parameters, scope, faults, bus, machine, commissioning };

const at = (id) => document.getElementById(id);
let open = null;
let offered = []; // views that this panel has, the first is opened where nobody chooses

export function refused(error) {
  at("said").hidden = false;
  say(at("said"), error.message);
}

// Do what a button says; what is refused is said in words.
export async function act(what, more) {
  try {
    const answer = await ask(what, more);
    at("said").hidden = true;
    return answer;
  } catch (error) {
    refused(error);
    return undefined;
  }
}

function show() {
  const name = offered.includes(location.hash.slice(1)) ? location.hash.slice(1) : offered[0];
  if (name === undefined) return;
  for (const link of at("views").children) {
    if (link.getAttribute("href") === `#${name}`) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  open?.close?.();
  open = { name, ...VIEWS[name](at("view")) };
  at("view").inert = true; // its controls mean nothing before it was told what there is
  watch(name);
}

function head(told) {
  say(at("bus"), told.lost ?? told.bus);
  at("place").hidden = told.bus === "";
  const { allowed, writer } = told.pen;
  say(at("pen"), allowed ? `${writer} writes` : "reads only; --allow-writes lets it write");
  at("release").hidden = writer !== "this page";
  at("motion").hidden = told.motion === null;
  if (told.motion === null) return;
  const why = told.motion.said === "" ? "" : ` (${told.motion.said})`;
  say(at("moves"), told.motion.runs ? "in motion" : `not in motion${why}`);
  say(at("move"), told.motion.runs ? "stop" : "start");
  at("move").disabled = !allowed;
  at("move").title = allowed ? "" : "needs --allow-writes";
}

function theme(chosen) {
  document.documentElement.dataset.theme = chosen;
  localStorage.setItem("theme", chosen);
  open?.themed?.();
}

const preferred = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
theme(localStorage.getItem("theme") ?? preferred);
at("theme").addEventListener("click", () => theme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
at("release").addEventListener("click", () => act("release"));
at("move").addEventListener("click", () => act("motion", { runs: at("move").textContent === "start" }));

// Which views there are; another panel may answer at this address after a while.
async function offer() {
  const views = await ask("views");
  if (views.join() === offered.join()) return;
  offered = views;
  at("views").replaceChildren(...views.map((name) => element("a", { href: `#${name}` }, name)));
  show();
}

addEventListener("hashchange", show);
hear((told) => {
  head(told);
  if (open === null || told.view !== open.name) return;
  at("view").inert = false;
  open.take?.(told);
});
connect((there) => {
  if (there) {
    offer().catch(refused);
    return;
  }
  offered = []; // whatever answers next may show another bus
  at("view").inert = at("motion").hidden = at("release").hidden = true;
  [at("place").hidden, at("bus").textContent] = [false, "the panel has gone; waiting for it"];
});
