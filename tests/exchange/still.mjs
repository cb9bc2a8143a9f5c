// A picture of an exported page at a moment, from a camera, without anything around the model.
// Usage: node still.mjs FOLDER SECONDS PICTURE.png EX EY EZ TX TY TZ     (eye and target, as filigree render --camera)
import { writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { open_browser } from './browser.mjs';

const [folder, seconds, picture, ...camera] = process.argv.slice(2);
const browser = await open_browser();
try {
    const page = await browser.newPage({ viewport: { width: 800, height: 600 } });
    await page.goto(pathToFileURL(join(resolve(folder), 'index.html')).href);
    await page.waitForFunction(() => window.filigree, null, { timeout: 120000 });
    await page.evaluate(({ moment, numbers }) => {
        const shown = window.filigree;
        if (shown.is_playing) shown.toggle_play();
        shown.stage.camera.clearViewOffset();
        shown.stage.camera.fov = 30;
        shown.stage.camera.position.set(...numbers.slice(0, 3));
        shown.stage.controls.target.set(...numbers.slice(3));
        shown.stage.camera.updateProjectionMatrix();
        shown.stage.controls.update();
        shown.seek(moment);
    }, { moment: Number(seconds), numbers: camera.map(Number) });
    await page.waitForFunction(() => window.filigree.request === undefined);
    writeFileSync(picture, await page.screenshot({ style: 'header, footer, #panel { visibility: hidden }' }));
} finally {
    await browser.close();
}
