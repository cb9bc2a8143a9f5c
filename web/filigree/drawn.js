// What engines draw of a model: one vertex for each pair of a vertex and its normal and UV.

/** The chosen points of an array, one behind another; null: all. 0xffffffff gives zeros. */
export function copyPoints(from, chosen, to) {
    if (!chosen) {
        to.set(from);
        return;
    }
    for (let k = 0; k < chosen.length; ++k)
        for (let i = 0; i < 3; ++i) to[3 * k + i] = chosen[k] === 0xffffffff ? 0 : from[3 * chosen[k] + i];
}

/** The vertices to draw: of each the model's vertex, normal and UV; null where these are all the same number. */
export function drawnVertices(model) {
    const { triangles, triangleNormals, triangleUvs } = model;
    if (!triangles) throw new Error("The model was opened without triangles, or has none.");
    if (!triangleNormals && !triangleUvs) return { corners: null, index: triangles.slice() };
    const made = new Map(), vertex = [], normal = [], uv = [];
    const index = new Uint32Array(triangles.length);
    for (let c = 0; c < triangles.length; ++c) {
        const v = triangles[c], n = triangleNormals ? triangleNormals[c] : v, t = triangleUvs ? triangleUvs[c] : v;
        const key = `${v} ${n} ${t}`;
        if (!made.has(key)) {
            made.set(key, vertex.length);
            vertex.push(v);
            normal.push(n);
            uv.push(t);
        }
        index[c] = made.get(key);
    }
    return { corners: { vertex, normal, uv }, index };
}

/** Their texture coordinates, 2 numbers each. */
export function drawnUvs(model, corners, count) {
    const uvs = new Float32Array(2 * count);
    for (let k = 0; k < count; ++k) {
        let t = corners ? corners.uv[k] : k;
        if (!model.triangleUvs && model.levelVertices) t = model.levelVertices[t];
        if (t !== 0xffffffff) uvs.set(model.uvs.subarray(2 * t, 2 * t + 2), 2 * k);
    }
    return uvs;
}

const MOST_SMALL_INDICES = 65536;

/**
 * The linear skin of the vertices to draw: four driver vertices and weights each, the fourth nothing. positions are of
 * the skin, not places at rest. normal: null without. reach: how far vertices rest from their driver vertices.
 */
export function drawnSkin(model, corners) {
    const { drivers, weights, points } = model.skin();
    const count = corners ? corners.vertex.length : model.info.vertices;
    const joint = new (model.info.driverVertices <= MOST_SMALL_INDICES ? Uint16Array : Float32Array)(4 * count);
    const weight = new Float32Array(4 * count), position = new Float32Array(3 * count);
    const normal = model.info.normals > 0 ? new Float32Array(3 * count) : null;
    const rest = restOf(model), driver = model.driverRest;
    let reach = 0;
    for (let k = 0; k < count; ++k) {
        const v = corners ? corners.vertex[k] : k, nearest = 3 * drivers[3 * v];
        for (let i = 0; i < 3; ++i) {
            joint[4 * k + i] = drivers[3 * v + i];
            weight[4 * k + i] = weights[3 * v + i];
        }
        reach = Math.max(reach, Math.hypot(...[0, 1, 2].map((i) => rest[3 * v + i] - driver[nearest + i])));
    }
    copyPoints(points, corners?.vertex, position);
    if (normal) copyPoints(model.normals, corners?.normal, normal);
    return { position, normal, joint, weight, count, reach };
}

/** Positions at rest; model.normals has the normals. */
function restOf(model) {
    return model.restore(model.driverRest.slice(), { gradients: restGradients(model) }).positions;
}

/** The gradients of a driver at rest: units. */
export function restGradients(model) {
    return Float32Array.from({ length: 9 * model.info.driverVertices }, (_, k) => (k % 9 % 4 === 0 ? 1 : 0));
}
