// SPDX-License-Identifier: GPL-2.0-or-later
//
// The main module of the page, which connects its parts.

import { Chart } from "./chart.js";
import { Keys, Pointer } from "./input.js";
import { Link } from "./link.js";
import { Scene, watchColours } from "./scene.js";
import { View } from "./view.js";

const SPEEDS = [[0.25, "¼×"], [0.5, "½×"], [1, "1×"], [2, "2×"], [5, "5×"], [20, "20×"], [0, "max"]];
const PAUSE_ICON = "M7 5h4v14H7zM13 5h4v14h-4z", GO_ICON = "M7 4l13 8-13 8z";
const CHART = 200; // milliseconds between two points
const FEW = 64; // max number of robots whose scans are drawn
const LOOK = 500; // milliseconds between two checks of which robots are in view

const $ = (id) => document.getElementById(id);
const number = (value, digits = 2) => value === null || value === undefined ? "–" : value.toFixed(digits);
const whole = new Intl.NumberFormat("en", { maximumFractionDigits: 0 });

const charts = { r_acc: new Chart($("r_acc")), rate: new Chart($("rate")), busy: new Chart($("busy"), { most: 1 }) };
const view = new View($("view"));
let latest = null, state = null, isFitted = false, isFollowing = false, isDirty = true, nextPoint = 0;

const link = new Link({
  scene(message) {
    latest = new Scene(message, latest);
    view.setScene(latest);
    document.title = `${message.world} – Stage`;
    $("world").textContent = message.world;
  },
  field: (field) => view.setField(field),
  frame(frame) {
    view.setFrame(frame);
    if (!view.scene.index.has(view.chosen)) choose(null);
    if (!isFitted) fit();
    if (isFollowing) centre();
    tell(frame);
    isDirty = true;
  },
  error: toast,
  state(connected) {
    $("light").classList.toggle("on", connected);
    $("note").textContent = connected ? "loading" : "no connection"; // until the first frame arrives
    watch.last = "";
    if (connected) watch();
    else latest = null;
  },
});

// ---- display ----

function tell(frame) {
  const before = state;
  state = frame;
  const minutes = Math.floor(frame.time / 60);
  $("clock").textContent = `${minutes}:${(frame.time - 60 * minutes).toFixed(1).padStart(4, "0")}`;
  const robots = `${whole.format(view.scene.robots)} ${view.scene.robots === 1 ? "robot" : "robots"}`;
  $("note").textContent = frame.note || (frame.paused ? `${robots}, paused` : robots);
  $("pause-icon").setAttribute("d", frame.paused ? GO_ICON : PAUSE_ICON);
  for (const button of $("speeds").children)
    button.setAttribute("aria-checked", String(Number(button.value) === frame.speed));
  if (before?.seed !== frame.seed && document.activeElement !== $("seed")) $("seed").value = frame.seed;
  tellChosen(frame.details);
}

function tellCharts() {
  if (!state || performance.now() < nextPoint) return;
  nextPoint = performance.now() + CHART;
  const figures = state.paused ? { r_acc: 0, rate: 0, busy: 0 } : state;
  const style = getComputedStyle(document.documentElement);
  for (const [name, chart] of Object.entries(charts)) {
    chart.add(figures[name]);
    chart.draw(style.getPropertyValue("--accent"), style.getPropertyValue("--edge"));
  }
  $("r_acc-now").textContent = whole.format(figures.r_acc);
  $("rate-now").textContent = `${figures.rate < 100 ? number(figures.rate) : whole.format(figures.rate)} ×`;
  $("busy-now").textContent = `${number(100 * figures.busy, 0)} %`;
}

function tellChosen(facts) {
  $("chosen").hidden = !facts;
  if (!facts) return;
  $("chosen-name").textContent = facts.name;
  const degrees = facts.pose[2] === null ? null : facts.pose[2] * 180 / Math.PI;
  const rows = [["Position", `${number(facts.pose[0])}, ${number(facts.pose[1])} m`],
    ["Heading", `${number(degrees, 0)}°`]];
  if (facts.velocity) {
    rows.push(["Speed", `${number(Math.hypot(facts.velocity[0], facts.velocity[1]))} m/s`],
      ["Turning", `${number(facts.velocity[2])} rad/s`]);
  }
  if (facts.energy !== null) rows.push(["Energy", `${whole.format(facts.energy)} J`]);
  if (facts.stalled) rows.push(["", "blocked"]);
  for (const { name, unit, shape, values } of facts.readings) {
    const count = shape.reduce((product, length) => product * length, 1);
    const shown = values.length > 0 ? values.map((value) => number(value)).join(", ") : shape.join(" × ");
    rows.push([name, `${shown}${values.length > 0 && count > values.length ? ", …" : ""} ${unit}`]);
  }
  $("chosen-facts").replaceChildren(...rows.flatMap(([name, value]) => {
    const term = document.createElement("dt"), text = document.createElement("dd");
    term.textContent = name;
    text.textContent = value;
    return [term, text];
  }));
  $("sense").hidden = facts.sensors === 0;
  $("sense").disabled = facts.sensing === facts.sensors;
  $("sense").textContent = $("sense").disabled ? "Sensing" : "Sensors on";
  $("chosen-hint").hidden = !facts.velocity;
}

/** Shows the scale, and stores the view in the body's data attributes for programs that use the page. */
function tellScale() {
  const [left, top] = view.camera.toWorld(0, 0);
  Object.assign(document.body.dataset, { scale: view.camera.scale, left, top });
  const metres = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 5000];
  const length = metres.find((m) => m * view.camera.scale > 50) ?? metres.at(-1);
  $("scale-text").textContent = length < 1 ? `${length * 100} cm` : `${length} m`;
  $("scale-bar").style.width = `${length * view.camera.scale}px`;
}

function toast(text) {
  $("toast").textContent = text;
  $("toast").classList.add("on");
  clearTimeout(toast.timer);
  toast.timer = setTimeout(() => $("toast").classList.remove("on"), 4000);
}

// ---- actions ----

/** Tells the server which data to send: scans of all robots, or of those in view, if they are few. */
function watch() {
  const scans = view.showScans ? view.robotsInView() : [];
  if (scans.length > FEW) scans.length = 0;
  if (view.chosen !== null) scans.push(view.chosen);
  const wish = JSON.stringify({ chosen: view.chosen, scans, all: view.showScans });
  if (wish !== watch.last) link.send("watch", JSON.parse(wish));
  watch.last = wish;
}

function choose(thing) {
  if (thing === view.chosen) return;
  view.chosen = thing;
  view.trail = [];
  if (thing === null) {
    follow(false);
    $("chosen").hidden = true;
  }
  watch();
  isDirty = true;
}

function follow(on) {
  isFollowing = on && view.chosen !== null;
  $("follow").setAttribute("aria-pressed", String(isFollowing));
  if (isFollowing) centre();
}

function centre() {
  const i = view.scene.index.get(view.chosen);
  if (i === undefined) return;
  [view.camera.x, view.camera.y] = view.place(i);
  isDirty = true;
}

function fit() {
  if (!view.frame) return;
  follow(false);
  const aside = innerWidth > 760 ? document.querySelector("aside").offsetWidth + 14 : 0;
  view.camera.fit(view.box(), aside, $("transport").offsetHeight + 16, $("title").offsetWidth + 14);
  isFitted = isDirty = true;
}

function zoom(factor) {
  view.camera.zoom(factor);
  isDirty = true;
}

function showScans(on) {
  view.showScans = on;
  $("scans").setAttribute("aria-pressed", String(on));
  watch();
  isDirty = true;
}

function reset() {
  const seed = $("seed").value.trim();
  link.send("reset", { seed: seed === "" ? null : seed });
  $("seed").blur();
}

const pause = () => state && link.send("pause", { on: !state.paused });
const step = () => link.send("step", { count: 1 });

// ---- wiring ----

for (const [factor, text] of SPEEDS) {
  const button = document.createElement("button");
  Object.assign(button, { value: String(factor), textContent: text });
  button.setAttribute("role", "radio");
  button.title = factor ? `${factor} simulated seconds per real second` : "As fast as possible";
  button.onclick = () => link.send("speed", { factor });
  $("speeds").append(button);
}
$("pause").onclick = pause;
$("step").onclick = step;
$("reset").onclick = reset;
$("fit").onclick = fit;
$("help").onclick = () => $("keys").showModal();
$("scans").onclick = () => showScans(!view.showScans);
$("follow").onclick = () => follow(!isFollowing);
$("let-go").onclick = () => choose(null);
$("sense").onclick = () => link.send("sense", { thing: view.chosen });
$("seed").onkeydown = (event) => { if (event.key === "Enter") reset(); };
for (const button of document.querySelectorAll("button")) {
  button.addEventListener("click", () => button.blur()); // otherwise Space would press it again
}

new Pointer(view, {
  choose,
  follow,
  move: (thing, pose) => link.send("move", { thing, pose: [...pose] }),
  changed: () => { isDirty = true; },
});
new Keys({
  " ": pause, ".": step, f: fit, r: reset, c: () => follow(!isFollowing), v: () => showScans(!view.showScans),
  "+": () => zoom(1.25), "=": () => zoom(1.25), "-": () => zoom(0.8), "?": () => $("keys").showModal(),
  Escape: () => choose(null),
}, {
  isPossible: () => view.scene?.things[view.scene.index.get(view.chosen)]?.robot ?? false,
  to: (velocity) => link.send("drive", { thing: view.chosen, velocity }),
});

function restyle() {
  view.restyle();
  isDirty = true;
}
new ResizeObserver(() => {
  view.resize();
  isDirty = true;
}).observe($("view"));
watchColours(() => latest, restyle);
restyle();
setInterval(watch, LOOK);

(function loop() {
  tellCharts();
  if (isDirty) {
    isDirty = false;
    view.draw();
    tellScale();
  }
  requestAnimationFrame(loop);
})();
