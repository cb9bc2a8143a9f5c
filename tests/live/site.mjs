// The standing page in headless Chromium, as a visitor uses it: meshes of the corpus, good and bad, are given to it; they
// are bent, measured, dropped, pulled and broken. Nothing may be asked of anybody.
// Usage: node site.mjs FOLDER CORPUS [PICTURE.png]
// With PICTURE.png it does nothing but to make docs/pictures/site.jpg: the koala, bent by hand, with its error as colours.
import { mkdtempSync, rmSync, truncateSync, writeFileSync, readFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, join } from 'node:path';
import { open_browser, serve } from '../exchange/browser.mjs';
import { fail } from '../exchange/tools.mjs';

const [folder, corpus, picture] = process.argv.slice(2);
const kWait = 90000; // ms: a body of a mesh takes seconds, and more where other work is on the machine
const wrong = [];
const check = (holds, sentence) => { if (!holds) wrong.push(sentence); };
const work = mkdtempSync(join(tmpdir(), 'filigree-site-'));
const made = (name, bytes) => (writeFileSync(join(work, name), bytes), join(work, name));

const server = await serve(folder), browser = await open_browser();
const page = await browser.newPage({ viewport: picture ? { width: 1120, height: 700 } : { width: 420, height: 680 } });
// Pictures are drawn in software here, which takes a second or more: only those are drawn that the test looks at. All else
// of a picture is done: what is due is asked for, and bodies are placed.
await page.addInitScript((is_picture) => {
  window.requestAnimationFrame = (draw) => {
    const go = () => (window.is_still ? setTimeout(go, 20) : draw(performance.now()));
    setTimeout(go, 30);
  };
  let shown;
  Object.defineProperty(window, 'filigree', {
    get: () => shown,
    set: (page) => {
      shown = page;
      const { live, stage } = page, draw = stage.draw.bind(stage), gl = stage.renderer.getContext();
      stage.renderer.shadowMap.enabled = is_picture;
      stage.draw = () => stage.controls.update();
      page.look = (visible) => {
        for (const { mesh } of live.bodies) mesh.visible = visible;
        draw();
        gl.finish();
      };
    },
  });
}, picture !== undefined);
const own = ['/', '/filigree.css', '/filigree.js'];
page.on('request', (request) => {
  const url = request.url();
  if (!/^(data|blob):/.test(url) && !own.includes(url.slice(server.url.length))) wrong.push(`asks for ${url}`);
});
page.on('console', (message) => { if (message.type() === 'error' && !/Content Security Policy|elsewhere/.test(message.text())) wrong.push(`console: ${message.text()}`); });
page.on('pageerror', (error) => wrong.push(`error: ${error.message}`));

/// Until the page shows another body, or says why not: then its sentence.
async function settled(action) {
  await page.evaluate(() => {
    window.before = window.filigree;
    if (document.getElementById('failure')) document.getElementById('failure').hidden = true;
  });
  await action();
  await page.waitForFunction(() => (window.filigree && window.filigree !== window.before) || !document.getElementById('failure').hidden, null, { timeout: kWait, polling: 30 });
  return page.evaluate(() => (document.getElementById('failure').hidden ? '' : document.getElementById('failure-cause').textContent));
}
const give = (path) => settled(() => page.setInputFiles('#file', path));
/// A text file, dragged from a folder and dropped on the page.
const let_go = (path) => settled(() => page.evaluate(({ name, text }) => {
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File([text], name));
  const send = (type) => document.body.dispatchEvent(new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true }));
  send('dragenter');
  if (document.getElementById('target').hidden) throw new Error('the page does not say that a file can be dropped');
  send('dragover');
  send('drop');
}, { name: basename(path), text: readFileSync(path, 'utf8') }));
const until = (condition) => page.waitForFunction(condition, null, { timeout: kWait, polling: 30 }).catch(() => check(false, `never: ${condition}`));
const is_quiet = () => window.filigree.bent && !window.filigree.waits_for_bend && !window.filigree.wanted && !window.filigree.is_new;
const hold_still = (is_still) => page.evaluate((is_still) => { window.is_still = is_still; }, is_still);
const places = () => page.evaluate(() => [...window.filigree.live.bodies[0].driver]);
const start = () => page.evaluate(() => [...window.filigree.start[0].subarray(0, window.filigree.live.bodies[0].driver.length)]);
/// Until the body is so far from where it was, m: low to high, in any coordinate.
const until_off = (places, low, high, sentence) => page.waitForFunction(({ places, low, high }) => {
  const most = window.filigree.live.bodies[0].driver.reduce((most, x, k) => Math.max(most, Math.abs(x - places[k])), 0);
  return low <= most && most <= high;
}, { places, low, high }, { timeout: kWait, polling: 30 }).catch(() => check(false, sentence));

/// Pixels of the body, and how many of them are blue. The picture stands still for it.
async function pixels() {
  const look = async (visible) => {
    await page.evaluate((visible) => window.filigree.look(visible), visible);
    return (await page.screenshot({ timeout: kWait })).toString('base64');
  };
  await hold_still(true);
  const shots = [await look(true), await look(false)];
  await hold_still(false);
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
  const { live, stage } = window.filigree;
  stage.camera.updateMatrixWorld(); // it may be that nothing was drawn yet
  const at = live.body_box().getCenter(live.scene.position.clone()).project(stage.camera);
  const box = document.getElementById('picture').getBoundingClientRect();
  return [(at.x + 1) / 2 * box.width, (1 - at.y) / 2 * box.height];
});
async function drag(x, y) {
  await hold_still(true);
  const [left, top] = await middle();
  await page.mouse.move(left, top);
  await page.mouse.down();
  await hold_still(false);
  await page.mouse.move(left + x / 2, top + y / 2);
  await page.mouse.move(left + x, top + y);
}
/// The page's sentence about the error, its average and the colours' end, in per cent.
async function said_error() {
  await until(() => window.filigree.error && !document.getElementById('legend').hidden);
  const sentence = await page.textContent('#error-text'), end = Number.parseFloat(await page.textContent('#ramp-end'));
  const [average, most] = (/^Off by ([\d.]+)\s% .* average, ([\d.]+)\s% .* from bending all [\d,]+ points\.$/.exec(sentence) ?? []).slice(1).map(Number);
  check(0 < average && average < most && average < end, `the error is not said: ${sentence} ... ${end} %`);
  return average;
}
/// A koala that a hand has bent, in the colours of its error.
async function make_picture() {
  await give(join(corpus, 'good/koala_100k.obj'));
  await page.evaluate(() => window.filigree.touched());
  await until(is_quiet);
  await page.click('#error');
  await drag(-95, 10);
  await until_off(await start(), 0.05, Infinity, 'a drag does not bend');
  await page.mouse.up();
  await until(is_quiet);
  await until(() => window.filigree.is_measured && !window.filigree.waits_for_measure);
  await hold_still(true);
  await page.evaluate(() => window.filigree.look(true));
  await page.screenshot({ path: picture, timeout: kWait });
}

/// Everything a visitor can do.
async function use() {
  check((await pixels()).count > 1000, 'the sample is not seen');
  await until_off(await places(), 1e-3, Infinity, 'what nobody has touched does not sway');
  const plain = await pixels();
  await page.click('#error'); // while it sways
  const average = await said_error(), colored = await pixels();
  check(average < 0.02, `the sample is off by ${average} %`);
  check(plain.blue < 0.1 * plain.count && colored.blue > 0.3 * colored.count, `the error's colours are not seen: ${plain.blue} of ${plain.count}, ${colored.blue} of ${colored.count}`);

  // A mesh is bent by hand, and measured.
  check(await give(join(corpus, 'good/spot_low.obj')) === '', 'spot_low.obj is refused');
  await page.evaluate(() => window.filigree.touched());
  const straight = await start();
  await drag(60, 0);
  await until_off(straight, 0.02, Infinity, 'a drag does not bend');
  await page.mouse.up();
  await page.click('#error');
  await said_error();
  await page.click('#again');
  await until_off(straight, 0, 1e-5, 'it does not become straight again');

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
  check(await let_go(join(corpus, 'good/torus.obj')) === '' && (await pixels()).count > 500, 'a file that is dropped on the page is not shown');
  check(await page.textContent('#title') === 'torus.obj', 'the page does not show the name of the file');
  for (const name of ['good/moon.glb', 'good/featuretype.STL', 'bad/draco/test_extra_whitespace.ply'])
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
}

try {
  check(await settled(() => page.goto(server.url)) === '', 'the page begins with a failure');
  await (picture ? make_picture() : use());
} finally {
  await browser.close();
  server.close();
  rmSync(work, { recursive: true });
}
if (wrong.length > 0) fail(wrong.map((sentence) => `site: ${sentence}`).join('\n'));
if (!picture) console.log('site: bends, says its error, falls, breaks; ten bad files give a sentence each; nothing leaves it');

/// A binary PLY of so many triangles.
function many(count) {
  const head = `ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face ${count}\nproperty list uchar int vertex_indices\nend_header\n`;
  const points = Buffer.from(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]).buffer), face = Buffer.alloc(13, 0);
  face[0] = 3;
  face.writeInt32LE(1, 5);
  face.writeInt32LE(2, 9);
  return Buffer.concat([Buffer.from(head), points, Buffer.alloc(13 * count, face)]);
}
