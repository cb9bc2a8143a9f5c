// Opens a page of `filigree export --web`, from disk and from a server, and uses it as a visitor would.
// Usage: node page.mjs FOLDER [--pictures FOLDER] [--key-frames] [--title TEXT]
// --key-frames: of a film whose faces change. --title: what the page has to be called, beside a logo.
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
async function visit(browser, url, { thorough, pictures, key_frames, title }) {
    const { page, foreign, complaints } = await watched_page(browser, new URL('.', url).href);
    const wrong = [];
    const check = (holds, sentence) => { if (!holds) wrong.push(sentence); };
    await page.goto(thorough ? `${url}?details` : url);
    await on_page.ready(page);
    check(await page.evaluate(() => document.getElementById('panel').open) === thorough, 'the panel is open without ?details, or closed with it');
    const failure = await on_page.failure(page);
    if (failure) return [...complaints, failure];

    const brand = await page.evaluate(() => {
        const logo = document.getElementById('logo');
        return { title: document.title, heading: document.querySelector('h1').textContent, logo: logo && logo.naturalWidth, scripts: document.scripts.length };
    });
    check(brand.title === brand.heading && brand.scripts <= 2, `the page calls itself ${JSON.stringify(brand)}`);
    if (title) check(brand.title === title, `its title is ${brand.title}`);
    if (title) check(brand.logo > 0, 'its logo is not to be seen');
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
    const room = await page.evaluate(() => {
        const { stage, model } = filigree, p = stage.centre.clone(), reach = [Infinity, -Infinity, Infinity, -Infinity];
        for (let i = 0; i < model.reached.length; i += 3) {
            p.fromArray(model.reached, i).project(stage.camera);
            const x = (0.5 + 0.5 * p.x) * innerWidth, y = (0.5 - 0.5 * p.y) * innerHeight;
            [x, -x, y, -y].forEach((value, k) => { reach[k] = k % 2 ? Math.max(reach[k], -value) : Math.min(reach[k], value); });
        }
        const { width, height } = stage.free, header = document.querySelector('header').offsetHeight;
        return { left: reach[0], right: width - reach[1], top: reach[2] - header, bottom: header + height - reach[3], across: (reach[1] - reach[0]) / width, upwards: (reach[3] - reach[2]) / height };
    });
    check(Math.min(room.left, room.right, room.top, room.bottom) > 0, `the motion leaves the picture: ${JSON.stringify(room)}`);
    check(Math.max(room.across, room.upwards) > 0.75, `the motion is small in the picture: ${JSON.stringify(room)}`);
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

/// What is to be seen while the model comes: its poster, and how much of it is there. Returns what went wrong.
async function wait_for(browser, base) {
    const { page } = await watched_page(browser, base), wrong = [];
    await page.goto(`${base}/index.html`, { waitUntil: 'commit' });
    const told = await page.waitForFunction(() => document.getElementById('loading-text')?.textContent.match(/ ([1-9][0-9]?) % of /)?.[1], null, { timeout: 60000 })
        .then((found) => found.jsonValue(), () => undefined);
    if (!told) wrong.push('how much of the model has come is not told');
    const poster = await page.evaluate(() => document.getElementById('poster')?.naturalWidth);
    if (poster !== 1200) wrong.push(`the poster is ${poster} pixels wide while the model comes`);
    await page.waitForFunction(() => window.filigree && !document.getElementById('poster') && !document.getElementById('loading'), null, { timeout: 60000 })
        .catch(() => wrong.push('the poster stays'));
    await page.close();
    return wrong;
}

/// Everything there is to check of one folder; returns what went wrong.
export async function check_page(folder, pictures, key_frames = false, title = '') {
    const browser = await open_browser();
    const server = await serve(folder);
    const broken = await serve(folder, { '/model.glb': Buffer.from('no model') });
    const slow = await serve(folder, {}, { rate: 1_000_000 });
    try {
        const from_disk = pathToFileURL(join(resolve(folder), 'index.html')).href;
        const wrong = await visit(browser, from_disk, { thorough: true, pictures, key_frames, title });
        if (key_frames) return wrong; // the rest is the same for all pages
        wrong.push(...await visit(browser, `${server.url}/index.html`, { thorough: false }));
        const { page } = await watched_page(browser, broken.url);
        await page.goto(`${broken.url}/index.html`);
        await on_page.ready(page);
        if (!/damaged/.test(await on_page.failure(page))) wrong.push('a damaged model is not told');
        wrong.push(...await wait_for(browser, slow.url));
        return wrong;
    } finally {
        await browser.close();
        server.close();
        broken.close();
        slow.close();
    }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
    const { positionals, values } = parseArgs({ allowPositionals: true, options: { pictures: { type: 'string' }, 'key-frames': { type: 'boolean' }, title: { type: 'string' } } });
    if (positionals.length !== 1) fail('page.mjs: name the folder of the page');
    const wrong = await check_page(positionals[0], values.pictures, values['key-frames'], values.title);
    if (wrong.length > 0) fail(wrong.join('\n'));
}
