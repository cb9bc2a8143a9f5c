import { Material } from "@babylonjs/core/Materials/material";
import { Geometry } from "@babylonjs/core/Meshes/geometry";
import { Mesh } from "@babylonjs/core/Meshes/mesh";
import { Scene } from "@babylonjs/core/scene";
import { Model } from "filigree";

/** A geometry that follows a model's driver, restored in WebAssembly: applyToMesh puts it onto a mesh. */
export class RestoredGeometry extends Geometry {
    readonly model: Model;
    /** model: opened with triangles. */
    constructor(id: string, model: Model, scene: Scene);
    /** driver: 3 numbers a driver vertex. gradients: 9, or null: estimated. */
    update(driver: Float32Array, gradients?: Float32Array | null): this;
}

/**
 * A mesh that is restored in the vertex shader, by Babylon's own skinning: with standard and PBR materials, and with
 * shadows. Each frame uploads 64 bytes a driver vertex. It is never culled; its bounding box follows the driver. Models
 * are right-handed: set scene.useRightHandedSystem, or scaling.z = -1.
 */
export class RestoredMesh extends Mesh {
    readonly model: Model;
    /** model: opened with triangles. material: not drawn yet; its normals are corrected. */
    constructor(name: string, model: Model, scene: Scene, material: Material);
    /** driver: 3 numbers a driver vertex. gradients: 9, or null: estimated. */
    update(driver: Float32Array, gradients?: Float32Array | null): this;
}

/** Makes a material turn the normals of any skin as they have to be under stretch: by the cofactor of the matrix. */
export function correctSkinNormals<M extends Material>(material: M): M;
