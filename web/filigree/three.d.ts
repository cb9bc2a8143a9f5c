import { BufferGeometry } from "three";
import { Model } from "filigree";

/** A geometry that follows a model's driver, restored in WebAssembly. */
export class RestoredGeometry extends BufferGeometry {
    readonly model: Model;
    /** model: opened with triangles. */
    constructor(model: Model);
    /** driver: 3 numbers a driver vertex. gradients: 9, or null: estimated. */
    update(driver: Float32Array, gradients?: Float32Array | null): this;
}
