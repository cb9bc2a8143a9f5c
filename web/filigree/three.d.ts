import { BufferGeometry, Material, SkinnedMesh } from "three";
import { Model } from "filigree";

/** A geometry that follows a model's driver, restored in WebAssembly. */
export class RestoredGeometry extends BufferGeometry {
    readonly model: Model;
    /** model: opened with triangles. */
    constructor(model: Model);
    /** driver: 3 numbers a driver vertex. gradients: 9, or null: estimated. */
    update(driver: Float32Array, gradients?: Float32Array | null): this;
}

/**
 * A mesh that is restored in the vertex shader, by three.js' own skinning: with any material, and with shadows. Each frame
 * uploads 64 bytes a driver vertex. It is never culled; its boundingSphere follows the driver.
 */
export class RestoredMesh extends SkinnedMesh {
    readonly model: Model;
    /** model: opened with triangles. */
    constructor(model: Model, material: Material | Material[]);
    /** driver: 3 numbers a driver vertex. gradients: 9, or null: estimated. */
    update(driver: Float32Array, gradients?: Float32Array | null): this;
}

/** Makes a material turn the normals of any skin as they have to be under stretch: by the cofactor of the matrix. */
export function correctSkinNormals<M extends Material>(material: M): M;
