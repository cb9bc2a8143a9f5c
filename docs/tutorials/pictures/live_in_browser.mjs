// Takes a picture of a live page while a hand holds its first body by the top.
// Usage: node live_in_browser.mjs FOLDER OUT.png
// Needs node 20, Chromium and web/node_modules: scripts/setup tools
import { pathToFileURL } from 'node:url';
import { join, resolve } from 'node:path';
import { open_browser } from '../../../tests/exchange/browser.mjs';

const [folder, out] = process.argv.slice(2), kWait = { timeout: 120000 };
const browser = await open_browser();
try {
    const page = await browser.newPage({ viewport: { width: 960, height: 600 } });
    // Software draws here: a picture takes longer than what moves in it.
    await page.addInitScript(() => {
        window.requestAnimationFrame = (draw) => {
            const go = () => (window.is_still ? setTimeout(go, 20) : draw(performance.now()));
            setTimeout(go, 30);
        };
    });
    await page.goto(pathToFileURL(join(resolve(folder), 'index.html')).href);
    await page.waitForFunction(() => window.filigree, null, kWait);
    const [left, top] = await page.evaluate(() => {
        const { live, stage } = window.filigree, box = live.body_box(), draw = stage.draw.bind(stage);
        window.draw_picture = draw;
        stage.draw = () => stage.controls.update();
        stage.camera.updateMatrixWorld();
        const at = box.getCenter(box.min.clone()).setY(box.max.y - 0.15 * (box.max.y - box.min.y)).project(stage.camera);
        return [(at.x + 1) / 2 * innerWidth, (1 - at.y) / 2 * innerHeight];
    });
    await page.mouse.move(left, top);
    await page.mouse.down();
    await page.mouse.move(left + 60, top - 70, { steps: 4 });
    await page.waitForFunction(() => window.filigree.simulated > 0.8, null, kWait);
    await page.evaluate(() => {
        window.is_still = true;
        window.draw_picture();
    });
    await page.screenshot({ path: out, ...kWait });
} finally {
    await browser.close();
}
