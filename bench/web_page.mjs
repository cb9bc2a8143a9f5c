// Over a slow line: when a page's model is seen, when it is within a thousandth of its size, when all is there; as a
// stream and as a plain GLB.
// Usage: node web_page.mjs STREAM_PAGE GLB_PAGE [--rate BYTES_A_SECOND]     (10 Mbit/s unless said)
// The folders are those of `filigree export MODEL -o FOLDER/ --web`, with --stream and without.
import { statSync } from 'node:fs';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { open_browser, serve } from '../tests/exchange/browser.mjs';

const { values: { rate }, positionals: [stream, glb] } = parseArgs({
    allowPositionals: true, options: { rate: { type: 'string', default: '1250000' } } });

async function visit(browser, folder) {
    const server = await serve(folder, {}, { rate: Number(rate) });
    const page = await browser.newPage({ viewport: { width: 900, height: 600 } });
    await page.goto(`${server.url}/index.html`, { waitUntil: 'commit' });
    await page.waitForFunction(() => window.filigree, null, { timeout: 600000 });
    const first = await page.evaluate(() => performance.now() / 1000);
    let told = { arrivals: [{ seconds: first, error: 0 }], diagonal: 1 };
    if (await page.evaluate(() => filigree.model.is_stream === true)) {
        await page.evaluate(() => filigree.pick_level(0));
        await page.waitForFunction(() => filigree.model.is_whole && filigree.model.levels.length === filigree.model.table.length, null, { timeout: 600000 });
        told = await page.evaluate(() => {
            const { box } = filigree.model, size = box.getSize(box.min.clone());
            return { arrivals: filigree.model.arrivals, diagonal: size.length() };
        });
    }
    await page.close();
    server.close();
    const near = told.arrivals.find(({ error }) => error <= 1e-3 * told.diagonal);
    return { first: Math.min(first, told.arrivals.at(-1).seconds), near: Math.max(first, near.seconds), all: Math.max(first, told.arrivals.at(-1).seconds) };
}

const browser = await open_browser();
console.log(`${(8 * Number(rate)) / 1e6} Mbit/s   model          seen      within 1e-3   all`);
for (const [name, folder, file] of [['stream', stream, 'model.fil'], ['GLB', glb, 'model.glb']]) {
    const { first, near, all } = await visit(browser, folder);
    const size = `${(statSync(join(folder, file)).size / 1e6).toFixed(2)} MB`;
    console.log(`${name.padEnd(10)} ${size.padStart(10)} ${first.toFixed(1).padStart(10)} s ${near.toFixed(1).padStart(10)} s ${all.toFixed(1).padStart(8)} s`);
}
await browser.close();
