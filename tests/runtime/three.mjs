// The geometry of three.js follows a model: vertices are drawn once for each normal and UV they have.
//   node three.mjs PACKAGE_FOLDER MODEL.fil...
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [folder, ...paths] = process.argv.slice(2);
const { Model } = await import(pathToFileURL(`${folder}/filigree.js`));
const { MeshDriver, RestoredGeometry } = await import(pathToFileURL(`${folder}/three.js`));
const THREE = await import("three");

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

// The driver as a mesh that an importer has split into triangles of their own, moved by a bone and a morph target.
const model = await Model.open(readFileSync(paths[0]));
const rest = model.driverRest.slice(), corners = [...model.driverTriangles].reverse();
const geometry = new THREE.BufferGeometry(), count = corners.length;
const places = new Float32Array(corners.flatMap((v) => [...rest.subarray(3 * v, 3 * v + 3)]));
geometry.setAttribute("position", new THREE.BufferAttribute(places, 3));
geometry.setAttribute("skinIndex", new THREE.BufferAttribute(new Uint16Array(4 * count), 4));
geometry.setAttribute("skinWeight", new THREE.BufferAttribute(Float32Array.from({ length: 4 * count }, (_, k) => (k % 4 === 0 ? 1 : 0)), 4));
geometry.morphAttributes.position = [new THREE.BufferAttribute(places.map((x, k) => (k % 3 === 1 ? x : 0)), 3)];
geometry.morphTargetsRelative = true;
const mesh = new THREE.SkinnedMesh(geometry, new THREE.MeshBasicMaterial()), bone = new THREE.Bone();
mesh.add(bone);
mesh.bind(new THREE.Skeleton([bone]));
const driver = new MeshDriver(model, mesh);
mesh.morphTargetInfluences[0] = 0.5;
bone.position.set(3, 0, 0);
bone.rotation.z = Math.PI / 2;
mesh.updateMatrixWorld(true);
mesh.skeleton.update();
driver.follow();
for (let v = 0; v < rest.length; v += 3) {
    const exact = [3 - 1.5 * rest[v + 1], rest[v], rest[v + 2]];
    check(exact.every((x, i) => Math.abs(x - driver.positions[v + i]) < 1e-6), "the driver is where the mesh is");
}
let message = "";
try {
    new MeshDriver(model, new THREE.Mesh(new THREE.BoxGeometry(), mesh.material));
} catch (error) {
    message = error.message;
}
check(/no vertex where driver vertex/.test(message), "another mesh is refused");
