// The file of a live page that the standing page makes of a mesh.
//   node site_page.mjs SITE.wasm MESH OPTIONS OUT.live      OPTIONS: JSON, of Maker.make
import { readFileSync, writeFileSync } from 'node:fs';
import { basename } from 'node:path';
import { Maker } from '../../web/site/maker.js';

const [code, mesh, options, out] = process.argv.slice(2);
const maker = await Maker.start(await WebAssembly.compile(readFileSync(code)));
maker.read(basename(mesh), readFileSync(mesh));
writeFileSync(out, maker.make(JSON.parse(options)));

// Bent and stretched it is restored as well as bent alone: the arc ends where the body ends.
if (!JSON.parse(options).pieces) {
  for (const stretch of [1, 1.3, 0.8]) {
    maker.bend([60, 0, 0, stretch]);
    const most = maker.measure().reduce((most, error) => Math.max(most, error), 0);
    if (!(most < 1e-4)) {
      console.error(`site: ${basename(mesh)}, bent by 60 degrees and stretched ${stretch} times, is off by ${most} of its diagonal`);
      process.exit(1);
    }
  }
}
