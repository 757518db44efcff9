// Heat maps of success, and bars of outcomes.

const MEASURES = { rate: "success", gap: "gap to explicit" };
const BARS = ["success", "grounding", "execution", "undecided", "not attributed", "error"];

const drawMaps = () => {
  const controls = byId("map-controls");
  const level = matrix.levels[Number(controls.elements.level?.value ?? 0)];
  const measure = controls.elements.measure.value;
  const cells = new Map(level.cells.map((cell) => [cell.at.join(), cell]));
  byId("maps").replaceChildren(...matrix.policies.map((policy, place) =>
    heatMap(policy, measure, (line, column) => cells.get([place, line, column].join()))));
};

const heatMap = (policy, measure, cellAt) => {
  const rows = [];
  const body = matrix.rows.map((row, line) => {
    const cells = matrix.columns.map((column, place) => {
      const cell = cellAt(line, place);
      return cell ? heatButton(cell, measure, { policy, ...aimOf(row), ...column }) : null;
    });
    if (!cells.some(Boolean)) return null;
    rows.push(cells);
    const kind = row.task ? "task" : row.suite ? "suite" : "all";
    return h("tr", { class: kind }, h("th", { scope: "row" }, breakable(row.name)),
      cells.map((cell) => h("td", {}, cell ?? h("span", { class: "none" }, "–"))));
  });
  roam(rows);
  const id = `map-${matrix.policies.indexOf(policy)}`;
  return h("div", { class: "map" },
    h("h3", { id }, policy),
    h("div", { class: "scroll" },
      h("table", { class: "heat", role: "grid", "aria-labelledby": id }, heatHead(), h("tbody", {}, body))));
};

/** Settings, with forms below if both were played. */
const heatHead = () => {
  const forms = new Set(matrix.columns.map((column) => column.form));
  const settings = [...new Set(matrix.columns.map((column) => column.setting))];
  const width = (setting) => matrix.columns.filter((column) => column.setting === setting).length;
  const first = h("tr", {}, h("td", { rowspan: forms.size > 1 ? 2 : 1 }),
    settings.map((setting) => h("th", { scope: "colgroup", colspan: width(setting) }, setting)));
  if (forms.size === 1) return h("thead", {}, first);
  return h("thead", {}, first, h("tr", { class: "forms" }, matrix.columns.map((column) =>
    h("th", { scope: "col" }, column.setting === data.reference ? "" : column.form))));
};

const aimOf = (row) => ({ task: row.task ?? (row.suite ? `any ${row.suite}` : "") });

const heatButton = (cell, measure, aim) => {
  const isGap = measure === "gap";
  const shown = isGap ? cell.gap_text ?? "–" : cell.text ?? "–";
  const share = isGap ? (cell.gap === undefined ? null : (cell.gap + 1) / 2) : cell.rate ?? null;
  const below = isGap ? cell.text : cell.floor ? "–" : cell.gap_text;
  const marks = `${cell.errors ? "!" : ""}${cell.missing ? "…" : ""}`;
  const level = matrix.levels[Number(byId("map-controls").elements.level?.value ?? 0)];
  const button = h("button", {
    type: "button",
    class: share === null ? "cell empty" : "cell",
    style: share === null ? null : `--share:${share}`,
    "aria-label": `${cell.note.join("; ")}. Show these episodes.`,
    click: () => {
      hideTip();
      showEpisodes({ ...aim, name: undefined, difficulty: level.difficulty });
    },
  },
  h("b", {}, shown), h("small", {}, below ?? "\u00a0"),
  marks ? h("i", { "aria-hidden": "true" }, marks) : null,
  cell.interval && !isGap ? h("span", { class: "whisker", "aria-hidden": "true" },
    h("span", { style: `left:${100 * cell.interval[0]}%;right:${100 * (1 - cell.interval[1])}%` })) : null);
  return withTip(button, cell.note);
};

/** Count episodes by policy, setting, form and kind of end. */
const countEnds = () => {
  const counts = new Map();
  for (let row = 0; row < total; row += 1) {
    const key = [columns.policy[row], columns.setting[row], columns.form[row]].join();
    const own = counts.get(key) ?? counts.set(key, new Map()).get(key);
    const kind = columns.failure[row] < 0 ? "success" : groupOf("failure", row);
    own.set(kind, (own.get(kind) ?? 0) + 1);
  }
  return counts;
};

const drawBars = () => {
  const counts = countEnds();
  const seen = BARS.filter((kind) => [...counts.values()].some((own) => own.has(kind)));
  byId("failure-key").replaceChildren(...seen.map((kind) =>
    h("span", {}, h("i", { class: `end ${kind.replace(" ", "-")}` }), kind)));
  byId("bars").replaceChildren(...choices.policy.values.map((policy, place) => {
    const rows = [];
    const body = matrix.columns.map((column) => {
      const key = [place, choices.setting.values.indexOf(column.setting), choices.form.values.indexOf(column.form)];
      const own = counts.get(key.join());
      if (!own) return null;
      const bar = endBar(policy, column, own);
      rows.push([...bar.children]);
      return h("tr", {}, h("th", { scope: "row" }, column.name), h("td", {}, bar));
    });
    roam(rows);
    const id = `bars-${place}`;
    return h("div", { class: "map" }, h("h3", { id }, policy),
      h("table", { class: "bars", "aria-labelledby": id }, h("tbody", {}, body)));
  }));
};

const endBar = (policy, column, own) => {
  const sum = [...own.values()].reduce((one, other) => one + other, 0);
  return h("div", { class: "bar" }, BARS.filter((kind) => own.has(kind)).map((kind) => {
    const number = own.get(kind);
    const share = (100 * number) / sum;
    const note = [`${policy}, ${column.name}`, `${kind}: ${number} of ${counted(sum, "episode")} (${share.toFixed(0)} %)`];
    return withTip(h("button", {
      type: "button",
      class: `end ${kind.replace(" ", "-")}`,
      style: `flex-grow:${number}`,
      "aria-label": `${note.join("; ")}. Show these episodes.`,
      click: () => {
        hideTip();
        showEpisodes({
          policy, setting: column.setting, form: column.form,
          ...(kind === "success" ? { outcome: kind } : { failure: anyOf("failure", kind) }),
        });
      },
    }, share > 7 ? String(number) : ""), note);
  }));
};

const makeControls = () => {
  const controls = byId("map-controls");
  if (matrix.levels.length > 1) {
    controls.append(h("label", {}, h("span", {}, "difficulty"),
      h("select", { name: "level", id: "level" }, matrix.levels.map((level, place) =>
        h("option", { value: place }, level.difficulty || "all")))));
  }
  controls.append(h("fieldset", { class: "switch" }, h("legend", {}, "color by"),
    Object.entries(MEASURES).map(([value, label]) => h("label", {},
      h("input", { type: "radio", name: "measure", value, checked: value === "rate" }), h("span", {}, label)))));
  controls.addEventListener("input", drawMaps);
  controls.addEventListener("submit", (event) => event.preventDefault());
};
