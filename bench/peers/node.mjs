// node bench/peers/node.mjs PACKAGES HYBMSS.JS ROUNDS EDGE...
// Springs of cubes of EDGE^3 cells by our WebAssembly module and by the engines that lie in PACKAGES/node_modules, in
// turns in this process. Writes JSON, which scripts/peers makes its tables of.
import { createRequire } from "node:module";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";
import * as engines from "./engines.mjs";
import { springCube } from "./springs.mjs";

const [packages, own, rounds, ...edges] = process.argv.slice(2);
const { resolve: find } = createRequire(pathToFileURL(`${resolve(packages)}/package.json`));
const load = (name) => import(pathToFileURL(find(name)).href);

const peers = { Jolt: engines.jolt, Rapier: engines.rapier, MuJoCo: engines.mujoco };
const report = { rows: [], checks: [], skipped: [] };

const ours = await import(pathToFileURL(resolve(own)).href);
await ours.load();

/** Seconds on the core that steps take: other programs, which hold them up, are left out. */
function timed(steps, count) {
  const before = process.cpuUsage();
  steps(count);
  const { user, system } = process.cpuUsage(before);
  return (user + system) / 1e6;
}

/** Until what runs often was compiled: that is done beside, on other cores, and would be counted. */
async function quiet() {
  for (let busy = Infinity; busy > 0.005; ) {
    const before = process.cpuUsage();
    await new Promise((done) => setTimeout(done, 300));
    const { user, system } = process.cpuUsage(before);
    busy = (user + system) / 1e6;
  }
}

const kSlice = 0.012; // s, as long as those of bench/interleaved.hpp
for (const edge of edges.map(Number)) {
  const cube = springCube(edge);
  const { contenders, checks, timeStep } = engines.hybmss(cube, ours);
  for (const [engine, add] of Object.entries(peers)) {
    try {
      const added = await add(cube, load, timeStep);
      contenders.push(...added.contenders);
      checks.push(...added.checks);
    } catch (error) {
      const why = String(error?.message ?? error).split("\n")[0].slice(0, 200);
      report.skipped.push({ place: "node", cells: edge, engine, why });
    }
  }
  for (const { steps, each = 1 } of contenders) {
    for (let spent = 0; spent < 0.3; ) spent += timed(steps, each);
  }
  await quiet();
  for (const contender of contenders) {
    const { steps, each = 1 } = contender;
    let [count, seconds] = [each, timed(steps, each)];
    while (seconds < kSlice / 4) seconds = timed(steps, (count *= 2));
    contender.count = Math.max(1, Math.round((count * kSlice) / seconds / each)) * each;
    contender.seconds = [];
  }
  for (let round = 0; round < Number(rounds); ++round) {
    for (let c = 0; c < contenders.length; ++c) {
      const { steps, count, seconds } = contenders[(c + round) % contenders.length];
      seconds.push(timed(steps, count) / count);
    }
  }
  for (const { engine, numbers, does, unit, springs, seconds } of contenders) {
    report.rows.push({ place: "node", cells: edge, engine, numbers, does, unit, springs, seconds });
  }
  report.checks.push(...checks.map((check) => ({ place: "node", cells: edge, ...check })));
}
report.machine = `node ${process.version}`;
report.versions = Object.fromEntries(
  ["jolt-physics", "@dimforge/rapier3d-compat", "mujoco-js"].flatMap((name) => {
    try {
      return [[name, createRequire(import.meta.url)(`${resolve(packages)}/node_modules/${name}/package.json`).version]];
    } catch {
      return [];
    }
  }),
);
process.stdout.write(JSON.stringify(report));
process.exit(0);
