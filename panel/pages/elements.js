// Elements of the page, made in one call; text is always text.
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null));
  return made;
}

const SVG = "http://www.w3.org/2000/svg";

export function drawn(tag, attributes = {}, ...children) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

export function table(head, rows) {
  const line = (tag, cells) => element("tr", {}, ...cells.map((cell) => element(tag, {}, cell)));
  return element("div", { class: "scroll" }, element("table", {}, line("th", head), ...rows.map((row) => line("td", row))));
}

// An object's address as the standard writes it.
export const address = (index, subindex) =>
  `${index.toString(16).toUpperCase().padStart(4, "0")}h:${subindex.toString(16).toUpperCase().padStart(2, "0")}`;

// Set a text only where it changes, so that a selection in it stays.
export function say(where, text) {
  if (where.textContent !== text) where.textContent = text;
}

// Hand a file to the person. A busy browser begins to read it long after the click: until then it has to be there.
export function keep(blob, name) {
  const link = element("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 600_000);
}
