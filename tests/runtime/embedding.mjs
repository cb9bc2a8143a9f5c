// An embedding: exact for what it promises, and what it refuses.
//   node embedding.mjs PACKAGE_FOLDER
import { pathToFileURL } from "node:url";

const { Embedding } = await import(pathToFileURL(`${process.argv[2]}/embedding.js`));

function check(holds, what) {
    if (!holds) throw new Error(`embedding.mjs: not so: ${what}`);
}
let state = 1;
const random = () => (state = Math.imul(state, 1664525) + 1013904223) / 0x80000000;
const cloud = (count, size) => Float32Array.from({ length: 3 * count }, () => size * random());
const moved = (points, map) => {
    const out = new Float32Array(points.length);
    for (let k = 0; k < points.length; k += 3) out.set(map(points.subarray(k, k + 3)), k);
    return out;
};
const farthest = (a, b) => a.reduce((most, x, k) => Math.max(most, Math.abs(x - b[k])), 0);

const driver = cloud(50, 0.8), points = cloud(600, 1);
const embedding = new Embedding(driver, points);
check(farthest(embedding.follow(points).positions, driver) < 1e-6, "at rest the driver is at rest");

const affine = ([x, y, z]) => [2 * x - z + 1000, y + 0.5 * x, 0.3 * z - y];
embedding.follow(moved(points, affine));
check(farthest(embedding.positions, moved(driver, affine)) < 2e-4, "affine motions are exact, also far from the origin");
const columns = [2, 0.5, 0, 0, 1, -1, -1, 0, 0.3];
check(embedding.gradients.every((x, k) => Math.abs(x - columns[k % 9]) < 2e-3), "and their gradients, by columns");

const quadratic = ([x, y, z]) => [x + 0.4 * z * z, y - 0.3 * x * y, z + 0.2 * y * y];
embedding.follow(moved(points, quadratic));
check(farthest(embedding.positions, moved(driver, quadratic)) < 2e-6, "quadratic motions are exact");
for (let v = 0; v < 50; ++v) {
    const [x, y, z] = driver.subarray(3 * v, 3 * v + 3);
    const exact = [1, -0.3 * y, 0, 0, 1 - 0.3 * x, 0.4 * y, 0.8 * z, 0, 1];
    check(exact.every((value, k) => Math.abs(value - embedding.gradients[9 * v + k]) < 1e-5), "with their gradients");
}

// Two limbs that lie close: one moves, the driver of the other stays.
const limb = cloud(100, 1), both = new Float32Array(600);
both.set(limb);
both.set(moved(limb, ([x, y, z]) => [x + 0.1, y, z]), 300);
const cells = [];
for (const first of [0, 100]) for (let k = 0; k + 3 < 100; ++k) cells.push(...[0, 1, 2, 3].map((c) => first + k + c));
const apart = both.slice();
for (let k = 301; k < 600; k += 3) apart[k] += 5;
const onFirst = moved(limb.slice(0, 30), ([x, y, z]) => [x + 0.03, y, z]);
const linked = new Embedding(onFirst, both, { cells: Uint32Array.from(cells) });
check(farthest(linked.follow(apart).positions, onFirst) < 1e-6, "cells keep limbs apart");
check(farthest(new Embedding(onFirst, both).follow(apart).positions, onFirst) > 0.1, "without cells they are mixed");

const error = (call) => {
    try {
        call();
    } catch (caught) {
        return caught.message;
    }
    return "";
};
check(/40 points/.test(error(() => new Embedding(driver, points.slice(0, 60)))), "too few points are refused");
check(/one surface/.test(error(() => new Embedding(driver, moved(points, ([x, y]) => [x, y, 0])))), "and a flat cloud");
check(/one place/.test(error(() => new Embedding(new Float32Array(3), new Float32Array(300)))), "and points at one place");
check(/600 points, and 2 are/.test(error(() => embedding.follow(points.slice(0, 6)))), "and another number of points");
