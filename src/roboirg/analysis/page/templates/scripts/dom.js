// Small helpers for making and finding elements.

const byId = (id) => document.getElementById(id);

/** Make an element. Attributes that are null or false are left out; functions are listeners. */
const h = (name, attributes, ...children) => {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes ?? {})) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === "function") element.addEventListener(key, value);
    else if (key === "style") element.style.cssText = value;
    else element.setAttribute(key, value === true ? "" : value);
  }
  element.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return element;
};

/** A sign for sighted readers and its words for screen readers. */
const sign = (mark, words) => [
  h("span", { "aria-hidden": "true" }, mark), h("span", { class: "unseen" }, words),
];

/** A name that may break before each of its words. */
const breakable = (name) => name.split(/(?<=[a-z])(?=[A-Z])/)
  .flatMap((part, place) => (place ? [document.createElement("wbr"), part] : [part]));

const counted = (number, word) => `${number.toLocaleString("en")} ${word}${number === 1 ? "" : "s"}`;

/**
 * Let arrow keys move among the buttons of a grid, which is a single tab stop.
 * `lines` are arrays of buttons, with null for gaps.
 */
const roam = (lines) => {
  const places = new Map();
  lines.forEach((line, row) => line.forEach((button, column) => {
    if (button) places.set(button, [row, column]);
  }));
  const buttons = [...places.keys()];
  const stop = (button) => buttons.forEach((other) => { other.tabIndex = other === button ? 0 : -1; });
  const step = ([row, column], [down, right]) => {
    for (let at = [row + down, column + right]; lines[at[0]]; at = [at[0] + down, at[1] + right]) {
      const line = lines[at[0]];
      if (at[1] < 0 || at[1] >= Math.max(line.length, 1)) return null;
      if (line[at[1]]) return line[at[1]];
    }
    return null;
  };
  const ways = { ArrowDown: [1, 0], ArrowUp: [-1, 0], ArrowRight: [0, 1], ArrowLeft: [0, -1] };
  for (const button of buttons) {
    button.addEventListener("focus", () => stop(button));
    button.addEventListener("keydown", (event) => {
      const line = lines[places.get(button)[0]].filter(Boolean);
      const next = event.key === "Home" ? line[0] : event.key === "End" ? line.at(-1)
        : ways[event.key] && step(places.get(button), ways[event.key]);
      if (!next) return;
      event.preventDefault();
      next.focus();
    });
  }
  if (buttons.length) stop(buttons[0]);
};
