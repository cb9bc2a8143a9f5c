// Opens a live page in headless Chromium, from a server and from disk, and uses it as a visitor would: the body falls, a
// mouse pulls it, buttons drop it again and slow it down, and a tilted phone turns its gravity.
// Usage: node page.mjs FOLDER [PICTURE.png]
// Fails where anything is asked of the network, the browser complains, nothing moves, or a control does nothing.
import { cpSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { open_browser, serve } from '../exchange/browser.mjs';
import { fail } from '../exchange/tools.mjs';

const [folder, picture] = process.argv.slice(2);
const kSize = { width: 480, height: 300 };
const wrong = [];
const check = (holds, sentence) => { if (!holds) wrong.push(sentence); };

async function open_page(browser, url, options = {}) {
  const context = await browser.newContext({ viewport: kSize, ...options }), page = await context.newPage();
  const base = new URL('.', url).href;
  page.on('request', (request) => {
    if (!request.url().startsWith(base) && !/^(data|blob):/.test(request.url())) wrong.push(`asks for ${request.url()}`);
  });
  page.on('console', (message) => { if (message.type() === 'error' && !/elsewhere|Content Security Policy/.test(message.text())) wrong.push(`console: ${message.text()}`); });
  page.on('pageerror', (error) => wrong.push(`error: ${error.message}`));
  await page.goto(url);
  await page.waitForFunction(() => window.filigree || !document.getElementById('failure').hidden, null, { timeout: 60000 });
  return { page, failure: await page.evaluate(() => document.getElementById('failure-cause').textContent) };
}
/// Once the simulation has gone on by so many seconds.
const seconds = (page, more) => page.evaluate((more) => new Promise((done) => {
  const until = (window.filigree.simulated ?? 0) + more;
  const wait = () => ((window.filigree.simulated ?? 0) >= until ? done() : setTimeout(wait, 5));
  wait();
}), more);
/// The middle of all drivers in the picture's axes, and where that is on the screen.
const middle = (page) => page.evaluate(() => {
  const { live, stage } = window.filigree, at = live.body_box().getCenter(live.scene.position.clone());
  const seen = at.clone().project(stage.camera);
  return { x: at.x, y: at.y, z: at.z, left: (seen.x + 1) / 2 * innerWidth, top: (1 - seen.y) / 2 * innerHeight };
});
/// Pixels that differ from the picture without bodies.
async function body_pixels(page) {
  const show = (visible) => page.evaluate((visible) => new Promise((done) => {
    for (const { mesh } of window.filigree.live.bodies) mesh.visible = visible;
    requestAnimationFrame(() => requestAnimationFrame(done));
  }), visible);
  const [with_bodies, without] = [await page.screenshot(), (await show(false), await page.screenshot())];
  await show(true);
  return page.evaluate(async (pictures) => {
    const [a, b] = await Promise.all(pictures.map(async (text) => {
      const bitmap = await createImageBitmap(await (await fetch(`data:image/png;base64,${text}`)).blob());
      const drawing = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
      drawing.drawImage(bitmap, 0, 0);
      return drawing.getImageData(0, 0, bitmap.width, bitmap.height).data;
    }));
    let count = 0;
    for (let i = 0; i < a.length; i += 4) if (Math.abs(a[i] - b[i]) + Math.abs(a[i + 1] - b[i + 1]) > 12) ++count;
    return count;
  }, [with_bodies, without].map((bytes) => bytes.toString('base64')));
}

/// Everything a mouse can do.
async function use(page) {
  const start = await middle(page);
  await seconds(page, 0.2);
  const fallen = await middle(page);
  check(fallen.y < start.y - 0.05, 'the body does not fall');
  check(await body_pixels(page) > 500, 'the body is not to be seen');

  await page.keyboard.press('r');
  await page.waitForFunction((y) => Math.abs(window.filigree.live.body_box().getCenter(window.filigree.live.scene.position.clone()).y - y) < 0.3, start.y);
  await page.click('#slow');
  check(await page.getAttribute('#slow', 'aria-pressed') === 'true', 'slow motion is not on');
  check(await page.evaluate(() => window.filigree.speed) < 0.2, 'slow motion does not slow down');
  await page.click('#slow');

  await page.keyboard.press('Space'); // so that the body is where the mouse goes, however slow this machine is
  await page.evaluate(() => new Promise((done) => { setTimeout(() => requestAnimationFrame(done), 100); }));
  const held = await middle(page);
  await page.mouse.move(held.left, held.top);
  await page.mouse.down();
  check(await page.evaluate(() => window.filigree.hand !== undefined), 'the mouse takes hold of nothing');
  await page.keyboard.press('Space');
  await page.mouse.move(held.left + 70, held.top - 40, { steps: 4 });
  await seconds(page, 0.25);
  const pulled = await middle(page);
  check(pulled.left > held.left + 8, 'a pull to the right does not move the body to the right');
  if (picture) writeFileSync(picture, await page.screenshot());
  await page.mouse.up();
  check(await page.evaluate(() => window.filigree.hand === undefined && window.filigree.stage.controls.enabled), 'letting go does nothing');

  const camera = () => page.evaluate(() => window.filigree.stage.camera.position.toArray().join());
  const before = await camera();
  await page.mouse.move(20, 150);
  await page.mouse.down();
  await page.mouse.move(90, 170, { steps: 3 });
  await page.mouse.up();
  check(await camera() !== before, 'a drag beside the body does not turn the view');

  await page.keyboard.press('Space');
  await page.waitForTimeout(150);
  const paused = await page.evaluate(() => window.filigree.simulated);
  await page.waitForTimeout(150);
  check(await page.evaluate(() => window.filigree.simulated) === paused, 'a pause does not pause');
  await page.keyboard.press('Space');
  check(await page.isVisible('#details') && /\d/.test(await page.textContent('#details')), 'details are not shown');
  const policy = await page.evaluate(() => fetch('http://127.0.0.1:9/elsewhere').then(() => 'answered', () => 'refused'));
  check(policy === 'refused', 'the page may ask others');
}

/// A phone that is held upright, then tilted to the right.
async function tilt(browser, url) {
  const { page, failure } = await open_page(browser, url, { hasTouch: true, isMobile: true });
  if (failure) return check(false, failure);
  check(await page.isVisible('#tilt'), 'there is no button for tilting');
  check(!await page.isVisible('#details'), 'details are shown to everybody');
  await page.click('#tilt');
  const hold = (beta, gamma) => page.evaluate(([beta, gamma]) => {
    dispatchEvent(new DeviceOrientationEvent('deviceorientation', { alpha: 0, beta, gamma }));
  }, [beta, gamma]);
  await hold(90, 0);
  await hold(45, 60);
  await seconds(page, 0.1);
  const gravity = await page.evaluate(() => window.filigree.tilt.told.toArray());
  check(Math.abs(Math.hypot(...gravity) - 9.81) < 1e-3, `a tilt changes the size of gravity: ${gravity}`);
  check(gravity[0] > 2, `a tilt to the right does not pull to the right: ${gravity}`);
  await page.context().close();
}

const server = await serve(folder), browser = await open_browser();
const copy = mkdtempSync(join(tmpdir(), 'filigree-live-'));
try {
  const served = await open_page(browser, `${server.url}/?details`);
  if (served.failure) wrong.push(served.failure);
  else await use(served.page);
  await served.page.context().close();
  await tilt(browser, `${server.url}/`);

  cpSync(resolve(folder), copy, { recursive: true });
  rmSync(join(copy, 'model.live')); // from disk the script holds it
  const from_disk = await open_page(browser, pathToFileURL(join(copy, 'index.html')).href);
  check(!from_disk.failure, `from disk: ${from_disk.failure}`);
  if (!from_disk.failure) await seconds(from_disk.page, 0.1);

  writeFileSync(join(copy, 'model.live.js'), 'filigree_part("RklMSUdSRUU=");');
  const before = wrong.length, damaged = await open_page(browser, pathToFileURL(join(copy, 'index.html')).href);
  wrong.length = before;
  check(damaged.failure === 'model.live is damaged.', `a damaged file: "${damaged.failure}"`);
} finally {
  await browser.close();
  server.close();
  rmSync(copy, { recursive: true });
}
if (wrong.length > 0) fail(wrong.map((sentence) => `live page: ${sentence}`).join('\n'));
console.log('live page: it falls, is pulled, dropped again, slowed, tilted; nothing leaves it');
