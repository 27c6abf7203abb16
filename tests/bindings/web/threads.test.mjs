// The module of several threads, in node and in an isolated page: threads that compute, and the bits of one.
import assert from "node:assert/strict";
import { readdir, readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import test from "node:test";

import { serve } from "../../../examples/web/serve.mjs";

const root = new URL("../../../", import.meta.url);
const { launch } = createRequire(new URL("build/web/page-modules/", root))("puppeteer-core");
const own = (words) => import(`../../../build/web/package/hybmss.js${words}`); // each with a module of its own

/** Digests of bodies in motion; sent to the page as its own text. */
async function motions({ Dynamics, Lattice, World }, threads) {
  const digests = {};
  const digest = async (name, views) => {
    const bytes = Uint8Array.from(views.flatMap((view) => Array.from(new Uint8Array(view.slice().buffer))));
    const sum = new Uint8Array(await globalThis.crypto.subtle.digest("SHA-256", bytes));
    digests[name] = Array.from(sum.subarray(0, 8), (byte) => byte.toString(16).padStart(2, "0")).join("");
  };
  const cells = [21, 18, 16]; // 7106 nodes: work for four threads
  const swing = (body) => {
    body.displacements = Float64Array.from({ length: 3 * body.nodeCount }, (_, i) => 1e-3 * (((7919 * i) % 1009) / 1009 - 0.5));
    body.setObstacles([{ shape: "plane", dimensions: [0, 1, 0], friction: 0.5 }]);
    body.step({ timeStep: 0.3 * body.criticalTimeStep, acceleration: [0, -9.81, 0], massDamping: 1 }, 60);
  };
  for (const precision of ["float32", "float64"]) {
    for (const layout of ["flat-rows", "active-rows", "packed-xyzw", "coloured-soa"]) {
      const lattice = new Lattice({ cells, cellSize: 0.01, material: { poissonRatio: 0.45 } });
      const body = new Dynamics(lattice, { precision, layout, threads });
      swing(body);
      await digest(`${layout}, ${precision}`, [body.displacements, body.velocities]);
      body.free();
      lattice.free();
    }
  }
  const lattice = new Lattice({ cells, cellSize: 0.01, material: { springs: "means" } });
  const world = new World({ threads });
  for (const origin of [[0, 0, 0], [0.005, 0.178, 0.005]]) {
    world.add(lattice, { origin, threads });
  }
  world.setContacts([{ first: 0, second: 1, friction: 0.5 }]);
  world.step({ timeStep: 0.3 * world.criticalTimeStep, acceleration: [0, -9.81, 0] }, 200);
  if (!(Math.hypot(...world.contactReadings()[0].impulse) > 0)) throw new Error("they do not touch");
  await digest("a world", world.bodies.flatMap((body) => [body.displacements, body.velocities]));
  world.free();
  lattice.free();
  return digests;
}

const single = await own("?single");
await single.load();
const expected = await motions(single);

test("the bits of one thread, with two, three and four", async () => {
  for (const threads of [2, 3, 4]) {
    const several = await own(`?${threads}`);
    await several.load({ threads });
    assert.deepEqual(await motions(several), expected);
    assert.deepEqual(await motions(several, 1), expected);
  }
});

/** The processor's time of each thread of this process, in hundredths of a second. */
async function times() {
  const of = async (id) => (await readFile(`/proc/self/task/${id}/stat`, "utf8")).split(") ")[1].split(" ");
  return new Map(await Promise.all((await readdir("/proc/self/task")).map(async (id) => [id, Number((await of(id))[11])])));
}

test("a second thread computes", async () => {
  const several = await own("?computes");
  await single.load(); // what node starts for itself is there
  const before = await times();
  await several.load({ threads: 2 });
  const loaded = await times();
  const added = [...loaded.keys()].filter((id) => !before.has(id));
  assert.ok(added.length > 0);
  const body = new several.Dynamics(new several.Lattice({ cells: [30, 30, 30], cellSize: 0.01 }));
  const spent = async () => {
    const now = await times();
    return added.reduce((sum, id) => sum + now.get(id) - loaded.get(id), 0);
  };
  for (let round = 0; (await spent()) < 20; ++round) {
    assert.ok(round < 200, "no thread that the module began has computed for 0.2 s");
    body.step({ timeStep: 0.5 * body.criticalTimeStep }, 20);
  }
});

test("views see the memory of now, and those taken before as well", async () => {
  const { ForcePlan, Lattice, load } = await own("?memory");
  await load({ threads: 2 });
  const plan = new ForcePlan(new Lattice({ cells: [2, 2, 2], cellSize: 0.1 }));
  const before = plan.displacements;
  const bytes = before.buffer.byteLength;
  const large = [];
  while (plan.displacements.buffer.byteLength === bytes) {
    large.push(new ForcePlan(new Lattice({ cells: [60, 60, 60], cellSize: 0.1 })));
    assert.ok(large.length < 100);
  }
  plan.displacements[5] = 0.125;
  assert.equal(before[5], 0.125);
  assert.throws(() => new ForcePlan(new Lattice({ cells: [900, 900, 900], cellSize: 0.1 })), { status: "out of memory" });
});

test("numbers of threads that cannot be are refused", async () => {
  const { Dynamics, Lattice, load, World } = await own("?refused");
  for (const threads of [0, 65, 1.5, "2"]) {
    await assert.rejects(load({ threads }), /load.threads = .* is not allowed: it must be a whole number from 1 to 64/);
  }
  await assert.rejects(load({ thread: 2 }), /load.thread is not known/);
  await assert.rejects(load({ threads: 2, source: new URL("nowhere.wasm", root) }), /nowhere.wasm/);
  await load({ threads: 2 });
  await load();
  await assert.rejects(load({ threads: 3 }), /load.threads = 3 is not allowed: the module is loaded with 2/);
  const lattice = new Lattice({ cells: [2, 2, 2], cellSize: 0.1 });
  assert.throws(() => new Dynamics(lattice, { threads: 3 }), /options.threads = 3 is not allowed: the module was loaded with 2/);
  assert.throws(() => new World({ threads: 0 }), /options.threads = 0/);
  assert.throws(() => new Lattice({ cells: [2, 2, 2], cellSize: -1 }), { status: "invalid argument", message: /cell_size = -1/ });
});

test("in a page: the same bits where it is isolated, one clear error where it is not", async () => {
  const browser = await launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: ["--no-sandbox"] });
  try {
    for (const isolated of [true, false]) {
      const server = await serve(new URL("build/web/package", root).pathname, 0, isolated);
      const page = await browser.newPage();
      await page.goto(`${server.address}/package.json`);
      const run = (threads) =>
        page.evaluate(`(async () => {
          const hybmss = await import("/hybmss.js?" + ${threads});
          await hybmss.load({ threads: ${threads} });
          return (${motions})(hybmss);
        })()`);
      assert.deepEqual(await run(1), expected);
      if (isolated) {
        assert.deepEqual(await run(2), expected);
      } else {
        await assert.rejects(run(2), /load.threads = 2 is not allowed: this page is not isolated .*Cross-Origin-Opener-Policy/);
      }
      server.close();
    }
  } finally {
    await browser.close();
  }
});
