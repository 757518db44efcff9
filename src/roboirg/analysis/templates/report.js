"use strict";
(() => {
  const form = document.getElementById("filters");
  const cards = [...document.querySelectorAll(".card")];
  const names = [...form.querySelectorAll("select")].map((choice) => choice.name);
  const said = (card) => [...card.querySelectorAll(".turns q, .cause")]
    .map((part) => part.textContent).join("\n").replace(/[^\S\n]+/g, " ").toLowerCase();
  const texts = new Map(cards.map((card) => [card, said(card)]));

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

  // Addresses: #e7 is a card, #?policy=oracle filters, #?policy=oracle&at=e7 is a card among them.
  const chosenWords = () =>
    new URLSearchParams([...new FormData(form)].filter(([, value]) => value));

  const remember = () => {
    const chosen = chosenWords();
    history.replaceState(null, "", chosen.size ? `#?${chosen}` : "#");
  };

  const fill = (values) => {
    for (const name of [...names, "words"]) {
      const field = form.elements[name];
      field.value = values.get(name) ?? "";
      if (field.selectedIndex === -1) field.value = "";
    }
    apply();
  };

  const aim = (id) => {
    for (const card of cards) card.classList.toggle("aim", card.id === id);
    const card = cards.find((other) => other.id === id);
    if (!card) return;
    if (card.hidden) fill(new URLSearchParams());
    card.scrollIntoView();
    // Cards above may get their true height only now.
    requestAnimationFrame(() => card.scrollIntoView());
  };

  const recall = () => {
    const hash = location.hash.slice(1);
    const values = new URLSearchParams(hash.startsWith("?") ? hash.slice(1) : "");
    if (hash.startsWith("?")) fill(values);
    aim(values.get("at") ?? hash);
  };
  addEventListener("hashchange", recall);

  for (const card of cards) {
    card.querySelector("h3 a").addEventListener("click", (event) => {
      const chosen = chosenWords();
      if (!chosen.size || event.ctrlKey || event.metaKey || event.shiftKey) return;
      event.preventDefault();
      chosen.set("at", card.id);
      history.pushState(null, "", `#?${chosen}`);
      aim(card.id);
    });
  }

  const level = document.getElementById("level");
  level?.addEventListener("input", () => {
    for (const body of document.querySelectorAll("tbody[data-level]")) {
      body.hidden = body.dataset.level !== level.value;
    }
  });

  form.addEventListener("input", () => { apply(); remember(); });
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("reset", () => setTimeout(() => { apply(); remember(); }));
  for (const cell of document.querySelectorAll("button.cell")) {
    cell.addEventListener("click", () => {
      fill(new URLSearchParams(Object.entries(cell.dataset)));
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
  apply();
  recall();
})();
