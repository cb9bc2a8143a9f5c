// What follows a model's driver in three.js: a mesh restored in the vertex shader, and a geometry restored on the
// processor, in WebAssembly.
import { Box3, BufferAttribute, BufferGeometry, DynamicDrawUsage, Vector3 } from "three";
import { copyPoints, drawnSkin, drawnUvs, drawnVertices, restGradients } from "./drawn.js";
import { DrivenMesh, DriverSkeleton } from "./three_skin.js";

export { correctSkinNormals } from "./three_skin.js";

const SAME_PLACE = 1e-3; // of the diagonal: files may hold rounded positions

/** Restored in the vertex shader: each frame uploads 64 bytes a driver vertex. */
export class RestoredMesh extends DrivenMesh {
    #reach; // of the mesh from its driver

    /** model: a Model that was opened with triangles. material: one of three.js, or an array of them. */
    constructor(model, material) {
        const { geometry, reach } = skinnedGeometry(model);
        super(geometry, material, new DriverSkeleton(model.info.driverVertices));
        this.model = model;
        this.#reach = reach;
        this.update(model.driverRest, model.info.hasFit ? null : restGradients(model));
    }

    /** Moves the mesh to where the driver is, with gradients where there are any. */
    update(driver, gradients = null) {
        this.skeleton.set(this.model.skinMatrices(driver.slice(), gradients));
        new Box3().setFromArray(driver).getBoundingSphere(this.boundingSphere);
        this.boundingSphere.radius += 2 * this.#reach; // twice: detail may be stretched
        return this;
    }
}

function skinnedGeometry(model) {
    const { corners, index } = drawnVertices(model);
    const { position, normal, joint, weight, count, reach } = drawnSkin(model, corners);
    const geometry = new BufferGeometry().setIndex(new BufferAttribute(index, 1));
    geometry.setAttribute("position", new BufferAttribute(position, 3)); // of the skin: the shader makes places of them
    if (normal) geometry.setAttribute("normal", new BufferAttribute(normal, 3));
    if (model.uvs) geometry.setAttribute("uv", new BufferAttribute(drawnUvs(model, corners, count), 2));
    geometry.setAttribute("skinIndex", new BufferAttribute(joint, 4));
    geometry.setAttribute("skinWeight", new BufferAttribute(weight, 4));
    return { geometry, reach };
}

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

/** The driver as a mesh of three.js that moves: with a skin, with morph targets. */
export class MeshDriver {
    #mesh;
    #vertices; // of the mesh, one for each driver vertex
    #place = new Vector3();

    /**
     * mesh: has the driver's vertices at rest, at the same places but in any order, also split ones, as importers leave
     * them.
     */
    constructor(model, mesh) {
        const rest = model.driverRest.slice(), { position } = mesh.geometry.attributes, count = rest.length / 3;
        const limit = SAME_PLACE * new Box3().setFromArray(rest).getSize(new Vector3()).length();
        this.#mesh = mesh;
        this.#vertices = new Uint32Array(count);
        /** Where `follow` leaves the driver, in the mesh's own space. */
        this.positions = rest;
        for (let v = 0; v < count; ++v) {
            let nearest = Infinity;
            for (let k = 0; k < position.count; ++k) {
                const x = position.getX(k) - rest[3 * v], y = position.getY(k) - rest[3 * v + 1];
                const z = position.getZ(k) - rest[3 * v + 2], distance = x * x + y * y + z * z;
                if (!(distance < nearest)) continue;
                nearest = distance;
                this.#vertices[v] = k;
            }
            if (!(nearest <= limit * limit))
                throw new Error(`The mesh has no vertex where driver vertex ${v} rests. Is it this model's driver, in its units?`);
        }
    }

    /** Reads where the mesh is now: then read `positions`. Skinned meshes need their matrices up to date. */
    follow() {
        this.#vertices.forEach((k, v) => this.#mesh.getVertexPosition(k, this.#place).toArray(this.positions, 3 * v));
        return this;
    }
}
