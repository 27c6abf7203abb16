// The bodies to choose from, as cells of one grid.
import liverFile from "../../scenes/liver.npy";

export function cube(edge) {
  return { cells: [edge, edge, edge], cellSize: 0.2 / edge, filled: new Float32Array(edge ** 3).fill(1) };
}

/** The voxels of 8 mm of examples/scenes/liver.npy, looked up on a grid that is `finer` times as fine. */
export function liver(finer, cellSize = 0.008 / finer) {
  const shape = [28, 19, 18];
  const labels = liverFile.subarray(liverFile.length - shape[0] * shape[1] * shape[2]); // z fastest
  const cells = shape.map((n) => Math.round(n * finer));
  const filled = new Float32Array(cells[0] * cells[1] * cells[2]);
  let at = 0;
  for (let k = 0; k < cells[2]; ++k) {
    for (let j = 0; j < cells[1]; ++j) {
      for (let i = 0; i < cells[0]; ++i, ++at) {
        const [x, y, z] = [i, j, k].map((n, a) => Math.min(shape[a] - 1, Math.floor(((n + 0.5) / cells[a]) * shape[a])));
        filled[at] = labels[(x * shape[1] + y) * shape[2] + z] > 0 ? 1 : 0;
      }
    }
  }
  return { cells, cellSize, filled };
}

/**
 * A mesh's vertices drawn towards the middle of their neighbours and back out again by a little more (Taubin 1995), so
 * that steps vanish and the volume stays.
 */
export function smoothed({ vertices, triangles }, rounds) {
  const around = Array.from({ length: vertices.length / 3 }, () => new Set());
  for (let t = 0; t < triangles.length; ++t) {
    const next = t % 3 === 2 ? t - 2 : t + 1;
    around[triangles[t]].add(triangles[next]);
    around[triangles[next]].add(triangles[t]);
  }
  let x = vertices;
  for (let round = 0; round < 2 * rounds; ++round) {
    const share = round % 2 === 0 ? 0.5 : -0.53;
    const moved = new Float64Array(x.length);
    around.forEach((others, v) => {
      for (let c = 0; c < 3; ++c) {
        let mean = 0;
        for (const other of others) mean += x[3 * other + c];
        moved[3 * v + c] = x[3 * v + c] + share * (mean / others.size - x[3 * v + c]);
      }
    });
    x = moved;
  }
  return { vertices: x, triangles };
}
