// A picture in which things can be pointed at: by mouse, finger, number keys, or with Tab and Enter.

const SVG = "http://www.w3.org/2000/svg";
const SIDE = 256;
const REACH = 14; // pixels of the picture by which a finger may miss a thing

const ORDINALS = ["1st", "2nd", "3rd"];

/** Where the sign of a thing stands: above it, so that it hides nothing of it. */
const above = (thing) => {
  const rows = thing.outlines.flatMap((outline) => outline.split(" ").map((point) => Number(point.split(",")[1])));
  return Math.max(8, Math.min(...rows) - 8);
};

const svg = (name, attributes, ...children) => {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
};

/**
 * Make the picture. `points` are the nouns of the things to point at, in order.
 * Calls `changed` whenever something was pointed at.
 */
const makePointing = ({ picture, points, least, things }, changed) => {
  const slots = points.map(() => null);
  const chosen = () => {
    const gap = slots.indexOf(null);
    return gap < 0 ? slots : slots.slice(0, gap);
  };
  const complete = () => chosen().length >= least && slots.slice(chosen().length).every((one) => one === null);

  const pick = (place) => {
    const before = slots.indexOf(place);
    const own = points.flatMap((noun, slot) => (noun === things[place].noun ? [slot] : []));
    if (before >= 0) {
      // What was pointed at after it moves up.
      const rest = own.map((slot) => slots[slot]).filter((one) => one !== null && one !== place);
      own.forEach((slot, order) => { slots[slot] = rest[order] ?? null; });
    } else {
      const free = own.find((slot) => slots[slot] === null) ?? own.at(-1);
      slots[free] = place;
    }
    draw();
    changed();
  };

  const shapes = things.map((thing, place) => {
    const same = things.filter((one) => one.noun === thing.noun);
    const label = `${thing.noun}, ${same.indexOf(thing) + 1} of ${same.length} from the left`;
    const badge = svg("g", { class: "badge", "aria-hidden": "true", transform: `translate(${thing.x} ${above(thing)})` },
      svg("rect", { x: -9, y: -6.5, width: 18, height: 13, rx: 6.5 }), svg("text", { y: 3, "text-anchor": "middle" }));
    const shape = svg("g", { class: "thing", role: "button", tabindex: 0, "data-place": place },
      ...thing.outlines.map((outline) => svg("polygon", { points: outline })), badge);
    shape.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      event.stopPropagation();
      pick(place);
    });
    return { shape, label, badge };
  });
  const draw = () => {
    shapes.forEach(({ shape, label, badge }, place) => {
      const slot = slots.indexOf(place);
      shape.classList.toggle("chosen", slot >= 0);
      shape.setAttribute("aria-pressed", String(slot >= 0));
      const order = slot >= 0 && points.length > 1 ? `, pointed at as number ${slot + 1}` : "";
      shape.setAttribute("aria-label", label + order);
      badge.lastChild.textContent = slot >= 0 ? (points.length > 1 ? ORDINALS[slot] : "✓") : place + 1;
    });
  };
  const layer = svg("svg", { viewBox: `0 0 ${SIDE} ${SIDE}`, role: "group", "aria-label": "Things in the picture" },
    ...shapes.map(({ shape }) => shape));
  layer.addEventListener("click", (event) => {
    const hit = event.target.closest(".thing");
    if (hit) { pick(Number(hit.dataset.place)); return; }
    const box = layer.getBoundingClientRect();
    const [x, y] = [(event.clientX - box.left) * SIDE / box.width, (event.clientY - box.top) * SIDE / box.height];
    const far = things.map((thing) => Math.hypot(thing.x - x, thing.y - y));
    const nearest = far.indexOf(Math.min(...far));
    if (far[nearest] <= REACH) pick(nearest);
  });
  draw();
  const element = h("div", { class: "picture" },
    h("img", { src: `/media/${picture}`, alt: "The table as it is now", width: SIDE, height: SIDE }),
    points.length ? layer : null);
  /** Show what was meant. */
  const reveal = (right) => {
    element.inert = true;
    right.forEach((place) => shapes[place].shape.classList.add("meant"));
  };
  return { element, pick, chosen, complete, reveal, count: things.length };
};
