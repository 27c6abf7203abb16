import hybmss
import numpy as np

cube = hybmss.Lattice.box(10, 10, 10, 0.5)  # 10^3 cells of 0.5 m
plan = hybmss.ForcePlan(cube, hybmss.Material(young_modulus=1e4, poisson_ratio=0.45), "float32")

u = np.zeros((plan.node_count, 3), np.float32)  # your own arrays, in m and N
f = np.zeros_like(u)
top = 5 + 11 * (10 + 11 * 5)
u[top, 1] = -0.05  # the middle of the top face, 5 cm down
plan.add_forces(u, f)

print(f"the node is pushed back up with {f[top, 1]:.1f} N")
assert f[top, 1] > 0
