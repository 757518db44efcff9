// The filters: a form with the choices, and the episodes that match it.

const form = byId("filters");
const ANY = "any ";
const HIDDEN_IN_PAIRS = ["policy", "outcome", "failure"];

/** The value of a filter that stands for a whole group. */
const anyOf = (name, group) => {
  const { groups, values } = choices[name];
  const members = values.filter((_, place) => groups[place] === group);
  return members.length > 1 ? ANY + group : members[0];
};

const optionsOf = ({ values, groups }) => {
  if (!groups.length) return values.map((value) => h("option", {}, value));
  return [...new Set(groups)].map((group) => {
    const own = values.filter((_, place) => groups[place] === group);
    return h("optgroup", { label: group },
      own.length > 1 ? h("option", { value: ANY + group }, `${ANY}${group}`) : null,
      own.map((value) => h("option", { value }, value.replaceAll("_", " "))));
  });
};

const field = (label, ...inside) => h("label", {}, h("span", {}, label), ...inside);

const makeFilters = () => {
  const several = Object.values(choices).filter((one) => one.values.length > 1);
  if (choices.policy.values.length > 1) {
    form.append(h("fieldset", { class: "switch" }, h("legend", {}, "show"),
      [["", "one by one"], ["pairs", "two policies"]].map(([value, label]) => h("label", {},
        h("input", { type: "radio", name: "view", value, checked: value === "" }), h("span", {}, label)))));
    form.append(...pairFields());
  }
  form.append(...several.map((one) => {
    const made = field(one.label, h("select", { name: one.name }, h("option", { value: "" }, "all"), optionsOf(one)));
    if (HIDDEN_IN_PAIRS.includes(one.name)) made.classList.add("single");
    return made;
  }));
  const search = field("words of instruction or cause", h("input", { type: "search", name: "words" }));
  search.classList.add("search");
  form.append(search, h("button", { type: "reset" }, "Clear"));
};

/** The chosen values of the form. */
const formValues = () => Object.fromEntries([...new FormData(form)].filter(([, value]) => value));

/** Set the values of the form; clear fields that are missing or unknown. */
const setForm = (values) => {
  for (const element of form.elements) {
    if (!element.name) continue;
    if (element.type === "radio") {
      element.checked = element.value === (values[element.name] ?? "");
      continue;
    }
    element.value = values[element.name] ?? element.dataset.usual ?? "";
    if (element.selectedIndex === -1) element.value = element.dataset.usual ?? "";
  }
};

let lowered = null;
/** For each text whether it contains the words; checks each text once. */
const textsWith = (words) => {
  lowered ??= strings.map((text) => text.toLowerCase());
  const wanted = words.toLowerCase().replace(/\s+/g, " ").trim();
  return wanted ? lowered.map((text) => text.includes(wanted)) : null;
};

/** A function that tests whether an episode matches a filter. */
const testOf = (name, value) => {
  const { values, groups } = choices[name];
  const fits = values.map((one, place) => one === value || (groups.length > 0 && ANY + groups[place] === value));
  const column = columns[name];
  return (row) => fits[column[row]] === true;
};

/** The episodes that match, in the order of the page. */
const matching = (values) => {
  const names = Object.keys(values).filter((name) => name in choices);
  const usable = values.view === "pairs" ? names.filter((name) => !HIDDEN_IN_PAIRS.includes(name)) : names;
  const tests = usable.map((name) => testOf(name, values[name]));
  const hits = values.words ? textsWith(values.words) : null;
  if (hits) tests.push((row) => data.words[row].some((text) => hits[text]));
  const found = [];
  for (let row = 0; row < total; row += 1) if (tests.every((test) => test(row))) found.push(row);
  counters.scanned = total;
  counters.matched = found.length;
  return found;
};
