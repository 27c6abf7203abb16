// node: a frame of the laboratory's bodies, and a step beside native SSE2 and another engine's. `scripts/web --bench`.
import { spawnSync } from "node:child_process";
import { Dynamics, Lattice, load } from "hybmss";
import { cube, liver } from "./shapes.js";

const [module, native] = process.argv.slice(2);
await load(`file://${module}`);

const at = (values, share) => values.slice().sort((a, b) => a - b)[Math.floor(share * (values.length - 1))];

/** ms that a call takes, by the clock and on the core: other programs may hold it up. */
function timed(work) {
  const [start, core] = [performance.now(), process.cpuUsage()];
  work();
  const { user, system } = process.cpuUsage(core);
  return { wall: performance.now() - start, core: (user + system) / 1000 };
}

function body({ cells, cellSize, filled }) {
  const material = { youngModulus: 1e4, poissonRatio: 0.45, density: 1000 };
  return new Dynamics(new Lattice({ cells, cellSize, scales: filled, material }));
}

// A frame of 1/60 s: the body falls, hits a floor and rebounds. From the first frame on.
console.log("body                 cells steps a frame  median ms   99 % ms    core ms core 99 %");
const edge = 27.1441761659491; // 20,000 cells
const shapes = {
  "cube, 10 mm": { ...cube(Math.ceil(edge)), cellSize: 0.01 },
  "liver, 8 mm": liver(1.52, 0.008),
};
for (const [name, shape] of Object.entries(shapes)) {
  const dynamics = body(shape);
  const count = Math.ceil(1 / 60 / (0.9 * dynamics.criticalTimeStep));
  dynamics.setObstacles([{ shape: "plane", dimensions: [0, 1, 0], pose: { position: [0, -0.02, 0] }, friction: 0.5 }]);
  const step = { timeStep: 1 / 60 / count, acceleration: [0, -9.81, 0], massDamping: 1 };
  const times = [];
  for (let frame = 0; frame < 600; ++frame) {
    times.push(timed(() => dynamics.step(step, count)));
  }
  const figures = ["wall", "core"].flatMap((clock) =>
    [0.5, 0.99].map((share) => at(times.map((time) => time[clock]), share).toFixed(2).padStart(10)),
  );
  console.log(`${name.padEnd(18)}${String(dynamics.lattice.cellCount).padStart(8)}${String(count).padStart(14)} ${figures.join("")}`);
  dynamics.free();
}

// A float step of 20^3 cells, in turns with the native program where it was built.
const own = body({ ...cube(20), cellSize: 0.01 });
const step = { timeStep: 0.5 * own.criticalTimeStep };
own.step(step, 2000);
const [here, there] = [[], []];
for (let turn = 0; turn < (native ? 5 : 3); ++turn) {
  for (let i = 0; i < 200; ++i) {
    here.push((timed(() => own.step(step, 5)).wall * 1e6) / 5 / 8000);
  }
  if (native) {
    const filter = "20x20x20/HybMSS/lattice/sse2/float";
    const given = ["bench", "--isa", "sse2", "--threads", "1", "--accuracy", "exact", "--min-time", "0.3", "--filter", filter];
    const row = /^20x20x20\s.*$/m.exec(spawnSync(native, given).stdout);
    if (row) there.push(Number(row[0].trim().split(/\s+/)[8]));
  }
}
// The fastest of many short rounds, of both: what other programs take of the core is left out.
const [module20, native20] = [here, there].map((times) => Math.min(...times));
console.log(`\na float step of 20^3 cells: ${module20.toFixed(1)} ns a cell`);
if (there.length > 0) {
  console.log(`native SSE2, exact, in turns: ${native20.toFixed(1)} ns; ${(module20 / native20).toFixed(2)} times as long`);
}
