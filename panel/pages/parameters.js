// Parameters: the object dictionary of a drive as a tree with search; values are read when they are asked for.
import { act } from "./app.js";
import { address, element, say } from "./elements.js";

const MOST_SHOWN_LIMIT = 1e15;

export function parameters(place) {
  const node = element("select", { "aria-label": "Drive" });
  const search = element("input", { type: "search", placeholder: "name, 6064, P360 …", "aria-label": "Search" });
  const changed = element("input", { type: "checkbox", id: "changed" });
  const count = element("span", { class: "soft" });
  const all = element("button", {}, "Read all");
  const store = element("button", {}, "Store in the drive (1010h)");
  const tree = element("div");
  let rows = [];
  let allowed = false;

  async function load() {
    const objects = await act("objects", { node: Number(node.value) });
    if (objects === undefined) return;
    rows = objects.map((each) => row(Number(node.value), each));
    for (const each of rows) each.allow(allowed);
    const groups = Map.groupBy(rows, (each) => each.told.index);
    tree.replaceChildren(...[...groups.values()].map(group));
    filter();
  }

  function filter() {
    const words = search.value.toLowerCase().split(/\s+/).filter((word) => word !== "");
    for (const each of rows) {
      const found = words.every((word) => each.words.includes(word)) && (!changed.checked || each.differs());
      each.line.hidden = !found;
    }
    for (const each of tree.children) {
      each.hidden = each.querySelector("tr:not([hidden])") === null;
      if (words.length > 0 || changed.checked) each.open = true;
    }
    say(count, `${rows.filter((each) => !each.line.hidden).length} of ${rows.length} entries`);
  }

  async function readAll() {
    all.disabled = true;
    for (const each of rows.filter((one) => one.told.access !== "wo")) {
      await each.read();
      filter();
    }
    all.disabled = false;
  }

  node.addEventListener("change", load);
  search.addEventListener("input", filter);
  changed.addEventListener("change", filter);
  all.addEventListener("click", readAll);
  store.addEventListener("click", () => act("store", { node: Number(node.value) }));
  place.replaceChildren(element("section", {},
    element("div", { class: "row" }, node, search, all, store),
    element("div", { class: "row" }, changed, element("label", { for: "changed" }, "only what differs from the drive type's default"), count),
    tree));
  return {
    take(told) {
      allowed = told.pen.allowed;
      store.disabled = !allowed;
      if (node.children.length === told.nodes.length) {
        for (const each of rows) each.allow(allowed);
        return;
      }
      node.replaceChildren(...told.nodes.map((each) => element("option", { value: each.id }, `${each.id} ${each.name}`)));
      load();
    },
  };
}

// The entries of one index.
function group(rows) {
  const { index, object, parameter } = rows[0].told;
  const title = `${address(index, 0).slice(0, 5)} ${object}${parameter === "" ? "" : ` · ${parameter}`}`;
  const head = element("tr", {}, ...["sub", "name", "value", "", "unit", "limits", "default", "access"].map((each) => element("th", {}, each)));
  const details = element("details", { "data-index": index }, element("summary", {}, title),
    element("div", { class: "scroll" }, element("table", {}, head, ...rows.map((each) => each.line))));
  head.hidden = true;
  details.addEventListener("toggle", () => {
    head.hidden = !details.open;
    if (details.open) for (const each of rows) each.first();
  });
  return details;
}

// One entry: its line, and how it is read and written.
function row(node, told) {
  const where = { node, index: told.index, subindex: told.subindex };
  const value = element("span", { class: "value" });
  const writable = told.access === "rw" || told.access === "wo";
  const input = element("input", { size: 12, "aria-label": `New value of ${told.object} ${told.name}`, disabled: true });
  const write = element("button", { disabled: true }, "write");
  const line = element("tr", { "data-subindex": told.subindex },
    element("td", {}, told.subindex), element("td", {}, told.name), element("td", { class: "n" }, value),
    element("td", {}, writable ? element("span", { class: "row" }, input, write) : ""),
    element("td", {}, unit(told)), element("td", {}, limits(told)), element("td", {}, `${told.default ?? ""}`),
    element("td", {}, `${told.access} ${told.type}`));
  let present;

  const show = (read) => {
    present = read;
    say(value, read === null ? "no value" : `${read}`);
    value.classList.toggle("changed", differs());
  };
  const differs = () => present !== undefined && told.default !== null && told.default !== "" && present !== told.default;
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
    words: `${address(told.index, told.subindex)} ${told.object} ${told.name} ${told.parameter} ${told.unit}`.toLowerCase(),
    first: () => {
      if (present === undefined && !line.hidden) read();
    },
    allow: (allowed) => {
      input.disabled = write.disabled = !allowed;
      write.title = allowed ? "" : "needs --allow-writes";
    },
  };
}

function unit(told) {
  return told.scaling === null ? told.unit : `${told.unit} (× ${Number(told.scaling.toPrecision(6))} = SI)`;
}

// None where they are those of the data type of a floating-point number.
function limits(told) {
  return told.low === null || Math.abs(told.high) > MOST_SHOWN_LIMIT ? "" : `${told.low} … ${told.high}`;
}
