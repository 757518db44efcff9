// One question after the other: the video, the words, the answer.

const STORE = "roboirg-person";
const main = byId("main"), status = byId("status"), undoButton = byId("undo");
let code = localStorage.getItem(STORE);
let keys = () => false; // what the keys do on this screen

const call = (path, body) => ask(path, body, code ? { "X-Person": code } : {});

/** Show a screen; what the keys do on it is `onKey`, which returns whether it used the key. */
const show = (content, onKey = () => false) => {
  main.replaceChildren(content);
  keys = onKey;
  scrollTo(0, 0);
  main.focus({ preventScroll: true });
};

const button = (text, act, options = {}) => h("button", { type: "button", click: act, ...options }, text);
const said = (texts) => h("blockquote", { class: "said" }, texts.map((text) => h("p", {}, `“${text}”`)));

// Time: from the first words to the answer, without the time in which the page cannot be seen.
const clock = { start: null, hidden: 0, since: null };
const startClock = () => {
  if (clock.start === null) Object.assign(clock, { start: performance.now(), hidden: 0, since: null });
};
document.addEventListener("visibilitychange", () => {
  if (document.hidden) clock.since = performance.now();
  else if (clock.since !== null) { clock.hidden += performance.now() - clock.since; clock.since = null; }
});
const readClock = () => ({
  seconds: (performance.now() - clock.start - clock.hidden) / 1000, hidden_s: clock.hidden / 1000,
});

const consent = () => {
  header(null);
  show(byId("consent").content.cloneNode(true));
  const begin = async (act) => {
    try {
      code = await act();
      localStorage.setItem(STORE, code);
      await next();
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      code = null;
      complain(error.message);
    }
  };
  byId("agree").addEventListener("submit", (event) => {
    event.preventDefault();
    begin(async () => (await ask("/join", { consent: true })).code);
  });
  byId("resume").addEventListener("submit", (event) => {
    event.preventDefault();
    begin(async () => {
      code = byId("code").value.trim().toLowerCase();
      await call("/state");
      return code;
    });
  });
};

const header = (state) => {
  const progress = byId("progress");
  const asks = state?.state === "question";
  const name = asks && (state.practice ? "Practice" : "Question");
  byId("where").textContent = asks ? `${name} ${state.place} of ${state.total}` : "RoboIRGBench";
  progress.hidden = !asks || state.practice;
  if (asks) { progress.max = state.total; progress.value = state.place - 1; }
  byId("foot").hidden = !state;
  byId("own-code").textContent = state?.code ?? "";
  undoButton.hidden = !state?.undo;
  undoButton.onclick = async () => {
    undoButton.hidden = true;
    try { await call("/undo", { number: state.number }); } catch (error) { if (!(error instanceof Refused)) throw error; }
    await next();
  };
};

/** Ask the server what comes next, and show it. */
const next = async () => {
  let state;
  try {
    state = await call("/state");
  } catch (error) {
    if (!(error instanceof Refused)) throw error;
    if (error.status === 403) { complain(error.message); return; }
    localStorage.removeItem(STORE);
    code = null;
    consent();
    return;
  }
  clock.start = null;
  header(state);
  if (state.state === "done") done();
  else play(state);
};

const done = () => {
  show(h("section", { class: "text" },
    h("h1", {}, "Thank you!"),
    h("p", {}, "All your answers are stored. You can close this page."),
    h("p", { class: "note" }, button("Another person begins", () => {
      localStorage.removeItem(STORE);
      code = null;
      consent();
    }, { class: "quiet" }))));
  status.textContent = "All answers are stored.";
};

/** Lead through one question. In turns, the first utterance comes before the video. */
const play = (question) => {
  const turns = question.turns.slice(0, -1);
  const plays = { count: 0 };
  const steps = turns.map((text) => (go) => hear(text, go));
  if (question.video) steps.splice(turns.length ? 1 : 0, 0, (go) => watch(question, plays, go));
  steps.push(() => answer(question, plays));
  const go = () => steps.shift()(go);
  go();
};

const hear = (text, go) => {
  startClock();
  show(h("section", { class: "text" }, h("h1", {}, "Listen"), said([text]),
    button("Go on", go, { class: "main", "aria-keyshortcuts": "Enter" })), enter(go));
};

const enter = (act) => (event) => event.key === "Enter" && (act(), true);

const film = (question, plays) => {
  const video = h("video", {
    src: `/media/${question.video}`, playsinline: true, "aria-label": "What the robot was shown", width: 256, height: 256,
  });
  video.muted = true;
  video.addEventListener("error", () => complain("This browser cannot play the video."));
  video.addEventListener("playing", () => { if (video.currentTime < 0.1) plays.count += 1; });
  return video;
};
const start = (video) => { video.currentTime = 0; video.play().catch(() => {}); };

const watch = (question, plays, go) => {
  const video = film(question, plays);
  const onward = button("Go on", go, { class: "main", disabled: true, "aria-keyshortcuts": "Enter" });
  const again = button("Play the video", () => start(video), { class: "quiet", "aria-keyshortcuts": "Space" });
  video.addEventListener("click", () => start(video));
  video.addEventListener("ended", () => {
    onward.disabled = false;
    again.textContent = "Play it again";
    status.textContent = "The video has ended.";
  });
  show(h("section", { class: "watch" },
    h("div", { class: "picture" }, video),
    h("div", { class: "panel" },
      h("h1", {}, "Watch"),
      h("p", {}, "This is what the robot was shown. It happened before the robot got its instruction."),
      h("div", { class: "actions" }, onward, again))),
  (event) => {
    if (event.key === " ") { start(video); return true; }
    return event.key === "Enter" && !onward.disabled && (go(), true);
  });
  start(video);
};

const pointAt = ({ points, least }) => {
  if (!points.length) return null;
  if (least < points.length) return `Point at the ${points[0]} that is meant, or at two in their order.`;
  return `Point at ${points.map((noun) => `the ${noun}`).join(", then at ")} that ${points.length > 1 ? "are" : "is"} meant.`;
};

const answer = (question, plays) => {
  const pointing = makePointing(question, () => refresh());
  const values = {};
  const groups = question.fields.map((field) => h("fieldset", { class: "values" },
    h("legend", {}, field.question),
    h("div", {}, field.values.map((value) => h("label", {},
      h("input", { type: "radio", name: field.name, value, change: () => { values[field.name] = value; refresh(); } }),
      h("span", {}, String(value)))))));
  const send = button("Answer", () => submit(), { class: "main", disabled: true, "aria-keyshortcuts": "Enter" });
  const ready = () => pointing.complete() && question.fields.every((field) => field.name in values);
  const refresh = () => { send.disabled = !ready(); };
  const task = pointAt(question);
  const screen = h("section", { class: "asks" },
    h("div", { class: "seen" }, pointing.element),
    h("div", { class: "panel" },
      h("h1", {}, "What is meant?"),
      said(question.turns.slice(-1)),
      task ? h("p", { class: "task" }, task) : null,
      groups,
      h("div", { class: "actions" }, send, question.video ? button("Watch the video again", () => replay(), { class: "quiet" }) : null),
      h("p", { class: "note keys" }, pointing.count && question.points.length
        ? "Click or tap; or keys 1 to 9 for the things from left to right, Tab for the rest, Enter to answer."
        : "Click or tap; or Tab and arrow keys, Enter to answer.")));
  const replay = () => {
    const video = film(question, plays);
    const back = () => { video.replaceWith(pointing.element); shut.remove(); };
    const shut = button("Back to the picture", back, { class: "quiet" });
    video.addEventListener("ended", back);
    pointing.element.replaceWith(video);
    screen.querySelector(".actions").append(shut);
    start(video);
  };
  let sent = false;
  const submit = async () => {
    if (!ready() || sent) return;
    sent = true;
    send.disabled = true;
    const body = { number: question.number, objects: pointing.chosen(), values, plays: plays.count, ...readClock() };
    try {
      const told = await call("/answer", body);
      if (question.practice) explain(told, pointing, groups, screen);
      else await next();
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      if (error.status !== 409) complain(error.message);
      await next();
    }
  };
  show(screen, (event) => {
    if (sent) return false;
    if (event.key === "Enter") { submit(); return true; }
    const place = Number(event.key) - 1;
    if (!(place >= 0 && place < pointing.count) || !question.points.length) return false;
    document.body.classList.add("by-keys");
    pointing.pick(place);
    return true;
  });
  startClock();
};

/** After a practice answer: say whether it was right, and show what was meant. */
const explain = (told, pointing, groups, screen) => {
  pointing.reveal(told.objects);
  for (const group of groups) {
    for (const input of group.querySelectorAll("input")) {
      input.disabled = true;
      if (String(told.values[input.name]) === input.value) input.parentElement.classList.add("meant");
    }
  }
  const words = told.right ? "Right." : "Not quite. What was meant is marked.";
  const onward = button("Go on", next, { class: "main", "aria-keyshortcuts": "Enter" });
  screen.querySelector(".actions").replaceChildren(
    h("p", { class: told.right ? "verdict good" : "verdict" }, words), onward);
  status.textContent = words;
  keys = enter(next);
};

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
  const field = event.target.closest("input[type=text], input[type=checkbox], button, summary, a");
  if (field) return;
  if (event.key.toLowerCase() === "u" && !undoButton.hidden) { undoButton.click(); return; }
  if (keys(event)) event.preventDefault();
});
document.addEventListener("pointerdown", () => document.body.classList.remove("by-keys"));

if (code) next();
else consent();
