// One channel over another, as points: pairs have no order that a line could follow.
import { element } from "./elements.js";
import { colour } from "./plot.js";

const HEIGHT = 320;
const EDGE = { left: 78, right: 16, top: 12, bottom: 40 };
const APART = 90; // numbers of the horizontal axis, at least [px]

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
  const [right, bottom] = [width - EDGE.right, HEIGHT - EDGE.bottom];
  const [xs, ys] = [scale(told.x, EDGE.left, right), scale(told.y, bottom, EDGE.top)];
  ctx.font = "12px system-ui, sans-serif";
  ctx.fillStyle = ink;
  ctx.strokeStyle = line;
  const grid = (value, ...rest) => {
    ctx.strokeStyle = value === 0 ? ink : line;
    ctx.strokeRect(...rest);
  };
  ctx.textAlign = "center";
  for (const value of ticks(xs, (right - EDGE.left) / APART)) {
    grid(value, xs.place(value), EDGE.top, 0, bottom - EDGE.top);
    ctx.fillText(value, xs.place(value), bottom + 16);
  }
  ctx.textAlign = "right";
  for (const value of ticks(ys, (bottom - EDGE.top) / (APART / 2))) {
    grid(value, EDGE.left, ys.place(value), right - EDGE.left, 0);
    ctx.fillText(value, EDGE.left - 6, ys.place(value) + 4);
  }
  ctx.textAlign = "center";
  ctx.fillText(labels[0], (EDGE.left + right) / 2, HEIGHT - 6);
  ctx.save();
  ctx.rotate(-Math.PI / 2);
  ctx.fillText(labels[1], -(EDGE.top + bottom) / 2, 12);
  ctx.restore();
  ctx.fillStyle = colour(0);
  told.x.forEach((x, number) => ctx.fillRect(xs.place(x) - 1.5, ys.place(told.y[number]) - 1.5, 3, 3));
}

// From values to places on the screen, with a margin.
function scale(values, from, to) {
  const [low, high] = values.length === 0 ? [0, 1] : [Math.min(...values), Math.max(...values)];
  const margin = 0.05 * (high - low) || 1;
  const [start, end] = [low - margin, high + margin];
  return { start, end, place: (value) => from + (value - start) / (end - start) * (to - from) };
}

// Round numbers on a scale, `most` at most: 1, 2 or 5 times a power of ten apart.
function ticks({ start, end }, most) {
  const least = (end - start) / most;
  const power = 10 ** Math.floor(Math.log10(least));
  const step = [1, 2, 5, 10].map((each) => each * power).find((each) => each >= least);
  const first = Math.ceil(start / step);
  return Array.from({ length: Math.floor(end / step) - first + 1 }, (_, number) => Number(((first + number) * step).toPrecision(12)));
}
