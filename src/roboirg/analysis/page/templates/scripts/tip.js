// One tooltip for the whole page: shown on hover and focus, hidden by Escape.

const tips = new WeakMap();
const tipBox = byId("tip");
let tipTimer = 0;

const showTip = (target) => {
  clearTimeout(tipTimer);
  const [title, ...rest] = tips.get(target);
  tipBox.replaceChildren(h("b", {}, title), ...rest.map((line) => h("span", {}, line)));
  tipBox.hidden = false;
  const from = target.getBoundingClientRect();
  const size = tipBox.getBoundingClientRect();
  const left = Math.min(Math.max(8, from.left + from.width / 2 - size.width / 2),
    document.documentElement.clientWidth - size.width - 8);
  const above = from.top - size.height - 6;
  tipBox.style.left = `${Math.max(8, left)}px`;
  tipBox.style.top = `${above > 8 ? above : from.bottom + 6}px`;
};
const hideTip = () => { clearTimeout(tipTimer); tipBox.hidden = true; };
// A short delay, so that the pointer can move onto the tip.
const hideTipSoon = () => { clearTimeout(tipTimer); tipTimer = setTimeout(hideTip, 120); };

const withTip = (element, tipLines) => {
  tips.set(element, tipLines);
  element.addEventListener("mouseenter", () => showTip(element));
  element.addEventListener("mouseleave", hideTipSoon);
  element.addEventListener("focus", () => { if (element.matches(":focus-visible")) showTip(element); });
  element.addEventListener("blur", hideTip);
  return element;
};
tipBox.addEventListener("mouseenter", () => clearTimeout(tipTimer));
tipBox.addEventListener("mouseleave", hideTipSoon);
addEventListener("keydown", (event) => { if (event.key === "Escape") hideTip(); });
addEventListener("scroll", hideTip, { passive: true });
