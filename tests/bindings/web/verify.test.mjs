// `hybmss verify --quick`, compiled to WebAssembly, in node: every kernel against the scalar reference.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import test from "node:test";

test("verify --quick passes", () => {
  const program = new URL("../../../build/web/bin/hybmss-verify.js", import.meta.url).pathname;
  const { status, stdout, stderr } = spawnSync(process.execPath, [program], { encoding: "utf8" });
  assert.equal(status, 0, stdout + stderr);
  const [words, checks] = /(\d+) checks in \d+ rows: all passed/.exec(stdout);
  console.log(words);
  assert.ok(checks > 100000);
});
