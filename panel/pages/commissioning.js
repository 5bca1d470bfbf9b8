// Commissioning: an axis is measured, and its loops are drawn with margins and proposed gains.
import { act } from "./app.js";
import { element, say, table } from "./elements.js";
import { bodePlot, colour, linePlot } from "./plot.js";

const LOOPS = [["velocity loop", "velocity_loop"], ["position loop", "position_loop"]];

export function commissioning(place) {
  const axis = element("select", { "aria-label": "Axis" });
  const measure = element("button", { "data-is": "measure" }, "Measure");
  const status = element("p", { class: "soft", "data-is": "status" });
  const result = element("div", { "data-is": "result" });
  let plots = [], shown = "", axes = "", last = null;

  place.replaceChildren(
    element("section", {}, element("h2", {}, "Measure an axis"), element("div", { class: "row" }, axis, measure), status), result);
  axis.addEventListener("change", () => draw());
  measure.addEventListener("click", () => act("commission", { axis: last?.desk?.runs ? null : axis.value }));

  function draw() {
    const found = last?.desk?.found[axis.value];
    const now = JSON.stringify([axis.value, found ?? null]);
    if (now === shown) return;
    shown = now;
    close();
    result.replaceChildren();
    if (found === undefined) return;
    const charts = element("div", { class: "charts" });
    result.append(element("section", {}, element("h2", {}, `${axis.value}: frequency response`), charts), numbers(found));
    const mechanics = (part) => [{ label: "mechanics", frequency: found.frequency, values: relied(found, found.mechanics[part]) }];
    const loops = (which, part) => LOOPS.map(([label, name]) => ({ label, frequency: found.frequency, values: relied(found, found[name][which][part]) }));
    chart(charts, "Mechanics, gain", found.units.mechanics, mechanics("gain"));
    chart(charts, "Open loops, gain", "dB", loops("open", "gain"));
    chart(charts, "Mechanics, phase", "degrees", mechanics("phase"));
    chart(charts, "Open loops, phase", "degrees", loops("open", "phase"));
    chart(charts, "Closed loops, gain", "dB", loops("closed", "gain"));
    chart(charts, "Closed loops, phase", "degrees", loops("closed", "phase"));
    chart(charts, "Coherence", "1", [{ label: "coherence", frequency: found.frequency, values: found.coherence }]);
    chart(charts, "Step of the position, its height is 1", "1", [{ label: "position", over: found.step.time, values: found.step.position }], "s");
    chart(charts, "Torque over speed", found.units.torque, [torqueOverSpeed(found)], found.units.speed);
  }

  // Over the frequency, or over what `over` is the unit of.
  function chart(where, title, unit, curves, over) {
    const names = curves.length < 2 ? [] : curves.map((each, number) => element("span", { class: "soft key", "data-colour": number }, `${each.label} `));
    const box = element("div", { class: "plot", role: "img", "aria-label": title });
    where.append(element("div", {}, element("h3", {}, title, " ", ...names), box));
    names.forEach((each, number) => { each.style.color = colour(number); });
    plots.push(over === undefined ? bodePlot(box, unit, curves) : linePlot(box, over, unit, curves));
  }

  function close() {
    plots.forEach((each) => each.destroy());
    plots = [];
  }

  return {
    close,
    themed: () => { shown = ""; draw(); },
    take(told) {
      last = told;
      measure.disabled = told.desk === null || !told.pen.allowed;
      measure.title = told.pen.allowed ? "" : "needs --allow-writes";
      if (told.desk === null) {
        say(status, "This panel moves nothing: on a bus with real drives, drivetwin bode --bus BUS --limits FILE measures.");
        return;
      }
      if (JSON.stringify(told.desk.axes) !== axes) {
        axes = JSON.stringify(told.desk.axes);
        axis.replaceChildren(...told.desk.axes.map((name) => element("option", { value: name }, name)));
      }
      say(measure, told.desk.runs ? "Stop" : "Measure");
      say(status, words(told.desk));
      draw();
    },
  };
}

function torqueOverSpeed(found) {
  const points = [...found.torque_speed].sort((one, other) => one.speed - other.speed);
  return { label: "torque", over: points.map((each) => each.speed), values: points.map((each) => each.torque) };
}

// Lines that are not reliable are left out.
const relied = (found, values) => values.map((each, number) => (found.relied_on[number] ? each : null));

function words(desk) {
  if (desk.runs) return `${desk.axis} is being measured, for ${desk.since} s: it travels slowly to and fro while a small torque excites it, then steps, then moves at many speeds.`;
  if (desk.said) return `The controller has ended: ${desk.said}. The motion can be started again.`;
  return "The motion is stopped, the controller excites the axis by a torque (60B2h) and proposes gains. Nothing is written to a drive.";
}

function numbers(found) {
  const gains = found.objects.map((each) => [each.quantity.replace("_", " "), each.object, each.now.toPrecision(5), each.proposed.toPrecision(5), each.unit]);
  return element("section", {}, element("h2", {}, "Margins and gains"),
    table(["", "now", "proposed"], found.summary.map((row) => [row.quantity, row.now, row.proposed])),
    gains.length === 0 ? element("p", { class: "soft" }, "No gain that was tried keeps the margins: there is no proposal.")
      : table(["gain", "object", "now", "proposed", "unit"], gains));
}
