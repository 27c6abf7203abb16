// What things cost, measured: pairs of bodies alike but for one effect, stepped in turns in the pauses between frames.
import { Lattice } from "hybmss";
import { dynamicsOf, effects, frameTime, materialOf } from "./subject.js";

const rounds = 12;

/** The settings with one thing changed, and a word for it. */
function variants(settings) {
  const others = Object.entries(effects).map(([name, { key }]) => [name, { ...settings, [key]: !settings[key] }]);
  others.push(["float", { ...settings, precision: settings.precision === "float32" ? "float64" : "float32" }]);
  others.push(["means", { ...settings, springs: settings.springs === "nodes" ? "means" : "nodes" }]);
  return others;
}

const median = (values) => values.slice().sort((a, b) => a - b)[values.length >> 1];

export class Meter {
  /** report(name, {on, off, step}): ns a cell and step with and without; step: how much of a frame they take. */
  constructor(subject, report) {
    this.subject = subject;
    this.report = report;
    this.queue = variants(subject.settings);
    this.pair = null;
  }

  #make(settings) {
    const { shape, dynamics } = this.subject;
    const { cells, cellSize, filled } = shape;
    const lattice = new Lattice({ cells, cellSize, scales: filled, material: materialOf(settings) });
    const body = dynamicsOf(lattice, settings);
    body.displacements = dynamics.displacements;
    const timeStep = 0.1 * body.criticalTimeStep; // stays near the state at hand
    const integrator = settings.leapfrog ? "leapfrog" : "symplectic-euler";
    const count = Math.max(1, Math.round(40000 / lattice.cellCount)); // some 2 ms
    body.step({ timeStep, integrator }, count);
    return { lattice, body, parameters: { timeStep, integrator }, count, times: [], critical: body.criticalTimeStep };
  }

  #free() {
    this.pair?.both.forEach(({ lattice, body }) => (body.free(), lattice.free()));
    this.pair = null;
  }

  /** A few milliseconds of measuring; true while there is more to do. */
  turn() {
    if (!this.pair) {
      const next = this.queue.shift();
      if (!next) {
        return false;
      }
      const [name, settings] = next;
      try {
        this.pair = { name, both: [this.#make(this.subject.settings), this.#make(settings)] };
      } catch (error) {
        this.report(name, { refused: error.message });
      }
      return true;
    }
    const { name, both } = this.pair;
    both.forEach((one) => {
      const start = performance.now();
      one.body.step(one.parameters, one.count);
      one.times.push(((performance.now() - start) * 1e6) / one.count / one.lattice.cellCount);
    });
    if (both[0].times.length === rounds) {
      const [own, other] = both.map(({ times, lattice, critical }) => {
        const ns = median(times);
        const steps = Math.ceil(frameTime / (0.9 * critical));
        return { ns, ms: (ns * lattice.cellCount * steps) / 1e6 };
      });
      this.#free();
      this.report(name, { own, other });
    }
    return true;
  }

  stop() {
    this.#free();
    this.queue = [];
  }
}
