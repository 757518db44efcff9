// The data of the page. Columns hold a number for each episode; for a filter the index of its value.

const data = JSON.parse(byId("data").textContent);
const { columns, strings, matrix } = data;
const total = columns.key?.length ?? 0;
const choices = Object.fromEntries(data.choices.map((one) => [one.name, one]));
const rowOf = new Map((columns.key ?? []).map((key, row) => [key, row]));

/** For tests: the work of the last filter and the last drawing. */
const counters = { total, scanned: 0, matched: 0, drawn: 0, filterMs: 0, drawMs: 0, openMs: 0 };
globalThis.roboirg = { counters };

const STEPS_PER_SECOND = 20;
const seconds = (step) => (step / STEPS_PER_SECOND).toFixed(1).replace("-", "−");

let lines = null;
/** The details of an episode, parsed when it is opened. */
const detailsOf = (row) => {
  lines ??= byId("details").textContent.split("\n");
  return JSON.parse(lines[row]);
};

const valueOf = (name, row) => choices[name].values[columns[name][row]];
const groupOf = (name, row) => choices[name].groups[columns[name][row]];

/** Setting and form of an episode. */
const optionsOfRow = (row) => {
  const [setting, form] = [valueOf("setting", row), valueOf("form", row)];
  return form === "implicit" ? setting : `${setting}, ${form}`;
};

const VERDICTS = { success: "✓", failure: "✗", error: "!" };

/** An episode's verdict with a sign, and its failure. */
const verdict = (row) => {
  const outcome = valueOf("outcome", row);
  const why = columns.failure[row] < 0 ? "" : valueOf("failure", row).replaceAll("_", " ");
  return h("span", { class: `verdict ${outcome}` },
    h("span", { "aria-hidden": "true" }, VERDICTS[outcome] ?? "?"), ` ${outcome}`,
    why && outcome !== "success" ? h("small", {}, ` ${why}`) : null);
};
