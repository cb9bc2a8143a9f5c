// Opens the page that own_files.mjs makes of a painted tube, from disk and from a server: its coarsest level and its finest
// show the picture's stripes where they belong, and the other material's colour.
// Usage: node textured_page.mjs FOLDER [--pictures FOLDER] [--any]
// --any: another model; that every material with a picture shows one is all that is asked then.
import { mkdirSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { parseArgs } from 'node:util';
import { open_browser, serve } from './browser.mjs';
import { fail } from './tools.mjs';

const { values: options, positionals: [folder] } = parseArgs({
    allowPositionals: true,
    options: { pictures: { type: 'string' }, any: { type: 'boolean' } },
});
if (options.pictures) mkdirSync(options.pictures, { recursive: true });
const wrong = [];

/// In the page: the share of the pixels that has a colour, and where they are in the mean, from the left: 0 to 1.
function look() {
    const { stage } = window.filigree, gl = stage.renderer.getContext();
    const width = gl.drawingBufferWidth, height = gl.drawingBufferHeight, pixels = new Uint8Array(4 * width * height);
    stage.renderer.render(stage.scene, stage.camera);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    const found = { yellow: [0, 0], green: [0, 0], blue: [0, 0] };
    for (let i = 0; i < pixels.length; i += 4) {
        const [r, g, b] = pixels.subarray(i, i + 3);
        const name = r > 2 * b && g > 2 * b && r > 0.8 * g ? 'yellow' : g > 1.7 * r && g > 1.7 * b ? 'green' : b > 1.7 * r && b > 1.7 * g ? 'blue' : '';
        if (!name) continue;
        ++found[name][0];
        found[name][1] += (i / 4) % width;
    }
    return Object.fromEntries(Object.entries(found).map(([name, [count, sum]]) => [name,
        { share: count / (width * height), from_left: sum / count / width }]));
}

async function visit(browser, url, name) {
    const page = await browser.newPage({ viewport: { width: 660, height: 360 } });
    const check = (holds, sentence) => { if (!holds) wrong.push(`${name}: ${sentence}`); };
    page.on('console', (message) => { if (message.type() === 'error') wrong.push(`${name}: ${message.text()}`); });
    page.on('pageerror', (error) => wrong.push(`${name}: ${error.message}`));
    await page.goto(url);
    await page.waitForFunction(() => window.filigree, null, { timeout: 120000 });
    if (options.pictures) await page.screenshot({ path: join(options.pictures, `${name}-first.png`) });
    await page.waitForFunction(() => filigree.model.materials.pictures.length === 0, null, { timeout: 60000 });
    check(await page.evaluate(() => filigree.model.materials.all.some(({ map }) => map)), 'no material has a picture');
    await page.evaluate(() => { if (filigree.is_playing) filigree.toggle_play(); filigree.seek(0); filigree.pick_level(0); });
    await page.waitForFunction(() => filigree.model.is_whole && filigree.model.levels.length === filigree.model.table.length, null, { timeout: 240000 });
    for (const level of ['coarsest', 'finest', 'auto']) {
        await page.evaluate((level) => {
            if (level === 'auto') filigree.choose_again();
            else filigree.pick_level(level === 'finest' ? 0 : filigree.model.levels.length - 1);
        }, level);
        await page.waitForTimeout(300);
        if (options.pictures) await page.screenshot({ path: join(options.pictures, `${name}-${level}.png`) });
        if (options.any) continue;
        const { yellow, green, blue } = await page.evaluate(look);
        for (const [color, { share }] of Object.entries({ yellow, green, blue })) check(share > 0.004, `${level}: ${100 * share} % of the pixels are ${color}`);
        check(yellow.from_left > green.from_left + 0.04, `${level}: the stripes are not where they belong`);
    }
    await page.close();
}

const browser = await open_browser();
const server = await serve(folder), whole = await serve(folder, {}, { has_ranges: false });
try {
    await visit(browser, pathToFileURL(join(resolve(folder), 'index.html')).href, 'disk');
    await visit(browser, `${server.url}/index.html`, 'ranges');
    await visit(browser, `${whole.url}/index.html`, 'whole');
} finally {
    await browser.close();
    server.close();
    whole.close();
}
if (wrong.length > 0) fail(wrong.join('\n'));
