// What the standing page takes for a mesh in headless Chromium (software GL): scripts/bench-site.
//   node site_page.mjs FOLDER MESH      prints ms to read it, ms to make body, model and page, ms until it can be drawn,
//                                       ms of the first picture, bytes of the maker's memory
import { open_browser, serve } from "../tests/exchange/browser.mjs";

const [folder, mesh] = process.argv.slice(2);
const server = await serve(folder), browser = await open_browser();
try {
    const page = await browser.newPage({ viewport: { width: 320, height: 320 } });
    page.on("pageerror", (error) => console.error(error.message));
    await page.addInitScript(() => { window.requestAnimationFrame = () => 0; }); // nothing is drawn but below
    await page.goto(server.url);
    const wait = () => page.waitForFunction(() => (window.filigree && window.filigree !== window.before) || !document.getElementById("failure").hidden,
        null, { timeout: 500000, polling: 100 });
    await wait();
    await page.evaluate(() => { window.before = window.filigree; });
    await page.setInputFiles("#file", mesh);
    await wait();
    console.log(await page.evaluate(() => {
        if (window.filigree === window.before) throw new Error(document.getElementById("failure-cause").textContent);
        const { stage, times } = window.filigree, { read, made, until, memory } = times.make;
        const gl = stage.renderer.getContext(), pixel = new Uint8Array(4), begun = performance.now();
        stage.draw();
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
        return [read, made, until - made, performance.now() - begun, memory].map((x) => x.toFixed(0)).join(" ");
    }));
} finally {
    await browser.close();
    server.close();
}
