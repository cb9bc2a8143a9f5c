// A mesh of Babylon.js that follows a model's driver. Restored on the processor, in WebAssembly.
import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import { VertexData } from "@babylonjs/core/Meshes/mesh.vertexData.js";
import { copyPoints, drawnUvs, drawnVertices } from "./drawn.js";

/** One vertex for each pair of a vertex and its normal and UV, where corners have their own; else the model's. */
export class RestoredMesh extends Mesh {
    #corners;
    #positions;
    #normals = null;

    /** model: a Model that was opened with triangles. */
    constructor(name, model, scene) {
        super(name, scene);
        this.model = model;
        const { corners, index } = drawnVertices(model);
        const count = corners ? corners.vertex.length : model.info.vertices;
        this.#corners = corners;
        this.#positions = new Float32Array(3 * count);
        if (model.info.normals > 0) this.#normals = new Float32Array(3 * count);
        this.#restore(model.driverRest, null);
        const data = new VertexData();
        Object.assign(data, { positions: this.#positions, indices: index });
        if (this.#normals) data.normals = this.#normals;
        if (model.uvs) data.uvs = drawnUvs(model, corners, count);
        data.applyToMesh(this, true);
    }

    #restore(driver, gradients) {
        this.model.restore(driver.slice(), { gradients });
        copyPoints(this.model.positions, this.#corners?.vertex, this.#positions);
        if (this.#normals) copyPoints(this.model.normals, this.#corners?.normal, this.#normals);
    }

    /** Restores for driver positions, and gradients where there are any. */
    update(driver, gradients = null) {
        this.#restore(driver, gradients);
        this.updateVerticesData(VertexBuffer.PositionKind, this.#positions, true);
        if (this.#normals) this.updateVerticesData(VertexBuffer.NormalKind, this.#normals);
        return this;
    }
}
