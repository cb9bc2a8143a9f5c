// What follows a model in Babylon.js: vertices are drawn once for each normal and UV they have.
//   node babylon.mjs PACKAGE_FOLDER MODEL.fil...
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [folder, ...paths] = process.argv.slice(2);
const { Model } = await import(pathToFileURL(`${folder}/filigree.js`));
const { RestoredGeometry } = await import("filigree/babylon");
const { NullEngine } = await import("@babylonjs/core/Engines/nullEngine.js");
const { Mesh } = await import("@babylonjs/core/Meshes/mesh.js");
const { Scene } = await import("@babylonjs/core/scene.js");

function check(holds, what) {
    if (!holds) throw new Error(`babylon.mjs: not so: ${what}`);
}

const scene = new Scene(new NullEngine());
for (const path of paths) {
    const model = await Model.open(readFileSync(path));
    const geometry = new RestoredGeometry("restored", model, scene), mesh = new Mesh("restored", scene);
    geometry.applyToMesh(mesh);
    const narrow = mesh.getBoundingInfo().boundingBox.maximum.x;
    geometry.update(model.driverRest.map((x, k) => (k % 3 === 0 ? 2 * x : x)));
    const positions = mesh.getVerticesData("position"), normals = mesh.getVerticesData("normal"), uvs = mesh.getVerticesData("uv");
    const indices = mesh.getIndices();
    check(indices.length === 3 * model.info.triangles, "every triangle is drawn");
    for (let c = 0; c < indices.length; ++c) {
        const drawn = indices[c], v = model.triangles[c];
        const n = model.triangleNormals ? model.triangleNormals[c] : v, t = model.triangleUvs ? model.triangleUvs[c] : v;
        for (let i = 0; i < 3; ++i) {
            check(positions[3 * drawn + i] === model.positions[3 * v + i], "a corner has its vertex's place");
            check(normals[3 * drawn + i] === model.normals[3 * n + i], "and its normal");
        }
        if (uvs) check(uvs[2 * drawn] === model.uvs[2 * t] && uvs[2 * drawn + 1] === model.uvs[2 * t + 1], "and its UV");
    }
    check(mesh.getBoundingInfo().boundingBox.maximum.x > 1.5 * narrow, "its box moves with the driver");
}
process.exit(0); // the engine's timers would go on
