// Responses to input, and the page's address.
// #?task=BinFill&outcome=failure filters, #?at=1f2e3d4c opens an episode, &page=3 shows a page.

/** Filter and draw. */
const apply = () => {
  const begun = performance.now();
  const values = formValues();
  const isPairs = values.view === "pairs";
  form.classList.toggle("pairs", isPairs);
  const rows = matching(values);
  const all = isPairs ? pairsOf(rows, values.left, values.right) : rows;
  pages.items = isPairs ? all.filter((pair) => fitsChange(pair, values.change)) : rows;
  pages.draw = isPairs ? drawPair : drawEpisode;
  byId("pair-summary").hidden = !isPairs;
  if (isPairs) drawPairSummary(all, values);
  showPage(0);
  byId("shown").textContent = isPairs
    ? `${pages.items.length.toLocaleString("en")} of ${counted(all.length, "pair")} of episodes`
    : `${rows.length.toLocaleString("en")} of ${counted(total, "episode")}`;
  counters.filterMs = performance.now() - begun;
};

const remember = (key) => {
  const values = { ...formValues(), ...(pages.at ? { page: pages.at + 1 } : {}), ...(key ? { at: key } : {}) };
  if (values.view !== "pairs") for (const name of ["left", "right", "change"]) delete values[name];
  const words = new URLSearchParams(values).toString();
  history.replaceState(null, "", words ? `#?${words}` : "#");
};

const recall = () => {
  if (!location.hash.startsWith("#?")) return;
  const values = Object.fromEntries(new URLSearchParams(location.hash.slice(2)));
  setForm(values);
  apply();
  if (values.page) showPage(Number(values.page) - 1);
  if (rowOf.has(values.at)) goTo(rowOf.get(values.at));
};

/** Show the episodes behind a cell or bar. */
const showEpisodes = (aim) => {
  setForm(aim);
  apply();
  remember();
  byId("episodes").scrollIntoView();
  byId("episodes").focus({ preventScroll: true });
};

const drawLead = () => {
  const counts = {};
  for (let row = 0; row < total; row += 1) {
    const outcome = valueOf("outcome", row);
    counts[outcome] = (counts[outcome] ?? 0) + 1;
  }
  const words = { success: "succeeded", failure: "failed", error: "ended in an error" };
  byId("lead").replaceChildren(`${counted(total, "episode")}: `, ...Object.keys(words)
    .filter((outcome) => counts[outcome] || outcome !== "error")
    .flatMap((outcome, place) => [place ? ", " : "",
      h("b", { class: outcome }, `${(counts[outcome] ?? 0).toLocaleString("en")} ${words[outcome]}`)]), ".");
};

drawLead();
makeControls();
drawMaps();
drawBars();
makeFilters();
form.addEventListener("input", () => { apply(); remember(); });
form.addEventListener("submit", (event) => event.preventDefault());
form.addEventListener("reset", (event) => { event.preventDefault(); setForm({}); apply(); remember(); });
addEventListener("hashchange", recall);
apply();
recall();
counters.openMs = performance.now();
