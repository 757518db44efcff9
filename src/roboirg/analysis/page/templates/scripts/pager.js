// A long list, one page at a time; the document holds only the current page.

const PAGE_SIZE = 40;
const pages = { at: 0, items: [], draw: () => {} };

const showPage = (at) => {
  const last = Math.max(0, Math.ceil(pages.items.length / PAGE_SIZE) - 1);
  pages.at = Math.min(Math.max(0, at), last);
  const begun = performance.now();
  const slice = pages.items.slice(pages.at * PAGE_SIZE, (pages.at + 1) * PAGE_SIZE);
  byId("rows").replaceChildren(...slice.map((item) => pages.draw(item)));
  counters.drawn = slice.length;
  byId("nothing").hidden = pages.items.length > 0;
  drawPager(last);
  counters.drawMs = performance.now() - begun;
};

const drawPager = (last) => {
  const pager = byId("pager");
  pager.hidden = last === 0;
  if (last === 0) return;
  const turn = (label, to, words) => h("button", {
    type: "button", "aria-label": words, "aria-disabled": to < 0 || to > last || to === pages.at ? "true" : null,
    "data-turn": words,
    click: (event) => {
      if (event.currentTarget.hasAttribute("aria-disabled")) return;
      showPage(to);
      remember();
      byId("episodes").scrollIntoView();
      pager.querySelector(`[data-turn="${words}"]`).focus({ preventScroll: true });
    },
  }, label);
  pager.replaceChildren(
    turn("«", 0, "First page"), turn("‹ earlier", pages.at - 1, "Previous page"),
    h("span", {}, `page ${pages.at + 1} of ${last + 1}`),
    turn("later ›", pages.at + 1, "Next page"), turn("»", last, "Last page"));
};
