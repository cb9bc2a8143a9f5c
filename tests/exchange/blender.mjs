// Imports GLBs into Blender, plays them, and compares every vertex with a point cache of ours.
// Usage: node blender.mjs FILE.glb... REFERENCE.pc2 [--rate FRAMES_A_SECOND] [--limit 1e-5] [--frames 0,10]
// rate: of the PC2, 60 unless said; frames: all unless said. Frames between the file's keys are as far off as it says.
import { spawnSync } from 'node:child_process';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { fail, find_program, root, skip } from './tools.mjs';

const { positionals, values } = parseArgs({
    allowPositionals: true,
    options: { rate: { type: 'string', default: '60' }, limit: { type: 'string', default: '1e-5' },
        frames: { type: 'string' } },
});
if (positionals.length < 2) fail('blender.mjs: name GLBs and a PC2');
const blender = find_program('/usr/bin/blender', '/usr/local/bin/blender');
if (!blender) skip('blender is not installed; run scripts/setup');

const reference = positionals.pop();
for (const file of positionals) {
    const { status, stdout, stderr } = spawnSync(blender, ['-b', '--factory-startup', '--python-exit-code', '1', '-P',
        join(root, 'tests/exchange/blender.py'), '--', file, reference, values.rate, values.limit,
        ...(values.frames?.split(',') ?? [])], { encoding: 'utf8', maxBuffer: 1 << 26 });
    const compared = stdout.split('\n').filter((line) => line.startsWith('compared ')).map((line) => JSON.parse(line.slice(9)));
    if (compared.length > 0) {
        const worst = compared.reduce((a, b) => (b.largest > a.largest ? b : a));
        console.log(`${file}: ${worst.bones} bones, ${compared.length} frames of ${worst.vertices} vertices; `
            + `largest ${worst.largest.toExponential(2)} of the diagonal (frame ${worst.frame}, vertex ${worst.vertex}), `
            + `RMS there ${worst.rms.toExponential(2)}`);
    }
    if (status !== 0) fail(`${file}: ${stderr.trim() || stdout.trim().split('\n').slice(-8).join('\n')}`);
    if (compared.length === 0) fail(`${file}: no frame was compared`);
}
