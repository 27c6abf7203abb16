// node examples/web/bench.mjs MODULES FOLDER [PROGRAM]: frames of frames.js, bundled in FOLDER, in headless chromium and in
// node, with one thread and with two, in turns; and a step beside that of the native PROGRAM. `scripts/web --bench`.
import { spawnSync } from "node:child_process";
import { createRequire } from "node:module";
import { cpus, loadavg } from "node:os";
import { resolve } from "node:path";
import { serve } from "./serve.mjs";

const [modules, folder, program] = process.argv.slice(2);
const { launch } = createRequire(`${resolve(modules)}/`)("puppeteer-core");
const server = await serve(folder);
const browser = await launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: ["--no-sandbox"] });

/** ms of this process on the processor: with one thread, what other programs take is not in it. */
const core = () => {
  const { user, system } = process.cpuUsage();
  return (user + system) / 1000;
};

const places = [];
for (const threads of [1, 2]) {
  const page = await browser.newPage();
  await page.goto(`${server.address}/frames.js`);
  await page.evaluate(`(async () => { globalThis.own = await import("/frames.js"); await own.load({ threads: ${threads} }); })()`);
  places.push({ place: "chromium", threads, run: (name, count) => page.evaluate(`own.frames(${JSON.stringify(name)}, ${count})`) });
}
const own = {};
for (const threads of [1, 2]) {
  own[threads] = await import(`${resolve(folder)}/frames.js?${threads}`);
  await own[threads].load({ threads });
  places.push({ place: "node", threads, run: (name, count) => own[threads].frames(name, count) });
}
places.push({ place: "node, on a core", threads: 1, run: (name, count) => own[1].frames(name, count, core) });

const at = (values, share) => values.slice().sort((a, b) => a - b)[Math.floor(share * (values.length - 1))];
const loads = [];
console.log("body            cells steps a frame  where            threads  median ms   99 % ms");
for (const name of own[1].names) {
  const times = places.map(() => []);
  let made = null;
  for (let round = 0; round < 5; ++round) {
    for (const [i, { run }] of places.entries()) {
      made = await run(name, round === 0 ? 20 : 120); // the first is not counted: modules are still compiled
      if (round > 0) times[i].push(...made.times);
    }
    loads.push(loadavg()[0]);
  }
  places.forEach(({ place, threads }, i) => {
    const [median, worst] = [0.5, 0.99].map((share) => at(times[i], share).toFixed(2));
    console.log(
      `${name.padEnd(13)}${String(made.cells).padStart(8)}${String(made.steps).padStart(14)}  ${place.padEnd(16)}` +
        `${String(threads).padStart(8)}${median.padStart(11)}${worst.padStart(10)}`,
    );
  });
}
await browser.close();
server.close();

const [here, there] = [[], []];
for (let turn = 0; turn < 5; ++turn) {
  here.push(own[1].stepTime());
  if (program) {
    const filter = "20x20x20/HybMSS/lattice/sse2/float";
    const given = ["bench", "--isa", "sse2", "--threads", "1", "--accuracy", "exact", "--min-time", "0.3", "--filter", filter];
    const row = /^20x20x20\s.*$/m.exec(spawnSync(program, given).stdout);
    if (row) there.push(Number(row[0].trim().split(/\s+/)[8]));
  }
}
// The fastest of many short rounds, of both: what other programs take of the core is left out.
const [module20, native20] = [here, there].map((times) => Math.min(...times));
console.log(`\na float step of 20^3 cells: ${module20.toFixed(1)} ns a cell`);
if (there.length > 0) {
  console.log(`native SSE2, exact, in turns: ${native20.toFixed(1)} ns; ${(module20 / native20).toFixed(2)} times as long`);
}
const [least, most] = [Math.min(...loads), Math.max(...loads)].map((load) => load.toFixed(1));
console.log(`${cpus()[0].model}, ${cpus().length} hardware threads, load ${least} to ${most} (this program's own is 1 to 2)`);
process.exit(0);
