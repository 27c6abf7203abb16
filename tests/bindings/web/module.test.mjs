// The module in node: the same bits as native kernels, records, refusals, memory, every call of the interface.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { copyFile, mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import test from "node:test";

import { Dynamics, ForcePlan, HybmssError, Lattice, load, Network, Record, Skin, Solid, version, World } from "../../../build/web/package/hybmss.js";

const root = new URL("../../../", import.meta.url);
const source = (path) => readFile(new URL(path, root));

test("nothing goes before load()", () => {
  assert.throws(() => new Lattice({ cells: [1, 1, 1], cellSize: 1 }), /await load\(\) comes first/);
});

await load();

/** The engine std::mt19937. */
function* twister(seed) {
  const state = new Uint32Array(624);
  state[0] = seed;
  for (let i = 1; i < 624; ++i) {
    state[i] = Math.imul(1812433253, state[i - 1] ^ (state[i - 1] >>> 30)) + i;
  }
  for (;;) {
    for (let i = 0; i < 624; ++i) {
      const y = (state[i] & 0x80000000) | (state[(i + 1) % 624] & 0x7fffffff);
      state[i] = state[(i + 397) % 624] ^ (y >>> 1) ^ (y & 1 ? 0x9908b0df : 0);
    }
    for (let y of state) {
      y ^= y >>> 11;
      y ^= (y << 7) & 0x9d2c5680;
      y ^= (y << 15) & 0xefc60000;
      yield (y ^ (y >>> 18)) >>> 0;
    }
  }
}

/** plan/tuning/digest.hpp */
function digest(views) {
  let value = 0xcbf29ce484222325n;
  for (const view of views) {
    for (const byte of new Uint8Array(view.buffer, view.byteOffset, view.byteLength)) {
      value = ((value ^ BigInt(byte)) * 0x100000001b3n) & 0xffffffffffffffffn;
    }
  }
  return value;
}

/** The numbers so many units of the last place on. */
function after(value, units) {
  const words = new BigInt64Array(new Float64Array([value]).buffer);
  words[0] += BigInt(units);
  return new Float64Array(words.buffer)[0];
}

test("exact motion has the golden bits of all instruction sets, which tests/plan/determinism_test.cpp holds", async () => {
  // The bound of the time step, half of which that test takes, comes of eigenvalues: what native builds do by vectors is
  // done here number by number, and summed in another order. In double that changes its last bit.
  const units = { float32: 0, float64: 1 };
  const [, ...golden] = /kThousandSteps\[\] = \{(\d+)u, (\d+)u\}/.exec(await source("tests/plan/determinism_test.cpp"));
  for (const [i, precision] of ["float32", "float64"].entries()) {
    const lattice = new Lattice({ cells: [6, 5, 9], cellSize: 0.25, material: { poissonRatio: 0.4 } });
    const body = new Dynamics(lattice, { precision, accuracy: "exact" });
    const draws = twister(7);
    const bound = 0.05 * 0.25;
    body.displacements = Array.from(
      { length: 3 * body.nodeCount },
      () => bound * (draws.next().value / 2147483648 - 1),
    );
    const native = after(body.criticalTimeStep, units[precision]);
    body.step({ timeStep: 0.5 * native, acceleration: [0, -9.81, 0], massDamping: 0.3 }, 1000);
    assert.equal(digest([body.displacements, body.velocities, body.forces]).toString(), golden[i], precision);
    body.free();
    lattice.free();
  }
});

test("forces and energies of records of the scalar reference, by every layout", async () => {
  // hybmss record: a bar of 3 x 2 x 4 cells, springs between nodes with nu = 0.45 and on means with nu = 0.1
  for (const name of ["nodes", "means"]) {
    const record = new Record(await source(`tests/bindings/web/${name}.record`));
    const lattice = record.lattice();
    assert.equal(record.stateCount, 2);
    for (const precision of ["float32", "float64"]) {
      for (const layout of ["flat-rows", "active-rows", "packed-xyzw", "coloured-soa"]) {
        const plan = new ForcePlan(lattice, { precision, layout });
        for (let state = 0; state < record.stateCount; ++state) {
          record.readDisplacements(state, plan);
          plan.forces.fill(0);
          plan.addForces();
          record.compareForces(state, plan); // throws where an error is above the record's own tolerance
          record.compareEnergy(state, plan);
          plan.forces[4] += 1000;
          assert.throws(() => record.compareForces(state, plan), { name: "HybmssError", status: "mismatch" });
        }
      }
    }
  }
  assert.throws(() => new Record("nonsense"), { name: "HybmssError", status: "file error" });
});

test("the instruction set is the only one, and has the exact levels' bits at every level", () => {
  const lattice = new Lattice({ cells: [7, 6, 5], cellSize: 0.1 });
  const bits = ["fast", "accurate", "exact"].map((accuracy) => {
    const plan = new ForcePlan(lattice, { accuracy });
    assert.match(plan.describe(), /sse2/);
    plan.displacements.forEach((_, i, u) => (u[i] = 0.01 * Math.sin(i * i)));
    plan.addForces();
    return digest([plan.forces]);
  });
  assert.equal(new Set(bits).size, 1);
});

test("forces are minus the gradient of the energy", () => {
  const lattice = new Lattice({ cells: [3, 2, 2], cellSize: 1, material: { poissonRatio: 0.45, springs: "means" } });
  const plan = new ForcePlan(lattice, { precision: "float64" });
  plan.displacements.forEach((_, i, u) => (u[i] = 0.05 * Math.sin(7 * i + 1)));
  plan.addForces();
  const total = () => Object.values(plan.energy()).reduce((a, b) => a + b);
  for (const i of [0, 13, 50]) {
    const at = plan.displacements[i];
    const [high, low] = [1e-5, -1e-5].map((h) => ((plan.displacements[i] = at + h), total()));
    plan.displacements[i] = at;
    // central differences: h^2 of a third derivative of the size of the stiffness, and rounding by h
    assert.ok(Math.abs(plan.forces[i] + (high - low) / 2e-5) < 1e-5 * 1e4, `component ${i}`);
  }
});

test("wrong values are refused in one line that says what is allowed", () => {
  const refused = (make, words) =>
    assert.throws(make, (error) => {
      assert.ok(error instanceof HybmssError);
      assert.equal(error.status, "invalid argument");
      assert.match(error.message, words);
      assert.ok(!error.message.includes("\n"));
      return true;
    });
  const box = { cells: [2, 2, 2], cellSize: 0.1 };
  refused(() => new Lattice({ ...box, material: { poissonRatio: 0.5 } }), /poisson_ratio = 0.5/);
  refused(() => new Lattice({ ...box, material: { poisonRatio: 0.4 } }), /material.poisonRatio is not known/);
  refused(() => new Lattice({ ...box, material: { springs: "edges" } }), /nodes, means/);
  refused(() => new Lattice({ ...box, cellSize: -1 }), /cell_size/);
  refused(() => new Lattice({ ...box, scales: [1, 2] }), /scales/);
  const lattice = new Lattice(box);
  refused(() => new Dynamics(lattice, { precision: "float16" }), /float32, float64/);
  refused(() => new ForcePlan(lattice, { layout: "rows" }), /rows/);
  const body = new Dynamics(lattice);
  refused(() => body.step({ timeStep: 0 }), /time_step/);
  refused(() => (body.displacements = [1, 2, 3]), /3 values given, 81 needed/);
  refused(() => body.prescribe([{ node: 99 }]), /node/);
  refused(() => body.setObstacles([{ shape: "cone", dimensions: [1, 1, 1] }]), /plane, sphere, box, capsule/);
  refused(() => body.setObstacles([{ shape: "capsule", dimensions: [1] }]), /obstacle.dimensions/);
  body.setObstacles([{ shape: "capsule", dimensions: [0.1, 0.3], pose: { position: [0.1, -1, 0.1] } }]);
  const corners = [-1, -1, -1, 1, -1, -1, -1, 1, -1, 1, 1, -1, -1, -1, 1, 1, -1, 1, -1, 1, 1, 1, 1, 1];
  const solid = new Solid({ points: corners });
  body.setObstacles([{ shape: "solid", solid, pose: { position: [0, -0.99, 0] } }]);
  solid.free();
  assert.ok(Math.abs(body.obstacleReadings()[0].depth - 0.01) < 1e-6);
  refused(() => body.setObstacles([{ shape: "solid" }]), /solid is null/);
  body.setObstacles([{ shape: "sphere", dimensions: [0.1], pose: { position: [0, 9, 0] }, mass: 2, inertia: [1, 1, 1] }]);
  body.step({ timeStep: 1e-5, acceleration: [0, -10, 0] }, 10);
  const [fallen] = body.obstaclePoses();
  assert.ok(Math.abs(fallen.velocity[1] + 1e-3) < 1e-12 && fallen.rotation[0] === 1);
  refused(() => body.setObstacles([{ shape: "plane", dimensions: [0, 1, 0], mass: 1 }]), /cannot be free/);
  refused(() => new Solid({ points: [0, 0, 0] }), /1 points given/);
  refused(() => new Solid({ vertices: corners, triangles: [0, 2, 3] }), /not closed/);
  refused(() => new Solid({ heights: [0, 0, 0], counts: [2, 2], spacing: [1, 1] }), /3 given, 4 needed/);
  body.setObstacles([
    { shape: "solid", solid: new Solid({ heights: [0, 0, 0, 0], counts: [2, 2], spacing: [1, 1] }), pose: { position: [0, 0.01, 0] } },
  ]);
  assert.ok(Math.abs(body.obstacleReadings()[0].depth - 0.01) < 1e-6);
  refused(() => body.removeCells([8]), /8/);
  refused(() => lattice.without([8]), /cell 8/);
  body.free();
  body.free(); // again is nothing
  refused(() => body.step({ timeStep: 1e-3 }), /was freed/);
});

test("a body held at one end, loaded, damped, cut, and let fall on a floor", () => {
  const cells = [4, 4, 4];
  const lattice = new Lattice({ cells, cellSize: 0.01 });
  const body = new Dynamics(lattice);
  const rest = lattice.restPositions;
  const bottom = Array.from({ length: lattice.nodeCount }, (_, n) => n).filter((n) => rest[3 * n + 1] === 0);
  body.prescribe(bottom.map((node) => ({ node })));
  body.dampSprings(1e-3);
  body.load([{ node: lattice.nodeCount - 1, force: [0, 0.01, 0] }]);
  const step = { timeStep: 0.9 * body.criticalTimeStep, massDamping: 5 };
  body.step(step, 500);
  assert.ok(body.displacements[3 * lattice.nodeCount - 2] > 1e-5);
  assert.ok(body.displacements[3 * bottom[3] + 1] === 0);
  assert.ok(body.energies().springs > 0);
  assert.equal(body.removeCells([0, 1, 1]), 2);
  assert.equal(body.removeCells([0]), 0);
  body.prescribe([]);
  body.load([]);
  body.setObstacles([{ shape: "plane", dimensions: [0, 1, 0], pose: { position: [0, -0.01, 0] }, friction: 0.5 }]);
  body.step({ ...step, acceleration: [0, -9.81, 0] }, 3000);
  const [floor] = body.obstacleReadings();
  const weight = 9.81 * body.masses.reduce((a, b) => a + b);
  assert.ok(floor.nodes > 10);
  assert.ok(Math.abs(floor.force[1] - weight) < 0.05 * weight, `${floor.force[1]} of ${weight}`);
  body.moveObstacles([{ position: [0, -0.02, 0] }]);
  assert.equal(body.notFiniteAt, 0);
  body.velocities = body.velocities.map(() => 1e30);
  body.step({ timeStep: 1e10 }, 200);
  assert.ok(body.notFiniteAt > 0);
});

test("a skin follows its body, also one that is cut", () => {
  const whole = new Lattice({ cells: [3, 3, 3], cellSize: 0.1 });
  const body = new Dynamics(whole, { precision: "float64" });
  body.displacements = Float64Array.from(body.displacements, (_, i) => (i % 3 === 0 ? 0.25 : 0));
  const cut = whole.without([0, 13]);
  assert.equal(cut.cellCount, 25);
  const place = new Map(Array.from(whole.gridIndices, (grid, n) => [grid, n]));
  const mesh = cut.boundaryMesh();
  const skin = new Skin(cut, mesh, { precision: "float64", map: Array.from(cut.gridIndices, (grid) => place.get(grid)) });
  skin.update(body);
  skin.positions.forEach((x, i) => assert.ok(Math.abs(x - mesh.vertices[i] - (i % 3 === 0 ? 0.25 : 0)) < 1e-15));
  for (let v = 0; v < skin.normals.length; v += 3) {
    assert.ok(Math.abs(Math.hypot(...skin.normals.subarray(v, v + 3)) - 1) < 1e-12);
  }
});

test("views come anew when memory has grown, with the same numbers", () => {
  const lattice = new Lattice({ cells: [2, 2, 2], cellSize: 0.1 });
  const plan = new ForcePlan(lattice);
  plan.displacements[5] = 0.125;
  const before = plan.displacements;
  const large = [];
  while (before.length > 0) {
    large.push(new Dynamics(new Lattice({ cells: [60, 60, 60], cellSize: 0.1 })));
    assert.ok(large.length < 1000);
  }
  assert.equal(plan.displacements[5], 0.125);
  large.forEach((body) => (body.free(), body.lattice.free()));
});

test("what is freed is there again, and what cannot be had is one error", () => {
  const cells = [60, 60, 60];
  for (let i = 0; i < 200; ++i) { // 200 times what two of them would fill
    const lattice = new Lattice({ cells, cellSize: 0.1 });
    new Dynamics(lattice).free();
    lattice.free();
  }
  assert.throws(() => new Dynamics(new Lattice({ cells: [900, 900, 900], cellSize: 0.1 })), {
    name: "HybmssError",
    status: "out of memory",
  });
});

test("the package carries the library's version and licence", async () => {
  const header = String(await source("include/hybmss/version.h"));
  const numbers = ["MAJOR", "MINOR", "PATCH"].map((part) => new RegExp(`${part} (\\d+)`).exec(header)[1]);
  const described = JSON.parse(await source("build/web/package/package.json"));
  assert.equal(version(), numbers.join("."));
  assert.equal(described.version, version());
  assert.equal(described.license, "MIT");
  const files = String(execFileSync("tar", ["tzf", new URL(`build/web/hybmss-${version()}.tgz`, root).pathname]));
  for (const file of ["LICENSE", "hybmss.js", "hybmss.worker.js", "hybmss.d.ts", "hybmss.wasm", "hybmss.threads.wasm", "package.json"]) {
    assert.ok(files.includes(`package/${file}\n`), file);
  }
});

test("installed from its tarball, the documents' example runs", async () => {
  const place = await mkdtemp(`${tmpdir()}/hybmss-`);
  try {
    const tarball = new URL(`build/web/hybmss-${version()}.tgz`, root).pathname;
    execFileSync("npm", ["install", "--silent", "--offline", "--no-audit", "--prefix", place, tarball]);
    await copyFile(new URL("examples/web/hanging.mjs", root), `${place}/hanging.mjs`);
    const lines = String(execFileSync(process.execPath, [`${place}/hanging.mjs`])).trim().split("\n");
    // 12 cm of 10 kPa stretch by rho g l^2 / (2 E) = 7 mm, while they swing to rest by a little more or less.
    const [, hangs] = /hangs ([\d.]+) mm/.exec(lines.at(-1));
    assert.equal(lines.length, 3);
    assert.ok(Math.abs(hangs - 7) < 2, lines.at(-1));
  } finally {
    await rm(place, { recursive: true });
  }
});

test("a world: what lies on another body weighs on it, and a pointer lifts it", () => {
  const cube = new Lattice({ cells: [3, 3, 3], cellSize: 0.1, material: { youngModulus: 1e6, poissonRatio: 0.3 } });
  const world = new World({ precision: "float64" });
  const low = world.add(cube);
  const high = world.add(cube, { origin: [0.02, 0.3, 0.02] });
  world.bodies[low].setObstacles([{ shape: "plane", dimensions: [0, 1, 0], friction: 0.5 }]);
  world.setContacts([{ first: low, second: high, friction: 0.5 }]);
  const step = { timeStep: 0.5 * world.criticalTimeStep, acceleration: [0, -10, 0], massDamping: 20 };
  world.step(step, 6000);
  const weight = 10 * world.bodies[high].masses.reduce((sum, mass) => sum + mass, 0);
  const [touch] = world.contactReadings();
  assert.ok(Math.abs(touch.force[1] + weight) < 1e-3 * weight && touch.nodes > 0);

  const corner = [0.32, 0.6, 0.32];
  const pointer = world.attach({ body: high, point: corner }, { point: corner }, 1e5);
  world.moveAnchor(pointer, [0.32, 1.1, 0.32]); // it turns about its corner as it hangs
  world.step(step, 6000);
  assert.ok(Math.abs(world.attachmentForce(pointer)[1] - weight) < 1e-2 * weight);
  assert.equal(world.contactReadings()[0].nodes, 0);
  world.detach(pointer);
  world.place(high, { position: [0, 1, 0], velocity: [1, 0, 0] });
  assert.equal(world.bodies[high].velocities[0], 1);
  assert.throws(() => world.place(7, {}), /body 7 is not there: the world has 2/);
  assert.throws(() => world.setContacts([{ first: 0, second: 1, frictoin: 1 }]), /contact.frictoin is not known/);
  assert.equal(world.removeCells(high, [0, 1]), 2);
  assert.throws(() => new World().removeCells(0, [0]), /body 0 is not there: the world has 0/);
  world.free();
  assert.equal(world.bodies[high].velocities.at(-3), 1); // lives on
});

test("lengths and names of what is given are checked", () => {
  const lattice = new Lattice({ cells: [2, 1, 1], cellSize: 0.1, material: {} });
  const body = new Dynamics(lattice);
  const refused = (work, message) => assert.throws(work, message);
  const timeStep = 0.5 * body.criticalTimeStep;
  refused(() => body.step({ timeStep, acceleration: [0, -9.81] }), /step.acceleration = \[0,-9.81\] is not allowed: it must be 3/);
  refused(() => body.step({ timeStep, mass_damping: 5 }), /step.mass_damping is not known/);
  refused(() => body.prescribe([{ nodes: 3 }]), /prescribe.nodes is not known/);
  refused(() => body.prescribe([{ node: 1.5 }]), /prescribe.node = 1.5 is not allowed/);
  refused(() => body.load([{ node: 0, force: [1, 2, 3, 4] }]), /load.force = .* it must be 3 numbers/);
  refused(() => body.setObstacles([{ shape: "box", dimensions: [1] }]), /obstacle.dimensions = \[1\]/);
  refused(() => body.removeCells([-1]), /cell = -1 is not allowed/);
  const labels = { cells: [2, 1, 1], cellSize: 0.1, labels: [1, 256], materials: [{}] };
  refused(() => new Lattice(labels), /label = 256 is not allowed: it must be a whole number below 2\^8/);
  refused(() => new Skin(lattice, lattice.boundaryMesh(), { map: [0] }), /map = \[0\] is not allowed: it must be 12 numbers/);
});

test("a network: springs by Hooke's law, cells by their volumes, motion that keeps momentum", () => {
  const random = twister(9);
  const drawn = () => random.next().value / 2 ** 31 - 1;
  // The corners of a cube of 1 cm, and one node beside it.
  const rest = Float64Array.from({ length: 27 }, (_, i) => (i < 24 ? ((i / 3) >> (i % 3)) & 1 : [3, 1, 2][i - 24]) * 0.01);
  const masses = Float64Array.from({ length: 9 }, (_, i) => 1e-4 * (1 + i));
  const nodes = [0, 1, 0, 7, 3, 8, 8, 5, 2, 4];
  const stiffness = [10, 20, 30, 40, 50];
  const springs = { nodes, stiffness };
  const plain = new ForcePlan(new Network({ restPositions: rest, masses, springs, volumeEnergy: "none" }), { precision: "float64" });
  const u = Float64Array.from(rest, () => 2e-3 * drawn());
  plain.displacements.set(u);
  plain.addForces();
  const expected = new Float64Array(27);
  let energy = 0;
  stiffness.forEach((k, s) => {
    const [a, b] = [nodes[2 * s], nodes[2 * s + 1]];
    const [at, now] = [rest, rest.map((x, i) => x + u[i])].map((x) => [0, 1, 2].map((i) => x[3 * b + i] - x[3 * a + i]));
    const stretch = Math.hypot(...now) - Math.hypot(...at);
    energy += (k * stretch ** 2) / 2;
    now.forEach((d, i) => {
      expected[3 * a + i] += (k * stretch * d) / Math.hypot(...now);
      expected[3 * b + i] -= (k * stretch * d) / Math.hypot(...now);
    });
  });
  plain.forces.forEach((f, i) => assert.ok(Math.abs(f - expected[i]) < 1e-13, `${f} ${expected[i]}`));
  assert.ok(Math.abs(plain.energy().springs - energy) < 1e-13 * energy && plain.energy().volume === 0);

  const cells = { nodes: [0, 1, 2, 3, 4, 5, 6, 7], kappa: [1e4] };
  for (const volumeEnergy of ["quadratic", "mean-stretch"]) {
    const whole = new ForcePlan(new Network({ restPositions: rest, masses, springs, cells, volumeEnergy }), { precision: "float64" });
    whole.displacements.set(u);
    whole.addForces();
    const direction = u.map(drawn);
    const slope = [1, -1].map((sign) => {
      whole.displacements.set(u.map((x, i) => x + sign * 1e-7 * direction[i]));
      const { springs: a, volume: b } = whole.energy();
      return a + b;
    });
    const power = whole.forces.reduce((sum, f, i) => sum + f * direction[i], 0);
    assert.ok(Math.abs((slope[0] - slope[1]) / 2e-7 + power) < 1e-6 * Math.abs(power));
    assert.ok(whole.energy().volume > 0);
  }

  const moving = new Dynamics(new Network({ restPositions: rest, masses, springs, cells }), { precision: "float64" });
  moving.displacements = u;
  moving.step({ timeStep: moving.criticalTimeStep / 2 }, 500);
  const { velocities } = moving;
  for (let axis = 0; axis < 3; ++axis) {
    const parts = Array.from(masses, (m, n) => m * velocities[3 * n + axis]);
    assert.ok(Math.abs(parts.reduce((a, b) => a + b)) < 1e-11 * parts.reduce((a, b) => a + Math.abs(b), 0));
  }

  const refused = (given, words) => assert.throws(() => new Network({ restPositions: rest, masses, ...given }), words);
  refused({ springs: { nodes: [0, 1, 2], stiffness: [1] } }, /network.springs.nodes: 3 values given, 2 needed/);
  refused({ springs: { nodes: [0, 9], stiffness: [1] } }, HybmssError);
  refused({ springs: { nodes: [0, 0], stiffness: [1] } }, HybmssError);
  refused({ springs: { nodes: [0, -1], stiffness: [1] } }, /network.springs.nodes = -1/);
  refused({ springs: { nodes: [0, 1], stiffness: [-1] } }, HybmssError);
  refused({ cells: { nodes: [0, 1, 2], kappa: [1] } }, /8 needed/);
  refused({ spring: springs }, /network.spring is not known/);
  refused({ masses: [1] }, /network.restPositions: 27 values given, 3 needed/);
});
