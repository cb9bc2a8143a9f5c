// A small skinned, animated GLB and the same animation as PC2, made from formulas: what the other scripts are tried
// with before they are believed.

const kRings = 25, kCoarse = 6, kAround = 12, kKeys = 7, kSeconds = 2;

/// A tube along y whose upper joint turns, moves and is stretched; the transforms of a key are a joint's T R S.
function upper_joint(key) {
    const u = key / (kKeys - 1), angle = 1.2 * Math.sin(Math.PI * u);
    return {
        translation: [0.3 * u, 1 + 0.2 * u, 0],
        rotation: [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)],
        scale: [1 + 0.5 * u, 1 - 0.4 * u, 1 + 0.1 * u],
    };
}

function transformed({ translation, rotation, scale }, [x, y, z]) {
    const [c, s] = [2 * rotation[3] ** 2 - 1, 2 * rotation[2] * rotation[3]];
    const [sx, sy, sz] = [x * scale[0], y * scale[1], z * scale[2]];
    return [c * sx - s * sy + translation[0], s * sx + c * sy + translation[1], sz + translation[2]];
}

/// { glb, pc2, vertices, keys, rate }: files as buffers. The frames of the PC2 are the keys. morphs: a target that swells
/// the tube, by a quarter at rest and more in the clip; the PC2 does not know it.
export function made_skin(morphs = false) {
    const positions = [], normals = [], joints = [], weights = [], triangles = [], coarse = [];
    for (let ring = 0; ring < kRings; ++ring) {
        const v = ring / (kRings - 1);
        for (let i = 0; i < kAround; ++i) {
            const a = (2 * Math.PI * i) / kAround;
            positions.push([0.4 * Math.cos(a), 2 * v, 0.4 * Math.sin(a)]);
            normals.push([Math.cos(a), 0, Math.sin(a)]);
            joints.push([0, v > 0 ? 1 : 0, 0, 0]);
            weights.push([1 - v, v, 0, 0]);
            if (ring === 0) continue;
            const [p, q] = [ring * kAround + i, ring * kAround + ((i + 1) % kAround)];
            const quad = (below) => [[p - below, p, q], [p - below, q, q - below]];
            triangles.push(...quad(kAround));
            if (ring % kCoarse === 0) coarse.push(...quad(kCoarse * kAround));
        }
    }
    const stored = Float32Array.from(positions.flat()), blend = Float32Array.from(weights.flat());
    const keys = Array.from({ length: kKeys }, (_, key) => key);
    const moves = keys.map(upper_joint);
    const numbers = (word) => Float32Array.from(moves.flatMap((move) => move[word]));

    const inverse_bind = [0, -1].flatMap((y) => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, y, 0, 1]);
    const parts = [
        [stored, 'VEC3', 5126, 34962, { min: axes(stored, Math.min), max: axes(stored, Math.max) }],
        [Float32Array.from(normals.flat()), 'VEC3', 5126, 34962],
        [Uint8Array.from(joints.flat()), 'VEC4', 5121, 34962],
        [blend, 'VEC4', 5126, 34962],
        [Uint16Array.from(triangles.flat()), 'SCALAR', 5123, 34963],
        [Float32Array.from(inverse_bind), 'MAT4', 5126],
        [Float32Array.from(keys.map((key) => (key * kSeconds) / (kKeys - 1))), 'SCALAR', 5126, undefined,
            { min: [0], max: [kSeconds] }],
        ...['translation', 'rotation', 'scale'].map((word) =>
            [numbers(word), word === 'rotation' ? 'VEC4' : 'VEC3', 5126]),
        [Uint16Array.from(coarse.flat()), 'SCALAR', 5123, 34963],
    ];
    if (morphs) {
        const swells = Float32Array.from(positions.flatMap(([x, y, z]) => [0.5 * x * y, 0, 0.5 * z * y]));
        parts.push([swells, 'VEC3', 5126, 34962, { min: axes(swells, Math.min), max: axes(swells, Math.max) }],
            [Float32Array.from(normals.flatMap(() => [0, -0.2, 0])), 'VEC3', 5126, 34962],
            [Float32Array.from(keys.map((key) => key / (kKeys - 1))), 'SCALAR', 5126]);
    }
    const target = morphs && { targets: [{ POSITION: 11, NORMAL: 12 }] };
    const weights_of = morphs && { weights: [0.25], extras: { targetNames: ['swell'] } };
    const attributes = { POSITION: 0, NORMAL: 1, JOINTS_0: 2, WEIGHTS_0: 3 };
    const paths = ['translation', 'rotation', 'scale'];
    return {
        glb: glb(parts, {
            scene: 0,
            scenes: [{ nodes: [0, 1] }],
            nodes: [{ mesh: 0, skin: 0, extensions: { MSFT_lod: { ids: [4] } } },
                { name: 'driver', children: [2, 3] }, {}, { translation: [0, 1, 0] }, { mesh: 1, skin: 0 }],
            extensionsUsed: ['MSFT_lod'],
            meshes: [4, 10].map((indices) => ({ primitives: [{ attributes, indices, material: 0, ...target }],
                ...weights_of })),
            materials: [{ pbrMetallicRoughness: { metallicFactor: 0, roughnessFactor: 0.7 } }],
            skins: [{ joints: [2, 3], inverseBindMatrices: 5, skeleton: 1 }],
            animations: [{
                channels: [...paths.map((path, i) => ({ sampler: i, target: { node: 3, path } })),
                    ...(morphs ? [{ sampler: 3, target: { node: 0, path: 'weights' } }] : [])],
                samplers: [...paths.map((_, i) => ({ input: 6, output: 7 + i })),
                    ...(morphs ? [{ input: 6, output: 13 }] : [])],
            }],
        }),
        pc2: pc2(moves.map((move) => positions.map((_, i) => {
            const p = stored.subarray(3 * i, 3 * i + 3), moved = transformed(move, [p[0], p[1] - 1, p[2]]);
            return moved.map((value, axis) => blend[4 * i] * p[axis] + blend[4 * i + 1] * value);
        }))),
        vertices: positions.length,
        keys: kKeys,
        rate: (kKeys - 1) / kSeconds,
    };
}

function axes(values, choose) {
    const bound = Array.from(values.subarray(0, 3));
    for (let i = 3; i < values.length; ++i) bound[i % 3] = choose(bound[i % 3], values[i]);
    return bound;
}

function glb(parts, json) {
    const components = { SCALAR: 1, VEC3: 3, VEC4: 4, MAT4: 16 };
    const accessors = [], bufferViews = [], pieces = [];
    let offset = 0;
    for (const [values, type, componentType, target, bounds] of parts) {
        const bytes = Buffer.from(values.buffer);
        accessors.push({ bufferView: bufferViews.length, componentType, type,
            count: values.length / components[type], ...bounds });
        bufferViews.push({ buffer: 0, byteOffset: offset, byteLength: bytes.length, ...(target && { target }) });
        pieces.push(padded(bytes, 0));
        offset += pieces.at(-1).length;
    }
    const data = Buffer.concat(pieces);
    const text = padded(Buffer.from(JSON.stringify({
        asset: { version: '2.0' }, ...json, accessors, bufferViews, buffers: [{ byteLength: data.length }] })), 0x20);
    const words = (...values) => Buffer.from(Uint32Array.from(values).buffer);
    return Buffer.concat([words(0x46546c67, 2, 28 + text.length + data.length), words(text.length, 0x4e4f534a), text,
        words(data.length, 0x004e4942), data]);
}

function padded(bytes, filler) {
    return Buffer.concat([bytes, Buffer.alloc(-bytes.length & 3, filler)]);
}

function pc2(frames) {
    const head = Buffer.alloc(32);
    head.write('POINTCACHE2\0', 'latin1');
    head.writeInt32LE(1, 12);
    head.writeInt32LE(frames[0].length, 16);
    head.writeFloatLE(0, 20);
    head.writeFloatLE(1, 24);
    head.writeInt32LE(frames.length, 28);
    return Buffer.concat([head, Buffer.from(Float32Array.from(frames.flat(2)).buffer)]);
}
