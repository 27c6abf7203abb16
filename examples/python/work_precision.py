# %% [markdown]
# Work and precision of explicit steps: how wrong is the motion of a beam after a given time, and what did it cost?
# Run as a script (`PYTHONPATH=build/release/python /usr/bin/python3 examples/python/work_precision.py`) or cell by cell.

# %%
import argparse
import time

import hybmss
import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

parser = argparse.ArgumentParser(description="Draws the error of explicit steps over their seconds.")
parser.add_argument("picture", nargs="?", default="work_precision.png", help="the file to write [%(default)s]")
# Cell by cell there is no file, and the arguments are the kernel's.
path = parser.parse_args(None if "__file__" in globals() else []).picture

beam = hybmss.Lattice.box(24, 4, 4, 0.1)
material = hybmss.Material(young_modulus=1e6, poisson_ratio=0.4)
held = np.flatnonzero(beam.rest_positions()[:, 0] == 0)
duration = 0.05  # s


# %%
def displacements(dtype, steps):
    """The state after the duration, and the seconds that it took."""
    body = hybmss.ExplicitDynamics(beam, material, dtype, threads=1)
    body.prescribe(held)
    start = time.perf_counter()
    body.step(duration / steps, steps, acceleration=[0, 0, -10])
    return body.displacements.astype("float64"), time.perf_counter() - start


fewest = int(np.ceil(duration / hybmss.ExplicitDynamics(beam, material).critical_time_step))
truth, _ = displacements("float64", 512 * fewest)

# %%
figure, axes = plt.subplots(figsize=(6, 4))
for dtype, mark in [("float32", "o-"), ("float64", "s-")]:
    work, error = [], []
    for steps in (fewest * 2**k for k in range(8)):
        u, seconds = displacements(dtype, steps)
        work.append(seconds)
        error.append(np.linalg.norm(u - truth) / np.linalg.norm(truth))
        print(f"{dtype}  {steps:7} steps  {1e3 * seconds:8.2f} ms  relative error {error[-1]:.2e}")
    axes.loglog(work, error, mark, label=dtype)
axes.set_xlabel("seconds, one thread")
axes.set_ylabel("relative error of the displacements")
axes.set_title(f"A held beam of {beam.cell_count} cells after {duration} s of gravity")
axes.legend()
axes.grid(True, which="both", alpha=0.3)
figure.savefig(path, dpi=120, bbox_inches="tight")
print(path)
