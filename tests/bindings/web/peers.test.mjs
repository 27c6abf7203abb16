// bench/peers in node: springs of a cube as the module has them, and what is said of engines that are not there.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import test from "node:test";
import { fileURLToPath } from "node:url";

import * as hybmss from "../../../build/web/package/hybmss.js";
import * as engines from "../../../bench/peers/engines.mjs";
import { PlainSprings, springCube } from "../../../bench/peers/springs.mjs";

await hybmss.load();

test("springs, each once, have the forces and the masses of the module's cells", () => {
  for (const n of [1, 2, 5]) {
    const cube = springCube(n);
    assert.equal(cube.stiffness.length, 3 * n * (n + 1) ** 2 + 6 * n * n * (n + 1) + 4 * n ** 3);
    assert.equal(new Set(cube.stiffness.map((_, s) => cube.ends.slice(2 * s, 2 * s + 2).sort().join())).size, cube.stiffness.length);
    const { contenders, checks } = engines.hybmss(cube, hybmss);
    for (const { what, error, bound } of checks) assert.ok(error <= bound, `${what}: ${error}, at most ${bound}`);
    assert.deepEqual(checks.map((check) => check.bound), [2e-5, 1e-11]);
    assert.deepEqual(contenders.map((contender) => contender.springs), Array(5).fill(cube.stiffness.length));
    const lattice = new hybmss.Lattice({ cells: [n, n, n], cellSize: 0.5, material: { density: 1000 } });
    assert.deepEqual(Array.from(new hybmss.Dynamics(lattice).masses), cube.mass);
  }
});

test("the plain loops push nothing on the whole, and do notice another stiffness", () => {
  const cube = springCube(3);
  const [plain, other] = [new PlainSprings(cube), new PlainSprings(cube, cube.stiffness.map((k, s) => (s === 7 ? 1.001 * k : k)))];
  plain.computeForces();
  other.computeForces();
  for (const axis of [0, 1, 2]) {
    const sum = plain.forces.reduce((total, f, i) => (i % 3 === axis ? total + f : total), 0);
    assert.ok(Math.abs(sum) < 1e-12 * Math.max(...plain.forces));
  }
  assert.notDeepEqual(plain.forces, other.forces);
});

test("an engine that is not there is left out with one line", async () => {
  const folder = await mkdtemp(`${tmpdir()}/hybmss-peers-`);
  const script = fileURLToPath(new URL("../../../bench/peers/node.mjs", import.meta.url));
  const module = fileURLToPath(new URL("../../../build/web/package/hybmss.js", import.meta.url));
  const report = JSON.parse(execFileSync("node", [script, folder, module, "2", "2"], { encoding: "utf8" }));
  await rm(folder, { recursive: true });
  assert.deepEqual(report.skipped.map((skip) => skip.engine), ["Jolt", "Rapier", "MuJoCo"]);
  for (const { why } of report.skipped) assert.match(why, /^Cannot find module[^\n]*$/);
  assert.equal(report.rows.length, 5);
  for (const { seconds } of report.rows) assert.equal(seconds.length, 2);
});
