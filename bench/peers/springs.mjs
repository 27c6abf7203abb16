// A cube of cells as springs, each once, for engines that know nothing of cells; and the plain loops over them.

export const material = { youngModulus: 1e4, poissonRatio: 0.45, density: 1000 };
export const cellSize = 0.5;

// 3 edges, 6 face diagonals and 4 cube diagonals begin at a node, as steps along the grid.
const directions = [];
for (const z of [-1, 0, 1]) {
  for (const y of [-1, 0, 1]) {
    for (const x of [-1, 0, 1]) {
      if (z > 0 || (z === 0 && (y > 0 || (y === 0 && x > 0)))) directions.push([x, y, z]);
    }
  }
}

/** A disturbance of at most `strain` of a cell's edge, the same in every run. */
function trembling(count, strain) {
  let state = 1;
  return Float64Array.from({ length: count }, () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return strain * cellSize * (state / 2 ** 31 - 1);
  });
}

/** n^3 cells: springs a b, their stiffness (N/m, the shares of all cells around them), rest lengths; masses; positions. */
export function springCube(n) {
  const nodes = n + 1;
  const at = (x, y, z) => x + nodes * (y + nodes * z);
  const shear = material.youngModulus / (2 * (1 + material.poissonRatio));
  // A whole spring's stiffness by how many axes it goes along, and how many cells share it inside the body: with face
  // diagonals as stiff as cube diagonals.
  const whole = [0, 11 / 7, 3 / 7, 3 / 7].map((factor) => factor * shear * cellSize);
  const most = [8, 4, 2, 1];
  const cube = { n, rest: [], ends: [], stiffness: [], length: [], mass: [] };
  for (let z = 0; z < nodes; ++z) {
    for (let y = 0; y < nodes; ++y) {
      for (let x = 0; x < nodes; ++x) {
        const here = [x, y, z];
        cube.rest.push(...here.map((i) => cellSize * i));
        // Along an axis that a spring does not follow, cells lie on both sides but at the border.
        const sides = (followed) => here.reduce((cells, i, axis) => (followed[axis] || (i > 0 && i < n) ? cells * (followed[axis] ? 1 : 2) : cells), 1);
        cube.mass.push((material.density * cellSize ** 3 * sides([0, 0, 0])) / 8);
        for (const step of directions) {
          const there = here.map((i, axis) => i + step[axis]);
          if (there.some((i) => i < 0 || i > n)) continue;
          const axes = step.filter((s) => s !== 0).length;
          cube.ends.push(at(...here), at(...there));
          cube.stiffness.push((whole[axes] * sides(step)) / most[axes]);
          cube.length.push(cellSize * Math.sqrt(axes));
        }
      }
    }
  }
  cube.displacements = trembling(3 * cube.mass.length, 0.01);
  cube.positions = cube.displacements.map((u, i) => u + cube.rest[i]);
  return cube;
}

/** Plain loops over structures of arrays, in double: what people would write first in JavaScript. */
export class PlainSprings {
  constructor(cube, stiffness = cube.stiffness) {
    this.ends = Int32Array.from(cube.ends);
    this.stiffness = Float64Array.from(stiffness);
    this.length = Float64Array.from(cube.length);
    this.mass = Float64Array.from(cube.mass);
    this.positions = Float64Array.from(cube.positions);
    this.velocities = new Float64Array(this.positions.length);
    this.forces = new Float64Array(this.positions.length);
  }
  computeForces() {
    const { ends, stiffness, length, positions: x, forces: f } = this;
    f.fill(0);
    for (let s = 0; s < stiffness.length; ++s) {
      const a = 3 * ends[2 * s];
      const b = 3 * ends[2 * s + 1];
      const dx = x[b] - x[a];
      const dy = x[b + 1] - x[a + 1];
      const dz = x[b + 2] - x[a + 2];
      const tension = stiffness[s] * (1 - length[s] / Math.sqrt(dx * dx + dy * dy + dz * dz));
      f[a] += tension * dx;
      f[a + 1] += tension * dy;
      f[a + 2] += tension * dz;
      f[b] -= tension * dx;
      f[b + 1] -= tension * dy;
      f[b + 2] -= tension * dz;
    }
  }
  step(timeStep) {
    this.computeForces();
    const { mass, positions, velocities, forces } = this;
    for (let n = 0; n < mass.length; ++n) {
      for (let i = 3 * n; i < 3 * n + 3; ++i) {
        velocities[i] += (timeStep / mass[n]) * forces[i];
        positions[i] += timeStep * velocities[i];
      }
    }
  }
}

/** The greatest difference over the greatest value of the first. */
export function difference(expected, found) {
  if (expected.length !== found.length) return Infinity;
  let [greatest, apart] = [0, 0];
  for (let i = 0; i < expected.length; ++i) {
    greatest = Math.max(greatest, Math.abs(expected[i]));
    const d = Math.abs(expected[i] - found[i]);
    apart = Number.isFinite(d) ? Math.max(apart, d) : Infinity;
  }
  return apart / greatest;
}
