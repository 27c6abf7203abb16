import ast
import inspect
import os
import pathlib
import struct
import subprocess
import sys
import zlib

import hybmss
import numpy as np
import pytest

SOURCE = pathlib.Path(os.environ.get("HYBMSS_SOURCE_DIR", pathlib.Path(__file__).parents[3]))
BOX = hybmss.Lattice.box(4, 3, 5, 0.1)
MATERIAL = hybmss.Material(young_modulus=2e4, poisson_ratio=0.4)


def displacements(dtype="float64"):
    return np.random.default_rng(3).uniform(-0.005, 0.005, (BOX.node_count, 3)).astype(dtype)


def test_force_is_minus_the_gradient_of_the_energy():
    plan = hybmss.ForcePlan(BOX, MATERIAL)
    u = displacements()
    f = plan.forces(u)
    p = np.random.default_rng(4).normal(size=u.shape)
    step = 1e-6
    slope = (sum(plan.energy(u + step * p)) - sum(plan.energy(u - step * p))) / (2 * step)
    assert slope == pytest.approx(-np.sum(f * p), rel=1e-7)
    assert np.abs(f.sum(axis=0)).max() < 1e-10 * np.abs(f).sum()  # a free body


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_arrays_of_any_strides_are_used_as_they_are(dtype):
    plan = hybmss.ForcePlan(BOX, MATERIAL, dtype)
    u = displacements(dtype)
    expected = plan.forces(u)
    fortran = np.zeros(u.shape, dtype, order="F")
    plan.add_forces(np.asfortranarray(u), fortran)
    assert np.array_equal(fortran, expected)

    particles = np.zeros(BOX.node_count, [("u", dtype, 3), ("mass", dtype), ("f", dtype, 3)])
    particles["u"] = u
    particles["mass"] = 7
    plan.add_forces(particles["u"], particles["f"])
    assert np.array_equal(particles["f"], expected) and (particles["mass"] == 7).all()
    plan.add_forces(particles["u"], particles["f"])  # added
    assert np.array_equal(particles["f"], 2 * expected)

    every_other = np.zeros((2 * len(u), 3), dtype)
    plan.add_forces(u, every_other[::-2])
    assert np.array_equal(every_other[::-2], expected) and not every_other[::2].any()


def test_levels_of_accuracy():
    u = displacements("float32")
    f = {level: hybmss.ForcePlan(BOX, MATERIAL, "float32", accuracy=level).forces(u).astype("float64")
         for level in ("fast", "accurate", "exact")}
    scale = np.abs(f["exact"]).max()
    assert np.abs(f["accurate"] - f["exact"]).max() < 1e-5 * scale
    assert np.abs(f["fast"] - f["exact"]).max() < 1e-2 * scale
    with pytest.raises(ValueError, match='accuracy "precise" is not known'):
        hybmss.ForcePlan(BOX, MATERIAL, accuracy="precise")


def test_hessian_product_is_the_forces_change():
    plan = hybmss.ForcePlan(BOX, MATERIAL)
    u, p = displacements(), np.random.default_rng(5).normal(size=(BOX.node_count, 3))
    product = np.zeros_like(u)
    plan.add_hessian_product(u, p, product)
    change = (plan.forces(u - 1e-6 * p) - plan.forces(u + 1e-6 * p)) / 2e-6
    assert np.abs(product - change).max() < 1e-6 * np.abs(product).max()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_stress(dtype):
    meter = hybmss.StressMeter(BOX, MATERIAL)
    u = displacements().astype(dtype)
    stress = meter.read(u)
    assert stress["cauchy"].shape == stress["green_strain"].shape == (meter.cell_count, 6)
    assert stress["first_piola"].shape == (meter.cell_count, 3, 3)
    volume = BOX.cell_size**3
    energy = sum(hybmss.ForcePlan(BOX, MATERIAL).energy(u.astype(np.float64)))
    assert np.isclose(volume * stress["energy_density"].sum(), energy, rtol=1e-5)
    assert np.allclose(stress["pressure"], -stress["cauchy"][:, :3].mean(axis=1))
    with pytest.raises(ValueError, match="shape"):
        meter.read(u[1:])


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_skin(dtype):
    smooth, same = hybmss.boundary_mesh(BOX, smooth=True)
    vertices, triangles = hybmss.boundary_mesh(BOX)
    assert (same == triangles).all() and smooth.shape == vertices.shape and (smooth != vertices).any()
    skin = hybmss.Skin(BOX, vertices, triangles, dtype)
    u = np.zeros((BOX.node_count, 3), dtype)
    positions, normals = np.empty_like(vertices, dtype), np.empty_like(vertices, dtype)
    skin.update(u, positions, normals)
    assert np.allclose(positions, vertices, atol=1e-6)
    assert np.allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)
    skin.update(u + np.array([1, 2, 3], dtype), positions)
    assert np.allclose(positions, vertices + [1, 2, 3], atol=1e-5)
    assert np.array_equal(skin.triangles_left(BOX), triangles)
    with pytest.raises(ValueError, match="positions: shape"):
        skin.update(u, positions[1:])
    with pytest.raises(ValueError, match="triangles: shape"):
        hybmss.Skin(BOX, vertices, triangles.ravel())
    with pytest.raises(ValueError, match="names vertex"):
        hybmss.Skin(BOX, vertices, triangles + len(vertices))


def test_what_is_not_allowed_is_a_value_error():
    plan = hybmss.ForcePlan(BOX, MATERIAL, np.float32)
    u = displacements("float32")
    read_only = np.zeros_like(u)
    read_only.flags.writeable = False
    for bad, f, words in [
        (u.astype("float64"), np.zeros_like(u), "dtype float64"),
        (u[1:], np.zeros_like(u), r"\(120, 3\)"),
        (u.reshape(-1), np.zeros_like(u), "shape"),
        (u, read_only, "cannot be written"),
        (u, np.broadcast_to(np.float32(0), u.shape), "cannot be written"),
    ]:
        with pytest.raises(ValueError, match=words):
            plan.add_forces(bad, f)
    with pytest.raises(ValueError, match="poisson_ratio = 0.5"):
        hybmss.Material(poisson_ratio=0.5)
    with pytest.raises(ValueError, match="dtype int32"):
        hybmss.ForcePlan(BOX, MATERIAL, "int32")
    with pytest.raises(ValueError, match="threads = -1"):
        hybmss.ForcePlan(BOX, MATERIAL, threads=-1)
    with pytest.raises(ValueError, match="three"):
        hybmss.Lattice.from_scales(np.ones((2, 2)), 0.1)


def test_lattice_from_materials():
    soft = hybmss.Material(young_modulus=1e4, poisson_ratio=0.3, density=1000)
    heavy = hybmss.Material(young_modulus=3e4, poisson_ratio=0.1, density=3000)
    labels = np.array([[[1], [2]], [[0], [2]]])
    body = hybmss.Lattice.from_materials(labels, 0.5, [soft, heavy])
    assert body.cells == [2, 2, 1] and body.cell_count == 3
    masses = hybmss.ExplicitDynamics(body, soft).masses
    assert np.isclose(masses.sum(), (1000 + 2 * 3000) * 0.5**3, rtol=1e-15)
    with pytest.raises(ValueError, match="material 2 of a lattice: none given"):
        hybmss.Lattice.from_materials(labels, 0.5, [soft])


def test_lattice_from_scales():
    scales = np.zeros((2, 3, 4))
    scales[1, 2, 3] = 1
    strided = np.zeros((4, 3, 8))[::2, :, ::-2]
    strided[:] = scales
    transposed = np.ascontiguousarray(scales.T).T
    for given in [scales, np.asfortranarray(scales), strided, transposed, scales.tolist(), scales.astype("int8")]:
        body = hybmss.Lattice.from_scales(given, 0.5)
        assert body.cells == [2, 3, 4] and body.cell_count == 1 and body.node_count == 8
        assert body.rest_positions().min(axis=0) == pytest.approx([0.5, 1.0, 1.5])


@pytest.mark.parametrize("order", ["C", "F"])
def test_scales_have_the_indices_of_a_voxel_file(tmp_path, order):
    labels = np.zeros((4, 3, 2), np.uint8, order=order)
    labels[:, 0, 0] = 1
    labels[0, :, 1] = 1
    labels[3, 2, 1] = 1
    np.save(tmp_path / "body.npy", labels)
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.replace("cells = [2, 2, 2]", 'voxels = "body.npy"'))
    voxels = hybmss.Simulation(str(scene)).lattice
    body = hybmss.Lattice.from_scales(labels, 0.1)
    assert body.cells == voxels.cells == [4, 3, 2]
    assert np.array_equal(body.rest_positions(), voxels.rest_positions())


def test_cells_of_other_shapes(tmp_path):
    material = hybmss.Material(young_modulus=1e4, poisson_ratio=0.3, density=1000)
    shear = 1e4 / 2.6
    axial = 2 * shear * 0.7 / 0.4  # lambda + 2 G
    for network, volume in (
        (hybmss.tetrahedron_lattice([2, 2, 2], 0.5, material), 1),
        (hybmss.pyramid_lattice([2, 2, 2], 0.5, material), 1),
        (hybmss.prism_lattice([2, 2, 2], 0.5, 0.4, material), 0.8 * 3**0.5 / 2),
    ):
        assert network.masses.sum() == pytest.approx(1000 * volume, rel=1e-12)
        x = network.rest_positions()
        assert x.shape == (network.node_count, 3) and network.spring_count > 0
        plan = hybmss.ForcePlan(network)
        for axis in range(3):
            u = np.zeros_like(x)
            u[:, axis] = 1e-5 * x[:, axis]
            assert sum(plan.energy(u)) == pytest.approx(axial / 2 * 1e-10 * volume, rel=1e-3)
        body = hybmss.ExplicitDynamics(network, "float32")
        body.velocities = np.ones((network.node_count, 3), np.float32)
        body.step(1e-4, 10)
        assert np.allclose(body.displacements, 1e-3, rtol=1e-5)
    network = hybmss.tetrahedron_lattice([4, 4, 4], 0.5, material)
    fitted = hybmss.fit_springs(network.rest_positions(), network.cells(), material)
    assert fitted.network.node_count == network.node_count
    assert 0 < fitted.anisotropy < 0.1 and abs(fitted.modulus_error) < 0.1 and fitted.misfit > 0
    assert fitted.without >= 0
    held = [n for n, x in enumerate(network.rest_positions()) if x[2] == 0]
    u = np.zeros((network.node_count, 3))
    found = hybmss.EquilibriumSolver(fitted.network).solve(u, [(held, "xyz", (0, 0, 0))], acceleration=(0, 0, -1))
    assert found["status"] == "converged" and u[:, 2].min() < 0
    path = tmp_path / "one.vtk"
    path.write_text("# vtk DataFile Version 3.0\nany\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n"
                    "0 0 0 1 0 0 0 1 0 0.3 0.3 0.1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n")
    nodes, cells = hybmss.read_cells(str(path))
    assert nodes.shape == (4, 3) and cells == [[0, 1, 2, 3]]
    with pytest.raises(ValueError, match="far from isotropic"):
        hybmss.fit_springs(nodes, cells, material)
    with pytest.raises(ValueError, match="cell 0: 3 nodes are not allowed"):
        hybmss.fit_springs(nodes, [[0, 1, 2]], material)


def test_tears():
    lattice = hybmss.Lattice.box(4, 1, 1, 0.5)
    material = hybmss.Material(poisson_ratio=0.3)
    whole = hybmss.separate(lattice, material, [])
    assert whole.network.node_count == lattice.node_count and len(whole.corners) == 4
    u = np.zeros((lattice.node_count, 3))
    u[whole.network.rest_positions()[:, 0] > 1.1, 0] = 0.2  # the third cell is stretched by 40 %
    assert hybmss.torn_faces(lattice, whole, u, 0.3) == []  # the mean of two cells is by 20 %
    faces = hybmss.torn_faces(lattice, whole, u, 0.1)
    assert faces == [[1, 2], [2, 3]]
    parted = hybmss.separate(lattice, material, faces)
    assert parted.network.node_count == lattice.node_count + 8
    assert parted.network.masses.sum() == pytest.approx(whole.network.masses.sum(), rel=1e-14)
    before = hybmss.nodes_before(whole, parted)
    assert (before == parted.lattice_nodes).all()
    energies = [sum(hybmss.ForcePlan(s.network).energy(v)) for s, v in ((whole, u), (parted, u[before]))]
    assert energies[1] == pytest.approx(energies[0], rel=1e-12) and energies[0] > 0
    with pytest.raises(ValueError, match="share no face"):
        hybmss.separate(lattice, material, [(0, 2)])


def test_stiffening_springs():
    stiffening = hybmss.Material(stiffening_quadratic=0.5, stiffening_cubic=1.0)
    assert (stiffening.stiffening_quadratic, stiffening.stiffening_cubic) == (0.5, 1.0)
    stretched = 0.2 * BOX.rest_positions()
    energy = [sum(hybmss.ForcePlan(BOX, m).energy(stretched)) for m in (hybmss.Material(), stiffening)]
    assert energy[1] > 1.05 * energy[0]
    with pytest.raises(ValueError, match="stiffening"):
        hybmss.Material(stiffening_cubic=-1)


def test_crush_resistance():
    resisting = hybmss.Material(crush_resistance=20, crush_ratio=0.8)
    assert (resisting.crush_resistance, resisting.crush_ratio) == (20, 0.8)
    pressed = -0.1 * BOX.rest_positions()  # J = 0.729
    plain, against = (hybmss.ForcePlan(BOX, m).energy(pressed) for m in (hybmss.Material(), resisting))
    assert against[0] == plain[0] and against[1] > plain[1]
    with pytest.raises(ValueError, match="crush.ratio"):
        hybmss.Material(crush_resistance=20, crush_ratio=1)


def test_motion():
    body = hybmss.ExplicitDynamics(BOX, MATERIAL)
    assert not body.masses.flags.writeable and not body.masses.flags.owndata
    assert body.masses.sum() == pytest.approx(1000 * 60 * 0.1**3)
    dt = body.critical_time_step / 2
    body.step(dt, 10, acceleration=[0, 0, -10])
    assert body.velocities[:, 2] == pytest.approx(-100 * dt)
    before = body.displacements[:, 2]
    body.step(dt, 10, acceleration=[0, 0, -10], integrator="leapfrog")  # falls as the equation says
    assert body.displacements[:, 2] - before == pytest.approx(-10 * (100 + 50) * dt**2)
    assert body.velocities[:, 2] == pytest.approx(-200 * dt)
    with pytest.raises(ValueError, match="integrator = \"euler\""):
        body.step(dt, integrator="euler")
    body.prescribe([0, 1], "xz")
    body.load([7], [1, 0, 0])
    body.step(dt)
    assert (body.displacements[:2, 0] == 0).all()
    state = body.displacements
    body.displacements = np.zeros_like(state)
    assert body.energies[0] == 0
    body.damp_springs(0.1)
    assert body.critical_time_step < 2 * dt
    assert body.finite and body.not_finite_at == 0
    body.step(1e6 * dt, 1000, acceleration=[0, 0, -10])
    assert not body.finite and body.not_finite_at == 1021
    masses = body.masses
    del body
    assert masses.sum() > 0  # keeps the body alive
    with pytest.raises(ValueError, match="made of x, y and z"):
        hybmss.ExplicitDynamics(BOX, MATERIAL).prescribe([0], "w")


def test_moduli_and_relaxation():
    moduli = hybmss.Material.young_and_poisson(shear_modulus=1e6, bulk_modulus=2e6)
    assert moduli["young_modulus"] == pytest.approx(18e12 / 7e6) and moduli["poisson_ratio"] == pytest.approx(2 / 7)
    with pytest.raises(ValueError, match="1 elastic moduli given"):
        hybmss.Material.young_and_poisson(shear_modulus=1e6)
    cube = hybmss.Lattice.box(3, 3, 3, 0.1)
    material = hybmss.Material(**moduli)
    body = hybmss.ExplicitDynamics(cube, material)
    dt = body.critical_time_step
    body.relax(cube, material, [(0.5, 0.1), (0.25, 1)])
    assert (dt / body.critical_time_step) ** 2 == pytest.approx(1.75)
    with pytest.raises(ValueError, match="time above 0"):
        body.relax(cube, material, [(0.5, 0)])


def test_actuation():
    cube = hybmss.Lattice.box(3, 3, 3, 0.1)
    material = hybmss.Material(young_modulus=1e6, poisson_ratio=0.4)
    body = hybmss.ExplicitDynamics(cube, material)
    body.actuate(cube, material, range(27), [(1, 1, 1)] * 27)
    body.set_rest_stretches([(0.8, 1, 1.1)] * 27)
    body.step(0.5 * body.critical_time_step, 4000, mass_damping=300)
    edges = body.displacements[63] - body.displacements[0]
    assert edges == pytest.approx([-0.06, 0, 0.03], abs=1e-5)
    with pytest.raises(ValueError, match="it is given twice"):
        body.actuate(cube, material, [1, 1], [(1, 1, 1)] * 2)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_equilibria(dtype):
    bar = hybmss.Lattice.box(2, 2, 10, 0.1)
    material = hybmss.Material(young_modulus=1e5, poisson_ratio=0.3, density=1000)
    solver = hybmss.EquilibriumSolver(bar, material, dtype, threads=1)
    u = np.zeros((solver.node_count, 3), dtype)
    foot = ([n for n in range(9)], "z", (0, 0, 0))
    pinned = ([0], "xy", (0, 0, 0)), ([2], "y", (0, 0, 0))
    tolerance = 1e-4 if dtype == "float32" else 1e-9
    # Hung up: a bar under its own weight becomes longer by rho g L^2 / 2 E.
    found = solver.solve(u, [foot, *pinned], acceleration=(0, 0, 1), tolerance=tolerance)
    assert found["status"] == "converged" and found["message"] == ""
    assert u[-1, 2] == pytest.approx(1000 * 1 / 2e5, rel=0.02)
    # The same by implicit steps, without a load, from there.
    v = np.zeros_like(u)
    for _ in range(40):
        assert solver.step(u, v, 0.5, [foot, *pinned], mass_damping=5, tolerance=tolerance)["status"] == "converged"
    assert np.abs(u).max() < 1e-4
    # A muscle that shortens by a tenth, and faces that are pressed.
    solver.actuate(range(40))
    found = solver.solve(u, [foot, *pinned], stretches=[(1, 1, 0.9)] * 40, tolerance=tolerance)
    assert u[-1, 2] == pytest.approx(-0.1, rel=1e-3)
    solver.actuate([])
    solver.press(bar, hybmss.surface_faces(bar))
    floor = hybmss.Obstacle.plane(normal=(0, 0, 1))
    floor.position = (0, 0, -0.01)
    solver.set_obstacles(bar, [floor])
    u[:] = 0
    found = solver.solve(u, pinned, pressures=[1000] * 88, acceleration=(0, 0, -1), tolerance=tolerance)
    assert found["status"] == "converged", found["message"]
    assert u[:9, 2].max() < -0.009
    with pytest.raises(ValueError, match="not known"):
        solver.solve(u, [foot], preconditioner="magic")
    with pytest.raises(ValueError, match="must be made of x, y and z"):
        solver.solve(u, [([0], "w", (0, 0, 0))])
    assert solver.solve(u, [foot], acceleration=(1, 0, 0), tolerance=tolerance)["status"] != "converged"


def test_pressure():
    cube = hybmss.Lattice.box(3, 3, 3, 0.1)
    body = hybmss.ExplicitDynamics(cube, hybmss.Material(young_modulus=1e6, poisson_ratio=0.3))
    faces = hybmss.surface_faces(cube)
    assert len(faces) == 54
    body.press(cube, faces, [0] * 54)
    body.set_pressures([1e3] * 54)
    body.step(0.5 * body.critical_time_step, 4000, mass_damping=300)
    shrunk = 1e3 * (1 - 2 * 0.3) / 1e6
    edge = body.displacements[3] - body.displacements[0]
    assert edge[0] == pytest.approx(-0.3 * shrunk, rel=0.01)
    with pytest.raises(ValueError, match="1 pressures given for 54 faces"):
        body.set_pressures([1])


def test_free_obstacles():
    """A ball that flies between two cubes of a world gives both what it loses, and turns about as a free one."""
    cube = hybmss.Lattice.box(2, 2, 2, 0.1)
    material = hybmss.Material(young_modulus=1e5, density=1000.0)
    world = hybmss.World()
    for x in (0.0, 0.6):
        world.add(cube, material, (x, 0, 0))
    ball = hybmss.Obstacle.sphere(0.15, position=(0.4, 0.1, 0.1), friction=0.3)
    ball.mass, ball.velocity, ball.angular_velocity = 3.0, (4, 0, 0), (0, 0, 9)
    for body in (0, 1):
        world[body].set_obstacles(cube, [ball])
    world.share_obstacles([[(0, 0), (1, 0)]])
    world.step(0.2 * world.critical_time_step, 2000)
    pose = world[0].obstacle_poses[0]
    assert pose == world[1].obstacle_poses[0]
    momentum = 3.0 * np.array(pose["velocity"])
    for body in (0, 1):
        momentum += (world[body].masses[:, None] * world[body].velocities).sum(axis=0)
        assert np.linalg.norm(world[body].obstacle_readings[0]["impulse"]) > 0.1
    assert momentum == pytest.approx([12, 0, 0], abs=1e-10)
    assert world[0].obstacle_readings[0]["kinetic"] > 0
    ball.mass = 2.0
    world[1].set_obstacles(cube, [ball])
    with pytest.raises(ValueError, match="same shape, mass and inertia"):
        world.step(1e-5)


def test_made_obstacles():
    cube = hybmss.Lattice.box(2, 2, 2, 0.1)
    body = hybmss.ExplicitDynamics(cube, hybmss.Material(young_modulus=1e6, poisson_ratio=0.3))
    corners = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    obstacles = [
        hybmss.Obstacle.box((2, 2, 2), position=(0.1, -0.99, 0.1)),
        hybmss.Obstacle.hull(corners, position=(0.1, -0.99, 0.1)),
        hybmss.Obstacle.mesh(corners, triangles, position=(0.1, -0.99, 0.1), cells=16),
        hybmss.Obstacle.height_field([[0, 0], [0, 0]], (1, 1), position=(-0.2, 0.01, -0.2)),
    ]
    body.set_obstacles(cube, obstacles)
    for reading in body.obstacle_readings:
        assert reading["nodes"] == 9
        assert reading["depth"] == pytest.approx(0.01, rel=1e-12)
        assert reading["force"] == pytest.approx(body.obstacle_readings[0]["force"], rel=1e-12, abs=1e-9)
    with pytest.raises(ValueError, match="not closed"):
        hybmss.Obstacle.mesh(corners, triangles[1:])
    with pytest.raises(ValueError, match="in a plane"):
        hybmss.Obstacle.hull(corners[:4])
    with pytest.raises(ValueError, match="a row of 1 numbers"):
        hybmss.Obstacle.height_field([[0, 0], [0]], (1, 1))


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_parts(dtype):
    world = hybmss.World(dtype, threads=1)
    bar = hybmss.Lattice.box(5, 1, 1, 0.1)
    soft = hybmss.Material(young_modulus=1e5, poisson_ratio=0.3)
    whole = world.add(bar, soft, (0, 1, 0))
    world[whole].velocities = np.arange(3.0 * bar.node_count, dtype=dtype).reshape(-1, 3)
    assert world.split_parts(whole, bar, soft) == []
    left = hybmss.Lattice.box(5, 1, 1, 0.1)
    cut = world[whole].masses.sum() / 5

    def momentum_of(body):
        return (body.masses[:, None] * body.velocities).sum(axis=0)

    assert world.remove_cells(whole, bar, [3]) == 1
    before = momentum_of(world[whole])
    parts = world.split_parts(whole, bar, soft)
    assert [number for number, _ in parts] == [1] and len(world) == 2
    assert bar.cell_count == 3 and parts[0][1].cell_count == 1
    after = momentum_of(world[whole]) + momentum_of(world[1])
    assert after == pytest.approx(before, rel=1e-6)
    assert world[1].masses.sum() == pytest.approx(cut, rel=1e-6)
    world[1].set_obstacles(parts[0][1], [hybmss.Obstacle.plane((0, 1, 0), position=(0, 0.99, 0))])
    assert world[1].obstacle_readings[0]["nodes"] == 0  # it knows where the body was
    with pytest.raises(ValueError, match="the lattice is not the one"):
        world.split_parts(whole, left, soft)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_world(dtype):
    world = hybmss.World(dtype, threads=1)
    cube = hybmss.Lattice.box(3, 3, 3, 0.1)
    firm = hybmss.Material(young_modulus=1e6, poisson_ratio=0.3)
    lower, upper = world.add(cube, firm), world.add(cube, firm, (0.02, 0.3, 0.02))
    assert len(world) == 2
    ground = hybmss.Obstacle.plane((0, 1, 0), friction=0.5)
    rod = hybmss.Obstacle.capsule((0.5, 0, 0), 0.2, position=(0.1, -0.1, 0.1))
    world[lower].set_obstacles(cube, [rod])
    assert world[lower].obstacle_readings[0]["depth"] == pytest.approx(0.1)
    world[lower].set_obstacles(cube, [ground], skin=hybmss.boundary_mesh(cube))
    world.touch([(lower, upper)], friction=0.5)
    step = 0.5 * world.critical_time_step
    world.step(step, 6000, acceleration=(0, -10, 0), mass_damping=20)
    weight = 10 * world[upper].masses.sum()
    assert world.contact_readings[0]["force"][1] == pytest.approx(-weight, rel=1e-3)
    assert world[lower].obstacle_readings[0]["force"][1] == pytest.approx(2 * weight, rel=1e-3)

    pointer = world.attach(upper, (0.32, 0.6, 0.32), stiffness=1e5)  # a corner, dragged up
    for frame in range(60):
        world.move_anchor(pointer, (0.32, 0.6 + 0.005 * frame, 0.32))
        world.step(step, 20, acceleration=(0, -10, 0), mass_damping=20)
    assert world[upper].displacements[-1, 1] > 0.25
    assert world[upper].finite
    assert world.attachment_force(pointer)[1] > 0.5 * weight
    world.detach(pointer)
    world.place(upper, position=(0, 1, 0), velocity=(1, 0, 0))
    assert np.allclose(world[upper].velocities, (1, 0, 0))
    cells = hybmss.Lattice.box(3, 3, 3, 0.1)
    assert world.remove_cells(lower, cells, [0, 1]) == 2
    assert cells.cell_count == 25
    with pytest.raises(IndexError, match="body 2 is not there: the world has 2"):
        world[2]
    with pytest.raises(ValueError, match="contact 0: body 5 is not there"):
        world.touch([(0, 5)])
    body = world[upper]
    del world  # lives on in its body
    assert np.allclose(body.velocities, (1, 0, 0))


def test_scene_in_steps():
    simulation = hybmss.Simulation(str(SOURCE / "examples/scenes/beam.toml"), precision="float")
    simulation.step(10)
    assert simulation.time > 0
    assert simulation.displacements.shape == (simulation.lattice.node_count, 3)
    assert np.abs(simulation.velocities).max() > 0
    assert simulation.cell_stresses()["von_mises"].max() > 0
    with pytest.raises(hybmss.SceneError, match="no/such"):
        hybmss.Simulation("no/such/scene.toml")


SCENE = """
[body]
cells = [2, 2, 2]
cell_size = 0.1
[material]
young_modulus = 1e4
poisson_ratio = 0.3
density = 1000
[[fix]]
where = "y-min"
[gravity]
acceleration = [0, -10, 0]
[solver]
method = "static"
[[probe]]
name = "ground"
where = "y-min"
"""


def test_simulation_and_record(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE)
    result = hybmss.Simulation(str(scene)).run()
    assert result["converged"]
    weight = 1000 * 10 * 0.2**3
    # Half a cell's share of the weight hangs on the held nodes themselves.
    assert 0.7 * weight < result["probes"]["ground"]["force"][1] <= weight * (1 + 1e-6)

    scene.write_text(SCENE.replace('"static"', '"modes"\ncount = 2'))
    modes = hybmss.Simulation(str(scene)).run()["modes"]
    assert len(modes) == 2 and 0 < modes[0]["frequency"] <= modes[1]["frequency"]
    assert modes[0]["shape"].shape[1] == 3
    scene.write_text(SCENE)

    path = tmp_path / "scene.record"
    subprocess.run([os.environ["HYBMSS_APP"], "record", scene, "--out", path], check=True, capture_output=True)
    record = hybmss.Record(str(path))
    assert len(record) == 2
    for dtype in ["float32", "float64"]:
        plan = hybmss.ForcePlan(record.lattice, record.material, dtype)
        for state in range(len(record)):
            forces = plan.forces(record.displacements(state).astype(dtype))
            assert record.check_forces(state, forces) < 1e-5
            forces[3] += 1
            with pytest.raises(ValueError, match="node 3 .*relative error [0-9.e+-]*, tolerance [1-9]"):
                record.check_forces(state, forces)
    path.write_text(path.read_text().replace("hybmss", "hypnos", 1))
    with pytest.raises(hybmss.RecordError, match="no record"):
        hybmss.Record(str(path))


def test_solve_to_accuracy(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.replace("cells = [2, 2, 2]\ncell_size = 0.1", "size = [0.2, 0.2, 0.2]")
                     .replace('"static"', '"static"\naccuracy = 0.05'))
    with pytest.raises(hybmss.SceneError, match=r"solve_to_accuracy\(\)"):
        hybmss.Simulation(str(scene))
    simulation, summary = hybmss.solve_to_accuracy(str(scene))
    accuracy = summary["accuracy"]
    assert summary["converged"] and summary["failure"] == "" and summary["warnings"] == []
    assert accuracy["free_mesh"] and accuracy["reached"] and accuracy["precision"] == "float"
    assert 0 < accuracy["error_estimate"] <= accuracy["wanted"] == 0.05
    assert simulation.lattice.cells[0] >= 8
    assert np.abs(simulation.displacements).max() > 0
    assert summary["probes"].keys() == {"ground"}
    assert hybmss.solve_to_accuracy(str(scene), precision="double")[1]["accuracy"]["precision"] == "double"

    scene.write_text(SCENE.replace('"static"', '"static"\naccuracy = 1e-4'))
    coarse, summary = hybmss.solve_to_accuracy(str(scene))
    assert coarse.lattice.cells == [2, 2, 2]
    assert not summary["accuracy"]["reached"] and "too coarse" in summary["warnings"][0]
    scene.write_text(SCENE)
    with pytest.raises(hybmss.SceneError, match="solver.accuracy"):
        hybmss.solve_to_accuracy(str(scene))


def test_work_precision_tells_of_its_arguments(tmp_path):
    pytest.importorskip("matplotlib")
    script = SOURCE / "examples/python/work_precision.py"
    told = subprocess.run([sys.executable, script, "--help"], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert told.returncode == 0 and told.stdout.startswith("usage: work_precision.py") and not list(tmp_path.iterdir())


def test_stubs_name_what_the_module_has():
    tree = ast.parse((SOURCE / "bindings/python/hybmss/__init__.pyi").read_text())
    functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    assert functions == {name for name, value in vars(hybmss).items() if inspect.isroutine(value)}
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    assert set(classes) == {name for name, value in vars(hybmss).items() if inspect.isclass(value)}
    for name, node in classes.items():
        if name.endswith("Error") or name in ("VolumeEnergy", "SpringForm"):
            continue
        stub = {m.name for m in node.body if isinstance(m, ast.FunctionDef)}
        stub |= {m.target.id for m in node.body if isinstance(m, ast.AnnAssign)}
        special = ("__init__", "__len__", "__getitem__", "_repr_html_", "_repr_png_")
        own = {m for m in vars(getattr(hybmss, name)) if not m.startswith("_") or m in special}
        # pybind11 gives every class an __init__, which refuses.
        assert stub - own == set() and own - stub <= {"__init__"}, name
        assert getattr(hybmss, name).__doc__
        assert getattr(hybmss, name).__module__ == "hybmss"


def pixels(png):
    """Of a file with rows that are not filtered."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    chunks, at = {}, 8
    while at < len(png):
        size, kind = struct.unpack(">I4s", png[at:at + 8])
        data = png[at + 8:at + 8 + size]
        assert struct.unpack(">I", png[at + 8 + size:at + 12 + size])[0] == zlib.crc32(kind + data)
        chunks[kind] = data
        at += 12 + size
    width, height, depth, colours = struct.unpack(">IIBB", chunks[b"IHDR"][:10])
    assert (depth, colours) == (8, 6) and b"IEND" in chunks
    rows = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(height, 1 + 4 * width)
    assert not rows[:, 0].any()
    return rows[:, 1:].reshape(height, width, 4)


@pytest.mark.parametrize("cells", [(1, 1, 1), (4, 3, 5), (60, 2, 40)])
def test_pictures_show_all_of_a_body_and_nothing_else(cells):
    lattice = hybmss.Lattice.box(*cells, 0.1)
    picture = hybmss.picture(lattice)
    image = pixels(picture.png)
    # Three sides of a box are seen, each with the part of its area that is across the line of sight.
    turn, tilt = 0.6, 0.3
    right = np.array([np.cos(turn), 0, -np.sin(turn)])
    eye = np.array([np.sin(turn) * np.cos(tilt), np.sin(tilt), np.cos(turn) * np.cos(tilt)])
    size = np.array(cells, float)
    wide, high = size @ abs(right), size @ abs(np.cross(eye, right))
    seen = np.prod(size) * (abs(eye) / size).sum() / (wide * high)
    rows, columns = np.nonzero(image[..., 3].any(axis=1))[0], np.nonzero(image[..., 3].any(axis=0))[0]
    box = (rows[-1] - rows[0] + 1) * (columns[-1] - columns[0] + 1)
    assert image[..., 3].sum() / 255 / box == pytest.approx(seen, rel=0.03)
    assert (columns[-1] - columns[0]) / (rows[-1] - rows[0]) == pytest.approx(wide / high, rel=0.03)
    # A shade a side; between them, where sides meet, mixed ones.
    counts = np.sort(np.unique(image[image[..., 3] == 255], axis=0, return_counts=True)[1])
    assert counts[-3:].sum() > 0.95 * counts.sum() and counts[-3] > 0.02 * counts.sum()
    assert f"{lattice.cell_count} of" in picture.text and picture.text in picture._repr_html_()
    assert picture._repr_png_() == picture.png and hybmss.picture(lattice).png == picture.png


def test_pictures_follow_the_body(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text((SOURCE / "examples/scenes/compression_nu025.toml").read_text())
    simulation = hybmss.Simulation(str(scene))
    at_rest = simulation._repr_html_()
    assert simulation.lattice._repr_html_().split('src="')[1].split('"')[0] in at_rest
    simulation.step(300)
    assert simulation._repr_html_().split('src="')[1] != at_rest.split('src="')[1]
    stretched = 0.5 * simulation.lattice.rest_positions() * [1, 0, 0]
    tall, wide = (pixels(hybmss.picture(simulation.lattice, u).png)[..., 3].any(axis=0).sum() for u in (0 * stretched, stretched))
    assert wide > tall
    with pytest.raises(ValueError, match="finite"):
        hybmss.picture(simulation.lattice, stretched * np.nan)
    with pytest.raises(ValueError, match="shape|nodes"):
        hybmss.picture(simulation.lattice, stretched[1:])


def test_the_package_runs_scenes(tmp_path):
    scene = SOURCE / "examples/scenes/compression_nu0499.toml"
    run = [sys.executable, "-m", "hybmss"]
    told = subprocess.run([*run, scene, "--quiet", "--out", tmp_path / "out"], capture_output=True, text=True, timeout=120)
    assert told.returncode == 0 and "settled" in told.stdout and (tmp_path / "out/summary.json").is_file()
    told = subprocess.run([*run, "--version"], capture_output=True, text=True, timeout=60)
    assert told.stdout.strip() == hybmss.__version__
    assert subprocess.run([*run, "nothing.toml"], capture_output=True, timeout=60).returncode == 2


@pytest.mark.parametrize("example", ["energies", "skin"])
def test_examples_plot(example, tmp_path):
    pytest.importorskip("matplotlib")
    subprocess.run([sys.executable, SOURCE / f"examples/python/{example}.py"], cwd=tmp_path, check=True, timeout=120)
    assert (tmp_path / f"{example}.png").read_bytes().startswith(b"\x89PNG")


if __name__ == "__main__":
    sys.exit(pytest.main([__file__]))
