import { Dynamics, Lattice, load } from "hybmss";

await load();
const bar = new Lattice({ cells: [4, 12, 4], cellSize: 0.01, material: { youngModulus: 1e4, poissonRatio: 0.45 } });
const body = new Dynamics(bar, { precision: "float32" });
const y = (node) => bar.restPositions[3 * node + 1];
const nodes = Array.from({ length: bar.nodeCount }, (_, node) => node);
body.prescribe(nodes.filter((node) => y(node) === 0.12).map((node) => ({ node })));

const parameters = { timeStep: 0.9 * body.criticalTimeStep, acceleration: [0, -9.81, 0], massDamping: 10 };
for (let frame = 0; frame < 120; ++frame) {
  body.step(parameters, 20);
  const u = body.displacements; // x y z a node, m: a view of the module's memory; draw it with what you have
  if (frame % 40 === 39) console.log(`the lower end hangs ${(-1000 * u[1]).toFixed(1)} mm lower`);
}
body.free();
bar.free();
