import { BufferGeometry, Material, Mesh, SkinnedMesh } from "three";
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

/** The driver as a mesh of three.js that moves: with a skin, with morph targets. */
export class MeshDriver {
    /**
     * mesh: has the driver's vertices at rest, at the same places but in any order, also split ones. Throws Error where
     * a driver vertex is missing. Cost: driver vertices times vertices of the mesh.
     */
    constructor(model: Model, mesh: Mesh);
    /** Where `follow` leaves the driver, in the mesh's own space: 3 numbers a driver vertex. */
    readonly positions: Float32Array;
    /** Reads where the mesh is now. Skinned meshes need their matrices up to date (scene.updateMatrixWorld). */
    follow(): this;
}
