import hybmss
import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

bar = hybmss.Lattice.box(24, 4, 4, 0.01)  # cells of 1 cm, held at one end
body = hybmss.ExplicitDynamics(bar, hybmss.Material(young_modulus=1e5, poisson_ratio=0.4))
rest = bar.rest_positions()
body.prescribe(np.flatnonzero(rest[:, 0] == 0))
tip = np.argmax(rest.sum(axis=1))
step, times, tips, energies = 0.9 * body.critical_time_step, [], [], []
for frame in range(400):
    body.step(step, 10, acceleration=(0, -9.81, 0))
    times.append((frame + 1) * 10 * step)
    tips.append(100 * body.displacements[tip, 1])
    weight = 9.81 * body.masses @ body.displacements[:, 1]
    energies.append([*body.energies, weight, sum(body.energies) + weight])
figure, (upper, lower) = plt.subplots(2, sharex=True)
upper.plot(times, tips)
upper.set_ylabel("tip, cm")
lower.plot(times, 1000 * np.array(energies), label=["springs", "volume", "kinetic", "weight", "sum"])
lower.set(xlabel="time, s", ylabel="energy, mJ")
lower.legend()
plt.savefig("energies.png")
