// hybmss view in a real browser: the page shows a scene that moves, a body yields to the pointer, and a run is replayed.
import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { existsSync, mkdtempSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { fileURLToPath } from "node:url";
import test, { after, before } from "node:test";

const root = new URL("../../../", import.meta.url);
const program = fileURLToPath(new URL("build/release/bin/hybmss", root));
const skip = existsSync(program) && spawnSync(program, ["view", "--help"]).status === 0 ? false : "build/release has no hybmss view";
const { launch } = createRequire(new URL("build/web/page-modules/", root))("puppeteer-core");
const pictures = process.env.HYBMSS_PICTURES; // a folder for a screenshot
const scene = (name) => fileURLToPath(new URL(`examples/scenes/${name}.toml`, root));
let browser;

before(async () => {
  if (!skip) {
    browser = await launch({
      executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
      args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
    });
  }
});
after(() => browser?.close());

/// work(page) on the page of what is shown.
async function shown(words, work) {
  const process = spawn(program, ["view", "--no-open", ...words], { stdio: ["ignore", "pipe", "inherit"] });
  const ended = new Promise((end) => process.on("exit", end));
  const wrong = [];
  try {
    const address = await new Promise((said) => process.stdout.once("data", (text) => said(String(text).split("\n")[0])));
    const page = await browser.newPage();
    page.on("console", (m) => {
      if (["error", "warn"].includes(m.type()) && !/GL Driver Message|GPU stall|favicon/.test(m.text() + m.location().url)) wrong.push(m.text());
    });
    page.on("pageerror", (error) => wrong.push(error.message));
    await page.setViewport({ width: 1000, height: 640 });
    await page.goto(address);
    await work(page);
    await page.close();
  } finally {
    process.kill("SIGINT");
  }
  assert.equal(await ended, 0);
  assert.deepEqual(wrong, []);
}
const reached = (page, condition) => page.waitForFunction(condition, { timeout: 60000 });
const middle = (page) =>
  page.evaluate(() => {
    const sums = [0, 0, 0];
    hybmssView.points.forEach((x, i) => (sums[i % 3] += (3 * x) / hybmssView.points.length));
    return sums;
  });

test("a scene moves, and yields to the pointer", { skip }, () =>
  shown([scene("stack")], async (page) => {
    await reached(page, () => globalThis.hybmssView?.frames > 30);
    assert.ok(await page.evaluate(() => hybmssView.readings.steps > 0 && hybmssView.readings.rate > 0));
    await page.evaluate(() => document.getElementById("run").click());
    await reached(page, () => document.getElementById("run").textContent === "Run");
    const { x, y } = await page.evaluate(() => hybmssView.onScreen(hybmssView.points.length / 3 - 1));
    const before = await middle(page);
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + 160, y - 60, { steps: 8 });
    await page.evaluate(() => document.getElementById("run").click());
    const frames = await page.evaluate(() => hybmssView.frames);
    await page.waitForFunction((n) => hybmssView.frames > n + 40, { timeout: 60000 }, frames);
    if (pictures) await page.screenshot({ path: `${pictures}/view.png` });
    const moved = await middle(page);
    assert.ok(Math.hypot(...moved.map((v, a) => v - before[a])) > 0.02 * (await page.evaluate(() => hybmssView.view.size)));
    await page.mouse.up();
    assert.equal(await page.evaluate(() => document.getElementById("note").textContent), "");
  }));

test("a finished run is replayed to its end", { skip }, async () => {
  const folder = mkdtempSync(`${tmpdir()}/hybmss-`);
  try {
    assert.equal(spawnSync(program, ["run", "--quiet", scene("compression_nu0499"), "--out", folder]).status, 0);
    await shown([folder], async (page) => {
      await reached(page, () => globalThis.hybmssView?.status.frames > 1 && !hybmssView.status.running);
      assert.ok(await page.evaluate(() => hybmssView.status.frame === hybmssView.status.frames - 1));
      await page.evaluate(() => {
        const slider = document.getElementById("frame");
        slider.value = 1;
        slider.dispatchEvent(new Event("input"));
      });
      await reached(page, () => hybmssView.readings.steps === 1);
    });
  } finally {
    rmSync(folder, { recursive: true });
  }
});
