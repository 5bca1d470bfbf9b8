// Curves over time by uPlot, with two cursors and zoom.
import uPlot from "./vendor/uplot/uPlot.esm.js";

// Distinguishable by the colour-blind (Okabe and Ito 2008), those of the dark theme a little lighter; dashed from the seventh on.
const COLOURS = {
  light: ["#0072b2", "#d55e00", "#009e73", "#a3568a", "#8a6d00", "#1b2630"],
  dark: ["#56b4e9", "#f0854a", "#2fcf9f", "#e29cc8", "#f0e442", "#e4eaef"],
};
const DASH = [8, 4];
const MOST_AXES = { wide: 4, narrow: 2 }; // further units are read in the table
const NARROW = 700; // [px]

const theme = () => (document.documentElement.dataset.theme === "dark" ? "dark" : "light");

export const colour = (number) => COLOURS[theme()][number % 6];

function axis(label, upright, curve = null) {
  const style = getComputedStyle(document.body);
  const [ink, line] = ["--ink", "--line"].map((name) => style.getPropertyValue(name).trim());
  return { label, stroke: curve === null ? ink : colour(curve), grid: { stroke: line, width: 1 }, ticks: { stroke: line, width: 1 }, labelSize: 20, size: upright ? 60 : 36 };
}

function size(place, height) {
  return { width: Math.max(200, place.clientWidth), height };
}

// Curves over time; a scale for each unit. `onZoom(from, to)` is told what was dragged over, nothing where all is shown again.
export function timePlot(place, channels, cursors, onZoom) {
  const units = [...new Set(channels.map((each) => each.unit))].slice(0, MOST_AXES[place.clientWidth < NARROW ? "narrow" : "wide"]);
  // In the colour of its curve, where it is the axis of one alone.
  const only = (unit) => (channels.filter((each) => each.unit === unit).length === 1 ? channels.findIndex((each) => each.unit === unit) : null);
  const plot = new uPlot({
    ...size(place, 380),
    legend: { show: false },
    cursor: { drag: { x: true, y: false, setScale: false }, points: { show: false } },
    scales: { x: { time: false } },
    axes: [axis("s", false), ...units.map((unit, number) => ({ ...axis(unit || "1", true, only(unit)), scale: unit || "1", side: number === 0 ? 3 : 1, grid: { show: number === 0 } }))],
    series: [{}, ...channels.map((each, number) => ({
      label: each.label, scale: each.unit || "1", stroke: colour(number), width: 1.4, spanGaps: true, dash: number >= 6 ? DASH : undefined, points: { show: false },
    }))],
    hooks: {
      setSelect: [(made) => {
        if (made.select.width > 4) onZoom(made.posToVal(made.select.left, "x"), made.posToVal(made.select.left + made.select.width, "x"));
        made.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
      }],
      draw: [(made) => drawCursors(made, cursors())],
      ready: [(made) => made.over.addEventListener("dblclick", () => onZoom())],
    },
  }, [[0], ...channels.map(() => [null])], place);
  new ResizeObserver(() => plot.setSize(size(place, 380))).observe(place);
  return plot;
}

// Curves over the logarithm of the frequency, all in one unit.
export function bodePlot(place, unit, curves) {
  const measured = curves[0].frequency.filter((each) => each > 0);
  const horizontal = { ...axis("Hz", false), values: (_, splits) => splits.map((each) => (each === null ? "" : String(each))) };
  const ends = [Math.min(...measured), Math.max(...measured)];
  return curvePlot(place, horizontal, { distr: 3, range: ends }, unit, curves.map((each) => ({ ...each, over: each.frequency })));
}

// Curves over anything else that rises, `over`, each axis in its unit.
export const linePlot = (place, over, unit, curves) => curvePlot(place, axis(over, false), {}, unit, curves);

function curvePlot(place, horizontal, scale, unit, curves) {
  const height = 240;
  const plot = new uPlot({
    ...size(place, height),
    legend: { show: false },
    cursor: { show: false },
    scales: { x: { time: false, ...scale } },
    axes: [horizontal, axis(unit, true)],
    series: [{}, ...curves.map((each, number) => ({ label: each.label, stroke: colour(number), width: 1.6, points: { show: false } }))],
  }, [curves[0].over, ...curves.map((each) => each.values)], place);
  const watcher = new ResizeObserver(() => plot.setSize(size(place, height)));
  watcher.observe(place);
  return { destroy: () => { watcher.disconnect(); plot.destroy(); } };
}

function drawCursors(plot, cursors) {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.strokeStyle = getComputedStyle(document.body).getPropertyValue("--bad").trim();
  ctx.setLineDash([6, 4]);
  for (const at of cursors.filter((each) => each !== null)) {
    const x = plot.valToPos(at, "x", true);
    if (x < bbox.left || x > bbox.left + bbox.width) continue;
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
  }
  ctx.restore();
}
