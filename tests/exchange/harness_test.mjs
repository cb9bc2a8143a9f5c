// The scripts themselves: the validator passes a good file and notices a bad one.
// Usage: node harness_test.mjs FOLDER
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { made_skin } from './made_glb.mjs';
import { fail } from './tools.mjs';
import { validate } from './validate.mjs';

const folder = process.argv[2];
mkdirSync(folder, { recursive: true });
const written = (name, bytes) => {
    const file = join(folder, name);
    writeFileSync(file, bytes);
    return file;
};

const { glb } = made_skin();
const good = await validate(written('made.glb', glb));
if (good.errors + good.warnings > 0) fail('the validator finds fault with a good file');

const wrong_bounds = Buffer.from(glb.toString('latin1').replace('"max":[2]', '"max":[3]'), 'latin1');
if ((await validate(written('wrong_bounds.glb', wrong_bounds))).errors === 0) fail('wrong bounds were not noticed');
