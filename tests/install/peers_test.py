#!/usr/bin/python3
"""scripts/peers: what it makes of reports, and what the native program reports where it was built. No time is judged.

    peers_test.py [PROGRAM]
"""

import contextlib
import copy
import importlib.machinery
import importlib.util
import io
import json
import pathlib
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.dont_write_bytecode = True
loader = importlib.machinery.SourceFileLoader("peers", str(ROOT / "scripts/peers"))
peers = importlib.util.module_from_spec(importlib.util.spec_from_loader("peers", loader))
loader.exec_module(peers)

PROGRAM = ""


def row(engine, does, seconds, place="native", cells=10, numbers="float"):
    return {"place": place, "cells": cells, "engine": engine, "numbers": numbers, "does": does, "unit": "step",
            "springs": 1000, "seconds": seconds}


# The machine is three times slower in the second round, and both with it.
NATIVE = {"machine": "a machine", "skipped": [{"place": "native", "cells": 10, "engine": "Bullet", "why": "no library"}],
          "rows": [row("HybMSS, avx2", "springs and volume", [1e-6, 3e-6, 1e-6]),
                   row("HybMSS, sse2", "springs and volume", [2e-6, 6e-6, 2e-6]),
                   row("LAMMPS", "springs", [8e-6, 27e-6, 10e-6], numbers="double")],
          "checks": [{"place": "native", "cells": 10, "what": "forces", "error": 1e-12, "bound": 1e-10}]}
NODE = {"machine": "node", "versions": {"jolt-physics": "1.0"}, "skipped": [], "checks": [],
        "rows": [row("HybMSS", "springs and volume", [4e-6] * 3, "node"),
                 row("Rapier's own", "tetrahedra", [8e-6] * 3, "node")]}


def shown(data):
    """The exit code, the lines and the complaints."""
    out, complaints = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(complaints):
        status = peers.show(data)
    return status, out.getvalue(), complaints.getvalue()


class Reports(unittest.TestCase):
    def setUp(self):
        self.data = peers.collect(copy.deepcopy([NATIVE, NODE]))
        self.rows = {(r["place"], r["engine"]): r for r in self.data["tables"][0]["rows"]}

    def test_ratios_are_of_rounds_to_the_first_row_of_ours_in_the_same_place(self):
        self.assertAlmostEqual(self.rows["native", "LAMMPS"]["ratio"], 9)  # of 8, 9 and 10; of the medians it is 10
        self.assertAlmostEqual(self.rows["native", "HybMSS, sse2"]["ratio"], 2)
        self.assertAlmostEqual(self.rows["node", "Rapier's own"]["ratio"], 2)

    def test_units(self):
        lammps = self.rows["native", "LAMMPS"]
        self.assertAlmostEqual(lammps["ms"], 0.010)
        self.assertAlmostEqual(lammps["ns_per_spring"], 10)
        self.assertAlmostEqual(lammps["million_springs_per_second"], 100)
        self.assertIsNone(self.rows["node", "Rapier's own"]["ns_per_spring"])  # tetrahedra are no springs

    def test_what_is_left_out_is_a_line(self):
        status, out, _ = shown(self.data)
        self.assertEqual(status, 0)
        self.assertIn("left out: Bullet (native, 10^3): no library\n", out)

    def test_engines_that_disagree_end_it_with_1(self):
        for error in (1e-9, float("nan"), None):  # JSON has no infinity: null
            with self.subTest(error=error):
                self.data["tables"][1]["rows"][0]["error"] = error
                status, _, complaints = shown(self.data)
                self.assertEqual(status, 1)
                self.assertIn("FAILED: forces, 10^3", complaints)

    def test_what_was_written_is_shown_again(self):
        self.assertEqual(shown(json.loads(json.dumps(self.data))), shown(self.data))

    def test_a_place_that_fails_loses_nothing_of_the_other_but_is_a_failure(self):
        def fails(*_):
            raise RuntimeError("no compiler")
        data = peers.collect([copy.deepcopy(NATIVE), peers.attempt("node", fails, [10], 5, [])])
        self.assertEqual(len(data["tables"][0]["rows"]), len(NATIVE["rows"]))
        status, out, _ = shown(data)
        self.assertEqual(status, 1)
        self.assertIn("left out: everything (node): no compiler\n", out)

    def test_a_command_that_fails_is_one_line(self):
        with contextlib.redirect_stderr(io.StringIO()), self.assertRaises(RuntimeError) as problem:
            peers.run(["sh", "-c", "echo first >&2; echo last >&2; exit 3"])
        self.assertIn("exit code 3: last", str(problem.exception))
        self.assertNotIn("\n", str(problem.exception))


class Command(unittest.TestCase):
    def test_refusals_say_what_was_given(self):
        for words, reason in ((["--cells", "101"], "--cells [101]"), (["--rounds", "0"], "--rounds 0"),
                              (["--from", "/nowhere"], "--from /nowhere"), (["--from", __file__], "--from ")):
            done = subprocess.run([ROOT / "scripts/peers", *words], capture_output=True, text=True, check=False)
            self.assertNotEqual(done.returncode, 0)
            self.assertNotIn("Traceback", done.stderr)
            self.assertIn(reason, done.stderr.splitlines()[-1])


class Native(unittest.TestCase):
    def setUp(self):
        if not (PROGRAM and pathlib.Path(PROGRAM).is_file()):
            self.skipTest("hybmss_peers is not built: -DHYBMSS_BUILD_PEERS=ON, target hybmss_peers")

    def test_all_do_the_same(self):
        report = json.loads(subprocess.run([PROGRAM, "1", "3", "4"], capture_output=True, text=True, check=True).stdout)
        self.assertEqual(peers.failed(report["checks"]), [])
        for cells, springs in ((3, 3 * 3 * 4 * 4 + 2 * 3 * 4 * 3 * 3 + 4 * 27), (4, 3 * 4 * 5 * 5 + 2 * 3 * 5 * 4 * 4 + 4 * 64)):
            counts = {(r["engine"], r["springs"]) for r in report["rows"] if r["cells"] == cells}
            self.assertEqual({count for _, count in counts}, {springs})
            there = {engine.split(",")[0] for engine, _ in counts} | {skip["engine"] for skip in report["skipped"]}
            self.assertEqual(there, {"HybMSS", "yardstick: plain loops", "LAMMPS", "Bullet"})
        data = peers.collect([report])
        self.assertEqual(shown(data)[0], 0)

    def test_refusals_are_one_line(self):
        for words in (["0", "3"], ["1", "3x"], ["1", "101"], ["1"]):
            done = subprocess.run([PROGRAM, *words], capture_output=True, text=True, check=False)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (2, "", 1), words)


if __name__ == "__main__":
    PROGRAM = sys.argv.pop() if len(sys.argv) > 1 else ""
    unittest.main()
