#!/usr/bin/env python3
"""What hybmss_distributed promises its users, on one machine: the same answer on 1, 2 and 4 ranks to rounding, the same bits
from one run to the next, counted messages as modelled, a checkpoint that outlives a killed rank, and errors in one line.

    distributed_test.py HYBMSS_DISTRIBUTED MPIEXEC
"""
import os
import pathlib
import re
import signal
import struct
import subprocess
import sys
import tempfile
import time

PROGRAM, MPIEXEC = sys.argv[1:3]
ENVIRONMENT = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", OMPI_MCA_rmaps_base_oversubscribe="1",
                   OMPI_MCA_mpi_yield_when_idle="1")
BEAM = ["motion", "--cells", "12,9,7", "--steps", "40"]


def command(ranks, *arguments):
    return [MPIEXEC, "-n", str(ranks), PROGRAM, *map(str, arguments)]


def run(ranks, *arguments, code=0):
    done = subprocess.run(command(ranks, *arguments), env=ENVIRONMENT, capture_output=True, text=True, timeout=1200)
    if done.returncode != code:
        raise SystemExit(f"FAILED: {' '.join(command(ranks, *arguments))} ended with {done.returncode} instead of {code}:\n"
                         f"{done.stdout}{done.stderr}")
    return done.stdout + done.stderr


def expect(true, what):
    if not true:
        raise SystemExit("FAILED: " + what)
    print("ok: " + what, flush=True)


def motions(folder):
    reference = folder / "reference"
    run(1, *BEAM, "--save", reference)
    for method, precision, tolerance in [("fused", "double", 1e-12), ("ts", "double", 1e-12), ("fused", "float", 1e-4)]:
        for ranks in (1, 2, 4):
            saved = [folder / f"{method}{precision}{ranks}{repeat}" for repeat in ("a" if ranks == 1 else "ab")]
            for file in saved:
                out = run(ranks, *BEAM, "--method", method, "--precision", precision, "--save", file, "--compare", reference,
                          "--tolerance", tolerance)
            total, modelled_total, most, modelled_most = re.search(
                r"all ranks (\S+) \(modelled (\S+)\), received by one rank at most (\S+) \(modelled (\S+)\)", out).groups()
            expect(total == modelled_total and most == modelled_most and (ranks == 1 or float(most) > 0),
                   f"{method} {precision}, {ranks} ranks: as on one to {tolerance}; {total} bytes a step, {most} to one rank, as modelled")
            if ranks > 1:
                expect(saved[0].read_bytes() == saved[1].read_bytes(), f"{method} {precision}, {ranks} ranks: the same bits twice")
    run(2, *BEAM, "--gravity", "0,-10.0001,0", "--compare", reference, "--tolerance", "1e-6", code=1)
    expect(True, "another motion is told apart")
    run(1, *BEAM, "--hollow", "--mass-damping", "2", "--save", folder / "hollow")
    run(4, *BEAM, "--hollow", "--mass-damping", "2", "--compare", folder / "hollow", "--tolerance", "1e-12")
    expect(True, "a hollow body on 4 ranks as on one")


def equilibria(folder):
    # docs/report/paper.md: 10^3 cells of 0.5 m, E = 10 kPa, nu = 1/4, 5 % compression between clamped plates.
    pressed = folder / "pressed"
    for ranks, extra in [(1, ["--save", pressed]), (2, ["--save", folder / "again"]), (2, ["--compare", pressed, "--tolerance", "1e-9"]),
                         (2, ["--save", folder / "again2"]), (4, ["--compare", pressed, "--tolerance", "1e-9"])]:
        out = run(ranks, "equilibrium", *extra)
        force = float(re.search(r"force of the plate ([\d.]+) N", out)[1])
        expect(abs(force - 12743.8) < 0.05, f"equilibrium on {ranks} ranks: the plate's force is {force:.2f} N (12743.8)")
    expect((folder / "again").read_bytes() == (folder / "again2").read_bytes(), "equilibrium on 2 ranks: the same bits twice")
    # Multigrid, by coarser meshes first: iterations that do not go by the ranks.
    cube, counts = ["equilibrium", "--cells", "24,24,24", "--poisson", "0.45", "--compression", "0.2", "--crush-resistance", "20",
                    "--preconditioner", "multigrid", "--residual", "1e-9"], []
    pressed = folder / "cube"
    for ranks, extra in [(1, ["--save", pressed]), (2, ["--compare", pressed, "--tolerance", "1e-7"]),
                         (4, ["--compare", pressed, "--tolerance", "1e-7"])]:
        out = run(ranks, *cube, *extra)
        counts.append(tuple(map(int, re.search(r"multigrid after \d+ coarser.*?(\d+) Newton iterations, (\d+) of CG", out).groups())))
    expect(all(newton == counts[0][0] and abs(cg - counts[0][1]) <= 1 for newton, cg in counts),
           f"multigrid on 1, 2 and 4 ranks: Newton and CG iterations {counts}")
    # Ours and finite elements press alike: at nu = 1/4 their laws agree to the first order of the strain.
    for ranks in (1, 2):
        out = run(ranks, "elasticity", "--edges", "8", "--poisson", "0.25", "--compression", "0.01", "--rounds", "1", "--residual", "1e-8")
        forces = [float(line.split()[-1]) for line in out.splitlines() if re.match("EquilibriumSolver|solve_eq|elements", line)]
        expect(len(forces) == (3 if ranks == 1 else 2) and max(forces) < 1.05 * min(forces), f"elasticity on {ranks} ranks: plates' forces {forces} kN")


def ranks_of(mpiexec):
    """The ranks' processes below mpiexec."""
    children = pathlib.Path(f"/proc/{mpiexec}/task/{mpiexec}/children").read_text().split()
    found = []
    for child in map(int, children):
        name = pathlib.Path(f"/proc/{child}/comm").read_text().strip()
        found += [child] if name == pathlib.Path(PROGRAM).name[:15] else ranks_of(child)
    return found


def killed_rank(folder):
    whole, part, checkpoint = folder / "whole", folder / "part", folder / "checkpoint"
    for method in ("fused", "ts"):
        beam = ["motion", "--cells", "16,8,8", "--method", method, "--steps"]
        job = subprocess.Popen(command(2, *beam, 10**9, "--checkpoint", checkpoint, "--checkpoint-every", 100),
                               env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        while "checkpoint at step 200" not in job.stdout.readline():
            if job.poll() is not None:
                raise SystemExit("FAILED: the run ended before it was killed")
        os.kill(ranks_of(job.pid)[-1], signal.SIGKILL)
        out, _ = job.communicate(timeout=120)
        expect(job.returncode != 0 and re.search(r"rank 1 with PID.*exited on\s+signal 9", out),
               f"{method}: a killed rank ends the job (exit code {job.returncode}), and mpirun says which")
        kept = checkpoint.read_bytes()
        step = int(re.search(r"restarted at step (\d+)", run(2, *beam, 0, "--restart", checkpoint))[1])
        for ranks in (2, 1):
            run(ranks, *beam, step + 50, "--restart", checkpoint, "--save", part)
            if ranks == 2:
                run(2, *beam, step + 50, "--save", whole)
                expect(whole.read_bytes() == part.read_bytes(),
                       f"{method}: from its checkpoint (step {step}) the run goes on with the same bits")
        run(1, *beam, step + 50, "--restart", checkpoint, "--compare", whole, "--tolerance", "1e-9")
        expect(checkpoint.read_bytes() == kept, f"{method}: and on one rank instead of two to rounding")


def refusals(folder):
    def refused(ranks, arguments, text):
        lines = [line for line in run(ranks, *arguments, code=2).splitlines() if line.startswith("hybmss_distributed:")]
        expect(len(lines) == 1 and text in lines[0], f"refused in one line: {lines[0] if lines else 'nothing'}")

    refused(2, ["motion", "--method", "magic"], 'method = "magic" is not allowed: it must be fused or ts')
    refused(2, ["motion", "--colour", "blue"], "--colour")
    refused(3, ["motion", "--cells", "1,1,1"], "ranks = 3 is not allowed for 2 x 2 x 2 nodes")
    refused(2, ["motion", "--method", "ts", "--mass-damping", "1"], "mass_damping = 1.000000 is not allowed")
    refused(1, ["motion", "--cells", "10000,10000,10000"], "64-bit indices")
    refused(2, [*BEAM, "--restart", folder / "absent"], "absent: No such file")
    checkpoint, broken = folder / "good", folder / "broken"
    run(2, *BEAM, "--checkpoint", checkpoint)
    good = checkpoint.read_bytes()
    middle = len(good) // 2
    flipped = good[:middle] + bytes([good[middle] ^ 1]) + good[middle + 1:]
    for content, text in [(b"no checkpoint" * 50, "no checkpoint of this program"), (b"", "it has 0 bytes alone"), (good[:-8], "damaged, it has"),
                          (struct.pack(">d", 1.0) + good[8:], "no checkpoint of this program"), (flipped, "damaged, its checksum differs")]:
        broken.write_bytes(content)
        refused(2, [*BEAM, "--restart", broken], text)
    refused(2, [*BEAM, "--poisson", "0.3", "--restart", checkpoint], "of another run: poisson ratio = 0.250000 in it, 0.300000 now")


if __name__ == "__main__":
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as name:
        for check in (motions, equilibria, killed_rank, refusals):
            check(pathlib.Path(name))
    print(f"all passed, {time.monotonic() - start:.0f} s")
