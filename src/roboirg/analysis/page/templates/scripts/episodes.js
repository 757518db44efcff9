// The list of episodes, one by one.

const opened = new Set();

/** The last utterance, which is the command. */
const commandOf = (row) => {
  const { turns } = detailsOf(row);
  return strings[turns.at(-1)[1]];
};

const drawEpisode = (row) => {
  const id = `e-${columns.key[row]}`;
  const item = h("li", { class: `row ${valueOf("outcome", row)}`, id });
  const button = h("button", {
    type: "button", "aria-expanded": "false", "aria-controls": `${id}-detail`,
    click: () => (opened.has(row) ? shut(item, row) : open(item, row)),
    keydown: (event) => {
      const way = { ArrowDown: "nextElementSibling", ArrowUp: "previousElementSibling" }[event.key];
      const next = way && item[way]?.querySelector("h3 button");
      if (next) { event.preventDefault(); next.focus(); }
    },
  },
  h("span", { class: "name" }, valueOf("task", row), h("small", {}, ` ${columns.episode[row]}`)),
  h("span", { class: "policy" }, valueOf("policy", row),
    choices.seed.values.length > 1 ? h("small", {}, ` seed ${valueOf("seed", row)}`) : null),
  h("span", { class: "tag" }, optionsOfRow(row)), h("span", { class: "tag" }, valueOf("difficulty", row)),
  verdict(row), h("span", { class: "preview" }, commandOf(row)));
  item.append(h("h3", {}, button), h("div", { class: "inside", id: `${id}-detail`, hidden: true }));
  if (opened.has(row)) open(item, row);
  return item;
};

const open = (item, row) => {
  opened.add(row);
  const inside = item.querySelector(".inside");
  inside.replaceChildren(detailOf(row),
    h("p", { class: "link" }, h("a", { href: `#?at=${columns.key[row]}` }, "link to this episode")));
  inside.hidden = false;
  item.querySelector("h3 button").setAttribute("aria-expanded", "true");
};

const shut = (item, row) => {
  opened.delete(row);
  const inside = item.querySelector(".inside");
  inside.replaceChildren();
  inside.hidden = true;
  item.querySelector("h3 button").setAttribute("aria-expanded", "false");
};

/** Open an episode; clear the filters if they hide it. */
const goTo = (row) => {
  opened.add(row);
  if (formValues().view === "pairs" || !pages.items.includes(row)) {
    setForm({});
    apply();
  }
  showPage(Math.floor(pages.items.indexOf(row) / PAGE_SIZE));
  remember(columns.key[row]);
  const item = byId(`e-${columns.key[row]}`);
  item.scrollIntoView();
  item.querySelector("h3 button").focus({ preventScroll: true });
};
