// Runs examples/blender/run.sh on a small mesh, and looks at what came out.
// Usage: node example.mjs PROGRAM FOLDER
import { spawnSync } from 'node:child_process';
import { mkdirSync, readFileSync, rmSync } from 'node:fs';
import { join } from 'node:path';
import { fail, find_program, root, skip } from './tools.mjs';

if (!find_program('/usr/bin/blender', '/usr/local/bin/blender')) skip('blender is not installed; run scripts/setup');
const [program, folder] = process.argv.slice(2);
const kFrames = 16, kFall = 11; // it lands in frame 8 or so

rmSync(folder, { recursive: true, force: true });
mkdirSync(folder, { recursive: true });
const mesh = join(folder, 'small.ply');
spawnSync(program, ['make', 'wavy-cube', '-o', mesh, '--resolution', '16', '--quiet']);
const { status, stdout, stderr } = spawnSync(join(root, 'examples/blender/run.sh'), [mesh, folder], {
    encoding: 'utf8',
    env: { ...process.env, FILIGREE: program, BASE: '60', FRAMES: String(kFrames), FRAME: String(kFall), WIDTH: '192',
        SAMPLES: '2' },
});
console.log(stdout);
if (status !== 0) fail(stderr);

const caches = ['driver.pc2', 'detail.pc2'].map((name) => {
    const bytes = readFileSync(join(folder, name));
    const points = bytes.readInt32LE(16), frames = bytes.readInt32LE(28);
    if (bytes.length !== 32 + 12 * points * frames || frames !== kFrames) fail(`${name}: ${frames} frames of ${points} points`);
    return Array.from({ length: frames }, (_, frame) => {
        let lowest = Infinity, highest = -Infinity;
        for (let i = 0; i < points; ++i) {
            const y = bytes.readFloatLE(32 + 12 * (points * frame + i) + 4);
            if (!Number.isFinite(y)) fail(`${name}: a position is not a number`);
            lowest = Math.min(lowest, y);
            highest = Math.max(highest, y);
        }
        return { lowest, highest };
    });
});
// The detail falls with the driver, to within its height; the driver stops on the ground, a drop below the mesh.
for (const [frame, { lowest }] of caches[0].entries())
    if (Math.abs(lowest - caches[1][frame].lowest) > 0.1) fail(`frame ${frame}: the detail is not where the driver is`);
const fall = caches[0][0].lowest - Math.min(...caches[0].map(({ lowest }) => lowest));
if (!(fall > 0.2 && fall < 0.6)) fail(`the driver falls by ${fall} where the ground is 0.35 below`);
if (readFileSync(join(folder, 'picture.png')).length < 2000) fail('the picture is empty');
console.log(`falls by ${fall.toFixed(3)}`);
