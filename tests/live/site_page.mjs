// The file of a live page that the standing page makes of a mesh.
//   node site_page.mjs SITE.wasm MESH OPTIONS OUT.live      OPTIONS: JSON, of Maker.make
import { readFileSync, writeFileSync } from 'node:fs';
import { basename } from 'node:path';
import { Maker } from '../../web/site/maker.js';

const [code, mesh, options, out] = process.argv.slice(2);
const maker = await Maker.start(await WebAssembly.compile(readFileSync(code)));
maker.read(basename(mesh), readFileSync(mesh));
writeFileSync(out, maker.make(JSON.parse(options)));
