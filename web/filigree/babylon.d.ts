import { Mesh } from "@babylonjs/core/Meshes/mesh";
import { Scene } from "@babylonjs/core/scene";
import { Model } from "filigree";

/**
 * A mesh that follows a model's driver, restored in WebAssembly. Models are right-handed: set
 * scene.useRightHandedSystem, or scaling.z = -1.
 */
export class RestoredMesh extends Mesh {
    readonly model: Model;
    /** model: opened with triangles. */
    constructor(name: string, model: Model, scene: Scene);
    /** driver: 3 numbers a driver vertex. gradients: 9, or null: estimated. */
    update(driver: Float32Array, gradients?: Float32Array | null): this;
}
