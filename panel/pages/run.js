// Run: how far a command is that tells of itself, what it says, and its page once there is one.
import { element, say } from "./elements.js";

export function run(place) {
  const title = element("h2", { "data-is": "command" }, "waiting for the command");
  const whole = element("progress", { max: 1, "aria-label": "All of it", hidden: true });
  const phases = element("div", { class: "phases", "data-is": "phases" });
  const lines = element("pre", { class: "lines", "data-is": "lines", hidden: true });
  const outcome = element("p", { class: "big", "data-is": "outcome" });
  const report = element("div");
  let shown = null;
  place.replaceChildren(element("section", {}, title, whole, outcome, phases, lines), report);
  return {
    take(told) {
      if (told.command) say(title, `drivetwin ${told.command}`);
      whole.hidden = told.share === null;
      whole.value = told.share ?? 0;
      renew(phases, told.phases);
      lines.hidden = told.lines.length === 0;
      if (lines.textContent !== told.lines.join("\n")) {
        lines.textContent = told.lines.join("\n");
        lines.scrollTop = lines.scrollHeight;
      }
      say(outcome, told.outcome);
      phases.hidden = told.outcome !== ""; // then all of them are done
      if (told.page === shown) return;
      shown = told.page;
      report.replaceChildren(...(shown === null ? [] : [page(shown)]));
    },
  };
}

// The last phases with a bar each; those that are there are moved on, not made anew.
function renew(phases, told) {
  while (phases.children.length > told.length) phases.lastChild.remove();
  while (phases.children.length < told.length) phases.append(element("p", {}, element("span"), element("progress", { max: 1 })));
  told.forEach((phase, number) => {
    const [name, bar] = phases.children[number].children;
    say(name, phase.name);
    bar.value = phase.share;
    bar.setAttribute("aria-label", phase.name);
  });
}

function page(address) {
  return element("section", {},
    element("h2", {}, "Report"),
    element("p", {}, element("a", { href: address, target: "_blank" }, "in a page of its own")),
    element("iframe", { class: "report", src: address, title: "Report", sandbox: "allow-scripts allow-downloads" }));
}
