// As bytes.c, by the npm package: restores models and prints a sum over all bytes that come out.
//   node bytes.mjs PACKAGE_FOLDER MODEL.fil...
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [folder, ...paths] = process.argv.slice(2);
const { FiligreeError, Model } = await import(pathToFileURL(`${folder}/filigree.js`));

function addBytes(sum, array) { // FNV
    for (const byte of new Uint8Array(array.buffer, array.byteOffset, array.byteLength))
        sum = ((sum ^ BigInt(byte)) * 1099511628211n) & 0xffffffffffffffffn;
    return sum;
}

function any(k) {
    k = (k ^ 61) ^ (k >>> 16);
    k = Math.imul(k, 9);
    k ^= k >>> 4;
    k = Math.imul(k, 0x27d4eb2d);
    k ^= k >>> 15;
    return Math.fround(k | 0) / 2147483648;
}

for (const path of paths) {
    const model = await Model.open(readFileSync(path));
    const rest = model.driverRest.slice(), driver = new Float32Array(rest.length);
    let sum = 14695981039346656037n;
    for (let frame = 0; frame < 3; ++frame) {
        for (let k = 0; k < rest.length; ++k) driver[k] = Math.fround(rest[k] * (1 << frame)) + 0.0625 * any(k + 977 * frame);
        model.restore(driver);
        sum = addBytes(sum, model.positions);
        sum = addBytes(sum, model.normals);
    }
    console.log(sum.toString(16).padStart(16, "0"));
}

// What the package refuses, and what it hands out.
function check(holds, what) {
    if (!holds) throw new Error(`bytes.mjs: not so: ${what}`);
}
const file = readFileSync(paths[0]);
for (const [bytes, status] of [[file.subarray(0, 100), 3], [new ArrayBuffer(50), 2]]) {
    const error = await Model.open(bytes).catch((caught) => caught);
    check(error instanceof FiligreeError && error.status === status && error.message.endsWith("."), "damage has its status");
}
const model = await Model.open(file);
const { info } = model;
for (const [call, status] of [[() => model.restore(new Float32Array(3)), 7], [() => model.frame(info.frames), 8]]) {
    let error;
    try {
        call();
    } catch (caught) {
        error = caught;
    }
    check(error instanceof FiligreeError && error.status === status, `status ${status}`);
}
check(model.triangles.every((v) => v < info.vertices), "triangles have vertices that are there");
check(model.driverTriangles.every((v) => v < info.driverVertices), "and the driver's too");
const own = new Float32Array(3 * info.vertices);
const gradients = model.estimateGradients(model.driverRest.slice());
model.restore(model.driverRest.slice(), { gradients, positions: own, normals: false });
check(own.every((x, k) => x === model.positions[k]), "a given array is filled");
const coarse = await Model.open(file, { level: 0, normals: false, triangles: false, fit: false });
check(coarse.info.vertices === info.driverVertices && coarse.triangles === null && coarse.info.normals === 0,
    "options leave out what they say");
check(coarse.levelVertices.length === info.driverVertices, "a level has the vertices it is made of");
