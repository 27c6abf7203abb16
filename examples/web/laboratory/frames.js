// Frames of 1/60 s of the bodies that are to keep up with a screen, timed; for node and for a page. `scripts/web --bench`.
import { Dynamics, Lattice, load } from "hybmss";
import { cube, liver } from "./shapes.js";

const shapes = {
  "cube, 10 mm": { ...cube(28), cellSize: 0.01 }, // 21,952 cells
  "liver, 8 mm": liver(1.53, 0.008), // 12,000 and more
};
export const names = Object.keys(shapes);
export { load };

export function bodyOf({ cells, cellSize, filled }) {
  const material = { youngModulus: 1e4, poissonRatio: 0.45, density: 1000 };
  return new Dynamics(new Lattice({ cells, cellSize, scales: filled, material }));
}

const falling = {};

/** ms that each of the next `count` frames takes: the body falls, hits a floor and rebounds. */
export function frames(name, count, clock = () => performance.now()) {
  if (!falling[name]) {
    const body = bodyOf(shapes[name]);
    body.setObstacles([{ shape: "plane", dimensions: [0, 1, 0], pose: { position: [0, -0.02, 0] }, friction: 0.5 }]);
    falling[name] = { body, steps: Math.ceil(1 / 60 / (0.9 * body.criticalTimeStep)) };
  }
  const { body, steps } = falling[name];
  const step = { timeStep: 1 / 60 / steps, acceleration: [0, -9.81, 0], massDamping: 1 };
  const times = [];
  for (let frame = 0; frame < count; ++frame) {
    const start = clock();
    body.step(step, steps);
    times.push(clock() - start);
  }
  return { cells: body.lattice.cellCount, steps, times };
}

/** ns a cell that a float step of 20^3 cells takes: the fastest of many short rounds. */
export function stepTime() {
  const body = (falling.step ??= bodyOf({ ...cube(20), cellSize: 0.01 }));
  const step = { timeStep: 0.5 * body.criticalTimeStep };
  let least = Infinity;
  for (let round = 0; round < 200; ++round) {
    const start = performance.now();
    body.step(step, 5);
    least = Math.min(least, (1e6 * (performance.now() - start)) / 5 / 8000);
  }
  return least;
}
