/** What a model has; runtime/filigree_rt.h explains each field. */
export interface ModelInfo {
    vertices: number;
    normals: number;
    normalSource: "none" | "vertex" | "corner" | "computed";
    triangles: number;
    faces: number;
    driverVertices: number;
    driverTriangles: number;
    levels: number;
    level: number;
    parts: number;
    frames: number;
    framesHaveGradients: boolean;
    hasFit: boolean;
    lanes: number;
    framesPerSecond: number;
    origin: number[];
}

export interface OpenOptions {
    /** 0 (the driver) to info.levels - 1; unset: the finest. */
    level?: number;
    /** false: leave them out, to save memory and time. Default true. */
    normals?: boolean;
    triangles?: boolean;
    /** false: every pose needs gradients. Default true. */
    fit?: boolean;
}

export interface RestoreOptions {
    /** 9 numbers a driver vertex, column by column. Unset: estimated from the positions. */
    gradients?: Float32Array | null;
    /** false: not wanted. An array: the result is copied there as well. Default true. */
    positions?: boolean | Float32Array;
    normals?: boolean | Float32Array;
}

/** `status` is flg_status of runtime/filigree_rt.h. */
export class FiligreeError extends Error {
    readonly status: number;
}

/** An opened model. Its memory is given back when nothing refers to it. */
export class Model {
    private constructor();
    /** Opens a plain model file. Throws FiligreeError where it is damaged, newer, packed or too large. */
    static open(bytes: ArrayBuffer | Uint8Array, options?: OpenOptions): Promise<Model>;

    readonly info: ModelInfo;
    /** Views of the model's memory, where restore leaves its results; 3 numbers a point. */
    readonly positions: Float32Array;
    readonly normals: Float32Array;
    readonly driverRest: Float32Array;
    readonly driverTriangles: Uint32Array | null;
    readonly triangles: Uint32Array | null;
    readonly triangleUvs: Uint32Array | null;
    readonly triangleNormals: Uint32Array | null;
    readonly triangleFaces: Uint32Array | null;
    readonly levelVertices: Uint32Array | null;
    /** 2 numbers each; null where the model has none. */
    readonly uvs: Float32Array | null;

    /** Restores the mesh. driver: 3 numbers a driver vertex. Throws FiligreeError where an array has another length. */
    restore(driver: Float32Array, options?: RestoreOptions): this;
    /** 9 numbers a driver vertex: what restore uses where no gradients are given. */
    estimateGradients(driver: Float32Array): Float32Array;
    /**
     * A restore as a linear skin, for vertex shaders: vertex v goes to the sum over k = 0, 1, 2 of weights[3 v + k] *
     * matrix drivers[3 v + k] * (points of v, 1). 3 numbers a vertex each. Points are not rest positions.
     */
    skin(): { drivers: Uint32Array; weights: Float32Array; points: Float32Array };
    /** The matrices of the skin in a pose, 16 numbers a driver vertex, column by column: a view, overwritten later. */
    skinMatrices(driver: Float32Array, gradients?: Float32Array | null): Float32Array;
    /** A pose of the file, 0 to info.frames - 1. */
    frame(k: number): { driver: Float32Array; gradients: Float32Array | null };
}
