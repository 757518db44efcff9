// Drive the arm: each command is one straight move, and the next is taken when it has ended.

const main = byId("main"), where = byId("where"), stateLine = byId("state");
const SIDE = 256;
const TURN = Math.PI / 12;
let step = 0.05; // meters of one move
let waiting = null; // a command that was given while the arm moved

const button = (text, act, options = {}) => h("button", { type: "button", click: act, ...options }, text);
const show = (content) => { main.replaceChildren(content); scrollTo(0, 0); main.focus({ preventScroll: true }); };

let news = { phase: "idle" };
const command = async (wanted) => {
  if (news.phase === "moving") { waiting = wanted; return; }
  if (news.phase !== "driving") return;
  news.phase = "moving";
  try { await ask("/command", wanted); } catch (error) { if (!(error instanceof Refused)) throw error; }
};

// In the large picture: right is the robot's left (y), down is away from the robot (x).
const COMMANDS = [
  { key: "q", sign: "⟲", label: "Turn left", act: () => ({ turn: TURN }) },
  { key: "ArrowUp", sign: "↑", label: "Up in the picture", act: () => ({ move: [-step, 0, 0] }) },
  { key: "e", sign: "⟳", label: "Turn right", act: () => ({ turn: -TURN }) },
  { key: "ArrowLeft", sign: "←", label: "Left in the picture", act: () => ({ move: [0, -step, 0] }) },
  { key: " ", sign: "", label: "Close or open the hand", act: () => ({ grip: news.gripper === "open" ? "close" : "open" }), id: "grip" },
  { key: "ArrowRight", sign: "→", label: "Right in the picture", act: () => ({ move: [0, step, 0] }) },
  { key: "f", sign: "Lower", label: "Lower the hand", act: () => ({ move: [0, 0, -step] }) },
  { key: "ArrowDown", sign: "↓", label: "Down in the picture", act: () => ({ move: [step, 0, 0] }) },
  { key: "r", sign: "Raise", label: "Raise the hand", act: () => ({ move: [0, 0, step] }) },
  { key: "j", sign: "To 2 cm", label: "Move the hand to a height of 2 centimeters", act: () => ({ height: 0.02 }) },
  { key: "k", sign: "To 6 cm", label: "Move the hand to a height of 6 centimeters", act: () => ({ height: 0.06 }) },
  { key: "l", sign: "To 20 cm", label: "Move the hand to a height of 20 centimeters", act: () => ({ height: 0.2 }) },
  { key: "w", sign: "Wait half a second", label: "Wait half a second", act: () => ({ wait: 0.5 }), id: "wait" },
];
const KEYS = { " ": "space", ArrowUp: "", ArrowDown: "", ArrowLeft: "", ArrowRight: "" };

/** Show the newest pictures; one that is not there yet is not asked for again. */
const makePictures = () => {
  const images = ["front", "wrist"].map((camera) => {
    const image = h("img", { alt: camera === "front" ? "The table" : "What the hand sees", width: SIDE, height: SIDE });
    return { camera, image, shown: 0, busy: false };
  });
  const refresh = (number) => images.forEach((one) => {
    one.wanted = number;
    if (one.busy || !number || one.shown === number) return;
    one.busy = true;
    one.shown = number;
    const free = () => { one.busy = false; refresh(one.wanted); };
    one.image.onload = free;
    one.image.onerror = free;
    one.image.src = `/picture/${one.camera}/${number}`;
  });
  return { front: images[0].image, wrist: images[1].image, refresh };
};

const cockpit = () => {
  const pictures = makePictures();
  const said = h("blockquote", { class: "said", "aria-live": "polite" });
  const height = h("output", {});
  const pad = h("div", { class: "pad", role: "group", "aria-label": "Move the hand" },
    COMMANDS.map((one) => button([
      h("span", {}, one.sign), one.key in KEYS && !KEYS[one.key] ? null : h("kbd", { "aria-hidden": "true" }, KEYS[one.key] ?? one.key),
    ], () => command(one.act()), { id: one.id ?? null, "aria-label": one.label, "aria-keyshortcuts": one.key === " " ? "Space" : one.key })));
  const steps = h("fieldset", { class: "switch" }, h("legend", {}, "Step"),
    [[0.01, "1 cm"], [0.05, "5 cm"]].map(([meters, text]) => h("label", {},
      h("input", { type: "radio", name: "step", value: meters, checked: meters === step, change: () => { step = meters; } }),
      h("span", {}, text))));
  const front = h("div", { class: "picture front", click: (event) => {
    const box = event.currentTarget.getBoundingClientRect();
    const clip = (value) => Math.min(SIDE - 1, Math.max(0, value));
    command({ point: [clip((event.clientX - box.left) * SIDE / box.width), clip((event.clientY - box.top) * SIDE / box.height)] });
  } }, pictures.front);
  const message = h("p", { class: "task", role: "status" });
  const screen = h("section", { class: "cockpit" },
    h("div", { class: "words" }, said, message),
    front,
    h("div", { class: "hand" }, h("div", { class: "picture wrist" }, pictures.wrist), h("p", { class: "note" }, "Height ", height)),
    h("div", { class: "controls" }, pad, steps));
  show(screen);
  let heard = 0;
  return (now) => {
    pictures.refresh(now.pictures);
    if (now.heard.length !== heard) {
      heard = now.heard.length;
      said.replaceChildren(...now.heard.map((text) => h("p", {}, `“${text}”`)));
    }
    const closes = now.gripper === "open";
    byId("grip").firstChild.textContent = closes ? "Close" : "Open";
    height.textContent = now.height_cm === null ? "" : `${now.height_cm} cm`;
    message.textContent = now.message ?? "";
    screen.classList.toggle("moving", now.phase !== "driving");
  };
};

/** Show the video until the person goes on. */
const watch = () => new Promise((go) => {
  const video = h("video", { src: "/video.mp4", playsinline: true, width: SIDE, height: SIDE, "aria-label": "What the robot is shown" });
  video.muted = true;
  const onward = button("Go on", go, { class: "main", disabled: true });
  const play = () => { video.currentTime = 0; video.play().catch(() => {}); };
  video.addEventListener("ended", () => { onward.disabled = false; onward.focus(); });
  video.addEventListener("error", () => { complain("This browser cannot play the video."); onward.disabled = false; });
  show(h("section", { class: "watch" },
    h("div", { class: "picture" }, video),
    h("div", { class: "panel" }, h("h1", {}, "Watch"), h("p", {}, "This happens before it is your turn."),
      h("div", { class: "actions" }, onward, button("Play it again", play, { class: "quiet" })))));
  play();
});

const TITLES = { success: "Success", failure: "Not a success", error: "The episode broke off" };
const verdict = (now) => {
  const { outcome, cause, why, meant, steps } = now.verdict;
  const last = makePictures();
  last.refresh(now.pictures);
  show(h("section", { class: "watch" },
    h("div", { class: "picture" }, last.front),
    h("div", { class: "panel", id: "verdict" },
      h("h1", { class: outcome }, TITLES[outcome]),
      cause ? h("p", {}, `Why: ${cause}.`) : null,
      why && why !== cause ? h("p", {}, why) : null,
      h("p", {}, "What was meant: ", h("b", {}, meant)),
      h("p", { class: "note" }, `${counted(steps, "control step")}; ${(steps / 20).toFixed(1)} seconds of the robot's time. The record is stored.`),
      h("div", { class: "actions" }, button("Drive it again", begin, { class: "main" })))));
};

const PHASES = { loading: "The table is being set up…", driving: "Your move", moving: "Moving…", over: "", idle: "", failed: "" };

/** Follow one episode to its end. */
const follow = async () => {
  let draw = null, version = -1;
  for (;;) {
    const now = await ask(`/news?after=${version}`);
    version = now.version;
    news = now;
    stateLine.textContent = PHASES[now.phase];
    if (now.phase === "failed") { complain(now.message); return; }
    if (now.phase === "idle") { intro(); return; }
    if (now.phase === "over") { verdict(now); return; }
    if (now.phase === "loading") continue;
    if (draw === null) {
      if (now.video) await watch();
      draw = cockpit();
    }
    draw(now);
    if (now.phase === "driving" && waiting) {
      const next = waiting;
      waiting = null;
      command(next);
    }
  }
};

const begin = async () => {
  waiting = null;
  main.replaceChildren(h("p", { class: "text" }, "The table is being set up…"));
  await ask("/begin", {});
  await follow();
};

const intro = () => {
  show(byId("intro").content.cloneNode(true));
  byId("begin").addEventListener("click", begin);
};

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || !document.querySelector(".cockpit")) return;
  const found = COMMANDS.find((one) => one.key === (event.key.length === 1 ? event.key.toLowerCase() : event.key));
  if (event.key === "1" || event.key === "5") {
    document.querySelector(`input[name=step][value="${event.key / 100}"]`).click();
  } else if (found && !(event.target.closest("button") && event.key === " ") && !event.target.closest("input")) {
    event.preventDefault();
    command(found.act());
  }
});

follow();
