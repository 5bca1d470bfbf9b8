// Scope: channels over time, trigger, cursors, zoom, one channel over another, and files of what is shown.
import { act, refused } from "./app.js";
import { element, keep, say } from "./elements.js";
import { scopeBar } from "./scope_bar.js";
import { colour, timePlot } from "./plot.js";
import { unpacked } from "./wire.js";
import { xyPlot } from "./xy_plot.js";

export function scope(place) {
  const curves = element("div", { class: "plot", "aria-label": "Channels over time" });
  const over = element("div", { class: "plot", "aria-label": "One channel over another" });
  const state = element("b", { "data-is": "state" });
  const readings = element("div", { class: "scroll", "data-is": "readings" });
  const cursors = [null, null];
  let told = null, plot = null, xy = null, drawnFor = "", xyFor = "", zoomed = null, nextCursor = 0;

  const bar = scopeBar((set) => act("scope set", set), (runs) => act("scope run", { runs }));
  const keep = (name) => element("button", { onclick: () => save(name) }, name.endsWith("csv") ? "Save CSV" : "Save recording");
  const whole = element("button", { onclick: () => zoom() }, "Whole window");
  const clear = element("button", { onclick: () => { cursors.fill(null); draw(); } }, "No cursors");
  place.replaceChildren(element("section", {},
    element("div", { class: "row" }, state, bar.run, keep("scope.csv"), keep("scope.zip"), whole, clear),
    curves,
    element("p", { class: "soft" }, "Click: a cursor. Drag: zoom into what is held. Double click: the whole window."),
    readings, over), bar.section);
  curves.addEventListener("click", (event) => {
    if (plot === null || event.detail > 1 || !plot.over.contains(event.target)) return;
    cursors[nextCursor] = plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x");
    nextCursor = 1 - nextCursor;
    draw();
  });

  async function zoom(start, end) {
    const finer = start === undefined ? undefined : await act("scope zoom", { start, end });
    zoomed = finer === undefined ? null : drawable(finer);
    draw();
  }

  function draw() {
    if (told === null) return;
    const picture = zoomed ?? told.picture;
    const names = JSON.stringify(told.channels.map((each) => [each.key, each.unit]));
    if (names !== drawnFor) {
      drawnFor = names;
      plot?.destroy();
      plot = timePlot(curves, told.channels, () => cursors, zoom);
    }
    plot.setData([picture.times, ...told.channels.map((each) => picture.values[each.key] ?? [])], false);
    plot.batch(() => {
      for (const unit of new Set(told.channels.map((each) => each.unit || "1"))) plot.setScale(unit, range(told.channels, picture, unit));
      plot.setScale("x", { min: picture.start, max: picture.end });
    });
    drawOver();
    read(picture);
  }

  function drawOver() {
    over.hidden = told.xy === null;
    const pair = told.set.xy?.map((key) => told.channels.find((each) => each.key === key));
    const names = JSON.stringify(pair?.map((each) => [each?.label, each?.unit]) ?? null);
    if (names !== xyFor) {
      xyFor = names;
      xy = pair === undefined || pair.includes(undefined) ? null : xyPlot(over, ...pair);
    }
    if (told.xy !== null) xy?.draw(told.xy);
  }

  function read(picture) {
    const at = (key, time) => (time === null ? null : value(picture, key, time));
    const shown = (number) => (number === null || number === undefined ? "" : String(Number(number.toPrecision(6))));
    const rows = told.channels.map((each, number) => {
      const [a, b] = cursors.map((time) => at(each.key, time));
      const swatch = element("span", { class: "swatch" });
      swatch.style.background = colour(number);
      return element("tr", { "data-key": each.key }, ...[
        element("span", {}, swatch, ` ${each.label}`), element("span", { class: each.source === "truth" ? "truth" : "" }, each.source),
        shown(each.last), each.unit, shown(a), shown(b), a === null || b === null ? "" : shown(b - a), each.note,
      ].map((cell) => element("td", {}, cell)));
    });
    const seconds = cursors.map((time) => (time === null ? "" : `${time.toFixed(4)} s`));
    const difference = cursors.includes(null) ? "" : `${(cursors[1] - cursors[0]).toFixed(4)} s`;
    const head = ["channel", "by", "now", "unit", `A ${seconds[0]}`, `B ${seconds[1]}`, `B − A ${difference}`, ""].map((name) => element("th", {}, name));
    readings.replaceChildren(element("table", {}, element("tr", {}, ...head), ...rows));
  }

  return {
    take(now) {
      told = { ...now, picture: drawable(now.picture) };
      if (told.state !== "triggered" && told.state !== "stopped") zoomed = null;
      say(state, told.fired === null ? told.state : `${told.state} at ${told.fired.toFixed(4)} s`);
      bar.take(now);
      draw();
    },
    themed() {
      drawnFor = xyFor = "";
      draw();
    },
    close() {
      plot?.destroy();
    },
  };
}

// Instants and values of a picture: two a column, in the middle of each half.
function drawable({ start, end, points, values }) {
  const times = Array.from({ length: points }, (_, place) => start + (place + 0.5) / points * (end - start));
  return { start, end, times, values: Object.fromEntries(Object.entries(values).map(([key, packed]) => [key, unpacked(packed)])) };
}

// A page's file: what is refused comes as a line.
async function save(name) {
  if (name.endsWith("zip") && await act("scope recording") === undefined) return;
  try {
    const answer = await fetch(name);
    if (answer.ok) keep(await answer.blob(), name);
    else refused(new Error((await answer.text()).trim()));
  } catch {
    refused(new Error("the panel has gone"));
  }
}

function value(picture, key, time) {
  const place = Math.round((time - picture.start) / (picture.end - picture.start) * picture.times.length - 0.5);
  for (let back = place; back >= 0; back -= 1) {
    const found = picture.values[key]?.[back];
    if (found !== null && found !== undefined) return found;
  }
  return null;
}

function range(channels, picture, unit) {
  const values = channels.filter((each) => (each.unit || "1") === unit).flatMap((each) => (picture.values[each.key] ?? []).filter((one) => one !== null));
  if (values.length === 0) return { min: 0, max: 1 };
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const margin = high > low ? 0.05 * (high - low) : Math.max(1e-6, 0.05 * Math.abs(high));
  return { min: low - margin, max: high + margin };
}
