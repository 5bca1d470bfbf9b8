// Bus: the load that these frames make on a physical bus, late cycles, who sends, and the last frames by name.
import { act } from "./app.js";
import { element, say, table } from "./elements.js";

const RATES = [1000000, 500000, 250000, 125000];
const SLOWER = 500; // a list that changes faster cannot be read [ms]

export function bus(place) {
  const rate = element("select", { "aria-label": "Bit rate" }, ...RATES.map((each) => element("option", { value: each }, `${each / 1000} kbit/s`)));
  const load = element("p", { class: "big", "data-is": "load" });
  const bar = element("div", { class: "load", role: "img", "aria-label": "Load by service" });
  const cycles = element("p", { "data-is": "cycles" });
  const services = element("div"), identifiers = element("div", { "data-is": "identifiers" }), frames = element("div", { class: "list", "data-is": "frames" });
  const hold = element("input", { type: "checkbox", id: "hold" });
  let drawn = -SLOWER, due = null, last = null;
  rate.addEventListener("change", () => act("bit rate", { bit_rate: Number(rate.value) }));
  place.replaceChildren(
    element("section", {}, element("h2", {}, "Load"), element("div", { class: "row" }, "measured against a physical bus of", rate), load, bar, cycles, services),
    element("section", {}, element("h2", {}, "Frames"), element("div", { class: "row" }, hold, element("label", { for: "hold" }, "hold the list")), frames),
    element("section", {}, element("h2", {}, "Identifiers"), identifiers));
  const percent = (share) => (share === null ? "unknown" : `${(100 * share).toFixed(1)} %`);

  function draw(told) {
    drawn = performance.now();
    rate.value = told.bit_rate;
    say(load, told.load === null ? "no SYNC has passed yet" : `${percent(told.load)} of the last ${told.seconds.toFixed(1)} s; worst cycle ${percent(told.worst)}`);
    load.classList.toggle("bad", told.worst !== null && told.worst >= 0.8);
    bar.replaceChildren(...Object.values(told.services).map((share, number) => {
      const part = element("span", { class: `part part${number % 6}` });
      part.style.width = `${Math.min(100, 100 * share)}%`;
      return part;
    }));
    say(cycles, `${told.late} of ${told.cycles} cycles end late`);
    cycles.className = told.late > 0 ? "bad" : "";
    services.replaceChildren(table(["service", "load"], Object.entries(told.services).map(([name, share]) => [name, percent(share)])));
    identifiers.replaceChildren(table(["COB-ID", "name", "frames", "bits a frame"], told.identifiers.map((one) => [one.id, one.name, `${one.count}`, one.bits.toFixed(1)])));
    if (!hold.checked) frames.replaceChildren(table(["time", "COB-ID", "name", "data", "values"], told.frames.map((one) => [`${one.time.toFixed(4)} s`, one.id, one.name, one.data, one.values])));
  }

  return {
    take(told) {
      last = told;
      due ??= setTimeout(() => {
        due = null;
        draw(last);
      }, Math.max(0, drawn + SLOWER - performance.now()));
    },
    close() {
      clearTimeout(due);
    },
  };
}
