"""What a call through NumPy costs: forces of one cell, which are computed in a fraction of a microsecond.

PYTHONPATH=build/release/python /usr/bin/python3 examples/python/overhead.py
"""

import statistics
import timeit

import hybmss
import numpy as np

plan = hybmss.ForcePlan(hybmss.Lattice.box(1, 1, 1, 0.1), hybmss.Material(poisson_ratio=0.4), "float32", threads=1)
u = np.zeros((plan.node_count, 3), np.float32)
f = np.zeros_like(u)
for name, call in [
    ("add_forces(u, f)", lambda: plan.add_forces(u, f)),
    ("forces(u)", lambda: plan.forces(u)),
    ("energy(u)", lambda: plan.energy(u)),
]:
    rounds = [1e6 * t / 1000 for t in timeit.repeat(call, number=1000, repeat=31)]
    print(f"{name:18} {statistics.median(rounds):6.2f} microseconds, the whole call (median of {len(rounds)} rounds)")
