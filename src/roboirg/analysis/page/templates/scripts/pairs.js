// Two policies, or two runs, on the same episodes.

const CHANGES = {
  changed: "verdict differs", left: "only the first succeeded", right: "only the second succeeded",
  other: "failed in different ways", both: "both succeeded", neither: "neither succeeded",
  error: "one ended in an error", all: "all",
};

const pairFields = () => {
  const pick = (name, label, usual) => {
    const made = field(label, h("select", { name, "data-usual": choices.policy.values[usual] },
      choices.policy.values.map((value, place) => h("option", { selected: place === usual }, value))));
    made.classList.add("paired");
    return made;
  };
  const change = field("what", h("select", { name: "change", "data-usual": "changed" },
    Object.entries(CHANGES).map(([value, label]) => h("option", { value }, label))));
  change.classList.add("paired");
  return [pick("left", "first", data.sides[0]), pick("right", "second", data.sides[1]), change];
};

const changeOf = ([left, right]) => {
  const [one, other] = [valueOf("outcome", left), valueOf("outcome", right)];
  if (one === "error" || other === "error") return "error";
  if (one === other) return one === "success" ? "both" : "neither";
  return one === "success" ? "left" : "right";
};

const fitsChange = (pair, wanted) => {
  const change = changeOf(pair);
  if (wanted === "all" || wanted === change) return true;
  if (wanted === "changed") return change === "left" || change === "right";
  return wanted === "other" && change === "neither"
    && columns.failure[pair[0]] !== columns.failure[pair[1]];
};

/** Pairs of rows: the same episode, instruction and policy seed. */
const pairsOf = (rows, left, right) => {
  const [ours, theirs] = [left, right].map((name) => choices.policy.values.indexOf(name));
  const partner = new Map();
  for (let row = 0; row < total; row += 1) {
    if (columns.policy[row] === theirs) partner.set(columns.pair[row], row);
  }
  return rows.filter((row) => columns.policy[row] === ours && partner.has(columns.pair[row]))
    .map((row) => [row, partner.get(columns.pair[row])]);
};

const drawPair = ([left, right]) => {
  const id = `p-${columns.key[left]}`;
  const inside = h("div", { class: "inside beside", id: `${id}-detail`, hidden: true });
  const button = h("button", {
    type: "button", "aria-expanded": "false", "aria-controls": `${id}-detail`,
    click: () => {
      const opens = inside.hidden;
      inside.replaceChildren(...(opens ? [left, right].map((row) => h("section", {},
        h("h4", { class: "policy" }, valueOf("policy", row), " ", verdict(row)), detailOf(row))) : []));
      inside.hidden = !opens;
      button.setAttribute("aria-expanded", String(opens));
    },
  },
  h("span", { class: "name" }, valueOf("task", left), h("small", {}, ` ${columns.episode[left]}`),
    choices.seed.values.length > 1 ? h("small", {}, ` seed ${valueOf("seed", left)}`) : null),
  h("span", { class: "tag" }, optionsOfRow(left)), h("span", { class: "tag" }, valueOf("difficulty", left)),
  verdict(left), h("span", { class: "arrow", "aria-hidden": "true" }, "→"), verdict(right),
  h("span", { class: "preview" }, commandOf(left)));
  return h("li", { class: `row pair ${changeOf([left, right])}`, id }, h("h3", {}, button), inside);
};

/** Count by setting which of the two succeeded; a number shows its episodes. */
const drawPairSummary = (pairs, { left, right }) => {
  const kinds = ["both", "left", "right", "neither", "error"];
  const names = { both: "both", left: `only ${left}`, right: `only ${right}`, neither: "neither", error: "error" };
  const counts = new Map();
  for (const pair of pairs) {
    const key = `${columns.setting[pair[0]]},${columns.form[pair[0]]}`;
    const own = counts.get(key) ?? counts.set(key, {}).get(key);
    own[changeOf(pair)] = (own[changeOf(pair)] ?? 0) + 1;
  }
  const seen = kinds.filter((kind) => kind !== "error" || [...counts.values()].some((own) => own.error));
  const rows = [...counts].map(([key, own]) => {
    const [setting, formIndex] = key.split(",").map(Number);
    const aim = { setting: choices.setting.values[setting], form: choices.form.values[formIndex] };
    return h("tr", {}, h("th", { scope: "row" }, aim.form === "implicit" ? aim.setting : `${aim.setting}, ${aim.form}`),
      seen.map((kind) => h("td", {}, own[kind] ? h("button", {
        type: "button", class: `count ${kind}`, "aria-label": `${counted(own[kind], "episode")}, ${names[kind]}. Show them.`,
        click: () => { setForm({ ...formValues(), ...aim, change: kind }); apply(); remember(); },
      }, own[kind]) : "0")));
  });
  const place = (name) => choices.policy.values.indexOf(name);
  const words = data.comparisons.find((one) => [one.left, one.right].sort().join()
    === [place(left), place(right)].sort().join());
  byId("pair-summary").replaceChildren(
    h("div", { class: "scroll" }, h("table", { class: "counts", "aria-label": "Successes by setting" },
      h("thead", {}, h("tr", {}, h("td", {}), seen.map((kind) => h("th", { scope: "col" }, names[kind])))),
      h("tbody", {}, rows))),
    ...(words ? [h("details", {}, h("summary", {}, "the comparison in words"),
      words.sentences.map((line) => h("p", { class: "line" }, line)))] : []));
};
