// The instruction with its referring expressions, each linked to its referent.

const HUES = 4;

/** Numbers of referents: the same for an expression and its antecedent. */
const referents = (details) => {
  const slots = details.slots ?? [];
  const found = new Map();
  for (const [, , , , , slot, value] of details.mentions ?? []) {
    const key = `${slot}=${value}`;
    if (!found.has(key)) {
      const place = slots.indexOf(slot);
      found.set(key, {
        number: found.size + 1,
        hue: place < 0 ? "reference" : place % HUES,
        words: `${strings[slot]} ${strings[value]}`.replaceAll("_", " "),
      });
    }
  }
  return found;
};

/** Spans of one utterance in order; one span may stand for several values ("them"). */
const spansOf = (details, utterance) => {
  const spans = [];
  const own = (details.mentions ?? []).filter(([at]) => at === utterance);
  for (const [, start, end, isAnaphor, kind, slot, value] of own.sort((one, other) => one[1] - other[1])) {
    const last = spans.at(-1);
    const key = `${slot}=${value}`;
    if (last && start < last.end) {
      if (!last.keys.includes(key)) last.keys.push(key);
    } else spans.push({ start, end, isAnaphor, kind: strings[kind], keys: [key] });
  }
  return spans;
};

const markOf = (span, text, shown, known) => {
  const own = span.keys.map((key) => known.get(key));
  const role = span.isAnaphor ? `refers back (${span.kind})` : "first named";
  const hint = `${role}: ${own.map((one) => one.words).join(", ")}`;
  return withTip(h("mark", {
    class: `${span.isAnaphor ? "anaphor" : "antecedent"} hue${own[0].hue}`,
    tabindex: "0",
    "aria-description": hint,
    "data-keys": span.keys.join(" "),
    "data-number": own.map((one) => one.number).join(","),
  }, shown), [text, hint]);
};

const turnsOf = (details) => {
  const known = referents(details);
  const list = h("ol", { class: "turns" }, (details.turns ?? []).map(([stage, text], utterance) => {
    const letters = [...strings[text]];
    const reached = details.reached?.[utterance] ?? letters.length;
    const lost = (part) => (part ? [h("del", { title: "cut off: the model does not read this" }, part)] : []);
    /** What the policy's model reads of a piece of the text, and what is cut off. */
    const cut = (start, end = letters.length) => {
      const middle = Math.min(Math.max(reached, start), end);
      return [letters.slice(start, middle).join(""), ...lost(letters.slice(middle, end).join(""))];
    };
    const parts = [];
    let position = 0;
    for (const span of spansOf(details, utterance)) {
      const said = letters.slice(span.start, span.end).join("");
      parts.push(...cut(position, span.start), markOf(span, said, cut(span.start, span.end), known));
      position = span.end;
    }
    return h("li", { class: strings[stage] }, h("span", { class: "stage" }, strings[stage]),
      h("q", {}, parts, ...cut(position)));
  }));
  for (const [event, on] of [["mouseover", true], ["focusin", true], ["mouseout", false], ["focusout", false]]) {
    list.addEventListener(event, ({ target }) => light(list, target.closest("mark"), on));
  }
  return list;
};

const light = (list, mark, on) => {
  if (!mark) return;
  const keys = mark.dataset.keys.split(" ");
  for (const other of list.querySelectorAll("mark")) {
    const same = other.dataset.keys.split(" ").some((key) => keys.includes(key));
    other.classList.toggle("lit", on && same);
  }
};
