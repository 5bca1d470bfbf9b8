// The state machine of CiA 402-2 as the standard draws it (figure 'FSA'), with its numbered transitions.
import { drawn } from "./elements.js";

const BOX = { width: 210, height: 40 };
const PLACES = {
  "Not ready to switch on": [70, 40],
  "Switch on disabled": [70, 130],
  "Ready to switch on": [70, 220],
  "Switched on": [70, 310],
  "Operation enabled": [70, 400],
  "Fault reaction active": [410, 40],
  "Fault": [410, 130],
  "Quick stop active": [410, 400],
};
const ARROWS = [
  [0, "M175 14 V38", 190, 27],
  [1, "M175 80 V128", 190, 108],
  [2, "M130 170 V218", 115, 198],
  [7, "M220 218 V172", 236, 198],
  [3, "M130 260 V308", 115, 288],
  [6, "M220 308 V262", 236, 288],
  [4, "M130 350 V398", 115, 378],
  [5, "M220 398 V352", 236, 378],
  [8, "M70 412 H44 V240 H68", 32, 330],
  [9, "M70 430 H14 V150 H68", 24, 210],
  [10, "M280 330 H310 V160 H282", 322, 250],
  [11, "M280 412 H408", 345, 405],
  [16, "M410 428 H282", 345, 446],
  [12, "M460 400 V200 H360 V148 H282", 476, 300],
  [13, "M330 60 H408", 369, 52],
  [14, "M515 80 V128", 532, 108],
  [15, "M410 138 H282", 345, 131],
];

let made = 0;

// The diagram, and a function that marks the present state.
export function stateDiagram() {
  made += 1;
  const id = `head-${made}`;
  const head = drawn("marker", { id, viewBox: "0 0 8 8", refX: 7, refY: 4, markerWidth: 8, markerHeight: 8, orient: "auto" },
    drawn("path", { d: "M0 0 L8 4 L0 8 z" }));
  const arrows = ARROWS.flatMap(([number, path, x, y]) => {
    const label = drawn("text", { class: "number", x, y });
    label.textContent = number;
    return [drawn("path", { d: path, "marker-end": `url(#${id})` }), label];
  });
  const any = drawn("text", { class: "number", x: 322, y: 52, "text-anchor": "end" });
  any.textContent = "any";
  const boxes = Object.entries(PLACES).map(([name, [x, y]]) => {
    const text = drawn("text", { x: x + BOX.width / 2, y: y + 25 });
    text.textContent = name;
    const rect = drawn("rect", { x, y, rx: 6, ...BOX });
    return drawn("g", { "data-state": name, class: name.startsWith("Fault") ? "fault" : "" }, rect, text);
  });
  const svg = drawn("svg", { class: "states", viewBox: "0 0 640 456", role: "img", "aria-label": "CiA 402 state machine" },
    drawn("defs", {}, head), ...arrows, any, ...boxes);
  const mark = (state) => {
    for (const box of boxes) box.classList.toggle("present", box.dataset.state === state);
  };
  return [svg, mark];
}
