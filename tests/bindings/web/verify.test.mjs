// Programs compiled to WebAssembly, in node: every kernel against the scalar reference, and the C interface from C.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import test from "node:test";

const run = (name) => {
  const program = new URL(`../../../build/web/bin/${name}.js`, import.meta.url).pathname;
  const { status, stdout, stderr } = spawnSync(process.execPath, [program], { encoding: "utf8" });
  assert.equal(status, 0, stdout + stderr);
  return stdout;
};

test("verify --quick passes", () => {
  const [words, checks] = /(\d+) checks in \d+ rows: all passed/.exec(run("hybmss-verify"));
  console.log(words);
  assert.ok(checks > 100000);
});

test("the C interface's own test passes", () => {
  assert.match(run("hybmss-c-test"), /all checks passed/);
});
