// Opens a page of `filigree export --web`, from disk and from a server, and uses it as a visitor would.
// Usage: node page.mjs FOLDER [--pictures FOLDER] [--key-frames]
// --key-frames: of a film whose faces change.
// Fails where anything is asked of the network, the browser complains, the model is not to be seen, or a control does
// nothing.
import { mkdirSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL, fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';
import { open_browser, serve } from './browser.mjs';
import { fail } from './tools.mjs';

/// A page that is watched: what it asks for and what the browser complains of.
async function watched_page(browser, base, size = { width: 660, height: 360 }) {
    const page = await browser.newPage({ viewport: size });
    const foreign = [], complaints = [];
    page.on('request', (request) => {
        if (!request.url().startsWith(base) && !/^(data|blob):/.test(request.url())) foreign.push(request.url());
    });
    page.on('console', (message) => { if (message.type() === 'error') complaints.push(message.text()); });
    page.on('pageerror', (error) => complaints.push(error.message));
    return { page, foreign, complaints };
}

/// How many pixels of two pictures differ; `page` is any page, whose browser decodes them.
async function different_pixels(page, first, second) {
    return page.evaluate(async (pictures) => {
        const [a, b] = await Promise.all(pictures.map(async (text) => {
            const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
            const bitmap = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
            const canvas = new OffscreenCanvas(bitmap.width, bitmap.height), drawing = canvas.getContext('2d');
            drawing.drawImage(bitmap, 0, 0);
            return drawing.getImageData(0, 0, bitmap.width, bitmap.height).data;
        }));
        let count = 0;
        for (let i = 0; i < a.length; i += 4)
            if (Math.abs(a[i] - b[i]) + Math.abs(a[i + 1] - b[i + 1]) + Math.abs(a[i + 2] - b[i + 2]) > 6) ++count;
        return count;
    }, [first.toString('base64'), second.toString('base64')]);
}

const on_page = {
    ready: (page) => page.waitForFunction(
        () => window.filigree || !document.getElementById('failure').hidden, null, { timeout: 60000 }),
    failure: (page) => page.evaluate(() => document.getElementById('failure-cause').textContent),
    /// The picture alone, once it has come to rest.
    picture: async (page) => {
        await page.evaluate(() => new Promise((done) => {
            const wait = () => (window.filigree.request === undefined ? done() : setTimeout(wait, 20));
            wait();
        }));
        return page.screenshot({ style: 'header, footer, #panel { visibility: hidden }' });
    },
};

/// Whether the page would fetch a picture from elsewhere, as a model may ask it to.
async function asks_elsewhere(page) {
    return page.evaluate((elsewhere) => Promise.race([
        new Promise((refused) => {
            document.addEventListener('securitypolicyviolation', ({ blockedURI }) => blockedURI === elsewhere && refused(false));
            fetch(elsewhere).catch(() => {});
        }),
        new Promise((timeout) => setTimeout(() => timeout(true), 5000)),
    ]), 'http://127.0.0.1:9/picture.png');
}

/// Uses the page; returns what went wrong. thorough: every control, not only that the model is there and moves.
async function visit(browser, url, { thorough, pictures, key_frames }) {
    const { page, foreign, complaints } = await watched_page(browser, new URL('.', url).href);
    const wrong = [];
    const check = (holds, sentence) => { if (!holds) wrong.push(sentence); };
    await page.goto(url);
    await on_page.ready(page);
    const failure = await on_page.failure(page);
    if (failure) return [...complaints, failure];

    const model = await page.evaluate(() => ({
        levels: filigree.model.levels.length, duration: filigree.model.duration, has_driver: Boolean(filigree.driver),
        key_frames: filigree.model.key_frames.map(({ time, counts }) => ({ time, triangles: counts.triangles })) }));
    if (model.duration > 0) {
        await page.waitForFunction(() => filigree.time > 0, null, { timeout: 30000 });
        await page.click('#play');
        check(!(await page.evaluate(() => filigree.is_playing)), 'the button does not pause');
    }
    const leave = async () => {
        check(foreign.length === 0, `asks for ${foreign.join(' ')}`);
        check(complaints.length === 0, `the browser says: ${complaints.join('; ')}`);
        check(!(await asks_elsewhere(page)), 'asks other machines for what a model names');
        await page.close();
        return wrong;
    };
    if (!thorough) return leave();
    const seek = (seconds) => page.evaluate((time) => filigree.seek(time), seconds);
    await seek(0);
    const start = await on_page.picture(page);
    await page.evaluate(() => { filigree.model.scene.visible = false; filigree.draw(); });
    const empty = await on_page.picture(page);
    await page.evaluate(() => { filigree.model.scene.visible = true; filigree.draw(); });
    const covered = await different_pixels(page, start, empty);
    check(covered > 5000, `the model covers ${covered} pixels`);

    if (model.duration > 0) {
        await seek(0.6 * model.duration);
        const moved = await different_pixels(page, start, await on_page.picture(page));
        check(moved > 500, `playing changes ${moved} pixels`);
        await seek(0);
        await page.keyboard.press('ArrowRight');
        check(await page.evaluate(() => filigree.time > 0), 'the arrow key goes to no other key');
        await page.keyboard.press('Space');
        check(await page.evaluate(() => filigree.is_playing), 'the space bar does not play');
        await page.keyboard.press('Space');
        await seek(0);
    }
    check(model.key_frames.length > 2 === Boolean(key_frames), `has ${model.key_frames.length} key frames`);
    check(new Set(model.key_frames.map(({ triangles }) => triangles)).size > 1 === Boolean(key_frames), 'the faces do not change');
    for (const { time, triangles } of model.key_frames) { // each is drawn from its time on, and no other
        await seek(time);
        const now = await page.evaluate(() => ({
            seen: filigree.model.key_frames.filter(({ node }) => node.visible).map((key) => key.time),
            told: document.getElementById('summary').textContent }));
        check(now.seen.length === 1 && now.seen[0] === time, `at ${time} s the key frames of ${now.seen} s are seen`);
        check(now.told.startsWith(`${triangles.toLocaleString('en')} triangles`), `at ${time} s the page tells of ${now.told}`);
    }
    await seek(0);
    const triangles = [];
    for (let level = 0; level < model.levels && model.levels > 1; ++level) {
        await page.click(`#levels button:nth-child(${level + 1})`);
        triangles.push(await page.evaluate(() => { filigree.stage.draw(); return filigree.stage.renderer.info.render.triangles; }));
    }
    check(triangles.every((count, i) => i === 0 || count > triangles[i - 1]), `triangles drawn by level: ${triangles}`);
    await page.keyboard.press('9');
    for (const control of ['wireframe', ...(model.has_driver ? ['driver'] : [])]) {
        const before = await on_page.picture(page);
        await page.click(`label:has(#${control})`);
        const changed = await different_pixels(page, before, await on_page.picture(page));
        check(changed > 50, `the ${control} changes ${changed} pixels`);
        if (control === 'wireframe') await page.click('label:has(#wireframe)');
    }
    if (pictures) {
        mkdirSync(pictures, { recursive: true });
        await seek(0.5 * model.duration);
        await on_page.picture(page);
        await page.screenshot({ path: join(pictures, 'page.png') });
        await page.click('#theme');
        await page.setViewportSize({ width: 390, height: 780 });
        await page.click('#panel summary');
        await on_page.picture(page);
        await page.screenshot({ path: join(pictures, 'page_dark_phone.png') });
    }
    console.log(`${url}: ${covered} pixels of model; triangles drawn by level: ${triangles.join(' ') || 'one level'}`);
    return leave();
}

/// Everything there is to check of one folder; returns what went wrong.
export async function check_page(folder, pictures, key_frames = false) {
    const browser = await open_browser();
    const server = await serve(folder);
    const broken = await serve(folder, { '/model.glb': Buffer.from('no model') });
    try {
        const from_disk = pathToFileURL(join(resolve(folder), 'index.html')).href;
        const wrong = await visit(browser, from_disk, { thorough: true, pictures, key_frames });
        if (key_frames) return wrong; // the rest is the same for all pages
        wrong.push(...await visit(browser, `${server.url}/index.html`, { thorough: false }));
        const { page } = await watched_page(browser, broken.url);
        await page.goto(`${broken.url}/index.html`);
        await on_page.ready(page);
        if (!/damaged/.test(await on_page.failure(page))) wrong.push('a damaged model is not told');
        return wrong;
    } finally {
        await browser.close();
        server.close();
        broken.close();
    }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
    const { positionals, values } = parseArgs({ allowPositionals: true, options: { pictures: { type: 'string' }, 'key-frames': { type: 'boolean' } } });
    if (positionals.length !== 1) fail('page.mjs: name the folder of the page');
    const wrong = await check_page(positionals[0], values.pictures, values['key-frames']);
    if (wrong.length > 0) fail(wrong.join('\n'));
}
