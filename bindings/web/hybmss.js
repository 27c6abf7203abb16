// The C interface (include/hybmss/hybmss.h) in JavaScript: hybmss.d.ts says what everything is.
import { environment } from "./hybmss.environment.js";

let wasm = null; // exports of the module
let memory = null;

export class HybmssError extends Error {
  constructor(status, message) {
    super(message);
    this.name = "HybmssError";
    this.status = status;
  }
}

/** The compiled module at `source`. */
async function compile(source) {
  if (source instanceof WebAssembly.Module) {
    return source;
  }
  if (source instanceof ArrayBuffer || ArrayBuffer.isView(source)) {
    return WebAssembly.compile(source);
  }
  const address = new URL(source, import.meta.url);
  if (address.protocol === "file:") {
    const files = await import(/* @vite-ignore */ "node:fs/promises");
    return WebAssembly.compile(await files.readFile(address));
  }
  const response = await fetch(address);
  if (!response.ok) {
    throw new HybmssError("file error", `${address}: cannot be read: ${response.status} ${response.statusText}`);
  }
  return WebAssembly.compile(await response.arrayBuffer());
}

async function one(source) {
  const module = await compile(source ?? new URL("./hybmss.wasm", import.meta.url));
  const { exports } = await WebAssembly.instantiate(module, environment(module, () => exports.memory));
  exports._initialize();
  return exports;
}

/** A worker that has the module and its memory, and waits. */
async function threadOf(module, memory) {
  const address = new URL("./hybmss.worker.js", import.meta.url);
  const inNode = typeof Worker === "undefined";
  const worker = inNode
    ? new (await import(/* @vite-ignore */ "node:worker_threads")).Worker(address)
    : new Worker(new URL("./hybmss.worker.js", import.meta.url), { type: "module" });
  const on = (event, work) => (inNode ? worker.on(event, work) : worker.addEventListener(event, work));
  await new Promise((resolve, reject) => {
    on("message", resolve);
    on("error", (error) => {
      error.preventDefault?.();
      reject(new HybmssError("internal error", `${address}: a thread cannot be started: ${error.message ?? "it cannot be read"}`));
    });
    worker.postMessage({ module, memory });
  });
  worker.unref?.(); // node ends though it waits
  return worker;
}

async function several(source, threads) {
  if (typeof SharedArrayBuffer === "undefined" || globalThis.crossOriginIsolated === false) {
    throw new HybmssError(
      "invalid argument",
      `load.threads = ${threads} is not allowed: this page is not isolated from other origins; its server must send ` +
        "Cross-Origin-Opener-Policy: same-origin and Cross-Origin-Embedder-Policy: require-corp, or threads must be 1",
    );
  }
  const module = await compile(source ?? new URL("./hybmss.threads.wasm", import.meta.url));
  const memory = new WebAssembly.Memory({ initial: 256, maximum: 32768, shared: true });
  const idle = await Promise.all(Array.from({ length: threads - 1 }, () => threadOf(module, memory)));
  const inWindow = typeof window !== "undefined"; // which must not be blocked
  const { exports } = await WebAssembly.instantiate(module, environment(module, memory, {
    emscripten_num_logical_cores: () => threads,
    _emscripten_default_pthread_stack_size: () => 1 << 20,
    __emscripten_init_main_thread_js(thread) {
      exports._emscripten_thread_init(thread, inWindow ? 1 : 0, 1, inWindow ? 0 : 1, 0);
      exports.emscripten_tls_init();
    },
    __pthread_create_js(thread, _attributes, routine, argument) {
      const worker = idle.pop();
      worker?.postMessage({ thread, stack: exports.hybmss_thread_stack(thread), routine, argument });
      return worker ? 0 : 6; // EAGAIN
    },
  }));
  exports.__wasm_call_ctors();
  return { ...exports, memory };
}

let loading = null;
let threads = 1; // that the module was loaded with
export async function load(given = {}) {
  const isSource = typeof given === "string" || ArrayBuffer.isView(given) ||
    [URL, ArrayBuffer, WebAssembly.Module].some((Type) => given instanceof Type);
  const options = isSource ? { source: given } : given;
  known("load", options, ["source", "threads"]);
  const wanted = options.threads ?? (loading ? threads : 1);
  if (!Number.isInteger(wanted) || wanted < 1 || wanted > 64) {
    throw new HybmssError("invalid argument", `load.threads = ${wanted} is not allowed: it must be a whole number from 1 to 64`);
  }
  if (loading && wanted !== threads) {
    throw new HybmssError("invalid argument", `load.threads = ${wanted} is not allowed: the module is loaded with ${threads}`);
  }
  threads = wanted;
  loading ??= wanted === 1 ? one(options.source) : several(options.source, wanted);
  try {
    wasm = await loading;
    memory = wasm.memory;
  } catch (error) {
    loading = null;
    throw error;
  }
}

// ---- memory: addresses of the module's, and views that last until it grows

let dataView = null;
function data() {
  if (dataView?.buffer !== memory.buffer) {
    dataView = new DataView(memory.buffer);
  }
  return dataView;
}

function text(address) {
  const bytes = new Uint8Array(memory.buffer);
  return new TextDecoder().decode(bytes.slice(address, bytes.indexOf(0, address))); // of shared memory it takes no view
}

function ready() {
  if (!wasm) {
    throw new HybmssError("invalid argument", "the module is not loaded: await load() comes first");
  }
}

/** Calls a function of the C interface, and throws what it refuses. */
function call(name, ...given) {
  const status = wasm[name](...given);
  if (status !== 0) {
    throw new HybmssError(text(wasm.hybmss_status_name(status)), text(wasm.hybmss_last_error()));
  }
}

function allocate(bytes) {
  const address = wasm.malloc(Math.max(bytes, 8));
  if (address === 0) {
    throw new HybmssError("out of memory", `out of memory: ${bytes} bytes more are not to be had`);
  }
  return address;
}

/** Memory for the length of a call; work(take), where take(bytes) gives zeros at an address. */
function withMemory(work) {
  const taken = [];
  const take = (bytes) => {
    const address = allocate(bytes);
    taken.push(address);
    new Uint8Array(memory.buffer, address, bytes).fill(0);
    return address;
  };
  try {
    return work(take);
  } finally {
    taken.forEach((address) => wasm.free(address));
  }
}

/** A copy of the numbers, in the module's memory. */
function put(take, Type, numbers) {
  const address = take(numbers.length * Type.BYTES_PER_ELEMENT);
  new Type(memory.buffer, address, numbers.length).set(numbers);
  return address;
}

const doubles = (address, values) => values.forEach((value, i) => data().setFloat64(address + 8 * i, value, true));
/** So many numbers, and no others. */
function vector(name, values, count = 3) {
  if (values?.length !== count || !Array.prototype.every.call(values, (value) => typeof value === "number")) {
    throw new HybmssError("invalid argument", `${name} = ${JSON.stringify(values)} is not allowed: it must be ${count} numbers`);
  }
  return Array.from(values);
}
/** A whole number below 2^bits. */
function whole(name, value, bits = 32) {
  if (!Number.isInteger(value) || value < 0 || value >= 2 ** bits) {
    throw new HybmssError("invalid argument", `${name} = ${value} is not allowed: it must be a whole number below 2^${bits}`);
  }
  return value;
}
const wholes = (name, values, bits) => Array.from(values, (value) => whole(name, value, bits));
const read = (address, count) => Array.from(new Float64Array(memory.buffer, address, count));

/** Numbers that the module has and the caller sees: `view` is made anew where memory has grown. */
class Block {
  constructor(Type, length) {
    this.Type = Type;
    this.length = length;
    this.address = allocate(length * Type.BYTES_PER_ELEMENT);
    this.seen = null;
    this.view.fill(0);
  }
  get view() {
    if (this.seen?.buffer !== memory.buffer) {
      this.seen = new this.Type(memory.buffer, this.address, this.length);
    }
    return this.seen;
  }
}

/** The address of a hybmss_field of x y z a node. */
function field(take, block, map) {
  const wide = block.Type === Float64Array;
  const step = wide ? 8 : 4;
  const { address } = block;
  const at = take(28);
  [wide ? 1 : 0, address, address + step, address + 2 * step, 3, block.length / 3, map?.address ?? 0].forEach(
    (value, i) => data().setUint32(at + 4 * i, value, true),
  );
  return at;
}

function choice(name, value, names) {
  const number = names.indexOf(value);
  if (number < 0) {
    throw new HybmssError(
      "invalid argument",
      `${name} = ${JSON.stringify(value)} is not allowed: it must be one of ${names.filter(Boolean).join(", ")}`,
    );
  }
  return number;
}

/** The keys of an object of options are known ones: a word misspelt is an error, not a default. */
function known(name, given, keys) {
  for (const key of Object.keys(given)) {
    if (!keys.includes(key)) {
      throw new HybmssError("invalid argument", `${name}.${key} is not known: there are ${keys.join(", ")}`);
    }
  }
}

const precisions = { float32: Float32Array, float64: Float64Array };
function typeOf(precision) {
  choice("precision", precision, Object.keys(precisions));
  return precisions[precision];
}

// ---- objects: what the module made for somebody

const forgotten = new FinalizationRegistry((release) => release());

class Handle {
  #release;
  #key = {};
  /** create(slot) calls the C function that writes the handle's address at `slot`. */
  constructor(kind, create) {
    this.blocks = [];
    const slot = allocate(4);
    try {
      create(slot);
      this.handle = data().getUint32(slot, true);
    } finally {
      wasm.free(slot);
    }
    const { handle, blocks } = this;
    this.#release = () => {
      wasm[`hybmss_${kind}_destroy`](handle);
      blocks.forEach((block) => wasm.free(block.address));
    };
    forgotten.register(this, this.#release, this.#key);
  }
  block(Type, length) {
    const made = new Block(Type, length);
    this.blocks.push(made);
    return made;
  }
  /** The address of the object; throws for one that was freed. */
  get at() {
    if (this.handle === 0) {
      throw new HybmssError("invalid argument", `this ${this.constructor.name} was freed`);
    }
    return this.handle;
  }
  free() {
    if (this.handle !== 0) {
      forgotten.unregister(this.#key);
      this.#release();
      this.handle = 0;
    }
  }
}

function number(handle, name, bytes = 4) {
  return withMemory((take) => {
    const at = take(8);
    call(name, handle, at);
    return bytes === 4 ? data().getUint32(at, true) : data().getFloat64(at, true);
  });
}

// ---- bodies

const volumeEnergies = ["automatic", "quadratic", "mean-stretch", "none"];
const materialKeys = [
  "youngModulus",
  "poissonRatio",
  "density",
  "faceDiagonalRatio",
  "volumeEnergy",
  "stiffening",
  "springs",
  "crush",
];

function writeMaterial(at, given = {}) {
  known("material", given, materialKeys);
  wasm.hybmss_default_material(at);
  const set = (offset, value) => value !== undefined && data().setFloat64(at + offset, value, true);
  set(0, given.youngModulus);
  set(8, given.poissonRatio);
  set(16, given.density);
  set(24, given.faceDiagonalRatio);
  data().setInt32(at + 32, choice("material.volumeEnergy", given.volumeEnergy ?? "automatic", volumeEnergies), true);
  set(40, given.stiffening?.quadratic);
  set(48, given.stiffening?.cubic);
  data().setInt32(at + 56, choice("material.springs", given.springs ?? "nodes", ["nodes", "means"]), true);
  set(64, given.crush?.resistance);
  set(72, given.crush?.ratio);
}

export class Lattice extends Handle {
  constructor(given) {
    ready();
    if (typeof given === "function") {
      super("body", given); // of a record, or less some cells
    } else {
      known("lattice", given, ["cells", "cellSize", "scales", "labels", "material", "materials"]);
      super("body", (slot) =>
        withMemory((take) => {
          const cells = put(take, Int32Array, vector("lattice.cells", given.cells));
          const materials = given.materials ?? [given.material];
          const material = take(80 * materials.length);
          materials.forEach((one, i) => writeMaterial(material + 80 * i, one));
          if (given.labels) {
            const labels = put(take, Uint8Array, wholes("label", given.labels, 8));
            call(
              "hybmss_lattice_create_of_materials",
              ...[cells, given.cellSize, labels, given.labels.length, material, materials.length, slot],
            );
          } else {
            const scales = given.scales ? put(take, Float32Array, given.scales) : 0;
            call("hybmss_lattice_create", cells, given.cellSize, scales, given.scales?.length ?? 0, material, slot);
          }
        }),
      );
    }
    this.nodeCount = number(this.at, "hybmss_body_node_count");
    this.cellCount = number(this.at, "hybmss_body_cell_count");
  }
  get restPositions() {
    this.rest ??= this.#filled(Float64Array, 3 * this.nodeCount, "hybmss_body_rest_positions");
    return this.rest.view;
  }
  get gridIndices() {
    this.grid ??= this.#filled(Uint32Array, this.nodeCount, "hybmss_body_grid_indices");
    return this.grid.view;
  }
  #filled(Type, length, name) {
    const block = this.block(Type, length);
    call(name, this.at, block.address, length);
    return block;
  }
  boundaryMesh() {
    return withMemory((take) => {
      const counts = take(8);
      call("hybmss_body_boundary_mesh", this.at, 0, counts, 0, counts + 4);
      const vertices = 3 * data().getUint32(counts, true);
      const triangles = 3 * data().getUint32(counts + 4, true);
      const x = take(8 * vertices);
      const t = take(4 * triangles);
      call("hybmss_body_boundary_mesh", this.at, x, counts, t, counts + 4);
      return {
        vertices: new Float64Array(memory.buffer, x, vertices).slice(),
        triangles: new Uint32Array(memory.buffer, t, triangles).slice(),
      };
    });
  }
  without(cells) {
    return new Lattice((slot) =>
      withMemory((take) =>
        call("hybmss_body_without_cells", this.at, put(take, Uint32Array, wholes("cell", cells)), cells.length, slot),
      ),
    );
  }
}

/** Explicit springs and cells. */
export class Network extends Handle {
  constructor(given) {
    ready();
    known("network", given, ["restPositions", "masses", "springs", "cells", "volumeEnergy"]);
    const { restPositions, masses, springs = { nodes: [], stiffness: [] }, cells = { nodes: [], kappa: [] } } = given;
    known("network.springs", springs, ["nodes", "stiffness", "restVectors"]);
    known("network.cells", cells, ["nodes", "kappa"]);
    const [nodes, springCount, cellCount] = [masses.length, springs.stiffness.length, cells.kappa.length];
    const long = (name, values, length) => {
      if (values.length !== length) {
        throw new HybmssError("invalid argument", `${name}: ${values.length} values given, ${length} needed`);
      }
    };
    long("network.restPositions", restPositions, 3 * nodes);
    long("network.springs.nodes", springs.nodes, 2 * springCount);
    long("network.springs.restVectors", springs.restVectors ?? { length: 3 * springCount }, 3 * springCount);
    long("network.cells.nodes", cells.nodes, 8 * cellCount);
    const ends = wholes("network.springs.nodes", springs.nodes, 31);
    const corners = wholes("network.cells.nodes", cells.nodes, 31);
    super("body", (slot) =>
      withMemory((take) => {
        const network = take(32);
        const [x, m] = [put(take, Float64Array, restPositions), put(take, Float64Array, masses)];
        const [s, c] = [take(40 * Math.max(springCount, 1)), take(40 * Math.max(cellCount, 1))];
        const view = data(); // nothing is allocated from here on
        [x, m, nodes, s, springCount, c, cellCount].forEach((value, i) => view.setUint32(network + 4 * i, value, true));
        view.setInt32(network + 28, choice("network.volumeEnergy", given.volumeEnergy ?? "quadratic", volumeEnergies), true);
        for (let i = 0; i < springCount; ++i) {
          const [a, b] = [ends[2 * i], ends[2 * i + 1]];
          view.setInt32(s + 40 * i, a, true);
          view.setInt32(s + 40 * i + 4, b, true);
          view.setFloat64(s + 40 * i + 8, springs.stiffness[i], true);
          for (let axis = 0; axis < 3; ++axis) {
            const between = springs.restVectors?.[3 * i + axis] ?? restPositions[3 * b + axis] - restPositions[3 * a + axis];
            view.setFloat64(s + 40 * i + 16 + 8 * axis, between, true);
          }
        }
        for (let i = 0; i < cellCount; ++i) {
          for (let corner = 0; corner < 8; ++corner) {
            view.setInt32(c + 40 * i + 4 * corner, corners[8 * i + corner], true);
          }
          view.setFloat64(c + 40 * i + 32, cells.kappa[i], true);
        }
        call("hybmss_network_create", network, slot);
      }),
    );
    this.nodeCount = number(this.at, "hybmss_body_node_count");
  }
}

// ---- plans and motion

const accuracies = ["accurate", "exact", "fast"];
/** Of those that the module was loaded with, all where nothing is said. */
function threadsOf({ threads: wanted = threads }) {
  if (!Number.isInteger(wanted) || wanted < 1 || wanted > threads) {
    throw new HybmssError(
      "invalid argument",
      `options.threads = ${wanted} is not allowed: the module was loaded with ${threads}, by load({ threads })`,
    );
  }
  return wanted;
}
function planOptions(take, given) {
  known("options", given, ["precision", "accuracy", "layout", "threads"]);
  const at = take(24);
  if (given.layout) {
    data().setUint32(at + 4, put(take, Uint8Array, new TextEncoder().encode(`${given.layout}\0`)), true);
  }
  data().setInt32(at + 8, choice("accuracy", given.accuracy ?? "accurate", accuracies), true);
  data().setInt32(at + 12, threadsOf(given), true);
  return at;
}

function planned(kind, lattice, options) {
  return (slot) =>
    withMemory((take) => {
      const wide = typeOf(options.precision ?? "float32") === Float64Array ? 1 : 0;
      call(`hybmss_${kind}_create`, lattice.at, wide, planOptions(take, options), slot);
    });
}

function pair(name, ...given) {
  return withMemory((take) => {
    const at = take(24);
    call(name, ...given, at, at + 8, ...(name === "hybmss_dynamics_energies" ? [at + 16] : []));
    return read(at, 3);
  });
}

export class ForcePlan extends Handle {
  constructor(lattice, options = {}) {
    ready();
    super("plan", planned("plan", lattice, options));
    const Type = typeOf(options.precision ?? "float32");
    this.nodeCount = lattice.nodeCount;
    this.u = this.block(Type, 3 * lattice.nodeCount);
    this.f = this.block(Type, 3 * lattice.nodeCount);
  }
  get displacements() {
    return this.u.view;
  }
  get forces() {
    return this.f.view;
  }
  addForces() {
    withMemory((take) => call("hybmss_plan_add_forces", this.at, field(take, this.u), field(take, this.f)));
  }
  energy() {
    const [springs, volume] = withMemory((take) => pair("hybmss_plan_energy", this.at, field(take, this.u)));
    return { springs, volume };
  }
  get criticalTimeStep() {
    return number(this.at, "hybmss_plan_critical_time_step", 8);
  }
  describe() {
    return withMemory((take) => {
      const length = take(4);
      call("hybmss_plan_describe", this.at, 0, 0, length);
      const capacity = data().getUint32(length, true) + 1;
      const words = take(capacity);
      call("hybmss_plan_describe", this.at, words, capacity, length);
      return text(words);
    });
  }
}

function writePose(at, pose = {}) {
  known("pose", pose, ["position", "rotation", "velocity", "angularVelocity"]);
  doubles(at, vector("pose.position", pose.position ?? [0, 0, 0]));
  doubles(at + 24, vector("pose.rotation", pose.rotation ?? [1, 0, 0, 0, 1, 0, 0, 0, 1], 9));
  doubles(at + 96, vector("pose.velocity", pose.velocity ?? [0, 0, 0]));
  doubles(at + 120, vector("pose.angularVelocity", pose.angularVelocity ?? [0, 0, 0]));
}

const shapes = ["plane", "sphere", "box", "capsule", "solid"];
const dimensionCounts = { sphere: 1, capsule: 2 };

export class Solid extends Handle {
  constructor({ points, vertices, triangles, cells = 0, heights, counts, spacing, ...rest }) {
    ready();
    known("solid", rest, []);
    super("solid", (slot) =>
      withMemory((take) => {
        if (points) {
          call("hybmss_solid_create_hull", put(take, Float64Array, points), points.length / 3, slot);
        } else if (heights) {
          const sizes = put(take, Uint32Array, wholes("solid.counts", vector("solid.counts", counts, 2)));
          if (heights.length !== counts[0] * counts[1]) {
            throw new HybmssError("invalid argument", `heights: ${heights.length} given, ${counts[0] * counts[1]} needed`);
          }
          const steps = put(take, Float64Array, vector("solid.spacing", spacing, 2));
          call("hybmss_solid_create_heights", put(take, Float64Array, heights), sizes, steps, slot);
        } else {
          const x = put(take, Float64Array, vertices);
          const t = put(take, Uint32Array, triangles);
          call("hybmss_solid_create_mesh", x, vertices.length / 3, t, triangles.length / 3, whole("solid.cells", cells), slot);
        }
      }),
    );
  }
}

function writeStep(at, given) {
  known("step", given, ["timeStep", "acceleration", "massDamping", "integrator"]);
  const { timeStep, acceleration = [0, 0, 0], massDamping = 0, integrator = "symplectic-euler" } = given;
  doubles(at, [timeStep, ...vector("step.acceleration", acceleration), massDamping]);
  data().setInt32(at + 40, choice("integrator", integrator, ["symplectic-euler", "leapfrog"]), true);
}

export class Dynamics extends Handle {
  /** `lent`: what a world lends, in place of a body of its own. */
  constructor(lattice, options = {}, lent = undefined) {
    ready();
    super("dynamics", lent ?? planned("dynamics", lattice, options));
    this.lattice = lattice;
    this.nodeCount = lattice.nodeCount;
    this.Type = typeOf(options.precision ?? "float32");
    this.parameters = this.block(Float64Array, 6);
    this.fields = {};
    this.obstacles = 0;
  }
  #field(name) {
    return (this.fields[name] ??= this.block(this.Type, 3 * this.nodeCount));
  }
  #get(name) {
    const block = this.#field(name);
    withMemory((take) => call(`hybmss_dynamics_get_${name}`, this.at, field(take, block)));
    return block.view;
  }
  #set(name, values) {
    const block = this.#field(name);
    if (values !== block.view) {
      if (values.length !== block.length) {
        throw new HybmssError(
          "invalid argument",
          `${name}: ${values.length} values given, ${block.length} needed: x y z a node`,
        );
      }
      block.view.set(values);
    }
    withMemory((take) => call(`hybmss_dynamics_set_${name}`, this.at, field(take, block)));
  }
  get displacements() {
    return this.#get("displacements");
  }
  set displacements(values) {
    this.#set("displacements", values);
  }
  get velocities() {
    return this.#get("velocities");
  }
  set velocities(values) {
    this.#set("velocities", values);
  }
  get forces() {
    return this.#get("forces");
  }
  get masses() {
    if (!this.m) {
      this.m = this.block(Float64Array, this.nodeCount);
    }
    call("hybmss_dynamics_masses", this.at, this.m.address, this.nodeCount);
    return this.m.view;
  }
  step(parameters, count = 1) {
    writeStep(this.parameters.address, parameters);
    call("hybmss_dynamics_step", this.at, this.parameters.address, BigInt(count));
  }
  prescribe(nodes) {
    this.#list("prescribe", nodes, 56, (at, given) => {
      known("prescribe", given, ["node", "axes", "displacement", "velocity"]);
      const { node, axes = 7, displacement = [0, 0, 0], velocity = [0, 0, 0] } = given;
      data().setUint32(at, whole("prescribe.node", node), true);
      data().setUint32(at + 4, whole("prescribe.axes", axes), true);
      doubles(at + 8, vector("prescribe.displacement", displacement));
      doubles(at + 32, vector("prescribe.velocity", velocity));
    });
  }
  load(loads) {
    this.#list("load", loads, 32, (at, { node, force, ...rest }) => {
      known("load", rest, []);
      data().setUint32(at, whole("load.node", node), true);
      doubles(at + 8, vector("load.force", force));
    });
  }
  moveObstacles(poses) {
    this.#list("move_obstacles", poses, 144, writePose);
  }
  #list(name, entries, bytes, write, ...before) {
    withMemory((take) => {
      const at = take(bytes * entries.length);
      entries.forEach((entry, i) => write(at + bytes * i, entry));
      call(`hybmss_dynamics_${name}`, this.at, ...before, at, entries.length);
    });
  }
  setObstacles(obstacles) {
    const write = (at, { shape, dimensions, solid, pose, friction = 0, stiffness = 0, frictionDelay = 0, ...more }) => {
      const { mass = 0, inertia = [0, 0, 0], ...rest } = more;
      known("obstacle", rest, []);
      data().setInt32(at, choice("obstacle.shape", shape, shapes), true);
      if (shape !== "solid") {
        doubles(at + 8, vector("obstacle.dimensions", dimensions, dimensionCounts[shape] ?? 3));
      }
      writePose(at + 32, pose);
      doubles(at + 176, [friction, stiffness, frictionDelay]);
      data().setUint32(at + 200, shape === "solid" ? (solid?.at ?? 0) : 0, true);
      doubles(at + 208, [mass, ...vector("obstacle.inertia", inertia)]);
    };
    this.#list("set_obstacles", obstacles, 240, write, this.lattice.at);
    this.obstacles = obstacles.length;
  }
  obstaclePoses() {
    return withMemory((take) => {
      const at = take(144 * this.obstacles);
      call("hybmss_dynamics_obstacle_poses", this.at, at, this.obstacles);
      return Array.from({ length: this.obstacles }, (_, i) => {
        const v = read(at + 144 * i, 18);
        const [position, velocity, angularVelocity] = [0, 12, 15].map((n) => v.slice(n, n + 3));
        return { position, rotation: v.slice(3, 12), velocity, angularVelocity };
      });
    });
  }
  obstacleReadings() {
    return withMemory((take) => {
      const at = take(136 * this.obstacles);
      call("hybmss_dynamics_obstacle_readings", this.at, at, this.obstacles);
      return Array.from({ length: this.obstacles }, (_, i) => {
        const v = read(at + 136 * i, 16);
        const [force, torque, impulse, angularImpulse] = [0, 3, 10, 13].map((n) => v.slice(n, n + 3));
        const [depth, greatestDepth, energy, dissipated] = v.slice(6, 10);
        const nodes = data().getUint32(at + 136 * i + 128, true);
        return { force, torque, nodes, depth, greatestDepth, energy, dissipated, impulse, angularImpulse };
      });
    });
  }
  removeCells(cells) {
    return withMemory((take) => {
      const removed = take(4);
      const list = put(take, Uint32Array, wholes("cell", cells));
      call("hybmss_dynamics_remove_cells", this.at, this.lattice.at, list, cells.length, removed);
      return data().getUint32(removed, true);
    });
  }
  dampSprings(stiffnessDamping) {
    call("hybmss_dynamics_damp_springs", this.at, stiffnessDamping);
  }
  energies() {
    const [springs, volume, kinetic] = pair("hybmss_dynamics_energies", this.at);
    return { springs, volume, kinetic };
  }
  get notFiniteAt() {
    return withMemory((take) => {
      const at = take(8);
      call("hybmss_dynamics_not_finite_at", this.at, at);
      return Number(data().getBigInt64(at, true));
    });
  }
  get criticalTimeStep() {
    return number(this.at, "hybmss_dynamics_critical_time_step", 8);
  }
}

// ---- skins and records

const inSpace = 0xffffffff;

/** Bodies that touch and are tied. */
export class World extends Handle {
  constructor(options = {}) {
    ready();
    known("options", options, ["precision", "threads"]);
    const precision = options.precision ?? "float32";
    const wide = typeOf(precision) === Float64Array ? 1 : 0;
    super("world", (slot) => call("hybmss_world_create", wide, threadsOf(options), slot));
    this.precision = precision;
    this.parameters = this.block(Float64Array, 6);
    this.bodies = [];
    this.contacts = 0;
  }
  add(lattice, { origin = [0, 0, 0], ...options } = {}) {
    const all = { ...options, precision: this.precision };
    const lent = (slot) =>
      withMemory((take) => {
        const low = put(take, Float64Array, vector("origin", origin));
        call("hybmss_world_add", this.at, lattice.at, planOptions(take, all), low, take(4), slot);
      });
    return this.bodies.push(new Dynamics(lattice, all, lent)) - 1;
  }
  place(body, pose) {
    withMemory((take) => {
      const at = take(144);
      writePose(at, pose);
      call("hybmss_world_place", this.at, body, at);
    });
  }
  removeCells(body, cells) {
    if (!(body in this.bodies)) {
      throw new HybmssError("invalid argument", `body ${body} is not there: the world has ${this.bodies.length}`);
    }
    return withMemory((take) => {
      const removed = take(4);
      const list = put(take, Uint32Array, wholes("cell", cells));
      const { at } = this.bodies[body].lattice;
      call("hybmss_world_remove_cells", this.at, body, at, list, cells.length, removed);
      return data().getUint32(removed, true);
    });
  }
  setContacts(contacts) {
    withMemory((take) => {
      const at = take(32 * contacts.length);
      contacts.forEach(({ first, second, friction = 0, stiffness = 0, frictionDelay = 0, ...rest }, i) => {
        known("contact", rest, []);
        data().setUint32(at + 32 * i, whole("contact.first", first), true);
        data().setUint32(at + 32 * i + 4, whole("contact.second", second), true);
        doubles(at + 32 * i + 8, [friction, stiffness, frictionDelay]);
      });
      call("hybmss_world_set_contacts", this.at, at, contacts.length);
    });
    this.contacts = contacts.length;
  }
  contactReadings() {
    return withMemory((take) => {
      const at = take(72 * this.contacts);
      call("hybmss_world_contact_readings", this.at, at, this.contacts);
      return Array.from({ length: this.contacts }, (_, i) => {
        const v = read(at + 72 * i, 8);
        const nodes = data().getUint32(at + 72 * i + 64, true);
        return { force: v.slice(0, 3), impulse: v.slice(3, 6), depth: v[6], greatestDepth: v[7], nodes };
      });
    });
  }
  attach(from, to, stiffness = Infinity) {
    return withMemory((take) => {
      const [f, t, attachment] = [take(32), take(32), take(4)];
      [from, to].forEach(({ body, point }, i) => {
        data().setUint32([f, t][i], body ?? inSpace, true);
        doubles([f, t][i] + 8, vector("point", point));
      });
      call("hybmss_world_attach", this.at, f, t, stiffness, attachment);
      return data().getUint32(attachment, true);
    });
  }
  moveAnchor(attachment, point) {
    withMemory((take) => call("hybmss_world_move_anchor", this.at, attachment, put(take, Float64Array, vector("point", point))));
  }
  attachmentForce(attachment) {
    return withMemory((take) => {
      const at = take(24);
      call("hybmss_world_attachment_force", this.at, attachment, at);
      return read(at, 3);
    });
  }
  detach(attachment) {
    call("hybmss_world_detach", this.at, attachment);
  }
  step(parameters, count = 1) {
    writeStep(this.parameters.address, parameters);
    call("hybmss_world_step", this.at, this.parameters.address, BigInt(count));
  }
  get criticalTimeStep() {
    return number(this.at, "hybmss_world_critical_time_step", 8);
  }
}

export class Skin extends Handle {
  constructor(lattice, mesh, { precision = "float32", map } = {}) {
    ready();
    super("skin", (slot) =>
      withMemory((take) => {
        const { vertices, triangles } = mesh;
        const x = put(take, Float64Array, vertices);
        const t = put(take, Uint32Array, triangles);
        const wide = typeOf(precision) === Float64Array ? 1 : 0;
        call("hybmss_skin_create", lattice.at, wide, x, vertices.length / 3, t, triangles.length / 3, 0, slot);
      }),
    );
    this.x = this.block(typeOf(precision), mesh.vertices.length);
    this.n = this.block(typeOf(precision), mesh.vertices.length);
    if (map) {
      vector("map", map, lattice.nodeCount);
      this.map = this.block(Uint32Array, map.length);
      this.map.view.set(wholes("map", map));
    }
  }
  update(dynamics) {
    dynamics.displacements; // as they are now
    if (this.map && this.map.view.some((node) => node >= dynamics.nodeCount)) {
      throw new HybmssError("invalid argument", `map names nodes that a body of ${dynamics.nodeCount} does not have`);
    }
    withMemory((take) => {
      const u = field(take, dynamics.fields.displacements, this.map);
      call("hybmss_skin_update", this.at, u, field(take, this.x), field(take, this.n));
    });
  }
  get positions() {
    return this.x.view;
  }
  get normals() {
    return this.n.view;
  }
}

export class Record extends Handle {
  constructor(words) {
    ready();
    const bytes = typeof words === "string" ? new TextEncoder().encode(words) : words;
    super("record", (slot) =>
      withMemory((take) => call("hybmss_record_parse", put(take, Uint8Array, bytes), bytes.length, slot)),
    );
    this.stateCount = number(this.at, "hybmss_record_state_count");
  }
  lattice() {
    return new Lattice((slot) => call("hybmss_record_body", this.at, slot));
  }
  readDisplacements(state, plan) {
    withMemory((take) => call("hybmss_record_displacements", this.at, state, field(take, plan.u)));
  }
  compareForces(state, plan) {
    return withMemory((take) => {
      const error = take(8);
      call("hybmss_record_compare_forces", this.at, state, field(take, plan.f), error);
      return data().getFloat64(error, true);
    });
  }
  compareEnergy(state, plan) {
    const { springs, volume } = plan.energy();
    return withMemory((take) => {
      const error = take(8);
      const wide = plan.u.Type === Float64Array ? 1 : 0;
      call("hybmss_record_compare_energy", this.at, state, wide, springs, volume, error);
      return data().getFloat64(error, true);
    });
  }
}

/** The version of the library, "major.minor.patch". */
export function version() {
  ready();
  return text(wasm.hybmss_version());
}
