// The page: what is pressed and pulled, and what it says.
import { HybmssError, load } from "hybmss";
import { Meter } from "./measure.js";
import { Stage } from "./stage.js";
import { defaults, effects, Subject } from "./subject.js";

const find = (id) => document.getElementById(id);
const panel = find("panel");
const budget = 11; // ms a frame for steps: beyond, time goes slower
const patience = 480; // frames in which a tortured body may come back

const settings = { ...defaults };
let hand = "pull";
let stage = null;
let subject = null;
let meter = null;
let trial = null; // the torture under way
let stroke = null; // of the blade: points on the screen
let arrows = null; // what arrow keys have pulled so far
const timing = { step: 0, simulation: 0, drawing: 0, steps: 0, share: 1 };
let frames = 0;

function say(words) {
  find("status").textContent = words;
}

const whole = (n) => n.toLocaleString("en");
const short = (x) => (x === 0 ? "0" : Math.abs(x) >= 99.5 ? whole(Math.round(x)) : x.toPrecision(2).replace(/e([+-])/, "e$1"));

// ---- the panel

const shown = {
  press: (v) => `${Math.round(90 * v)} %`,
  young: (v) => `${(10 ** v / 1000).toFixed(10 ** v < 10000 ? 1 : 0)} kPa`,
  poisson: (v) => Number(v).toFixed(2),
  damping: (v) => `${v} 1/s`,
  mesh: () => (subject ? `cells of ${(1000 * subject.shape.cellSize).toFixed(1)} mm` : ""),
};

function choices() {
  for (const group of document.querySelectorAll(".choice")) {
    const { name, options, words = options } = group.dataset;
    group.setAttribute("role", "radiogroup");
    group.setAttribute("aria-label", name);
    options.split(",").forEach((value, i) => {
      const label = document.createElement("label");
      label.innerHTML = `<input type="radio" name="${name}" value="${value}" /><span></span>`;
      label.querySelector("span").textContent = words.split(",")[i];
      label.querySelector("input").checked = value === (settings[name] ?? hand);
      group.append(label);
    });
  }
  for (const [name, { key }] of Object.entries(effects)) {
    const row = document.createElement("tr");
    row.innerHTML = `<td><label><input type="checkbox" name="${key}" /><span></span></label></td><td>–</td><td>–</td>`;
    row.querySelector("span").textContent = name;
    row.querySelector("input").checked = settings[key];
    row.dataset.effect = name;
    find("effects").append(row);
  }
  for (const kind of ["flatten", "scramble", "inside out", "crush"]) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = kind[0].toUpperCase() + kind.slice(1);
    button.addEventListener("click", () => torture(kind));
    find("torture").append(button);
  }
}

function showValues() {
  const values = { ...settings, young: Math.log10(settings.young), press: subject?.plates ?? 0 };
  for (const input of panel.querySelectorAll('input[type="range"]')) {
    input.value = values[input.name];
    input.closest("label").querySelector("output").textContent = shown[input.name](input.value);
  }
  find("press").hidden = settings.stage !== "plates";
  find("throw").disabled = settings.stage !== "floor";
}

/** Makes the body anew by the settings; the old one stays where they are refused. */
function renew(words) {
  let made = null;
  try {
    made = new Subject(settings);
  } catch (error) {
    if (!(error instanceof HybmssError)) throw error;
    say(`Refused: ${error.message}.`);
    return false;
  }
  meter?.stop();
  subject?.free();
  subject = made;
  trial = stroke = arrows = null;
  timing.step = 0;
  meter = new Meter(subject, report);
  stage.show(subject);
  for (const row of find("effects").rows) {
    row.cells[1].textContent = row.cells[2].textContent = "–";
  }
  find("precision-cost").textContent = find("springs-cost").textContent = find("error").textContent = "–";
  showValues();
  say(words);
  return true;
}

function report(name, { own, other, refused }) {
  const cost = (ns) => `${short(ns)} ns`;
  if (name === "float" || name === "means") {
    const id = name === "float" ? "precision" : "springs";
    const words = { float: { float32: "double", float64: "float" }, means: { nodes: "means", means: "nodes" } }[name];
    find(`${id}-name`).textContent = `a cell and step; with ${words[settings[id]]}`;
    find(`${id}-cost`).textContent = refused ? "refused" : `${cost(own.ns)}; ${cost(other.ns)}`;
    return;
  }
  const row = [...find("effects").rows].find(({ dataset }) => dataset.effect === name);
  const sign = settings[effects[name].key] ? 1 : -1;
  row.cells[1].textContent = refused ? "refused" : short(sign * (own.ns - other.ns));
  row.cells[2].textContent = refused ? "" : short(sign * (own.ms - other.ms));
}

panel.addEventListener("submit", (event) => event.preventDefault());
panel.addEventListener("input", ({ target }) => {
  const { name, value, type, checked } = target;
  if (name === "press") {
    subject.plates = Number(value);
    showValues();
  } else if (type === "range") {
    settings[name] = name === "young" ? 10 ** value : Number(value);
    later();
    target.closest("label").querySelector("output").textContent = shown[name](value);
  } else if (name === "hand") {
    hand = value;
    stage.canvas.style.cursor = hand === "cut" ? "crosshair" : "";
  } else {
    settings[name] = type === "checkbox" ? checked : value;
    renew(`Made anew: ${type === "checkbox" ? `${target.nextSibling.textContent} ${checked ? "on" : "off"}` : value}.`);
  }
});

let waiting = 0;
/** Sliders on their way make one body, not one a pixel. */
function later() {
  clearTimeout(waiting);
  waiting = setTimeout(() => renew("Made anew by the new values."), 120);
}

find("reset").addEventListener("click", () => renew("At rest."));
find("throw").addEventListener("click", throwIt);
function throwIt() {
  subject.throwIt();
  say("Thrown.");
}

// ---- torture

const did = { flatten: "Flattened", scramble: "Scrambled", "inside out": "Turned inside out", crush: "Crushed" };

function torture(kind) {
  subject.torture(kind);
  trial = { kind, frames: 0, well: 0 };
  say(`${did[kind]}.`);
}

function watch() {
  const name = did[trial.kind];
  if (++trial.frames % 10 !== 0) {
    return;
  }
  const { cells, inverted, smallest, longest, shortest } = subject.health();
  const stretch = Math.max(longest - 1, 1 - shortest);
  trial.well = inverted === 0 && smallest > 0.3 && stretch < 0.5 ? trial.well + 1 : 0;
  const seconds = (trial.frames / 60).toFixed(1);
  if (trial.well === 3) {
    const most = Math.round(100 * stretch);
    say(`${name}: back after ${seconds} s. No cell is inside out; edges differ from their length by ${most} % at most.`);
    rest();
  } else if (trial.frames >= patience) {
    const still =
      inverted > 0
        ? `${whole(inverted)} of ${whole(cells)} cells are inside out still. Springs cannot tell a cell from its mirror image: ` +
          (settings.crush ? "the resistance to crushing did not suffice from this state." : "resistance to crushing can.")
        : `edges differ from their length by ${Math.round(100 * stretch)} % still: it has not come to rest.`;
    renew(`${name}: not back after ${seconds} s; ${still} The body was made anew.`);
  } else {
    say(`${name}: ${seconds} s, ${inverted > 0 ? `${whole(inverted)} of ${whole(cells)} cells inside out` : "no cell inside out"}.`);
  }
}

function rest() {
  trial = null;
  subject.settle();
}

function lost() {
  const at = subject.dynamics.notFiniteAt;
  const what = trial ? did[trial.kind] : "The motion";
  if (renew("")) {
    say(`${what}: numbers grew beyond all bounds at step ${whole(at)}; the body was made anew.`);
  }
}

// ---- pointer and keys

const view = document.querySelector(".view");
view.addEventListener(
  "pointerdown",
  (event) => {
    if (!subject || event.target !== stage.canvas || !event.isPrimary) {
      return;
    }
    const at = hand === "pull" && !trial ? stage.pick(event.clientX, event.clientY) : null;
    const taken = at !== null && subject.take(at);
    stage.controls.enabled = hand === "pull" && !taken;
    if (taken) {
      subject.from = at;
      say("Pulled.");
    } else if (hand === "cut") {
      stroke = [[event.clientX, event.clientY]];
    }
    if (!stage.controls.enabled) {
      stage.canvas.setPointerCapture(event.pointerId);
    }
  },
  { capture: true },
);
view.addEventListener("pointermove", (event) => {
  if (subject?.grip && subject.from) {
    const at = stage.follow(event.clientX, event.clientY);
    if (at) subject.pull(at.map((x, c) => x - subject.from[c]));
  } else if (stroke) {
    stroke.push([event.clientX, event.clientY]);
  }
});
for (const end of ["pointerup", "pointercancel"]) {
  view.addEventListener(end, () => letGo());
}
function letGo() {
  if (subject?.grip) {
    subject.release();
    say("Let go.");
  }
  if (subject) subject.from = arrows = null;
  if (stroke) slice();
  stroke = null;
  stage.controls.enabled = true;
}

/** The blade goes through the body as deep as one sees. */
function slice() {
  const near = (p, [a, b]) => {
    const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    const t = Math.max(0, Math.min(1, ((p.x - a[0]) * dx + (p.y - a[1]) * dy) / (dx * dx + dy * dy || 1)));
    return Math.hypot(p.x - a[0] - t * dx, p.y - a[1] - t * dy);
  };
  const parts = stroke.slice(1).map((b, i) => [stroke[i], b]);
  const gone = subject.cut((middle) => {
    const at = stage.project(middle);
    const reach = 0.55 * subject.shape.cellSize * at.metre;
    return parts.some((part) => near(at, part) < reach);
  });
  if (gone > 0) {
    meter.stop();
  }
  say(gone > 0 ? `Cut: ${whole(gone)} cells are gone.` : "The blade met nothing.");
}

const directions = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
find("canvas").addEventListener("keydown", (event) => {
  const direction = directions[event.key];
  if (direction && !trial) {
    event.preventDefault();
    if (!arrows) {
      const u = subject.dynamics.displacements;
      let top = 0;
      for (let n = 0; n < subject.lattice.nodeCount; ++n) {
        if (subject.rest[3 * n] + 2 * subject.rest[3 * n + 1] > subject.rest[3 * top] + 2 * subject.rest[3 * top + 1]) top = n;
      }
      if (!subject.take([0, 1, 2].map((c) => subject.rest[3 * top + c] + u[3 * top + c]))) return;
      arrows = [0, 0, 0];
    }
    direction.forEach((d, c) => (arrows[c] += 0.05 * subject.size * d));
    subject.pull(arrows);
    say("Pulled by its upper corner; Escape lets go.");
  } else if (event.key === "Escape" || event.key === "Enter") {
    event.preventDefault();
    if (subject.grip) letGo();
    else if (event.key === "Enter" && settings.stage === "floor") throwIt();
  }
});

// ---- frames

const mean = (old, now) => (old === 0 ? now : old + 0.1 * (now - old));

function frame() {
  requestAnimationFrame(frame);
  const start = performance.now();
  const wanted = timing.step * subject.stepsAFrame;
  timing.share = wanted > budget ? budget / wanted : 1;
  let steps = 1;
  try {
    steps = subject.advance(timing.share);
  } catch (error) {
    if (!(error instanceof HybmssError)) throw error;
    renew(`Refused: ${error.message}. The body was made anew.`);
  }
  const stepped = performance.now();
  timing.step = mean(timing.step, (stepped - start) / steps);
  timing.simulation = mean(timing.simulation, stepped - start);
  timing.steps = mean(timing.steps, steps);
  ++frames;
  if (frames % 10 === 0 && subject.dynamics.notFiniteAt > 0) {
    lost();
  }
  if (trial) {
    watch();
  }
  const drawn = performance.now();
  if (frames % laboratory.sparing === 0) stage.draw(subject);
  timing.drawing = mean(timing.drawing, performance.now() - drawn);
  drawTrail();
  if (frames % 15 === 0) {
    read();
  }
  if (frames % 120 === 60) {
    find("error").textContent = subject.forceError().toExponential(1);
  }
  if (frames > 30 && frames % 2 === 0 && !subject.grip && !trial) {
    meter.turn();
  }
}

function read() {
  const ns = (1e6 * timing.step) / subject.cellCount;
  find("simulation").textContent = `${timing.simulation.toFixed(1)} ms`;
  find("drawing").textContent = `${timing.drawing.toFixed(1)} ms`;
  find("cells").textContent = whole(subject.cellCount);
  find("steps").textContent = `${whole(Math.round(60 * timing.steps))} /s, ${ns.toFixed(0)} ns a cell`;
  find("speed").textContent = timing.share === 1 ? "real" : `${Math.round(100 * timing.share)} %`;
}

function drawTrail() {
  const box = stage.canvas.getBoundingClientRect();
  const line = find("trail").firstElementChild;
  const points = stroke ? stroke.map(([x, y]) => `${x - box.left},${y - box.top}`).join(" ") : "";
  if (line.getAttribute("points") !== points) line.setAttribute("points", points);
}

async function begin() {
  try {
    await load(); // one thread: what the page measures is then the work of a core
    stage = new Stage(find("canvas"));
    choices();
    panel.inert = find("reset").disabled = false;
    renew("Pull the body, turn the view beside it.");
  } catch (error) {
    say(`This page cannot start: ${error.message}.`);
    throw error;
  }
  requestAnimationFrame(frame);
}

begin();

/** For tests. */
export const laboratory = {
  get subject() {
    return subject;
  },
  get stage() {
    return stage;
  },
  get trial() {
    return trial !== null;
  },
  get frames() {
    return frames;
  },
  settings,
  sparing: 1, // draws one frame of so many: where no graphics card helps, each takes a third of a second
};
globalThis.laboratory = laboratory;
