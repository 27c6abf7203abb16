import hybmss
import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

bar = hybmss.Lattice.box(6, 6, 18, 0.01)  # cells of 1 cm
body = hybmss.ExplicitDynamics(bar, hybmss.Material(young_modulus=1e4, poisson_ratio=0.45), "float32")
body.prescribe(np.flatnonzero(bar.rest_positions()[:, 2] == 0))
vertices, triangles = hybmss.boundary_mesh(bar)  # or those of a finer mesh of your own
skin = hybmss.Skin(bar, vertices, triangles, "float32")
positions, normals = np.empty((2, *vertices.shape), np.float32)
for frame in range(60):
    body.step(0.9 * body.critical_time_step, 20, acceleration=(3, 0, -3), mass_damping=5)
    skin.update(body.displacements, positions, normals)  # draw them with what you have
axes = plt.figure().add_subplot(projection="3d", box_aspect=np.ptp(positions, axis=0))
axes.plot_trisurf(*positions.T, triangles=triangles)
plt.savefig("skin.png")
