// The body on the table: what it is made of, how it is held, what is done to it, and whether it is well.
import { Dynamics, ForcePlan, Lattice, Skin } from "hybmss";
import { cube, liver, smoothed } from "./shapes.js";

export const frameTime = 1 / 60; // s
const gripRadius = 1.6; // cells
const fullStep = 0.9; // of the critical time step, which holds near rest
const edgeBits = [2, 4, 1]; // what tells the low corner of an edge along x, y, z from the high one
const calm = 0.1; // of the velocity, a step
const strides = 4; // frames in which every cell is looked at once

/** What costs something, each with what it changes of the settings. */
export const effects = {
  "volume force": { off: { volumeEnergy: "none" }, key: "volume" },
  "face diagonals": { off: { faceDiagonalRatio: 0 }, key: "diagonals" },
  "stiffening springs": { on: { stiffening: { quadratic: 0, cubic: 4 } }, key: "stiffening" },
  "crush resistance": { on: { crush: { resistance: 5, ratio: 0.5 } }, key: "crush" },
  "damping along springs": { key: "springDamping" },
  "leapfrog steps": { key: "leapfrog" },
};

export const defaults = {
  body: "cube",
  stage: "held",
  mesh: 12,
  young: 10000,
  poisson: 0.45,
  damping: 3,
  precision: "float32",
  accuracy: "accurate",
  springs: "nodes",
  volume: true,
  diagonals: true,
  stiffening: false,
  crush: false,
  springDamping: false,
  leapfrog: false,
};

export function materialOf(settings) {
  let material = { youngModulus: settings.young, poissonRatio: settings.poisson, density: 1000, springs: settings.springs };
  for (const { on, off, key } of Object.values(effects)) {
    material = { ...material, ...(settings[key] ? on : off) };
  }
  if (settings.springs === "means") {
    delete material.faceDiagonalRatio; // they are part of that form
  }
  return material;
}

export function shapeOf({ body, mesh }) {
  return body === "cube" ? cube(mesh) : liver(mesh / 12);
}

/** A dynamics of the settings, with their effects. */
export function dynamicsOf(lattice, settings) {
  const dynamics = new Dynamics(lattice, { precision: settings.precision, accuracy: settings.accuracy });
  if (settings.springDamping) {
    dynamics.dampSprings(0.3 * dynamics.criticalTimeStep);
  }
  return dynamics;
}

export class Subject {
  constructor(settings) {
    this.settings = { ...settings };
    this.shape = shapeOf(settings);
    this.lattice = new Lattice({
      cells: this.shape.cells,
      cellSize: this.shape.cellSize,
      scales: this.shape.filled,
      material: materialOf(settings),
    });
    this.dynamics = dynamicsOf(this.lattice, settings);
    this.rest = this.lattice.restPositions.slice();
    this.filled = this.shape.filled.slice();
    this.nodeAt = new Map(Array.from(this.lattice.gridIndices, (grid, node) => [grid, node]));
    this.corners = this.#cellCorners();
    this.centre = [0, 1, 2].map((a) => (this.shape.cells[a] * this.shape.cellSize) / 2);
    this.size = Math.max(...this.shape.cells) * this.shape.cellSize;
    this.criticalTimeStep = this.dynamics.criticalTimeStep;
    this.grip = null;
    this.loose = false; // nothing holds it: while it comes back from torture
    this.away = null; // where that left what is fixed
    this.back = 0; // what is left of that way, of 1
    this.wild = 0; // frames in which all cells are looked at
    this.turn = 0;
    this.longest = this.smallest = 1; // of edges by their length, of cells by their volume
    this.stepsAFrame = Math.ceil(frameTime / (fullStep * this.criticalTimeStep));
    this.plates = 0; // how far pressed together, 0 to 1
    this.pressed = 0;
    this.owned = []; // plans
    this.left = null; // of the lattice, after cuts
    this.#setStage();
    this.#makeSkin(this.lattice);
  }

  free() {
    [this.skin, this.left, ...this.owned, this.dynamics, this.lattice].forEach((one) => one?.free());
  }

  /** Cell by cell that is there: its number, then its eight nodes. */
  #cellCorners() {
    const [nx, ny, nz] = this.shape.cells;
    const row = nx + 1;
    const plane = row * (ny + 1);
    const all = [];
    for (let c = 0; c < this.filled.length; ++c) {
      if (this.filled[c] > 0) {
        const low = (c % nx) + row * (Math.floor(c / nx) % ny) + plane * Math.floor(c / nx / ny);
        const grid = [0, 1, row, row + 1].flatMap((n) => [low + n, low + n + plane]);
        all.push(c, ...grid.map((n) => this.nodeAt.get(n)));
      }
    }
    return Int32Array.from(all); // corners in the order (x low y low) z low, z high, (x high y low) ...
  }

  #makeSkin(lattice) {
    const raw = lattice.boundaryMesh();
    const mesh = this.settings.body === "cube" ? raw : smoothed(raw, 24);
    const map = Array.from(lattice.gridIndices, (grid) => this.nodeAt.get(grid));
    this.skin?.free();
    this.skin = new Skin(lattice, mesh, { precision: this.settings.precision, map });
    this.triangles = mesh.triangles;
    this.restSkin = mesh.vertices;
    this.skinChanged = true;
  }

  // ---- how it is held

  get floor() {
    return -0.25 * this.size;
  }

  #setStage() {
    const { stage, body } = this.settings;
    const [cx, , cz] = this.centre;
    const height = this.shape.cells[1] * this.shape.cellSize;
    const plane = (normal, y) => ({ shape: "plane", dimensions: [0, normal, 0], pose: { position: [cx, y, cz] }, friction: 0.5 });
    this.obstacles = {
      held: [],
      floor: [plane(1, this.floor)],
      plates: [plane(1, 0), plane(-1, height)],
    }[stage];
    this.dynamics.setObstacles(this.obstacles);
    this.fixed = [];
    if (stage === "held") {
      for (let n = 0; n < this.lattice.nodeCount; ++n) {
        const [x, y, z] = this.rest.subarray(3 * n, 3 * n + 3);
        const hangs = Math.hypot(x - 0.072, y - 0.15, z - 0.03) < 0.05; // where it has grown to the diaphragm
        if (body === "cube" ? y === 0 : hangs) {
          this.fixed.push({ node: n });
        }
      }
    }
    this.#prescribe();
  }

  #prescribe() {
    const fixed = this.fixed.map(({ node }, i) => ({ node, displacement: this.away?.[i].map((d) => this.back * d) }));
    this.dynamics.prescribe(this.loose ? [] : [...fixed, ...(this.grip?.nodes ?? [])]);
  }

  get gravity() {
    return this.loose || this.settings.stage === "plates" ? [0, 0, 0] : [0, -9.81, 0];
  }

  // ---- grips

  /** Takes hold of the nodes around a point of space; false where nothing is near. */
  take(point) {
    const u = this.dynamics.displacements;
    const radius = gripRadius * this.shape.cellSize;
    const held = new Set(this.fixed.map(({ node }) => node));
    const nodes = [];
    for (let n = 0; n < this.lattice.nodeCount; ++n) {
      const at = [0, 1, 2].map((c) => this.rest[3 * n + c] + u[3 * n + c]);
      if (!held.has(n) && Math.hypot(...at.map((x, c) => x - point[c])) < radius) {
        nodes.push({ node: n, displacement: Array.from(u.subarray(3 * n, 3 * n + 3)) });
      }
    }
    if (nodes.length === 0) {
      return false;
    }
    this.grip = { start: nodes, nodes, moved: [0, 0, 0], wanted: [0, 0, 0] };
    this.#prescribe();
    return true;
  }
  pull(offset) {
    if (this.grip) {
      this.grip.wanted = offset;
    }
  }
  release() {
    this.grip = null;
    this.#prescribe();
  }

  // ---- motion

  /**
   * How the next frame is stepped. Near rest the critical step holds. Where edges are `longest` times their length, volumes
   * are stiffer by the fourth power of that, and cells that resist crushing many times stiffer: shorter steps first, and
   * beyond four in one's place a damping under which these are stable (dt^2 omega^2 < 4 + 2 dt c).
   */
  #pace() {
    const { crush, poisson } = this.settings;
    const crushed = this.smallest < 0.55 && (crush || poisson < 0.2);
    const stiffer = Math.max(1, this.longest - 0.1) ** 4 * (crushed ? 8 : 1);
    const shorter = Math.max(this.wild > 0 ? 2 : 1, Math.min(4, Math.sqrt(stiffer)));
    const steps = Math.ceil((frameTime * shorter) / (fullStep * this.criticalTimeStep));
    const timeStep = frameTime / steps;
    const left = stiffer / shorter ** 2;
    // Per step: what is stable; or so that what was crushed does not overshoot within a frame.
    const damped = left > 1 ? 1.7 * left : this.wild > 0 && this.smallest < 0.5 ? calm : 0;
    return { steps, timeStep, massDamping: Math.max(this.settings.damping, damped / timeStep) };
  }

  /** What #pace() goes by: of a body that was just tortured all cells, else those in turn; what was long stays a while. */
  #feel() {
    const all = this.wild > 0;
    const seen = all ? this.#look(0, 1) : this.#look(this.turn++ % strides, strides);
    const keep = all ? 0 : 0.8;
    const longest = Number.isFinite(seen.longest) ? seen.longest : 1; // else all is lost, and said so
    this.longest = Math.max(longest, 1 + keep * (this.longest - 1));
    this.smallest = Math.min(seen.smallest, 1 - keep * (1 - this.smallest));
    this.wild = Math.max(0, this.wild - 1);
  }

  /** One frame, or `share` of it: what is led moves on in a few parts, so that it does not jump. */
  advance(share = 1) {
    this.#feel();
    const { steps: all, timeStep, massDamping } = this.#pace();
    const steps = Math.max(1, Math.round(share * all));
    const led = !this.loose && (this.grip || this.back > 0 || this.settings.stage === "plates");
    const parts = led ? Math.min(4, steps) : 1;
    // Leapfrog takes no damping that ends a motion within a step.
    const integrator = this.settings.leapfrog && massDamping === this.settings.damping ? "leapfrog" : "symplectic-euler";
    const parameters = { timeStep, acceleration: this.gravity, massDamping, integrator };
    let done = 0;
    for (let part = 1; part <= parts; ++part) {
      const until = Math.round((part * steps) / parts);
      if (led) this.#lead((until - done) * timeStep);
      this.dynamics.step(parameters, until - done);
      done = until;
    }
    this.stepsAFrame = all;
    return steps;
  }

  #lead(time) {
    const fastest = 1.5 * this.size * time; // m in this time
    if (this.grip) {
      const way = this.grip.wanted.map((w, c) => w - this.grip.moved[c]);
      const part = Math.min(1, fastest / (Math.hypot(...way) || 1));
      this.grip.moved = this.grip.moved.map((m, c) => m + part * way[c]);
      this.grip.nodes = this.grip.start.map(({ node, displacement }) => ({
        node,
        displacement: displacement.map((d, c) => d + this.grip.moved[c]),
      }));
      this.#prescribe();
    }
    if (this.back > 0) {
      this.back = Math.max(0, this.back - 1.5 * time);
      this.#prescribe();
    }
    if (this.settings.stage === "plates") {
      const height = this.shape.cells[1] * this.shape.cellSize;
      const way = this.plates * 0.45 * height - this.pressed;
      this.pressed += Math.sign(way) * Math.min(Math.abs(way), 0.3 * fastest);
      this.obstacles[0].pose.position[1] = this.pressed;
      this.obstacles[1].pose.position[1] = height - this.pressed;
      this.dynamics.moveObstacles(this.obstacles.map(({ pose }) => pose));
    }
  }

  /** Up and forward, with a spin about its middle. */
  throwIt() {
    const u = this.dynamics.displacements;
    const v = this.dynamics.velocities;
    const middle = [0, 1, 2].map((c) => {
      let sum = 0;
      for (let n = 0; n < this.lattice.nodeCount; ++n) sum += this.rest[3 * n + c] + u[3 * n + c];
      return sum / this.lattice.nodeCount;
    });
    const spin = [1.5, 2, -5];
    for (let n = 0; n < this.lattice.nodeCount; ++n) {
      const [x, y, z] = middle.map((m, c) => this.rest[3 * n + c] + u[3 * n + c] - m);
      v[3 * n] += spin[1] * z - spin[2] * y;
      v[3 * n + 1] += 2 + spin[2] * x - spin[0] * z;
      v[3 * n + 2] += spin[0] * y - spin[1] * x;
    }
    this.dynamics.velocities = v;
  }

  // ---- torture: displacements that no body comes to by itself, from which it is let go

  torture(kind) {
    const move = {
      flatten: ([x, y, z]) => [x, this.centre[1] + 0.001 * (y - this.centre[1]), z],
      crush: (p) => p.map((x, c) => this.centre[c] + 0.15 * (x - this.centre[c])),
      "inside out": ([x, y, z]) => [2 * this.centre[0] - x, y, z],
      scramble: (p) => p.map((x) => x + 4 * (Math.random() - 0.5) * this.shape.cellSize),
    }[kind];
    this.release();
    this.loose = true;
    this.dynamics.setObstacles([]);
    this.#prescribe();
    const u = new Float64Array(this.rest.length);
    for (let n = 0; n < this.lattice.nodeCount; ++n) {
      const at = this.rest.subarray(3 * n, 3 * n + 3);
      move(Array.from(at)).forEach((x, c) => (u[3 * n + c] = x - at[c]));
    }
    this.dynamics.displacements = u;
    this.dynamics.velocities = new Float64Array(u.length);
    this.wild = 480;
  }

  /** Holds it again as before, after torture: what was fixed is led back to its place. */
  settle() {
    this.loose = false;
    this.dynamics.setObstacles(this.obstacles);
    const u = this.dynamics.displacements;
    this.away = this.fixed.map(({ node }) => Array.from(u.subarray(3 * node, 3 * node + 3)));
    this.back = 1;
  }

  /** Of the cells: how many are inside out, the smallest volume ratio, and the largest length of an edge. */
  health() {
    return this.#look(0, 1);
  }

  /** The same of every `stride`-th cell from number `first` on. */
  #look(first, stride) {
    const u = this.dynamics.displacements;
    const { rest, corners, filled } = this;
    const h = this.shape.cellSize;
    const g = new Float64Array(9); // the mean of a cell's gradient, from its edges: four along each axis
    const found = { cells: 0, inverted: 0, smallest: Infinity, longest: 0, shortest: Infinity };
    let [longest, shortest] = [0, Infinity];
    for (let at = 9 * first; at < corners.length; at += 9 * stride) {
      if (filled[corners[at]] === 0) {
        continue;
      }
      for (let axis = 0; axis < 3; ++axis) {
        const bit = edgeBits[axis];
        let [sx, sy, sz] = [0, 0, 0];
        for (let n = 0; n < 8; ++n) {
          if ((n & bit) === 0) {
            const a = 3 * corners[at + 1 + n];
            const b = 3 * corners[at + 1 + n + bit];
            const x = rest[b] + u[b] - rest[a] - u[a];
            const y = rest[b + 1] + u[b + 1] - rest[a + 1] - u[a + 1];
            const z = rest[b + 2] + u[b + 2] - rest[a + 2] - u[a + 2];
            const square = x * x + y * y + z * z;
            if (square > longest) longest = square;
            if (square < shortest) shortest = square;
            sx += x;
            sy += y;
            sz += z;
          }
        }
        g[3 * axis] = sx;
        g[3 * axis + 1] = sy;
        g[3 * axis + 2] = sz;
      }
      const volume =
        (g[0] * (g[4] * g[8] - g[5] * g[7]) - g[1] * (g[3] * g[8] - g[5] * g[6]) + g[2] * (g[3] * g[7] - g[4] * g[6])) /
        (4 * h) ** 3;
      if (volume < found.smallest) found.smallest = volume;
      if (volume <= 0) ++found.inverted;
      ++found.cells;
    }
    found.longest = Math.sqrt(longest) / h;
    found.shortest = Math.sqrt(shortest) / h;
    return found;
  }

  // ---- cuts

  /** Removes the cells whose middle, where it is now, the blade meets. */
  cut(meets) {
    const u = this.dynamics.displacements;
    const gone = [];
    for (let at = 0; at < this.corners.length; at += 9) {
      const cell = this.corners[at];
      if (this.filled[cell] > 0) {
        const middle = [0, 0, 0];
        for (let n = 1; n <= 8; ++n) {
          const node = 3 * this.corners[at + n];
          for (let c = 0; c < 3; ++c) middle[c] += (this.rest[node + c] + u[node + c]) / 8;
        }
        if (meets(middle)) {
          gone.push(cell);
        }
      }
    }
    const left = this.filled.reduce((sum, s) => sum + (s > 0 ? 1 : 0), 0) - gone.length;
    if (gone.length === 0 || left === 0) {
      return 0;
    }
    this.dynamics.removeCells(gone);
    gone.forEach((cell) => (this.filled[cell] = 0));
    const removed = Array.from(this.filled.keys()).filter((c) => this.filled[c] === 0);
    this.left?.free();
    this.left = this.lattice.without(removed);
    this.#makeSkin(this.left);
    return gone.length;
  }

  get cellCount() {
    return (this.left ?? this.lattice).cellCount;
  }

  /** The largest error of the body's forces now, against double and exact, by the largest force at a node. */
  forceError() {
    const { precision, accuracy } = this.settings;
    this.plans ??= [{ precision, accuracy }, { precision: "float64", accuracy: "exact" }].map((options) => {
      this.owned.push(new ForcePlan(this.lattice, options));
      return this.owned.at(-1);
    });
    const u = this.dynamics.displacements;
    const [own, exact] = this.plans.map((plan) => {
      plan.displacements.set(u);
      plan.forces.fill(0);
      plan.addForces();
      return plan;
    });
    let [error, largest] = [0, 0];
    exact.forces.forEach((f, i) => {
      error = Math.max(error, Math.abs(own.forces[i] - f));
      largest = Math.max(largest, Math.abs(f));
    });
    return largest > 0 ? error / largest : 0;
  }
}
