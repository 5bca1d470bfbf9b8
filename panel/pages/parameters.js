// Parameters: the object dictionary of a drive as a tree with search; values are read when they are asked for.
// They are compared with the drive type's defaults, or with a file; saved as a DCF, and restored from a file.
import { act, refused } from "./app.js";
import { address, element, keep, say } from "./elements.js";

const MOST_SHOWN_LIMIT = 1e15;

export function parameters(place) {
  const node = element("select", { "aria-label": "Drive" });
  const search = element("input", { type: "search", placeholder: "name, 6064, P360 …", "aria-label": "Search" });
  const changed = element("input", { type: "checkbox", id: "changed" });
  const count = element("span", { class: "soft" });
  const all = element("button", { disabled: true }, "Read all");
  const store = element("button", {}, "Store in the drive (1010h)");
  const file = element("input", { type: "file", accept: ".eds,.dcf,.json", "aria-label": "Compare with a file" });
  const restore = element("button", { disabled: true }, "Restore from the file");
  const save = element("button", {}, "Save as DCF");
  const compared = element("label", { for: "changed" });
  const outcome = element("div", { "data-is": "outcome", role: "status" });
  const tree = element("div");
  let rows = [];
  let allowed = false;
  let held = null; // the file to compare with: node, name and text
  let shown = 0; // rises with each drive that is chosen, and when the view is left: what was asked for before is no longer wanted
  let reading = Promise.resolve(); // values of entries that were opened are read one after the other

  async function load() {
    const [mine, of] = [++shown, Number(node.value)];
    [rows, held, file.value, all.disabled] = [[], null, "", true];
    outcome.replaceChildren();
    tree.replaceChildren();
    withFile();
    filter();
    const objects = await act("objects", { node: of });
    if (mine !== shown || objects === undefined) return;
    all.disabled = false;
    rows = objects.map((each) => row(of, each, (read) => {
      reading = reading.then(() => (mine === shown ? read() : undefined));
    }));
    for (const each of rows) each.allow(allowed);
    const groups = Map.groupBy(rows, (each) => each.told.index);
    const areas = Map.groupBy(groups.values(), ([first]) => area(first.told.index));
    tree.replaceChildren(...[...areas].map(([name, members]) => element("div", {}, element("h3", {}, name), ...members.map(group))));
    filter();
  }

  function filter() {
    const words = search.value.toLowerCase().split(/\s+/).filter((word) => word !== "");
    for (const each of rows) {
      const found = words.every((word) => each.words.includes(word)) && (!changed.checked || each.differs());
      each.line.hidden = !found;
    }
    for (const each of tree.querySelectorAll("details")) {
      each.hidden = each.querySelector("tr[data-subindex]:not([hidden])") === null;
      if (words.length > 0 || changed.checked) each.open = true;
    }
    for (const each of tree.children) each.hidden = each.querySelector("details:not([hidden])") === null;
    say(count, `${rows.filter((each) => !each.line.hidden).length} of ${rows.length} entries`);
  }

  function withFile() {
    restore.disabled = !allowed || held === null;
    restore.title = allowed ? "" : "needs --allow-writes";
    say(compared, `only what differs from ${held === null ? "the drive type's default" : held.name}`);
  }

  async function compare() {
    const [mine, of, [chosen]] = [shown, Number(node.value), file.files];
    held = null;
    outcome.replaceChildren();
    withFile();
    for (const each of rows) each.forget();
    filter();
    if (chosen === undefined) return;
    const told = { node: of, name: chosen.name, text: await chosen.text() };
    const answer = await act("compare", told);
    if (answer === undefined || mine !== shown || file.files[0] !== chosen) return;
    held = told;
    const values = new Map(answer.values.map(([index, subindex, value]) => [address(index, subindex), value]));
    for (const each of rows) each.expect(values.get(address(each.told.index, each.told.subindex)));
    withFile();
    if (!await readAll() || held !== told) return;
    const differ = rows.filter((each) => each.differs()).length;
    const strange = answer.strange === 0 ? "" : ` ${answer.strange} values are of objects that this drive does not have.`;
    outcome.replaceChildren(element("p", {}, `${values.size} values of ${told.name}: ${differ} differ from the drive's.${strange}`));
  }

  async function restoreAll() {
    node.disabled = true;
    const answer = await act("restore", held);
    node.disabled = false;
    if (answer === undefined) return;
    const { written, same, left_out, refused: lines } = answer;
    if (!await readAll()) return;
    outcome.replaceChildren(
      element("p", {}, `${written} written and read back, ${same} stood there already, ${left_out} left out (read only, commands and set-points, communication), ${lines.length} not taken.`),
      element("ul", {}, ...lines.map((line) => element("li", {}, line))));
  }

  async function saveAll() {
    save.disabled = true;
    try {
      const answer = await fetch(`parameters/${node.value}.dcf`);
      if (answer.ok) keep(await answer.blob(), /filename="(.*)"/.exec(answer.headers.get("content-disposition"))[1]);
      else refused(new Error(await answer.text()));
    } catch {
      refused(new Error("the panel has gone"));
    }
    save.disabled = false;
  }

  // Whether all were read: another drive may be chosen meanwhile.
  async function readAll() {
    const mine = shown;
    all.disabled = true;
    for (const each of rows.filter((one) => one.told.access !== "wo")) {
      await each.read();
      if (mine !== shown) return false;
      filter();
    }
    all.disabled = false;
    return true;
  }

  node.addEventListener("change", load);
  search.addEventListener("input", filter);
  changed.addEventListener("change", filter);
  all.addEventListener("click", readAll);
  store.addEventListener("click", () => act("store", { node: Number(node.value) }));
  file.addEventListener("change", compare);
  restore.addEventListener("click", restoreAll);
  save.addEventListener("click", saveAll);
  place.replaceChildren(element("section", {},
    element("div", { class: "row" }, node, search, all, store),
    element("div", { class: "row" }, save, element("label", { class: "row" }, "Compare with", file), restore),
    outcome,
    element("div", { class: "row" }, changed, compared, count),
    tree));
  return {
    take(told) {
      allowed = told.pen.allowed;
      store.disabled = !allowed;
      withFile();
      if (node.children.length === told.nodes.length) {
        for (const each of rows) each.allow(allowed);
        return;
      }
      node.replaceChildren(...told.nodes.map((each) => element("option", { value: each.id }, `${each.id} ${each.name}`)));
      load();
    },
    close() {
      shown += 1;
    },
  };
}

// What is read only beyond identity and communication is a measured value, and differs at any two instants.
const measured = (told) => told.access === "ro" && told.index >= 0x2000;

// Of an entry: what is above each, whether it is a number, and its share of the width, so that those of all objects line up.
const COLUMNS = [["sub", false, 3], ["name", false, 17], ["value", true, 11], ["", false, 17], ["unit", false, 17], ["limits", false, 12], ["default", true, 8], ["file", true, 9], ["access", false, 6]];

function widths() {
  return element("colgroup", {}, ...COLUMNS.map(([, , share]) => {
    const column = element("col");
    column.style.width = `${share}%`;
    return column;
  }));
}

// Where an index lies in an object dictionary (CiA 301, 7.4.1).
function area(index) {
  if (index < 0x2000) return "Communication (CiA 301)";
  return index < 0x6000 ? "Manufacturer" : "Drive (CiA 402)";
}

// The entries of one index.
function group(rows) {
  const { index, object, parameter } = rows[0].told;
  const title = `${address(index, 0).slice(0, 5)} ${object}${parameter === "" ? "" : ` · ${parameter}`}`;
  const head = element("tr", {}, ...COLUMNS.map(([name, number]) => element("th", number ? { class: "n" } : {}, name)));
  const details = element("details", { "data-index": index }, element("summary", {}, title),
    element("div", { class: "scroll" }, element("table", { class: "entries" }, widths(), head, ...rows.map((each) => each.line))));
  head.hidden = true;
  details.addEventListener("toggle", () => {
    head.hidden = !details.open;
    if (details.open) for (const each of rows) each.first();
  });
  return details;
}

// One entry: its line, and how it is read and written; `inTurn` does the first read when it is its turn.
function row(node, told, inTurn) {
  const where = { node, index: told.index, subindex: told.subindex };
  const value = element("span", { class: "value" });
  const writable = told.access === "rw" || told.access === "wo";
  const input = element("input", { size: 12, "aria-label": `New value of ${told.object} ${told.name}`, disabled: true });
  const write = element("button", { disabled: true }, "write");
  const inFile = element("td", { class: "n", "data-is": "file" });
  const line = element("tr", { "data-subindex": told.subindex },
    element("td", {}, told.subindex), element("td", {}, told.name), element("td", { class: "n" }, value),
    element("td", {}, writable ? element("span", { class: "row" }, input, write) : ""),
    element("td", {}, unit(told)), element("td", {}, limits(told)), element("td", { class: "n" }, number(told, told.default)), inFile,
    element("td", {}, `${told.access} ${told.type}`));
  let present;
  let expected; // by the file, undefined without one
  let isCompared = false;

  const show = (read) => {
    present = read;
    say(value, read === null ? "no value" : number(told, read));
    value.classList.toggle("changed", differs());
  };
  const differs = () => {
    if (isCompared && measured(told)) return false;
    const other = isCompared ? expected : told.default;
    return present !== undefined && other !== undefined && other !== null && other !== "" && present !== other;
  };
  const read = async () => {
    if (told.access === "wo") return;
    const answer = await act("read", where);
    if (answer === undefined) say(value, "refused");
    else show(answer);
  };
  write.addEventListener("click", async () => {
    const answer = await act("write", { ...where, value: input.value });
    if (answer !== undefined) show(answer);
  });
  value.addEventListener("click", read);
  return {
    told,
    line,
    read,
    differs,
    expect: (other) => {
      isCompared = true;
      expected = other;
      say(inFile, number(told, other));
    },
    forget: () => {
      isCompared = false;
      expected = undefined;
      say(inFile, "");
    },
    words: `${address(told.index, told.subindex)} ${told.object} ${told.name} ${told.parameter} ${told.unit}`.toLowerCase(),
    first: () => {
      if (present === undefined && !line.hidden) inTurn(() => (present === undefined && !line.hidden ? read() : undefined));
    },
    allow: (allowed) => {
      input.disabled = write.disabled = !allowed;
      write.title = allowed ? "" : "needs --allow-writes";
    },
  };
}

// A value in words; a REAL32 with the digits that it has, not with those of the double that carries it.
function number(told, value) {
  if (value === null || value === undefined) return "";
  if (told.type !== "R32" || typeof value !== "number") return `${value}`;
  const digits = [6, 7, 8, 9].find((each) => Math.fround(Number(value.toPrecision(each))) === Math.fround(value)) ?? 9;
  return `${Number(value.toPrecision(digits))}`;
}

function unit(told) {
  return told.scaling === null ? told.unit : `${told.unit} (× ${Number(told.scaling.toPrecision(6))} = SI)`;
}

// None where they are those of the data type of a floating-point number.
function limits(told) {
  return told.low === null || Math.abs(told.high) > MOST_SHOWN_LIMIT ? "" : `${told.low} … ${told.high}`;
}
