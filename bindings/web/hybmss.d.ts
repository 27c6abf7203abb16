/**
 * Soft bodies of hybrid mass-spring systems: the C interface of hybmss as a WebAssembly module. SI units. Order of
 * indices: x fastest, then y, then z. What is given is checked; what is refused throws a HybmssError of one line.
 *
 * Objects live in the module's memory. free() gives it back; what is forgotten goes with the garbage, some time later.
 *
 * Typed arrays that are properties are views of the module's memory, without copies. Its memory may grow when something
 * is made or cut; the views that were taken before are then empty (their length is 0): take them from the property
 * again, which costs nothing. (With threads they see the same memory as before.)
 */

export class HybmssError extends Error {
  /** "invalid argument", "out of memory", "file error", "mismatch" or "internal error". */
  readonly status: string;
}

/** Where hybmss.wasm is (with threads: hybmss.threads.wasm), its bytes, or it compiled; left out: the file beside this one. */
export type Source = string | URL | BufferSource | WebAssembly.Module;

/**
 * Loads the module, once; await it before anything else. `threads`, from 1 (as it is without) to 64: that of the caller
 * and so many workers less one. A page must be isolated from other origins for more than one (crossOriginIsolated), and
 * says so if it is not. Results have the same bits with any number.
 */
export function load(given?: Source | { source?: Source; threads?: number }): Promise<void>;

/** "major.minor.patch" of the library. */
export function version(): string;

export type Vector = readonly [number, number, number];
export type Precision = "float32" | "float64";
export type Values = Float32Array | Float64Array;

/** Left out: 1e4 Pa, 0.25, 1000 kg/m^3, 1, automatic, none, nodes, none. */
export interface Material {
  /** Pa, > 0 */
  youngModulus?: number;
  /** in (-1, 1/2) */
  poissonRatio?: number;
  /** kg/m^3, > 0 */
  density?: number;
  /** stiffness of face diagonals over that of cube diagonals, >= 0 */
  faceDiagonalRatio?: number;
  volumeEnergy?: "automatic" | "quadratic" | "mean-stretch" | "none";
  /** Springs of the strain e bear k l (e + quadratic e^2 + cubic e^3). */
  stiffening?: { quadratic: number; cubic: number };
  springs?: "nodes" | "means";
  /** Cells below the volume ratio `ratio` resist in addition. */
  crush?: { resistance: number; ratio: number };
}

export interface Mesh {
  /** x y z of each vertex at rest, m */
  vertices: Float64Array;
  /** three numbers of vertices each, counter-clockwise seen from outside */
  triangles: Uint32Array;
}

/** Cubic cells of one grid, and what they are made of. Not changed by use. */
export class Lattice {
  /**
   * cells: how many along x, y, z; cellSize: their edge, m. `scales`: a stiffness scale a cell, 0 for none there. Or
   * `labels` and `materials`: 0 is no cell, n is materials[n - 1].
   */
  constructor(given: {
    cells: Vector;
    cellSize: number;
    scales?: ArrayLike<number>;
    labels?: ArrayLike<number>;
    material?: Material;
    materials?: readonly Material[];
  });
  readonly nodeCount: number;
  readonly cellCount: number;
  /** x y z a node, m; a view */
  readonly restPositions: Float64Array;
  /** i + (nx + 1) (j + (ny + 1) k) of each node, ascending; a view */
  readonly gridIndices: Uint32Array;
  /** The faces of cells that no other cell shares. */
  boundaryMesh(): Mesh;
  /** Another body, less the cells i + nx (j + ny k). */
  without(cells: ArrayLike<number>): Lattice;
  free(): void;
}

/** Explicit springs and hexahedral cells. Not changed by use. */
export class Network {
  constructor(given: {
    /** x y z a node, m */
    restPositions: ArrayLike<number>;
    /** one a node, kg */
    masses: ArrayLike<number>;
    /** `nodes`: the two ends of each; N/m; `restVectors`: x y z from the first end to the second, m; left out: as the nodes are */
    springs?: { nodes: ArrayLike<number>; stiffness: ArrayLike<number>; restVectors?: ArrayLike<number> };
    /** `nodes`: eight corners of each, bit 0 of a corner's number the high side in x, bit 1 in y, bit 2 in z; Pa */
    cells?: { nodes: ArrayLike<number>; kappa: ArrayLike<number> };
    /** left out: quadratic */
    volumeEnergy?: "quadratic" | "mean-stretch" | "none";
  });
  readonly nodeCount: number;
  free(): void;
}

/** Left out: float32, accurate, the plan's own choice. */
export interface PlanOptions {
  precision?: Precision;
  accuracy?: "fast" | "accurate" | "exact";
  layout?: string;
  /** at most those of load(), which are taken where this is left out; small bodies take fewer */
  threads?: number;
}

/** Forces and energies of a body at displacements of the caller's. */
export class ForcePlan {
  constructor(body: Lattice | Network, options?: PlanOptions);
  readonly nodeCount: number;
  /** x y z a node, m; a view, to be written */
  readonly displacements: Values;
  /** x y z a node, N; a view. addForces() adds to it. */
  readonly forces: Values;
  addForces(): void;
  /** J */
  energy(): { springs: number; volume: number };
  /** s */
  readonly criticalTimeStep: number;
  /** What was chosen, a fact a line. */
  describe(): string;
  free(): void;
}

export interface StepParameters {
  /** s, > 0 */
  timeStep: number;
  /** m/s^2 */
  acceleration?: Vector;
  /** 1/s */
  massDamping?: number;
  integrator?: "symplectic-euler" | "leapfrog";
}

/** A node whose displacement and velocity are given along axes: bit 0 is x, bit 1 y, bit 2 z; all where left out. */
export interface PrescribedNode {
  node: number;
  axes?: number;
  displacement?: Vector;
  velocity?: Vector;
}

export interface Pose {
  position?: Vector;
  /** row by row, from the obstacle's axes to space */
  rotation?: readonly number[];
  velocity?: Vector;
  angularVelocity?: Vector;
}

/** A convex hull, a closed mesh or a height field, made once for any number of obstacles; m, in the obstacle's axes. */
export class Solid {
  constructor(
    given:
      | { points: ArrayLike<number> }
      | { vertices: ArrayLike<number>; triangles: ArrayLike<number>; cells?: number }
      | { heights: ArrayLike<number>; counts: readonly number[]; spacing: readonly number[] },
  );
  free(): void;
}

export interface Obstacle {
  shape: "plane" | "sphere" | "box" | "capsule" | "solid";
  /** a plane's normal, a sphere's radius, a box's lengths; a capsule's radius and the length of its axis, along its y */
  dimensions?: readonly number[];
  /** of shape "solid" */
  solid?: Solid;
  pose?: Pose;
  friction?: number;
  stiffness?: number;
  frictionDelay?: number;
  /** kg; none: it is led, else bodies and gravity move it */
  mass?: number;
  /** kg m^2, about its axes; by default that of the full shape */
  inertia?: Vector;
}

export interface ObstacleReading {
  force: number[];
  torque: number[];
  nodes: number;
  depth: number;
  greatestDepth: number;
  energy: number;
  dissipated: number;
  impulse: number[];
  angularImpulse: number[];
}

/** A body that moves by explicit steps. Starts at rest. */
export class Dynamics {
  constructor(body: Lattice | Network, options?: PlanOptions);
  readonly nodeCount: number;
  readonly lattice: Lattice;
  /** x y z a node, m; read: a view of the state as it is now, until it is read again. Set: a copy of what is given. */
  get displacements(): Values;
  set displacements(values: ArrayLike<number>);
  /** m/s, likewise */
  get velocities(): Values;
  set velocities(values: ArrayLike<number>);
  /** N: internal forces now */
  readonly forces: Values;
  /** kg, one a node */
  readonly masses: Float64Array;
  step(parameters: StepParameters, count?: number): void;
  /** Replaces the list. */
  prescribe(nodes: readonly PrescribedNode[]): void;
  /** Replaces the list; N. */
  load(loads: readonly { node: number; force: Vector }[]): void;
  /** Replaces the list. */
  setObstacles(obstacles: readonly Obstacle[]): void;
  /** One pose an obstacle. */
  moveObstacles(poses: readonly Pose[]): void;
  /** Where they are now, free ones too. */
  obstaclePoses(): Required<Pose>[];
  obstacleReadings(): ObstacleReading[];
  /** Removes cells i + nx (j + ny k); says how many there were. Nodes keep their numbers; `lattice` stays as it is. */
  removeCells(cells: ArrayLike<number>): number;
  /** Damps springs along themselves; s, 0 for none. */
  dampSprings(stiffnessDamping: number): void;
  /** J */
  energies(): { springs: number; volume: number; kinetic: number };
  /** 0 while all is finite; else the step at which it was not. */
  readonly notFiniteAt: number;
  /** s */
  readonly criticalTimeStep: number;
  free(): void;
}

/** That two bodies touch, or one itself where both numbers are the same. */
export interface BodyContact {
  first: number;
  second: number;
  friction?: number;
  stiffness?: number;
  frictionDelay?: number;
}

export interface BodyContactReading {
  /** N, on the first body in the last step */
  force: number[];
  /** N s, since the contact was set */
  impulse: number[];
  depth: number;
  greatestDepth: number;
  nodes: number;
}

/** A point of a body at rest, or without one a point in space; m. */
export interface Anchor {
  body?: number;
  point: Vector;
}

/** Bodies that touch and are tied. */
export class World {
  constructor(options?: { precision?: Precision; threads?: number });
  /** By number: to hold, load, read and set them by. Steps are the world's. */
  readonly bodies: Dynamics[];
  /** Adds a body whose grid has its low corner at the origin; returns its number. */
  add(lattice: Lattice, options?: { origin?: Vector; accuracy?: PlanOptions["accuracy"]; layout?: string }): number;
  /** Puts a body as it is at rest to position + rotation X, where it was at X. */
  place(body: number, pose: Pose): void;
  /** Removes cells of a body; says how many there were. */
  removeCells(body: number, cells: ArrayLike<number>): number;
  /** Replaces the list. */
  setContacts(contacts: readonly BodyContact[]): void;
  contactReadings(): BodyContactReading[];
  /** Ties two points by a spring without length, N/m; welds them where it is left out. Returns its number. */
  attach(from: Anchor, to: Anchor, stiffness?: number): number;
  moveAnchor(attachment: number, point: Vector): void;
  /** N */
  attachmentForce(attachment: number): number[];
  detach(attachment: number): void;
  step(parameters: StepParameters, count?: number): void;
  /** s */
  readonly criticalTimeStep: number;
  /** The bodies are to be freed by themselves. */
  free(): void;
}

/** Triangles that move with a body. */
export class Skin {
  /** `map`: where the lattice is another one than the dynamics was made of, the number there of each of its nodes. */
  constructor(lattice: Lattice, mesh: Mesh, options?: { precision?: Precision; map?: ArrayLike<number> });
  /** Sets positions and normals, at the body's state now. */
  update(dynamics: Dynamics): void;
  /** x y z a vertex, m; a view */
  readonly positions: Values;
  /** of length 1; a view */
  readonly normals: Values;
  free(): void;
}

/** A file of `hybmss record`: states of a body with the forces of the scalar reference. */
export class Record {
  constructor(text: string | Uint8Array);
  readonly stateCount: number;
  lattice(): Lattice;
  /** Sets the plan's displacements. */
  readDisplacements(state: number, plan: ForcePlan): void;
  /** The largest error by the largest sum of force magnitudes at a node; throws where it is above the tolerance. */
  compareForces(state: number, plan: ForcePlan): number;
  compareEnergy(state: number, plan: ForcePlan): number;
  free(): void;
}
