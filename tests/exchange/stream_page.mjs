// Opens a page of `filigree export --web --stream`, from disk, from a server with ranges and from one without.
// Usage: node stream_page.mjs FOLDER [--reference LAST.obj] [--pictures FOLDER] [--rate BYTES] [--json FILE]
// Fails where the browser complains, a level does not come, the animation stands still meanwhile, or what is shown is
// not what the whole file says. --reference: the last moment, restored by the program. --rate: bytes a second of the server; --json: when what was to be seen.
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { parseArgs } from 'node:util';
import { open_browser, serve } from './browser.mjs';
import { fail } from './tools.mjs';

const { values: options, positionals: [folder] } = parseArgs({
    allowPositionals: true,
    options: { reference: { type: 'string' }, pictures: { type: 'string' }, rate: { type: 'string' }, json: { type: 'string' } },
});
if (options.pictures) mkdirSync(options.pictures, { recursive: true });

async function visit(browser, url, name) {
    const page = await browser.newPage({ viewport: { width: 480, height: 320 } });
    const complaints = [], wrong = [];
    page.on('console', (message) => { if (message.type() === 'error') complaints.push(message.text()); });
    page.on('pageerror', (error) => complaints.push(error.message));
    const check = (holds, sentence) => { if (!holds) wrong.push(`${name}: ${sentence}`); };
    const start = Date.now();
    const seconds = () => (Date.now() - start) / 1000;
    await page.goto(url, { waitUntil: 'commit' });
    await page.waitForFunction(() => window.filigree || document.getElementById('failure')?.hidden === false, null, { timeout: 120000 });
    const failure = await page.evaluate(() => document.getElementById('failure').hidden ? '' : document.getElementById('failure-cause').textContent);
    if (failure) return { wrong: [`${name}: ${failure}`, ...complaints] };
    const seen = [{ seconds: seconds(), level: 1 }];
    if (options.pictures) await page.screenshot({ path: join(options.pictures, `${name}-first.png`) });

    const state = () => page.evaluate(() => ({
        arrived: filigree.model.arrived, of: filigree.model.table.length, bytes: filigree.model.bytes_read, all: filigree.model.bytes,
        shown: filigree.model.levels[filigree.model.level].vertices, time: filigree.time, chooses: filigree.model.chooses }));
    let now = await state();
    check(await page.evaluate(() => filigree.model.arrivals.length > 0), 'no level was there with the first picture');
    check(now.chooses, 'a level was chosen before anybody did');
    // Left alone, it takes what is to be seen at this distance; asked for the finest level, it takes all.
    await page.waitForFunction(() => filigree.wake || filigree.model.is_whole, null, { timeout: 120000 });
    seen.push({ seconds: seconds(), level: (await state()).arrived, what: 'nothing finer is seen' });
    if (options.pictures) await page.screenshot({ path: join(options.pictures, `${name}-enough.png`) });
    const before = await state();
    await page.evaluate(() => filigree.pick_level(0));
    await page.waitForFunction(() => filigree.model.is_whole && filigree.model.levels.length === filigree.model.table.length, null, { timeout: 240000 });
    now = await state();
    seen.push({ seconds: seconds(), level: now.arrived, what: 'all' });
    check(now.bytes > 0.9 * now.all, 'the file has not been read');
    const plays = await page.waitForFunction((time) => !filigree.model.duration || filigree.time !== time, before.time,
        { timeout: 10000 }).then(() => true, () => false);
    check(plays, 'the animation stands still');

    const told = await page.evaluate(() => {
        const { model } = filigree, [{ meshes: [mesh] }] = model.levels;
        if (filigree.is_playing) filigree.toggle_play();
        filigree.seek(model.duration);
        const arrivals = model.arrivals, used = new Set(mesh.geometry.index.array), low = [1e9, 1e9, 1e9], high = [-1e9, -1e9, -1e9];
        const p = mesh.position.clone(), sums = [0, 0, 0, 0, 0, 0];
        for (const v of used) {
            mesh.getVertexPosition(v, p);
            [p.x, p.y, p.z].forEach((x, k) => { low[k] = Math.min(low[k], x); high[k] = Math.max(high[k], x); sums[k] += x; sums[k + 3] += x * x; });
        }
        return { arrivals, vertices: used.size, triangles: mesh.geometry.index.count / 3, low, high, means: sums.map((sum) => sum / used.size),
                 memory: performance.memory?.usedJSHeapSize, decoder: model.decoder.calls.memory.buffer.byteLength };
    });
    if (options.pictures) {
        await page.evaluate(() => { filigree.model.chooses = true; filigree.draw(); });
        await page.waitForTimeout(1500);
        await page.screenshot({ path: join(options.pictures, `${name}-last.png`) });
        await page.keyboard.press('w');
        await page.keyboard.press('d');
        await page.keyboard.press('3');
        await page.waitForTimeout(1500);
        await page.screenshot({ path: join(options.pictures, `${name}-coarse.png`) });
    }
    await page.close();
    return { wrong: [...wrong, ...complaints.map((text) => `${name}: ${text}`)], told, seen };
}

const browser = await open_browser();
const visits = [];
try {
    const disk = pathToFileURL(join(resolve(folder), 'index.html')).href;
    if (!options.rate) visits.push(await visit(browser, disk, 'disk'));
    for (const has_ranges of [true, false]) {
        const server = await serve(folder, {}, { rate: Number(options.rate) || undefined, has_ranges });
        visits.push(await visit(browser, `${server.url}/index.html`, has_ranges ? 'ranges' : 'whole'));
        server.close();
    }
} finally {
    await browser.close();
}
/// Vertices in another order have the same box, means and mean squares.
function far_from_reference(told, name) {
    const points = readFileSync(options.reference, 'utf8').split('\n').filter((line) => line.startsWith('v '))
        .map((line) => line.split(/\s+/).slice(1, 4).map(Number));
    const size = Math.hypot(...told.high.map((x, k) => x - told.low[k])), wrong = [];
    const compare = (what, is, should, most) => {
        if (!(Math.abs(is - should) <= most)) wrong.push(`${name}: ${what} is ${is} and should be ${should}`);
    };
    for (let k = 0; k < 3; ++k) {
        const axis = points.map((p) => p[k]), mean = axis.reduce((a, b) => a + b, 0) / axis.length;
        compare('the mean', told.means[k], mean, 1e-4 * size);
        compare('the mean square', told.means[k + 3], axis.reduce((a, b) => a + b * b, 0) / axis.length, 2e-4 * size * size);
        compare('the lowest', told.low[k], axis.reduce((a, b) => Math.min(a, b)), 1e-3 * size);
        compare('the highest', told.high[k], axis.reduce((a, b) => Math.max(a, b)), 1e-3 * size);
    }
    return wrong;
}

const shape_of = ({ told }) => JSON.stringify({ ...told, arrivals: 0, memory: 0, decoder: 0 });
const wrong = visits.flatMap((one) => one.wrong), [first, ...others] = visits;
for (const other of others)
    if (shape_of(first) !== shape_of(other)) wrong.push('two ways to read it give two models');
if (options.reference && first.told) wrong.push(...far_from_reference(first.told, 'reference'));
if (options.json) writeFileSync(options.json, JSON.stringify(visits.map(({ seen, told }) => ({ seen, told })), null, 2));
console.log(JSON.stringify(visits.map(({ seen, told }) => ({ seen, told })), null, 1));
if (wrong.length > 0) fail(wrong.join('\n'));
