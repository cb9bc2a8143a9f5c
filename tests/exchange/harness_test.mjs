// The scripts themselves: each passes a good file and notices a bad one.
// Usage: node harness_test.mjs FOLDER
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { made_skin } from './made_glb.mjs';
import { check_comparison, compare_in_three, print_comparison } from './three.mjs';
import { fail } from './tools.mjs';
import { validate } from './validate.mjs';

const folder = process.argv[2];
mkdirSync(folder, { recursive: true });
const written = (name, bytes) => {
    const file = join(folder, name);
    writeFileSync(file, bytes);
    return file;
};

const { glb, pc2, rate } = made_skin();
const made = written('made.glb', glb);
const good = await validate(made);
if (good.errors + good.warnings > 0) fail('the validator finds fault with a good file');

const wrong_bounds = Buffer.from(glb.toString('latin1').replace('"max":[2]', '"max":[3]'), 'latin1');
if ((await validate(written('wrong_bounds.glb', wrong_bounds))).errors === 0) fail('wrong bounds were not noticed');

const exact = await compare_in_three(made, written('made.pc2', pc2), { rate });
print_comparison(made, exact);
check_comparison(exact, 2e-7);
const moved = Buffer.from(pc2);
moved.writeFloatLE(moved.readFloatLE(32 + 12 * 100) + 0.01, 32 + 12 * 100); // one vertex of the first frame
const noticed = await compare_in_three(made, written('moved.pc2', moved), { rate, frames: [0, 6], pictures: false });
print_comparison('moved.pc2', noticed);
if (noticed.frames[0].vertex !== 100 || !(noticed.frames[0].largest > 1e-3)) fail('a moved vertex was not noticed');
if (!(noticed.frames[1].largest < 2e-7)) fail('a frame that was not changed differs');
