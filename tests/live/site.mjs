// The standing page in headless Chromium, as a visitor uses it: meshes of the corpus, good and bad, are given to it; they
// are bent, measured, dropped, pulled and broken. Nothing may be asked of anybody.
// Usage: node site.mjs FOLDER CORPUS
import { mkdtempSync, rmSync, truncateSync, writeFileSync, readFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { open_browser, serve } from '../exchange/browser.mjs';
import { fail } from '../exchange/tools.mjs';

const [folder, corpus] = process.argv.slice(2);
const kWait = 300000; // ms: software draws
const wrong = [];
const check = (holds, sentence) => { if (!holds) wrong.push(sentence); };
const work = mkdtempSync(join(tmpdir(), 'filigree-site-'));
const made = (name, bytes) => (writeFileSync(join(work, name), bytes), join(work, name));

const server = await serve(folder), browser = await open_browser();
const page = await browser.newPage({ viewport: { width: 400, height: 420 } });
// Pictures are drawn in software here: fewer of them, without shadows, leave time for the rest.
await page.addInitScript(() => { window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 700); });
const own = ['/', '/filigree.css', '/filigree.js'];
page.on('request', (request) => {
  const url = request.url();
  if (!/^(data|blob):/.test(url) && !own.includes(url.slice(server.url.length))) wrong.push(`asks for ${url}`);
});
page.on('console', (message) => { if (message.type() === 'error' && !/Content Security Policy|elsewhere/.test(message.text())) wrong.push(`console: ${message.text()}`); });
page.on('pageerror', (error) => wrong.push(`error: ${error.message}`));

/// Until the page shows another body, or says why not.
async function settled(action) {
  await page.evaluate(() => {
    window.before = window.filigree;
    if (document.getElementById('failure')) document.getElementById('failure').hidden = true;
  });
  await action();
  await page.waitForFunction(() => (window.filigree && window.filigree !== window.before) || !document.getElementById('failure').hidden, null, { timeout: kWait, polling: 50 });
  return page.evaluate(() => ((window.filigree && (window.filigree.stage.renderer.shadowMap.autoUpdate = false), document.getElementById('failure').hidden) ? '' : document.getElementById('failure-cause').textContent));
}
const give = (path) => settled(() => page.setInputFiles('#file', path));
const until = (condition) => page.waitForFunction(condition, null, { timeout: kWait, polling: 30 }).catch(() => check(false, `never: ${condition}`));
const places = () => page.evaluate(() => [...window.filigree.live.bodies[0].driver]);
const farthest = (a, b) => a.reduce((most, x, k) => Math.max(most, Math.abs(x - b[k])), 0);

/// Pixels of the body, and how many colours are strong in them. The picture stands still for it.
async function pixels() {
  const look = async (visible) => {
    await page.evaluate((visible) => {
      const { filigree } = window;
      for (const { mesh } of filigree.live.bodies) mesh.visible = visible;
      filigree.stage.draw();
    }, visible);
    return (await page.screenshot({ timeout: kWait })).toString('base64');
  };
  await page.evaluate(() => new Promise((done) => {
    window.filigree.has_failed = true; // the loop ends: software that draws all the time leaves none for the screenshot
    setTimeout(done, 250);
  }));
  const shots = [await look(true), await look(false)];
  await page.evaluate(() => {
    const { filigree } = window;
    for (const { mesh } of filigree.live.bodies) mesh.visible = true;
    filigree.has_failed = false;
    filigree.draw(performance.now());
  });
  return page.evaluate(async (shots) => {
    const [a, b] = await Promise.all(shots.map(async (text) => {
      const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)); // the page may fetch nothing
      const bitmap = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
      const drawing = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
      drawing.drawImage(bitmap, 0, 0);
      return drawing.getImageData(0, 0, bitmap.width, bitmap.height).data;
    }));
    let count = 0, blue = 0;
    for (let i = 0; i < a.length; i += 4) {
      if (Math.abs(a[i] - b[i]) + Math.abs(a[i + 1] - b[i + 1]) + Math.abs(a[i + 2] - b[i + 2]) < 24) continue;
      ++count;
      if (a[i + 2] > a[i] + 15) ++blue;
    }
    return { count, blue };
  }, shots);
}
/// Where the body's middle is on the screen.
const middle = () => page.evaluate(() => {
  const { live, stage } = window.filigree, at = live.body_box().getCenter(live.scene.position.clone()).project(stage.camera);
  const box = document.getElementById('picture').getBoundingClientRect();
  return [(at.x + 1) / 2 * box.width, (1 - at.y) / 2 * box.height];
});
async function drag(x, y) {
  await page.evaluate(() => { window.filigree.is_paused = true; });
  const [left, top] = await middle();
  await page.mouse.move(left, top);
  await page.mouse.down();
  await page.evaluate(() => { window.filigree.is_paused = false; });
  await page.mouse.move(left + x / 2, top + y / 2);
  await page.mouse.move(left + x, top + y);
}

try {
  check(await settled(() => page.goto(server.url)) === '', 'the page begins with a failure');
  check((await pixels()).count > 2000, 'the sample is not seen');
  const start = await places();
  await page.waitForTimeout(400);
  check(farthest(start, await places()) > 1e-3, 'what nobody has touched does not sway');

  // A body is bent by hand, and measured.
  check(await give(join(corpus, 'good/spot_low.obj')) === '', 'spot_low.obj is refused');
  await page.evaluate(() => window.filigree.touched());
  await drag(70, 0);
  await until(() => window.filigree.bent && !window.filigree.waits_for_bend && !window.filigree.wanted);
  await page.mouse.up();
  const bent = await places();
  check(farthest(bent, await page.evaluate(() => [...window.filigree.start[0].subarray(0, window.filigree.live.bodies[0].driver.length)])) > 0.02, 'a drag does not bend');
  const plain = await pixels();
  await page.click('#error');
  await until(() => window.filigree.error && !document.getElementById('legend').hidden);
  const colored = await pixels();
  check(plain.blue < 0.1 * plain.count && colored.blue > 0.3 * colored.count, `the error's colours are not seen: ${plain.blue} of ${plain.count}, ${colored.blue} of ${colored.count}`);
  check(/Off by [\d.e-]+ % .* from bending all [\d,]+ points/.test(await page.textContent('#error-text')), `the error is not said: ${await page.textContent('#error-text')}`);
  await page.click('#again');
  await until(() => window.filigree.bent && !window.filigree.wanted && !window.filigree.waits_for_bend);
  check(farthest(await places(), bent) > 0.01, 'it does not become straight again');

  // It falls, is pulled, and breaks.
  await page.click('#mode-drop');
  const high = await page.evaluate(() => window.filigree.live.body_box().min.y);
  await until(() => window.filigree.simulated > 0.25);
  check(await page.evaluate(() => window.filigree.live.body_box().min.y) < high - 0.05, 'the body does not fall');
  await drag(0, -60);
  check(await page.evaluate(() => window.filigree.hand !== undefined), 'the mouse takes hold of nothing');
  await page.mouse.up();
  check(await settled(() => page.click('#breaks')) === '', 'a body that breaks is not made');
  check(await page.evaluate(() => !window.filigree.is_bent), 'the body that breaks does not fall');
  await until(() => window.filigree.parts > 1);

  // The model that is saved is the one in the page.
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('#save')]);
  check(download.suggestedFilename() === 'spot_low.fil', `saved as ${download.suggestedFilename()}`);
  check(readFileSync(await download.path()).subarray(0, 8).toString() === 'FILIGREE', 'what is saved is no model');

  // More meshes, good and bad: a body each, or one sentence. What was there stays.
  for (const name of ['good/moon.glb', 'good/featuretype.STL', 'good/torus.obj', 'bad/draco/test_extra_whitespace.ply'])
    check(await give(join(corpus, name)) === '' && (await pixels()).count > 500, `${name} is not shown`);
  const stl = readFileSync(join(corpus, 'good/featuretype.STL'));
  const refused = [[made('cut.stl', stl.subarray(0, 3000)), /cut\.stl/], [made('nan.obj', 'v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n'), /nan\.obj/],
    [made('empty.ply', ''), /is empty/], [made('photo.obj', Buffer.from('89504e470d0a1a0a', 'hex')), /PNG picture/],
    [made('text.glb', 'glTF\x02\0\0\0'), /./], [made('points.obj', 'v 0 0 0\nv 1 0 0\nv 0 1 0\n'), /no triangles/],
    [join(corpus, 'bad/assimp/BoxWithInfinites.glb'), /./], [join(corpus, 'bad/gltf-validator/glb/invalid_magic.glb'), /./],
    [made('large.ply', ''), /files of up to/], [made('many.ply', many(501000)), /501,000 triangles.*up to 500,000/]];
  truncateSync(join(work, 'large.ply'), 500e6);
  for (const [path, pattern] of refused) {
    const sentence = await give(path);
    check(pattern.test(sentence) && !/undefined|not a function|TypeError/.test(sentence) && sentence.split('. ').length < 3, `${path}: "${sentence}"`);
  }
  await page.click('#failure-close');
  check((await pixels()).count > 500, 'after a bad file the body that was there is gone');
  const answer = await page.evaluate(() => Promise.all([location.href, 'http://127.0.0.1:9/'].map((url) => fetch(url).then(() => 'answered', () => 'refused'))));
  check(answer.join() === 'refused,refused', `the page may ask: ${answer}`);
} finally {
  await browser.close();
  server.close();
  rmSync(work, { recursive: true });
}
if (wrong.length > 0) fail(wrong.map((sentence) => `site: ${sentence}`).join('\n'));
console.log('site: bends, says its error, falls, breaks; ten bad files give a sentence each; nothing leaves it');

/// A binary PLY of so many triangles.
function many(count) {
  const head = `ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face ${count}\nproperty list uchar int vertex_indices\nend_header\n`;
  const points = Buffer.from(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]).buffer), face = Buffer.alloc(13, 0);
  face[0] = 3;
  face.writeInt32LE(1, 5);
  face.writeInt32LE(2, 9);
  return Buffer.concat([Buffer.from(head), points, Buffer.alloc(13 * count, face)]);
}
