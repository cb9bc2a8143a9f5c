// The geometry of three.js follows a model: vertices are drawn once for each normal and UV they have.
//   node three.mjs PACKAGE_FOLDER MODEL.fil...
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [folder, ...paths] = process.argv.slice(2);
const { Model } = await import(pathToFileURL(`${folder}/filigree.js`));
const { RestoredGeometry } = await import(pathToFileURL(`${folder}/three.js`));

function check(holds, what) {
    if (!holds) throw new Error(`three.mjs: not so: ${what}`);
}

for (const path of paths) {
    const model = await Model.open(readFileSync(path));
    const geometry = new RestoredGeometry(model);
    const driver = model.driverRest.map((x, k) => (k % 3 === 0 ? 2 * x : x));
    geometry.update(driver);
    const { position, normal, uv } = geometry.attributes;
    check(geometry.index.count === 3 * model.info.triangles, "every triangle is drawn");
    for (let c = 0; c < geometry.index.count; ++c) {
        const drawn = geometry.index.array[c], v = model.triangles[c];
        const n = model.triangleNormals ? model.triangleNormals[c] : v, t = model.triangleUvs ? model.triangleUvs[c] : v;
        for (let i = 0; i < 3; ++i) {
            check(position.array[3 * drawn + i] === model.positions[3 * v + i], "a corner has its vertex's place");
            check(normal.array[3 * drawn + i] === model.normals[3 * n + i], "and its normal");
        }
        if (uv) check(uv.array[2 * drawn] === model.uvs[2 * t] && uv.array[2 * drawn + 1] === model.uvs[2 * t + 1],
            "and its UV");
    }
    check(position.version > 0, "the positions are uploaded");
    geometry.computeBoundingBox();
    const wide = geometry.boundingBox.max.x;
    geometry.update(model.driverRest);
    geometry.computeBoundingBox();
    check(wide > 1.5 * geometry.boundingBox.max.x, "it moves with the driver");
}
