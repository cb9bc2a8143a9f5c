// Rapier moves a soft body, the runtime restores the detail: a soft ball falls onto the ground.
//   npm install filigree @dimforge/rapier3d-compat
//   node rapier_soft_body.mjs MODEL.fil
// The driver has to be closed: Rapier fills it with tetrahedra. Its particles lie around the driver, not on it, so an
// embedding carries the driver along.
import RAPIER from "@dimforge/rapier3d-compat";
import { Model } from "filigree";
import { Embedding } from "filigree/embedding";
import { readFileSync } from "node:fs";

await RAPIER.init();
const model = await Model.open(readFileSync(process.argv[2]), { normals: false });
const raised = (points) => points.map((x, k) => (k % 3 === 1 ? x + 2 : x));

const world = new RAPIER.World({ x: 0, y: -9.81, z: 0 });
world.createCollider(RAPIER.ColliderDesc.cuboid(10, 1, 10).setTranslation(0, -1, 0));
const description = RAPIER.SoftBodyDesc.volumetric(raised(model.driverRest), model.driverTriangles.slice(), 0.2);
description.setSoftness(12, 0.3);
const body = world.createSoftBody(description);
const embedding = new Embedding(raised(model.driverRest), body.particlePositions(), { cells: body.cells() });

let lowest = 0;
for (let frame = 0; frame < 120; ++frame) {
    world.step();
    embedding.follow(body.particlePositions()); // your simulator's arrays in
    model.restore(embedding.positions, { gradients: embedding.gradients }); // model.positions: vertices out
    lowest = model.positions.reduce((low, x, k) => (k % 3 === 1 ? Math.min(low, x) : low), Infinity);
}
console.log(`${model.info.vertices} vertices followed ${body.numParticles()} particles; ` +
    `the lowest is ${lowest.toFixed(3)} above the ground`);
if (!(lowest > -0.1 && lowest < 0.2)) process.exit(1); // it lies on the ground
