// Plays GLBs in three.js, in a browser without a window, and compares every vertex with a point cache of ours.
// Usage: node three.mjs FILE.glb... REFERENCE.pc2 [--rate FRAMES_A_SECOND] [--frames 0,10,20] [--limit 1e-5] [--no-pictures]
// rate: of the PC2, 60 unless said. frames: which to compare, five spread over all unless said; the limit is for each.
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';
import { open_browser, serve } from './browser.mjs';
import { fail, require, root } from './tools.mjs';

/// Compares. { frames: [{ frame, largest, rms, different, covered }], ... }, distances as fractions of the diagonal of
/// the reference's first frame: the mesh at rest may be in other units.
export async function compare_in_three(glb, pc2, { rate = 60, frames, pictures = true } = {}) {
    const { outputFiles } = await require('esbuild').build({
        entryPoints: [join(root, 'tests/exchange/three_probe.js')], bundle: true, format: 'iife', globalName: 'probe',
        nodePaths: [join(root, 'web/node_modules')], write: false, logLevel: 'error',
    });
    const browser = await open_browser();
    const server = await serve(undefined, {
        '/': Buffer.from('<!doctype html><title>probe</title><script src="probe.js"></script>'),
        '/probe.js': Buffer.from(outputFiles[0].contents),
        '/model.glb': glb,
        '/reference.pc2': pc2,
    });
    try {
        const page = await browser.newPage();
        const complaints = [];
        page.on('console', (message) => {
            if (['error', 'warning'].includes(message.type()) && !/favicon|GPU stall|WebGL-0x/.test(message.text() + message.location().url))
                complaints.push(message.text());
        });
        await page.goto(server.url);
        const model = await page.evaluate(() => probe.load('model.glb'));
        const reference = await page.evaluate(() => probe.load_reference('reference.pc2'));
        if (model.vertices < reference.points)
            throw new Error(`the file has ${model.vertices} vertices, the reference ${reference.points}`);
        frames ??= [0, 1, 2, 3, 4].map((i) => Math.round((i * (reference.frames - 1)) / 4));
        const compared = [];
        for (const frame of frames) {
            const moment = { frame, seconds: frame / rate };
            const result = await page.evaluate((at) => probe.compare(at.frame, at.seconds), moment);
            if (pictures)
                Object.assign(result, await page.evaluate((at) => probe.compare_pictures(at.frame, at.seconds), moment));
            compared.push({ ...result, frame, largest: result.largest / reference.diagonal,
                rms: result.rms / reference.diagonal });
        }
        if (complaints.length > 0) throw new Error(`the browser says: ${complaints.join('; ')}`);
        return { ...model, points: reference.points, frames: compared };
    } finally {
        await browser.close();
        server.close();
    }
}

export function print_comparison(name, { vertices, triangles, joints, points, frames }) {
    console.log(`${name}: ${vertices} vertices, ${triangles} triangles, ${joints} joints; ${points} vertices compared`);
    for (const { frame, largest, rms, vertex, covered, different } of frames) {
        const picture = covered === undefined ? '' : `; ${different} of ${covered} pixels differ`;
        console.log(`  frame ${frame}: largest ${largest.toExponential(2)} of the diagonal (vertex ${vertex}), `
            + `RMS ${rms.toExponential(2)}${picture}`);
    }
}

/// Fails where a frame is further off than the limit, or its picture shows it. A pixel whose centre lies on an edge to
/// within rounding may fall to either side.
export function check_comparison({ frames }, limit, pictures = true) {
    if (frames.length === 0) fail('no frame was compared');
    for (const { frame, largest, covered, different } of frames) {
        if (!(largest <= limit)) fail(`frame ${frame}: ${largest.toExponential(2)} is above ${limit}`);
        if (!pictures) continue;
        if (!(covered >= 1000)) fail(`frame ${frame}: only ${covered} pixels are covered`);
        if (!(different <= 0.005 * covered)) fail(`frame ${frame}: ${different} of ${covered} pixels differ`);
    }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
    const { positionals, values } = parseArgs({
        allowPositionals: true,
        options: { rate: { type: 'string', default: '60' }, frames: { type: 'string' },
            limit: { type: 'string', default: '1e-5' }, 'no-pictures': { type: 'boolean', default: false } },
    });
    if (positionals.length < 2) fail('three.mjs: name GLBs and a PC2');
    const reference = positionals.pop();
    for (const file of positionals) {
        const compared = await compare_in_three(file, reference, {
            rate: Number(values.rate),
            frames: values.frames?.split(',').map(Number),
            pictures: !values['no-pictures'],
        });
        print_comparison(file, compared);
        check_comparison(compared, Number(values.limit), !values['no-pictures']);
    }
}
