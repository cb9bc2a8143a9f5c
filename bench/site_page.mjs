// What the standing page takes for a mesh in headless Chromium (software GL): scripts/bench-site.
//   node site_page.mjs FOLDER MESH      prints two lines of numbers:
//     making: ms to read it, ms to make body, model and page, ms from then until it can be drawn, ms of the first picture,
//             bytes of the maker's memory, bytes of the file of the live page
//     moving, medians: ms from asking for a bend to having it, the same of an error, ms of the worker for a frame of the
//             fall and the longest of them, ms of a pose; then bytes that a pose uploads, bytes of the physics' memory
import { open_browser, serve } from "../tests/exchange/browser.mjs";

const kFrames = 60; // of the fall: a second, with contact
const [folder, mesh] = process.argv.slice(2);
const server = await serve(folder), browser = await open_browser();
try {
    const page = await browser.newPage({ viewport: { width: 320, height: 480 } });
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
        const { stage, times, file } = window.filigree, { read, made, until, memory } = times.make;
        const gl = stage.renderer.getContext(), pixel = new Uint8Array(4), begun = performance.now();
        stage.draw();
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
        return [read, made, until - made, performance.now() - begun, memory, file.bytes].map((x) => x.toFixed(0)).join(" ");
    }));
    console.log(await page.evaluate(async (frames) => {
        const { filigree } = window, median = (list) => [...list].sort((a, b) => a - b)[Math.floor(list.length / 2)];
        const timed = async (is_over) => {
            const begun = performance.now();
            filigree.ask(0);
            while (!is_over()) await new Promise((done) => { const { port1, port2 } = new MessageChannel(); port1.onmessage = done; port2.postMessage(0); });
            return performance.now() - begun;
        };
        const bends = [], errors = [];
        filigree.touched();
        for (let k = 0; k < 20; ++k) {
            filigree.wanted = { bend: [30 + k, 20, 0, 1.1] };
            bends.push(await timed(() => !filigree.waits_for_bend));
        }
        filigree.show_error(true);
        for (let k = 0; k < 6; ++k) {
            filigree.is_measured = filigree.measured_at = false;
            errors.push(await timed(() => !filigree.waits_for_measure));
        }
        filigree.set_mode("drop");
        const steps = [], poses = [];
        while (steps.length < frames) {
            filigree.late = filigree.frame_seconds;
            await timed(() => !filigree.is_waiting);
            steps.push(filigree.times.step.at(-1));
            poses.push(filigree.live.place(filigree.seen(), filigree.poses));
        }
        const upload = filigree.live.bodies[0].mesh.skeleton.boneMatrices.byteLength;
        return [...[median(bends), median(errors), median(steps), Math.max(...steps), median(poses)].map((x) => x.toFixed(1)), upload,
            filigree.physics_bytes].join(" ");
    }, kFrames));
} finally {
    await browser.close();
    server.close();
}
