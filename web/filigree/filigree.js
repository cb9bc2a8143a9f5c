// Opens models of Filigree and restores them: the C runtime (runtime/filigree_rt.h) as WebAssembly. No dependency; works
// in browsers, workers and node. wasm.js is written by scripts/npm.
import { plain, simd } from "./wasm.js";

const FINEST = 0xffffffff;
const WITHOUT_NORMALS = 2, WITHOUT_TRIANGLES = 4, WITHOUT_FIT = 8; // flg_options.flags
const OPTIONS_BYTES = 28, INFO_BYTES = 96; // of flg_options and flg_info with pointers of 32 bits
const INFO = ["vertices", "normals", "normalSource", "triangles", "faces", "driverVertices", "driverTriangles", "levels",
    "level", "parts", "frames", "framesHaveGradients", "hasFit", "lanes"];
const SKIN_STEP = 16384; // vertices; their skin fits into the memory of a restore
const NORMAL_SOURCES = ["none", "vertex", "corner", "computed"];

function bytesOf(base64) {
    const text = atob(base64);
    const bytes = new Uint8Array(text.length);
    for (let k = 0; k < text.length; ++k) bytes[k] = text.charCodeAt(k);
    return bytes;
}

let compiled; // a promise: once for all models
function runtime() {
    compiled ??= (async () => {
        const fast = bytesOf(simd);
        return WebAssembly.compile(WebAssembly.validate(fast) ? fast : bytesOf(plain));
    })();
    return compiled;
}

/** An error of the runtime; `status` is flg_status. */
export class FiligreeError extends Error {
    constructor(status, message) {
        super(message);
        this.name = "FiligreeError";
        this.status = status;
    }
}

function floats(values, count, what) {
    if (!(values instanceof Float32Array)) throw new TypeError(`${what} has to be a Float32Array.`);
    if (values.length !== count)
        throw new FiligreeError(7, `${what} has ${values.length} numbers and the model needs ${count}.`);
    return values;
}

/** An opened model, in memory of its own: it is given back when nothing refers to the model any more. */
export class Model {
    #calls;
    #model;
    #file = 0; // in the model's memory, while it has frames
    #fileBytes = 0;
    #at = {}; // of arrays that do not move any more

    constructor(calls) {
        this.#calls = calls;
    }

    /** bytes: a plain model file, as ArrayBuffer or Uint8Array. */
    static async open(bytes, { level = FINEST, normals = true, triangles = true, fit = true } = {}) {
        const file = bytes instanceof Uint8Array ? bytes : new Uint8Array(bytes);
        const { exports } = await WebAssembly.instantiate(await runtime(), {});
        const model = new Model(exports);
        model.#open(file, level,
            (normals ? 0 : WITHOUT_NORMALS) | (triangles ? 0 : WITHOUT_TRIANGLES) | (fit ? 0 : WITHOUT_FIT));
        return model;
    }

    #take(bytes) {
        const at = this.#calls.malloc(Math.max(bytes, 1));
        if (at === 0) throw new FiligreeError(1, this.#text(1));
        return at;
    }
    #text(status) {
        const memory = new Uint8Array(this.#calls.memory.buffer);
        const at = this.#calls.flg_status_text(status);
        return new TextDecoder().decode(memory.subarray(at, memory.indexOf(0, at)));
    }
    #check(status) {
        if (status !== 0) throw new FiligreeError(status, this.#text(status));
    }
    #floats(at, count) {
        return new Float32Array(this.#calls.memory.buffer, at, count);
    }
    #indices(at, count) {
        return at === 0 ? null : new Uint32Array(this.#calls.memory.buffer, at, count);
    }

    #open(file, level, flags) {
        const calls = this.#calls;
        const at = this.#take(file.length), options = this.#take(OPTIONS_BYTES), info = this.#take(INFO_BYTES);
        new Uint8Array(calls.memory.buffer).set(file, at);
        new Uint32Array(calls.memory.buffer, options, 7).set([OPTIONS_BYTES, flags, level, 0, 0, 0, 0]);
        this.#check(calls.flg_open(at, file.length, options, info));
        this.#model = new Uint32Array(calls.memory.buffer, info, 1)[0];
        new Uint32Array(calls.memory.buffer, info, 1)[0] = INFO_BYTES;
        this.#check(calls.flg_get_info(this.#model, info));
        const numbers = new Uint32Array(calls.memory.buffer, info + 4, INFO.length);
        this.info = Object.fromEntries(INFO.map((name, k) => [name, numbers[k]]));
        const [framesPerSecond, ...origin] = new Float64Array(calls.memory.buffer, info + 64, 4);
        Object.assign(this.info, {
            framesPerSecond, origin,
            normalSource: NORMAL_SOURCES[this.info.normalSource],
            framesHaveGradients: this.info.framesHaveGradients !== 0,
            hasFit: this.info.hasFit !== 0,
        });
        this.uvs = this.#uvs(at, file.length, info);
        if (this.info.frames > 0) {
            this.#file = at;
            this.#fileBytes = file.length;
        } else {
            calls.free(at);
        }
        calls.free(options);
        calls.free(info);
        const { driverVertices, vertices, normals } = this.info;
        const sizes = { driver: 12 * driverVertices, gradients: 36 * driverVertices,
            pose: calls.flg_pose_bytes(this.#model), scratch: calls.flg_scratch_bytes(this.#model),
            matrices: 64 * driverVertices, positions: 12 * vertices, normals: 12 * normals };
        for (const name in sizes) this.#at[name] = this.#take(sizes[name]); // after this no memory grows
    }

    #uvs(file, size, room) {
        const calls = this.#calls;
        const name = this.#take(8);
        new Uint8Array(calls.memory.buffer).set(new TextEncoder().encode("uv.val\0\0"), name);
        let found = calls.flg_find_decoded(this.#model, name, 0, room, room + 4, room + 8); // of a packed model
        if (found !== 0) found = calls.flg_find_section(file, size, name, 0, room, room + 4, room + 8);
        calls.free(name);
        if (found !== 0) return null;
        const [at, bytes, count] = new Uint32Array(calls.memory.buffer, room, 3);
        return bytes === 8 ? this.#floats(at, 2 * count).slice() : null;
    }

    /** Where a restore leaves its results: views of the model's memory, the same arrays each time. */
    get positions() { return this.#floats(this.#at.positions, 3 * this.info.vertices); }
    get normals() { return this.#floats(this.#at.normals, 3 * this.info.normals); }

    get driverRest() { return this.#floats(this.#calls.flg_driver_rest(this.#model), 3 * this.info.driverVertices); }
    get driverTriangles() {
        return this.#indices(this.#calls.flg_driver_triangles(this.#model), 3 * this.info.driverTriangles);
    }
    get triangles() { return this.#indices(this.#calls.flg_triangles(this.#model), 3 * this.info.triangles); }
    get triangleUvs() { return this.#indices(this.#calls.flg_triangle_uvs(this.#model), 3 * this.info.triangles); }
    get triangleNormals() { return this.#indices(this.#calls.flg_triangle_normals(this.#model), 3 * this.info.triangles); }
    get triangleFaces() { return this.#indices(this.#calls.flg_triangle_faces(this.#model), this.info.triangles); }
    get levelVertices() { return this.#indices(this.#calls.flg_level_vertices(this.#model), this.info.vertices); }

    #setPose(driver, gradients) {
        const { driverVertices } = this.info;
        const at = this.#at;
        this.#floats(at.driver, 3 * driverVertices).set(floats(driver, 3 * driverVertices, "The driver"));
        if (gradients)
            this.#floats(at.gradients, 9 * driverVertices).set(floats(gradients, 9 * driverVertices, "The gradients"));
        this.#check(this.#calls.flg_set_pose(this.#model, at.driver, gradients ? at.gradients : 0, driverVertices, at.pose));
    }

    /** Restores the mesh where its driver is at `driver`. Results are in model.positions and model.normals. */
    restore(driver, { gradients = null, positions = true, normals = this.info.normals > 0 } = {}) {
        const at = this.#at;
        this.#setPose(driver, gradients);
        this.#check(this.#calls.flg_restore(this.#model, at.pose, positions ? at.positions : 0, normals ? at.normals : 0,
            at.scratch));
        if (positions instanceof Float32Array) floats(positions, 3 * this.info.vertices, "`positions`").set(this.positions);
        if (normals instanceof Float32Array) floats(normals, 3 * this.info.normals, "`normals`").set(this.normals);
        return this;
    }

    /** A restore as a linear skin, for vertex shaders: 3 driver vertices, 3 weights and a point for each vertex. */
    skin() {
        const { vertices } = this.info, at = this.#at.scratch;
        const drivers = new Uint32Array(3 * vertices), weights = new Float32Array(3 * vertices);
        const points = new Float32Array(3 * vertices);
        for (let first = 0; first < vertices; first += SKIN_STEP) {
            const count = Math.min(SKIN_STEP, vertices - first), bytes = 12 * count;
            this.#check(this.#calls.flg_skin(this.#model, first, count, at, at + bytes, at + 2 * bytes));
            drivers.set(this.#indices(at, 3 * count), 3 * first);
            weights.set(this.#floats(at + bytes, 3 * count), 3 * first);
            points.set(this.#floats(at + 2 * bytes, 3 * count), 3 * first);
        }
        return { drivers, weights, points };
    }

    /** The matrices of that skin in a pose: 16 numbers a driver vertex. A view, overwritten by the next call. */
    skinMatrices(driver, gradients = null) {
        this.#setPose(driver, gradients);
        this.#check(this.#calls.flg_skin_matrices(this.#model, this.#at.pose, this.#at.matrices));
        return this.#floats(this.#at.matrices, 16 * this.info.driverVertices);
    }

    /** The gradients that a pose without any is restored with. */
    estimateGradients(driver) {
        const { driverVertices } = this.info;
        const at = this.#at;
        this.#floats(at.driver, 3 * driverVertices).set(floats(driver, 3 * driverVertices, "The driver"));
        this.#check(this.#calls.flg_gradients(this.#model, at.driver, driverVertices, 0, driverVertices, at.gradients));
        return this.#floats(at.gradients, 9 * driverVertices).slice();
    }

    /** A pose of the file, in arrays of its own. */
    frame(k) {
        const { driverVertices, frames, framesHaveGradients } = this.info;
        const at = this.#at;
        if (!(k >= 0 && k < frames)) this.#check(8); // missing
        this.#check(this.#calls.flg_read_frame(this.#model, this.#file, this.#fileBytes, k, at.driver,
            framesHaveGradients ? at.gradients : 0));
        return {
            driver: this.#floats(at.driver, 3 * driverVertices).slice(),
            gradients: framesHaveGradients ? this.#floats(at.gradients, 9 * driverVertices).slice() : null,
        };
    }
}
