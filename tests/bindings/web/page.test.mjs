// The laboratory in a real browser: it loads, moves, is pulled, cut, thrown, pressed and tortured, and comes to no harm.
import assert from "node:assert/strict";
import { createRequire } from "node:module";
import test, { after, before } from "node:test";

import { serve } from "../../../examples/web/serve.mjs";

const root = new URL("../../../", import.meta.url);
const { launch } = createRequire(new URL("build/web/page-modules/", root))("puppeteer-core");
const pictures = process.env.HYBMSS_PICTURES; // a folder for screenshots

let server;
let browser;
let page;
const wrong = []; // what the page's console said

before(async () => {
  server = await serve(new URL("build/web/page", root).pathname);
  browser = await launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
  });
  page = await browser.newPage();
  page.on("console", (message) => {
    if (["error", "warn"].includes(message.type()) && !/GL Driver Message|GPU stall/.test(message.text())) wrong.push(message.text());
  });
  page.on("pageerror", (error) => wrong.push(error.message));
  await page.setViewport({ width: 1180, height: 720 });
  await page.goto(`${server.address}/`);
  await started();
});

after(async () => {
  await browser?.close();
  server?.close();
});

const started = async () => {
  await page.waitForFunction(() => globalThis.laboratory?.frames > 5, { timeout: 60000 });
  await ask(() => (laboratory.sparing = 20));
};
const ask = (work, ...given) => page.evaluate(work, ...given);
const status = () => ask(() => document.getElementById("status").textContent);
const frames = async (count) => {
  const until = (await ask(() => laboratory.frames)) + count;
  await page.waitForFunction((n) => laboratory.frames >= n, { timeout: 120000 }, until);
};
const choose = (name, value) =>
  ask((n, v) => document.querySelector(`input[name="${n}"][value="${v}"]`).click(), name, value);
const press = (words) =>
  ask((w) => [...document.querySelectorAll("button")].find((b) => b.textContent === w).click(), words);
const picture = async (name) => {
  if (pictures) {
    await ask(() => (laboratory.sparing = 1));
    await frames(2);
    await page.screenshot({ path: `${pictures}/${name}.png` });
    await ask(() => (laboratory.sparing = 20));
  }
};
/** Where a place of the body is on the screen. */
const seen = (place) =>
  ask((share) => {
    const { subject, stage } = laboratory;
    const { x, y } = stage.project(subject.centre.map((c, i) => c + share[i] * subject.size));
    return [x, y];
  }, place);
const drag = async (from, to) => {
  await page.mouse.move(...from);
  await page.mouse.down();
  await page.mouse.move((from[0] + to[0]) / 2, (from[1] + to[1]) / 2, { steps: 4 });
  await page.mouse.move(...to, { steps: 4 });
};
const farthest = () =>
  ask(() => laboratory.subject.dynamics.displacements.reduce((most, u) => Math.max(most, Math.abs(u)), 0));
const well = async () => {
  const { cells, inverted, smallest } = await ask(() => laboratory.subject.health());
  assert.ok(cells > 0 && inverted === 0 && smallest > 0.05, `${inverted} of ${cells} inside out, ${smallest}`);
};

test("it loads, frames go on, and it stands", async () => {
  await frames(60);
  assert.ok((await ask(() => laboratory.subject.cellCount)) === 12 ** 3);
  await well();
  await picture("web-cube");
});

test("a pull moves the body, and it swings back", async () => {
  const still = await farthest();
  const [x, y] = await seen([0.3, 0.3, 0.5]);
  await drag([x, y], [x + 90, y - 30]);
  await frames(40);
  const pulled = await farthest();
  assert.ok(pulled > still + 0.02, `${pulled} m after ${still} m`);
  await picture("web-pull");
  await page.mouse.up();
  assert.equal(await status(), "Let go.");
  await frames(150);
  assert.ok((await farthest()) < still + 0.01);
  await well();
});

test("arrow keys pull too, and Escape lets go", async () => {
  const still = await farthest();
  await page.focus("#canvas");
  for (let i = 0; i < 6; ++i) await page.keyboard.press("ArrowRight");
  await frames(40);
  assert.ok((await farthest()) > still + 0.02);
  await page.keyboard.press("Escape");
  assert.equal(await status(), "Let go.");
});

test("the blade removes cells", async () => {
  await press("Reset");
  await choose("hand", "cut");
  const [left, right] = [await seen([-0.9, 0.2, 0.5]), await seen([0.05, 0.1, 0.5])];
  await drag(left, right);
  await page.mouse.up();
  const words = await status();
  const gone = Number(/Cut: ([\d,]+) cells/.exec(words)?.[1].replace(",", ""));
  assert.ok(gone > 20, words);
  assert.equal(await ask(() => laboratory.subject.cellCount), 12 ** 3 - gone);
  await frames(90);
  await picture("web-cut");
  await choose("hand", "pull");
});

test("the plates press the liver, and it is thrown on the floor", async () => {
  await choose("body", "liver");
  await choose("stage", "plates");
  await ask(() => {
    const slider = document.querySelector('input[name="press"]');
    slider.value = 0.5;
    slider.dispatchEvent(new Event("input", { bubbles: true }));
  });
  await frames(120);
  assert.ok((await farthest()) > 0.015);
  await well();
  await choose("stage", "floor");
  await frames(30);
  await press("Throw");
  await frames(90);
  await well();
  await picture("web-liver");
});

test("errors and costs are measured and shown", async () => {
  await choose("body", "cube");
  await choose("stage", "held");
  await page.waitForFunction(
    () => [...document.getElementById("effects").rows].every((row) => row.cells[1].textContent !== "–"),
    { timeout: 120000 },
  );
  await page.waitForFunction(() => /e-\d/.test(document.getElementById("error").textContent), { timeout: 60000 });
  const error = Number(await ask(() => document.getElementById("error").textContent));
  assert.ok(error > 0 && error < 1e-5, `${error}`);
  await page.setViewport({ width: 1180, height: 1080 });
  await frames(5);
  await picture("web-laboratory");
  await page.setViewport({ width: 390, height: 844, hasTouch: true, isMobile: true }); // loads the page again
  await started();
  await frames(30);
  const wide = await ask(() => document.documentElement.scrollWidth);
  assert.equal(wide, 390);
  await picture("web-phone");
  await page.setViewport({ width: 1180, height: 720 });
  await started();
});

test("torture ends in a body that is well, and the line says how", async () => {
  for (const kind of ["Flatten", "Scramble"]) {
    await press(kind);
    await frames(8);
    if (kind === "Scramble") await picture("web-torture");
    await page.waitForFunction(() => /back after|made anew/.test(document.getElementById("status").textContent), {
      timeout: 120000,
    });
    assert.match(await status(), /: back after/);
    await well();
  }
});

test("200 random presses end in a body that is well, or one line that says why not", async () => {
  const seed = Number(process.env.HYBMSS_SEED ?? Date.now() % 100000);
  console.log(`seed ${seed}`);
  let state = seed;
  const draw = (n) => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return Math.floor((state / 4294967296) * n);
  };
  await choose("body", "cube");
  for (let i = 0; i < 200; ++i) {
    const count = await ask((at) => {
      const inputs = [...document.querySelectorAll('button:not(:disabled), input[type="radio"]:not([name="hand"]), input[type="checkbox"]')];
      inputs[at % inputs.length].click();
      return inputs.length;
    }, draw(1000));
    assert.ok(count > 10);
    if (draw(10) === 0) await frames(4);
  }
  const before = await ask(() => laboratory.frames);
  await frames(5);
  assert.ok((await ask(() => laboratory.frames)) > before);
  await page.waitForFunction(() => !laboratory.trial, { timeout: 240000 });
  assert.match(await status(), /^[^\n]{5,}$/);
  assert.ok(Number.isFinite(await farthest()));
});

test("the console is empty", () => {
  assert.deepEqual(wrong, []);
});
