// The timeline of an episode. Selecting a moment shows it in the video.

const TICKS = [1, 2, 5, 10, 20, 60, 120];
const MOST_TICKS = 8;

/** Events, completed stages and the failure, in order of time. */
const momentsOf = (details) => {
  const moments = [
    ...(details.events ?? []).map(([step, text, holds]) =>
      ({ step, kind: holds ? "event" : "event ends", words: strings[text] })),
    ...(details.subgoals ?? []).map(([step, text, right]) =>
      ({ step, kind: right ? "said" : "said wrong", label: right ? "“" : "?", words: `planner: ${strings[text]}` })),
    ...(details.stages ?? []).map(([text, step], place) =>
      ({ step, kind: "done", label: String(place + 1), words: `stage ${place + 1}: ${strings[text]}` })),
  ].filter(({ step }) => step !== null);
  if (details.attribution && details.attribution[2] !== null) {
    const [kind, failure, step] = details.attribution;
    moments.push({ step, kind: "fault", label: "✗", words: `${strings[kind]}: ${strings[failure].replaceAll("_", " ")}` });
  }
  return moments.sort((one, other) => one.step - other.step);
};

/** The time of a moment in the video, seconds. The video ends with its last frame repeated. */
const filmTime = (film, step, steps) => {
  const { every, rate, repeats } = data.film;
  const end = film.duration - repeats / rate;
  return Math.min(Math.max(0, end - (steps - step) / (every * rate)), Math.max(0, film.duration - 0.05));
};

const seek = (film, step, steps) => {
  const jump = () => { film.currentTime = filmTime(film, step, steps); };
  film.controls = true;
  film.parentElement.querySelector(".play")?.remove();
  if (film.readyState > 0) jump();
  else {
    film.addEventListener("loadedmetadata", jump, { once: true });
    film.preload = "auto";
    film.load();
  }
};

const timelineOf = (row, details, film) => {
  const moments = momentsOf(details);
  const steps = columns.steps[row];
  const first = -(details.shown ?? 0);
  const last = Math.max(1, steps, ...moments.map(({ step }) => step));
  const at = (step) => (100 * (Math.max(step, first) - first)) / (last - first);
  const marks = moments.map((moment) => {
    const isPlain = moment.kind.startsWith("event");
    const mark = h("button", {
      type: "button", tabindex: "-1", "aria-hidden": "true", class: moment.kind,
      style: `left:${at(moment.step)}%`, click: () => film && seek(film, moment.step, steps),
    }, isPlain ? "" : moment.label);
    return withTip(mark, [`${seconds(moment.step)} s`, moment.words]);
  });
  const items = moments.map((moment, place) => momentItem(moment, film, steps, marks[place]));
  const head = h("span", { class: "head", hidden: true });
  if (film) {
    film.addEventListener("timeupdate", () => {
      const { every, rate } = data.film;
      const step = steps - (film.duration - data.film.repeats / rate - film.currentTime) * every * rate;
      head.hidden = false;
      head.style.left = `${Math.min(100, Math.max(0, at(step)))}%`;
    });
  }
  const shown = details.shown ? h("span", { class: "shown-before", style: `width:${at(0)}%` }) : null;
  return h("div", { class: "time" },
    h("h4", {}, "What happened"),
    h("div", { class: "track", "aria-hidden": "true" }, shown, head, marks),
    scaleOf(first, last, at),
    h("ol", { class: "moments" }, items), legend(details, moments));
};

const momentItem = (moment, film, steps, mark) => {
  const words = [h("span", { class: "when" }, `${seconds(moment.step)} s`),
    h("i", { class: moment.kind, "aria-hidden": "true" }, moment.label ?? ""), moment.words];
  const inside = film
    ? h("button", { type: "button", click: () => seek(film, moment.step, steps) }, words)
    : h("span", {}, words);
  const item = h("li", { class: moment.step <= 0 ? "before" : null }, inside);
  for (const [event, on] of [["mouseenter", true], ["focusin", true], ["mouseleave", false], ["focusout", false]]) {
    item.addEventListener(event, () => mark.classList.toggle("lit", on));
  }
  mark.addEventListener("mouseenter", () => item.classList.add("lit"));
  mark.addEventListener("mouseleave", () => item.classList.remove("lit"));
  return item;
};

const scaleOf = (first, last, at) => {
  const length = (last - first) / STEPS_PER_SECOND;
  const every = TICKS.find((tick) => length / tick < MOST_TICKS) ?? TICKS.at(-1);
  const ticks = [];
  for (let second = Math.ceil(first / STEPS_PER_SECOND / every) * every; second * STEPS_PER_SECOND <= last; second += every) {
    ticks.push(h("span", { style: `left:${at(second * STEPS_PER_SECOND)}%` }, `${second}`.replace("-", "−")));
  }
  ticks.at(-1)?.append(" s");
  return h("div", { class: "scale", "aria-hidden": "true" }, ticks);
};

const legend = (details, moments) => {
  const open = (details.stages ?? []).filter(([, step]) => step === null).length;
  const words = [];
  if (details.shown) words.push("striped: the video shown before");
  if (moments.some(({ kind }) => kind === "done")) words.push("numbers: a stage of the task was completed");
  if (moments.some(({ kind }) => kind === "said wrong")) words.push("?: a planner’s subgoal that was not due");
  if (open) words.push(`${counted(open, "stage")} never completed`);
  return words.length ? h("p", { class: "aside" }, `${words.join("; ")}.`) : null;
};
