"use strict";
(() => {
  const form = document.getElementById("filters");
  const cards = [...document.querySelectorAll(".card")];
  const names = [...form.querySelectorAll("select")].map((choice) => choice.name);
  const texts = new Map(cards.map((card) => [card, card.textContent.toLowerCase()]));

  const apply = () => {
    const chosen = new FormData(form);
    const words = (chosen.get("words") || "").toLowerCase().trim();
    let shown = 0;
    for (const card of cards) {
      const fits = names.every((name) => !chosen.get(name) || card.dataset[name] === chosen.get(name))
        && (!words || texts.get(card).includes(words));
      card.hidden = !fits;
      if (!fits) card.querySelector("video")?.pause();
      shown += fits;
    }
    document.getElementById("shown").textContent = shown;
    document.getElementById("nothing").hidden = shown > 0;
  };

  const remember = () => {
    const chosen = new URLSearchParams([...new FormData(form)].filter(([, value]) => value));
    history.replaceState(null, "", chosen.size ? `#?${chosen}` : "#");
  };

  const recall = () => {
    if (!location.hash.startsWith("#?")) return;
    for (const [name, value] of new URLSearchParams(location.hash.slice(2))) {
      if (form.elements[name]) form.elements[name].value = value;
    }
  };

  form.addEventListener("input", () => { apply(); remember(); });
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("reset", () => setTimeout(() => { apply(); remember(); }));
  for (const cell of document.querySelectorAll("button.cell")) {
    cell.addEventListener("click", () => {
      form.reset();
      for (const name of names) form.elements[name].value = cell.dataset[name] ?? "";
      apply();
      remember();
      document.getElementById("episodes").scrollIntoView();
      document.getElementById("episodes").focus({ preventScroll: true });
    });
  }
  const light = (event, on) => {
    const mark = event.target.closest?.("mark[data-value]");
    if (!mark) return;
    for (const other of mark.closest(".card").querySelectorAll("mark[data-value]")) {
      other.classList.toggle("lit", on && other.dataset.value === mark.dataset.value);
    }
  };
  document.addEventListener("mouseover", (event) => light(event, true));
  document.addEventListener("mouseout", (event) => light(event, false));
  // A film on screen is loaded when it is played; one plays at a time.
  document.addEventListener("play", (event) => {
    for (const film of document.querySelectorAll("video")) if (film !== event.target) film.pause();
  }, true);
  // The last picture says how it ended; the browser's controls would hide half of it.
  for (const film of document.querySelectorAll("video")) {
    const button = document.createElement("button");
    button.type = "button";
    button.setAttribute("aria-label", `Play: ${film.getAttribute("aria-label")}`);
    film.controls = false;
    film.after(button);
    button.addEventListener("click", () => {
      button.remove();
      film.controls = true;
      film.play();
      film.focus();
    });
  }
  recall();
  apply();
})();
