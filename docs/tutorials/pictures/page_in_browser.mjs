// Takes a picture of a page of `filigree export --web` at a moment.
// Usage: node page_in_browser.mjs FOLDER OUT.png SECONDS [--size WxH] [--zoom TURNS] [--dark] [--panel]
// Needs node 20, Chromium and web/node_modules: scripts/setup tools
import { pathToFileURL } from 'node:url';
import { join, resolve } from 'node:path';
import { parseArgs } from 'node:util';
import { open_browser } from '../../../tests/exchange/browser.mjs';

const { positionals: [folder, out, seconds], values } = parseArgs({ allowPositionals: true, options: {
    size: { type: 'string', default: '960x600' }, zoom: { type: 'string', default: '0' }, dark: { type: 'boolean' }, panel: { type: 'boolean' } } });
const [width, height] = values.size.split('x').map(Number);
const browser = await open_browser();
try {
    const page = await browser.newPage({ viewport: { width, height } });
    await page.goto(pathToFileURL(join(resolve(folder), 'index.html')).href);
    await page.waitForFunction(() => window.filigree, null, { timeout: 120000 });
    if (await page.evaluate(() => filigree.is_playing)) await page.keyboard.press('Space');
    if (values.dark) await page.click('#theme');
    const is_open = await page.evaluate(() => document.getElementById('panel').open);
    if (is_open !== Boolean(values.panel)) await page.click('#panel summary');
    await page.mouse.move(width / 2, height / 2);
    for (let turn = 0; turn < Number(values.zoom); ++turn) await page.mouse.wheel(0, -100); // of the wheel, nearer
    await page.evaluate((time) => filigree.seek(time), Number(seconds));
    await page.waitForFunction(() => filigree.request === undefined, null, { timeout: 120000 });
    await page.screenshot({ path: out, timeout: 120000 });
} finally {
    await browser.close();
}
