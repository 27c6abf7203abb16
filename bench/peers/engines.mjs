// What is timed in node: each function makes contenders { engine, numbers, does, unit, springs, steps(count) } of a cube
// of springs, and checks { what, error, bound }. An engine that cannot throws, and is left out with its words.
import { cellSize, difference, material, PlainSprings } from "./springs.mjs";

export function hybmss(cube, { Dynamics, Lattice }) {
  const contenders = [];
  const checks = [];
  const cells = [cube.n, cube.n, cube.n];
  const full = new Lattice({ cells, cellSize, material: { ...material, volumeEnergy: "quadratic" } });
  const springs = new Lattice({ cells, cellSize, material: { ...material, volumeEnergy: "none" } });
  const parameters = { timeStep: 0.5 * new Dynamics(full, { precision: "float64" }).criticalTimeStep };
  for (const precision of ["float32", "float64"]) {
    for (const lattice of [full, springs]) {
      const body = new Dynamics(lattice, { precision });
      body.displacements = cube.displacements;
      if (lattice === springs) {
        const plain = new PlainSprings(cube);
        plain.computeForces();
        const what = `HybMSS, ${precision}: forces of the springs beside the plain loops'`;
        checks.push({ what, error: difference(plain.forces, body.forces), bound: precision === "float32" ? 2e-5 : 1e-11 });
      }
      contenders.push({
        engine: "HybMSS",
        numbers: precision === "float32" ? "float" : "double",
        does: lattice === full ? "springs and volume" : "springs",
        unit: "step",
        springs: cube.stiffness.length,
        steps: (count) => body.step(parameters, count),
      });
    }
  }
  const plain = new PlainSprings(cube);
  contenders.push({
    engine: "plain loops in JavaScript",
    numbers: "double",
    does: "springs",
    unit: "step",
    springs: cube.stiffness.length,
    steps(count) {
      for (let s = 0; s < count; ++s) plain.step(parameters.timeStep);
    },
  });
  return { contenders, checks, timeStep: parameters.timeStep };
}

const counted = (engine, expected, found) => ({ what: `${engine}: springs that it counts beside ours`, error: Math.abs(found - expected) / expected, bound: 0 });

/** Jolt projects edges (XPBD): each of a step's iterations is a step of its own, with motion. Many a step, so that what
 * a step costs besides is spread over them. No faces, so nothing to collide with. */
export async function jolt(cube, load, timeStep) {
  const iterations = 20;
  const J = await (await load("jolt-physics")).default();
  const shared = new J.SoftBodySharedSettings();
  for (let n = 0; n < cube.mass.length; ++n) {
    const vertex = new J.SoftBodySharedSettingsVertex();
    vertex.mPosition = new J.Float3(...cube.rest.slice(3 * n, 3 * n + 3));
    vertex.mInvMass = 1 / cube.mass[n];
    shared.mVertices.push_back(vertex);
    J.destroy(vertex);
  }
  for (let s = 0; s < cube.stiffness.length; ++s) {
    const edge = new J.SoftBodySharedSettingsEdge(cube.ends[2 * s], cube.ends[2 * s + 1], 1 / cube.stiffness[s]);
    shared.mEdgeConstraints.push_back(edge);
    J.destroy(edge);
  }
  shared.CalculateEdgeLengths();
  shared.Optimize();
  const settings = new J.JoltSettings();
  const pairs = new J.ObjectLayerPairFilterTable(1);
  const layers = new J.BroadPhaseLayerInterfaceTable(1, 1);
  layers.MapObjectToBroadPhaseLayer(0, new J.BroadPhaseLayer(0));
  settings.mObjectLayerPairFilter = pairs;
  settings.mBroadPhaseLayerInterface = layers;
  settings.mObjectVsBroadPhaseLayerFilter = new J.ObjectVsBroadPhaseLayerFilterTable(layers, 1, pairs, 1);
  const world = new J.JoltInterface(settings);
  world.GetPhysicsSystem().SetGravity(new J.Vec3(0, 0, 0));
  const creation = new J.SoftBodyCreationSettings(shared, new J.RVec3(0, 0, 0), J.Quat.prototype.sIdentity(), 0);
  Object.assign(creation, { mNumIterations: iterations, mLinearDamping: 0, mAllowSleeping: false, mUpdatePosition: false });
  const bodies = world.GetPhysicsSystem().GetBodyInterface();
  const body = bodies.CreateSoftBody(creation);
  bodies.AddBody(body.GetID(), J.EActivation_Activate);
  const motion = J.castObject(body.GetMotionProperties(), J.SoftBodyMotionProperties);
  for (let n = 0; n < cube.mass.length; ++n) {
    const vertex = motion.GetVertex(n);
    vertex.mPosition = new J.Vec3(...cube.positions.slice(3 * n, 3 * n + 3));
  }
  const springs = motion.GetSettings().mEdgeConstraints.size();
  return {
    contenders: [
      {
        engine: "Jolt",
        numbers: "float",
        does: "springs",
        unit: "iteration",
        each: iterations,
        springs,
        steps(count) {
          for (let s = 0; s < count; s += iterations) world.Step(iterations * timeStep, 1);
        },
      },
    ],
    checks: [counted("Jolt", cube.stiffness.length, springs)],
  };
}

/** Rapier solves edges as constraints of its velocities; a step has substeps, each with motion and here with one sweep
 * over the edges (by default there are four). Nothing to collide with, no search for tangles. Beside it a cuboid of as
 * many cells filled with tetrahedra, as Rapier makes and solves it by default. */
export async function rapier(cube, load, timeStep) {
  const substeps = 10;
  const R = await load("@dimforge/rapier3d-compat");
  await R.init();
  const world = () => {
    const made = new R.World({ x: 0, y: 0, z: 0 });
    made.integrationParameters.softBodiesMaxExtraSubsteps = 0;
    return made;
  };
  const own = world();
  const recovery = own.integrationParameters.softBodiesRecovery;
  for (const [name, value] of Object.entries(recovery)) {
    if (typeof value === "boolean") recovery[name] = false;
  }
  own.integrationParameters.softBodiesRecovery = recovery;
  own.integrationParameters.numSolverIterations = substeps;
  own.integrationParameters.dt = substeps * timeStep;
  const body = own.createSoftBody(
    new R.SoftBodyDesc(Float32Array.from(cube.rest))
      .setEdges(Uint32Array.from(cube.ends))
      .setMasses(Float32Array.from(cube.mass))
      .setNoSurfaceCollider()
      .setAdditionalPgsIterations(0)
      .setCanSleep(false),
  );
  for (let n = 0; n < cube.mass.length; ++n) {
    const [x, y, z] = cube.positions.slice(3 * n, 3 * n + 3);
    body.setParticlePosition(n, { x, y, z });
  }
  const edge = cube.n * cellSize;
  const half = { x: edge / 2, y: edge / 2, z: edge / 2 };
  const cuboids = [R.SoftBodySolver.Constraints, R.SoftBodySolver.Fem].map((solver) => {
    const place = world();
    const made = place.createSoftBody(
      R.SoftBodyDesc.cuboid(half, half, cube.n + 1, cube.n + 1, cube.n + 1).setSolver(solver).setNoSurfaceCollider().setCanSleep(false));
    for (let n = 0; n < made.numParticles(); ++n) {
      const p = made.particlePosition(n);
      const [x, y, z] = cube.displacements.slice(3 * n, 3 * n + 3);
      made.setParticlePosition(n, { x: p.x + x, y: p.y + y, z: p.z + z });
    }
    const substeps = place.integrationParameters.numSolverIterations;
    place.integrationParameters.dt = substeps * timeStep;
    return {
      engine: `Rapier, ${made.numCells()} tetrahedra, ${solver === R.SoftBodySolver.Fem ? "finite elements" : "constraints"}`,
      numbers: "float",
      does: "tetrahedra",
      unit: "substep",
      each: substeps,
      springs: made.numEdges(),
      steps(count) {
        for (let s = 0; s < count; s += substeps) place.step();
      },
    };
  });
  return {
    contenders: [
      {
        engine: "Rapier",
        numbers: "float",
        does: "springs",
        unit: "substep",
        each: substeps,
        springs: body.numEdges(),
        steps(count) {
          for (let s = 0; s < count; s += substeps) own.step();
        },
      },
      ...cuboids,
    ],
    checks: [counted("Rapier", cube.stiffness.length, body.numEdges())],
  };
}

/** MuJoCo's flex of one dimension: each spring is an element, each node a body with three slides; one stiffness for all
 * edges. No constraints, no contacts, no implicit damping. */
export async function mujoco(cube, load, timeStep) {
  if (cube.n > 12) throw new Error("not tried above 12^3 cells: after minutes its compiler had no model of 20^3");
  const M = await (await load("mujoco-js")).default();
  const stiffness = cube.stiffness[0];
  const mass = cube.mass.reduce((sum, m) => sum + m, 0);
  M.FS.writeFile(
    "/cube.xml",
    `<mujoco><option timestep="${timeStep}" gravity="0 0 0" integrator="Euler" jacobian="sparse">
     <flag constraint="disable" contact="disable" eulerdamp="disable"/></option><size memory="500M"/><worldbody>
     <flexcomp name="cube" type="direct" dim="1" mass="${mass}" radius="0.001" point="${cube.rest.join(" ")}"
      element="${cube.ends.join(" ")}"><edge stiffness="${stiffness}" damping="0"/>
     <contact contype="0" conaffinity="0" selfcollide="none" internal="false"/></flexcomp></worldbody></mujoco>`,
  );
  const model = M.MjModel.loadFromXML("/cube.xml");
  const data = new M.MjData(model);
  data.qpos.set(cube.displacements);
  M.mj_forward(model, data);
  const plain = new PlainSprings(cube, cube.stiffness.map(() => stiffness));
  plain.computeForces();
  const springs = model.nflexedge;
  const contender = (does, unit, once) => ({
    engine: "MuJoCo",
    numbers: "double",
    does,
    unit,
    springs,
    steps(count) {
      for (let s = 0; s < count; ++s) once();
    },
  });
  return {
    contenders: [
      contender("springs", "step", () => M.mj_step(model, data)),
      contender("springs", "forces", () => {
        M.mj_flex(model, data);
        M.mj_passive(model, data);
      }),
    ],
    checks: [
      counted("MuJoCo", cube.stiffness.length, springs),
      { what: "MuJoCo: forces of alike springs beside the plain loops'", error: difference(plain.forces, Array.from(data.qfrc_passive)), bound: 1e-10 },
    ],
  };
}
