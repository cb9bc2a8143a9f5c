// A page's model from a server without ranges: whatever pieces it comes in, a byte is moved a few times and not once
// for each piece that came before. No browser; what a browser gives is made up here. Usage: node served_bytes_test.mjs
import { StreamFile } from '../../web/src/stream_file.js';
import { fail } from './tools.mjs';

/// A model file of one section of so many bytes, 0 1 2 ...
function file_of(size) {
    const bytes = new Uint8Array(72 + size), view = new DataView(bytes.buffer);
    bytes.set(new TextEncoder().encode('FILIGREE'));
    view.setUint32(8, 2, true);
    view.setUint32(12, 1, true);
    view.setBigUint64(16, BigInt(bytes.length), true);
    bytes.set(new TextEncoder().encode('numbers'), 32);
    view.setUint32(44, 1, true); // an item's bytes
    view.setBigUint64(48, 72n, true);
    view.setBigUint64(56, BigInt(size), true);
    for (let at = 0; at < size; ++at) bytes[72 + at] = at;
    return bytes;
}

/// What a read of the whole section moved, in bytes.
async function moved_bytes(size, piece, status) {
    const bytes = file_of(size);
    globalThis.location = { protocol: 'http:' };
    globalThis.fetch = async (url, { headers }) => {
        const [, begin, last] = headers.Range.match(/bytes=(\d+)-(\d+)/).map(Number);
        if (status === 206) return { status, arrayBuffer: async () => bytes.slice(begin, Math.min(last + 1, bytes.length)).buffer };
        let at = 0;
        const read = async () => at >= bytes.length ? { done: true }
            : { done: false, value: bytes.subarray(at, Math.min(at += piece, bytes.length)) };
        return { status, ok: true, body: { getReader: () => ({ read }) } };
    };
    const set = Uint8Array.prototype.set;
    let moved = 0;
    Uint8Array.prototype.set = function (from, ...rest) { // eslint-disable-line no-extend-native
        moved += from.length;
        return set.call(this, from, ...rest);
    };
    try {
        const file = await StreamFile.open();
        const section = await file.section('numbers');
        if (section.length !== size) fail(`a section of ${size} bytes has ${section.length}`);
        for (let k = 0; k < size; k += 997) if (section[k] !== k % 256) fail(`byte ${k} is wrong`);
    } finally {
        Uint8Array.prototype.set = set;
    }
    return moved;
}

for (const [size, piece, status] of [[8_000_000, 4096, 200], [8_000_000, 65536, 200], [1_000_000, 7, 200], [500, 3, 200], [8_000_000, 0, 206]]) {
    const moved = await moved_bytes(size, piece, status);
    console.log(`${size} bytes in pieces of ${piece} (${status}): ${(moved / size).toFixed(2)} times moved`);
    if (moved > 3 * (size + 72)) fail(`${size} bytes in pieces of ${piece} were moved ${(moved / size).toFixed(1)} times`);
}
