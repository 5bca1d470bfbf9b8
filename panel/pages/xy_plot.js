// One channel over another, as points: pairs have no order that a line could follow.
import { element } from "./elements.js";
import { colour } from "./plot.js";

const HEIGHT = 320;
const EDGE = { left: 78, right: 16, top: 12, bottom: 40 };

// A canvas in `place`, and a function that draws what it is told.
export function xyPlot(place, x, y) {
  const canvas = element("canvas", { role: "img", "aria-label": `${y.label} over ${x.label}` });
  place.replaceChildren(canvas);
  return { draw: (told) => draw(canvas, place.clientWidth, told, [`${x.label} [${x.unit}]`, `${y.label} [${y.unit}]`]) };
}

function draw(canvas, width, told, labels) {
  const sharp = devicePixelRatio || 1;
  [canvas.width, canvas.height] = [width * sharp, HEIGHT * sharp];
  canvas.style.width = `${width}px`;
  canvas.style.height = `${HEIGHT}px`;
  const ctx = canvas.getContext("2d");
  ctx.scale(sharp, sharp);
  const style = getComputedStyle(document.body);
  const [ink, line] = ["--ink", "--line"].map((name) => style.getPropertyValue(name).trim());
  const [xs, ys] = [scale(told.x, EDGE.left, width - EDGE.right), scale(told.y, HEIGHT - EDGE.bottom, EDGE.top)];
  ctx.font = "12px system-ui, sans-serif";
  ctx.fillStyle = ink;
  ctx.strokeStyle = line;
  for (const share of [0, 0.25, 0.5, 0.75, 1]) {
    const [x, y] = [xs.place(xs.at(share)), ys.place(ys.at(share))];
    ctx.strokeRect(EDGE.left, y, width - EDGE.left - EDGE.right, 0);
    ctx.strokeRect(x, EDGE.top, 0, HEIGHT - EDGE.top - EDGE.bottom);
    ctx.textAlign = "right";
    ctx.fillText(Number(ys.at(share).toPrecision(3)), EDGE.left - 6, y + 4);
    ctx.textAlign = "center";
    ctx.fillText(Number(xs.at(share).toPrecision(3)), x, HEIGHT - EDGE.bottom + 16);
  }
  ctx.fillText(labels[0], (EDGE.left + width - EDGE.right) / 2, HEIGHT - 6);
  ctx.save();
  ctx.rotate(-Math.PI / 2);
  ctx.fillText(labels[1], -HEIGHT / 2, 12);
  ctx.restore();
  ctx.fillStyle = colour(0);
  told.x.forEach((x, number) => ctx.fillRect(xs.place(x) - 1.5, ys.place(told.y[number]) - 1.5, 3, 3));
}

// From values to places on the screen, with a margin.
function scale(values, from, to) {
  const [low, high] = values.length === 0 ? [0, 1] : [Math.min(...values), Math.max(...values)];
  const margin = 0.05 * (high - low) || 1;
  const at = (share) => low - margin + share * (high - low + 2 * margin);
  return { at, place: (value) => from + (value - at(0)) / (at(1) - at(0)) * (to - from) };
}
