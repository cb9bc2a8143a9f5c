// Opens a page of `filigree export --web --stream` near a part of its model: fine triangles are drawn there alone, and
// the picture is that of the finest level.
// Usage: node near_page.mjs FOLDER [--pictures FOLDER] [--away SHARE] [--size WIDTHxHEIGHT] [--json FILE]
// --away: of the eye from the nearest vertex, of the model's size (0.08 unless said). --size: of the page (480x320
// unless said). --json: what was measured.
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { open_browser, serve } from './browser.mjs';
import { fail } from './tools.mjs';

const { values: options, positionals: [folder] } = parseArgs({
    allowPositionals: true,
    options: { pictures: { type: 'string' }, away: { type: 'string' }, size: { type: 'string' }, json: { type: 'string' } },
});
if (options.pictures) mkdirSync(options.pictures, { recursive: true });

/// In the page: draws, and gives the milliseconds of a frame, the triangles, and the picture's pixels.
function measure() {
    const { stage, model } = window.filigree, { renderer } = stage, gl = renderer.getContext();
    const width = gl.drawingBufferWidth, height = gl.drawingBufferHeight, pixels = new Uint8Array(4 * width * height);
    const draw = () => {
        stage.renderer.render(stage.scene, stage.camera);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    };
    draw();
    const kFrames = 5, start = performance.now();
    for (let i = 0; i < kFrames; ++i) {
        model.seek((model.duration * i) / kFrames);
        draw();
    }
    const milliseconds = (performance.now() - start) / kFrames;
    model.seek(model.duration / 2);
    draw();
    const [mesh] = model.shown_meshes, { drawRange, index } = mesh.geometry;
    return { milliseconds, triangles: Math.min(drawRange.count, index.count) / 3, pixels, width, height };
}

const browser = await open_browser();
const server = await serve(folder);
const wrong = [], measured = [];
try {
    const [width, height] = (options.size ?? '480x320').split('x').map(Number);
    const page = await browser.newPage({ viewport: { width, height } });
    page.on('console', (message) => { if (message.type() === 'error') wrong.push(message.text()); });
    page.on('pageerror', (error) => wrong.push(error.message));
    await page.goto(`${server.url}/index.html`);
    await page.waitForFunction(() => window.filigree, null, { timeout: 120000 });
    await page.evaluate(() => filigree.pick_level(0));
    await page.waitForFunction(() => filigree.model.is_whole && filigree.model.levels.length === filigree.model.table.length, null, { timeout: 240000 });
    for (const [name, away] of [['far', 2.5], ['near', Number(options.away ?? 0.08)]]) {
        const result = await page.evaluate(([text, share]) => {
            const measure = (0, eval)(`(${text})`), { model, stage } = window.filigree;
            if (window.filigree.is_playing) window.filigree.toggle_play();
            window.filigree.seek(model.duration / 2);
            // Before the vertex that is nearest to the first view, and a little above.
            const { camera, controls } = stage, point = camera.position.clone(), size = model.box.max.distanceTo(model.box.min);
            const [{ meshes: [finest] }] = model.levels, direction = camera.position.clone().sub(controls.target).normalize();
            let best = 0, farthest = -Infinity;
            for (let v = 0; v < finest.geometry.attributes.position.count; v += 7) {
                const along = finest.getVertexPosition(v, point).dot(direction);
                if (along > farthest) [best, farthest] = [v, along];
            }
            finest.getVertexPosition(best, point);
            controls.target.copy(point);
            camera.position.copy(point).addScaledVector(direction, share * size);
            controls.update();
            model.chooses = true;
            let choice = 0;
            for (let i = 0; i < 4; ++i) { // the last one counts: the browser compiles meanwhile
                model.near_choice = undefined; // not too soon, and as if all had changed
                model.near.is_new = true;
                choice = performance.now();
                window.filigree.choose_near();
                choice = performance.now() - choice;
            }
            const near = measure();
            window.filigree.pick_level(0);
            const whole = measure();
            // The coarsest level that is fine enough at the nearest point, for all of the mesh.
            const nearest = Math.max(camera.position.distanceTo(point), camera.near);
            const pixel = (2 * Math.tan((camera.fov / 2) * (Math.PI / 180)) * nearest) / stage.height;
            window.filigree.pick_level(Math.max(0, model.levels.findLastIndex(({ error }) => error <= 0.05 * pixel)));
            const level = measure();
            const far_off = (a, b) => {
                let count = 0, seen = 0;
                for (let i = 0; i < a.pixels.length; i += 4) {
                    const off = Math.max(...[0, 1, 2].map((k) => Math.abs(a.pixels[i + k] - b.pixels[i + k])));
                    count += off > 24;
                    seen += Math.max(...[0, 1, 2].map((k) => Math.abs(b.pixels[i + k] - b.pixels[k]))) > 8;
                }
                return { count, seen };
            };
            const told = ({ milliseconds, triangles }) => ({ milliseconds, triangles });
            const result = { choice_milliseconds: choice, near: told(near), level: told(level), finest: told(whole),
                pixels: far_off(near, whole), level_pixels: far_off(level, whole) };
            model.chooses = true;
            window.filigree.choose_near();
            window.filigree.draw();
            return result;
        }, [measure.toString(), away]);
        measured.push({ name, ...result });
        if (options.pictures) {
            await page.waitForTimeout(500);
            await page.screenshot({ path: join(options.pictures, `${name}.png`) });
            await page.keyboard.press('w');
            await page.waitForTimeout(1500);
            await page.screenshot({ path: join(options.pictures, `${name}-wires.png`) });
            await page.keyboard.press('w');
        }
        const { near, finest, pixels } = result; // from afar all of a small model may be wanted
        if (!(near.triangles > 0 && near.triangles < (name === 'near' ? 0.7 : 1.01) * finest.triangles))
            wrong.push(`${name}: ${near.triangles} of ${finest.triangles} triangles are drawn`);
        if (!(pixels.count <= 0.01 * pixels.seen)) wrong.push(`${name}: ${pixels.count} of ${pixels.seen} pixels are not the finest level's`);
    }
} finally {
    await browser.close();
    server.close();
}
if (options.json) writeFileSync(options.json, JSON.stringify(measured, null, 2));
console.log(JSON.stringify(measured, null, 1));
if (wrong.length > 0) fail(wrong.join('\n'));
