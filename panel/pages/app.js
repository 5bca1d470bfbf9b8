// The page: which view is open, what the head says, and the theme.
import { bus } from "./bus.js";
import { commissioning } from "./commissioning.js";
import { drives } from "./drives.js";
import { element, say } from "./elements.js";
import { faults } from "./faults.js";
import { machine } from "./machine.js";
import { parameters } from "./parameters.js";
import { scope } from "./scope.js";
import { ask, connect, hear, watch } from "./wire.js";

const VIEWS = { drives, parameters, scope, faults, bus, machine, commissioning };

const at = (id) => document.getElementById(id);
let open = null;

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
  const name = location.hash.slice(1) in VIEWS ? location.hash.slice(1) : "drives";
  for (const link of at("views").children) {
    if (link.getAttribute("href") === `#${name}`) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  open?.close?.();
  open = { name, ...VIEWS[name](at("view")) };
  watch(name);
}

function head(told) {
  say(at("bus"), told.lost ?? told.bus);
  const { allowed, writer } = told.pen;
  say(at("pen"), allowed ? `${writer} writes` : "reads only; --allow-writes lets it write");
  at("release").hidden = writer !== "this page";
  at("motion").hidden = told.motion === null;
  if (told.motion === null) return;
  say(at("moves"), told.motion.runs ? "in motion" : `not in motion (${told.motion.said})`);
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
at("views").append(...Object.keys(VIEWS).map((name) => element("a", { href: `#${name}` }, name)));
addEventListener("hashchange", show);
hear((told) => {
  head(told);
  if (open !== null && told.view === open.name) open.take?.(told);
});
connect((there) => {
  if (!there) say(at("bus"), "the panel has gone; waiting for it");
});
show();
