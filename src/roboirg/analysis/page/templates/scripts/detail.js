// An opened episode.

const mediaOf = (row, details) => {
  const key = columns.key[row];
  const source = (kind, value) => (value === "#" ? byId(`${kind}-${key}`)?.textContent : value);
  if (!details.film) return null;
  const name = `Video of ${titleOf(row)}, ${valueOf("policy", row)}, ${optionsOfRow(row)}`;
  const film = h("video", {
    muted: true, playsinline: true, preload: "none", "aria-label": name,
    src: source("film", details.film), poster: source("poster", details.poster) ?? null,
  });
  film.muted = true;
  // Only one plays at a time.
  film.addEventListener("play", () => {
    for (const other of document.querySelectorAll("video")) if (other !== film) other.pause();
  });
  // The poster shows the end of the episode; the browser's controls would hide half of it.
  const button = h("button", {
    type: "button", class: "play", "aria-label": `Play: ${name}`,
    click: () => { button.remove(); film.controls = true; film.play(); film.focus(); },
  });
  return { film, shots: h("div", { class: "shots" }, h("div", { class: "film" }, film, button)) };
};

const titleOf = (row) => `${valueOf("task", row)} ${columns.episode[row]}`;

const entry = (label, ...value) => [h("dt", {}, label), h("dd", {}, ...value)];

const factsOf = (row, details) => {
  const facts = [];
  if (details.command !== undefined) facts.push(entry("explicit", strings[details.command]));
  if (details.resolved !== undefined) facts.push(entry("resolved", strings[details.resolved]));
  if (details.prompt !== undefined) facts.push(entry("prompt", strings[details.prompt]));
  facts.push(entry("meant", strings[details.goal]));
  if (details.named !== undefined) facts.push(entry("understood", strings[details.named]));
  if (details.attribution) {
    const [kind, failure, , sentence] = details.attribution;
    facts.push(entry("why it failed", h("b", { class: `kind ${strings[kind]}` },
      `${strings[kind]}: ${strings[failure].replaceAll("_", " ")}.`), ` ${strings[sentence]}`));
  }
  if (details.cause !== undefined && !details.attribution) facts.push(entry("verdict", strings[details.cause]));
  if (details.lost !== undefined) facts.push(entry("video", `lost: ${strings[details.lost]}`));
  const before = details.shown ? `; before that a video of ${seconds(details.shown)} s` : "";
  facts.push(entry("played", `${counted(columns.steps[row], "step")}, ${seconds(columns.steps[row])} s${before}`));
  facts.push(entry("conditions", strings[details.conditions]));
  return h("dl", { class: "episode-facts" }, facts);
};

/** Other episodes in the same scene: other settings and policies. */
const sceneMatesOf = (row) => {
  const byPolicy = new Map();
  for (let other = 0; other < total; other += 1) {
    if (columns.scene[other] !== columns.scene[row]) continue;
    const own = byPolicy.get(columns.policy[other]) ?? [];
    byPolicy.set(columns.policy[other], [...own, other]);
  }
  const seeded = choices.seed.values.length > 1;
  const lists = [...byPolicy].map(([policy, others]) => h("li", {},
    h("span", {}, choices.policy.values[policy]),
    others.map((other) => h("button", {
      type: "button", class: `chip ${valueOf("outcome", other)}`,
      "aria-current": other === row ? "true" : null, click: () => goTo(other),
    }, sign(VERDICTS[valueOf("outcome", other)], `${valueOf("outcome", other)}: `), ` ${optionsOfRow(other)}`,
    seeded ? ` · seed ${valueOf("seed", other)}` : ""))));
  return h("div", { class: "scene-mates" }, h("h4", {}, "The same scene"), h("ul", {}, lists));
};

const detailOf = (row) => {
  const details = detailsOf(row);
  const media = mediaOf(row, details);
  const hasFrame = data.framed.some((name) => valueOf("setting", row).split(" ")[0] === name);
  return h("div", { class: media ? "detail" : "detail unfilmed" },
    media?.shots,
    h("div", { class: "instruction" }, turnsOf(details), factsOf(row, details),
      hasFrame ? h("p", { class: "aside" }, "The front camera faces the robot: the robot’s left is "
        + "on the right of the image.") : null),
    timelineOf(row, details, media?.film),
    details.traceback === undefined ? null
      : h("details", {}, h("summary", {}, "traceback"), h("pre", { tabindex: "0" }, strings[details.traceback])),
    details.log === undefined ? null
      : h("p", { class: "link" }, h("a", { href: details.log }, "what was printed")),
    sceneMatesOf(row));
};
