// A geometry of three.js that follows a model's driver. Restored on the processor, in WebAssembly.
import { BufferAttribute, BufferGeometry, DynamicDrawUsage } from "three";

/** One vertex for each pair of a vertex and its normal and UV, where corners have their own; else the model's. */
export class RestoredGeometry extends BufferGeometry {
    /** model: a Model that was opened with triangles. */
    constructor(model) {
        super();
        this.model = model;
        const { corners, index } = drawnVertices(model);
        this.corners = corners;
        const count = corners ? corners.vertex.length : model.info.vertices;
        this.setIndex(new BufferAttribute(index, 1));
        this.setAttribute("position", new BufferAttribute(new Float32Array(3 * count), 3).setUsage(DynamicDrawUsage));
        if (model.info.normals > 0)
            this.setAttribute("normal", new BufferAttribute(new Float32Array(3 * count), 3).setUsage(DynamicDrawUsage));
        if (model.uvs) this.setAttribute("uv", new BufferAttribute(drawnUvs(model, corners, count), 2));
        this.update(model.driverRest);
    }

    /** Restores for driver positions, and gradients where there are any. */
    update(driver, gradients = null) {
        const { model, corners } = this;
        model.restore(driver.slice(), { gradients });
        copyPoints(model.positions, corners?.vertex, this.attributes.position.array);
        this.attributes.position.needsUpdate = true;
        if (this.attributes.normal) {
            copyPoints(model.normals, corners?.normal, this.attributes.normal.array);
            this.attributes.normal.needsUpdate = true;
        }
        this.boundingBox = this.boundingSphere = null;
        return this;
    }
}

function copyPoints(from, chosen, to) {
    if (!chosen) {
        to.set(from);
        return;
    }
    for (let k = 0; k < chosen.length; ++k)
        for (let i = 0; i < 3; ++i) to[3 * k + i] = chosen[k] === 0xffffffff ? 0 : from[3 * chosen[k] + i];
}

/** The vertices to draw: of each the model's vertex, normal and UV; null where these are all the same number. */
function drawnVertices(model) {
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

function drawnUvs(model, corners, count) {
    const uvs = new Float32Array(2 * count);
    for (let k = 0; k < count; ++k) {
        let t = corners ? corners.uv[k] : k;
        if (!model.triangleUvs && model.levelVertices) t = model.levelVertices[t];
        if (t !== 0xffffffff) uvs.set(model.uvs.subarray(2 * t, 2 * t + 2), 2 * k);
    }
    return uvs;
}
