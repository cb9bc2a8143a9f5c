// What a frame of a live page takes in headless Chromium (software GL), and the memory of its parts: rows of a table for
// scripts/bench-live.
//   node live_page.mjs FOLDER [PICTURE.png]      PICTURE: of the body while it is pulled up by its highest point
import { statSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { open_browser, serve } from "../tests/exchange/browser.mjs";

const [folder, picture] = process.argv.slice(2);
const FRAMES = 90, DRAWN = 2; // software GL takes seconds for a picture of the dragon
const server = await serve(folder), browser = await open_browser();
try {
    const page = await browser.newPage({ viewport: { width: 960, height: 600 } });
    page.on("pageerror", (error) => console.error(error.message));
    await page.addInitScript(() => { window.requestAnimationFrame = () => 0; }); // nothing is drawn but below
    const start = Date.now();
    await page.goto(server.url);
    await page.waitForFunction(() => window.filigree || !document.getElementById("failure").hidden, null,
        { timeout: 240000, polling: 100 });
    const opened = Date.now() - start;
    const result = await page.evaluate(async ({ frames, drawn, pulled }) => {
        const { filigree } = window, { worker, live, stage } = filigree;
        const least = (list) => Math.min(...list); // the machine may be busy
        const times = { step: [], pose: [], draw: [], whole: [] };
        let bytes = 0, substeps = 0, contacts = 0;
        for (let frame = 0; frame < frames; ++frame) {
            const moved = await new Promise((done) => {
                worker.onmessage = ({ data }) => done(data);
                worker.postMessage({ kind: "step", frames: 1, buffers: [] });
            });
            if (moved.kind === "failed") throw new Error(moved.message);
            ({ bytes, substeps } = moved);
            contacts = Math.max(contacts, moved.contacts);
            times.step.push(moved.milliseconds);
            times.pose.push(live.place(moved.drivers, moved.poses));
        }
        if (pulled) {
            const { driver, model, scale } = live.bodies[0];
            let top = 0;
            for (let at = 0; at < driver.length; at += 3) if (driver[at + 1] > driver[top + 1]) top = at;
            const place = [...driver.subarray(top, top + 3)], rest = [...model.driverRest.subarray(top, top + 3)];
            worker.postMessage({ kind: "grab", body: 0, rest: rest.map((x) => x * scale), place });
            for (let frame = 0; frame < pulled; ++frame) {
                const part = Math.min(frame / (pulled / 2), 1), size = live.body_box().max.y;
                worker.postMessage({ kind: "move", place: [place[0] - 0.3 * part * size, place[1] + 0.25 * part * size, place[2] + 0.1 * part * size] });
                const moved = await new Promise((done) => {
                    worker.onmessage = ({ data }) => done(data);
                    worker.postMessage({ kind: "step", frames: 1, buffers: [] });
                });
                live.place(moved.drivers, moved.poses);
            }
            live.body_box().getCenter(stage.controls.target); // the camera comes nearer
            stage.camera.position.sub(stage.centre).multiplyScalar(0.62).add(stage.controls.target);
        }
        const gl = stage.renderer.getContext(), pixel = new Uint8Array(4);
        for (let k = 0; k < drawn; ++k) {
            for (const { mesh } of live.bodies) mesh.skeleton.boneTexture.needsUpdate = true;
            const begun = performance.now();
            stage.draw();
            times.draw.push(performance.now() - begun);
            gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // until all is drawn
            times.whole.push(performance.now() - begun);
        }
        const upload = live.bodies.reduce((sum, { mesh }) => sum + mesh.skeleton.boneMatrices.byteLength, 0);
        return { particles: filigree.particles, driver: live.driver_vertices, vertices: live.vertices, substeps, contacts, bytes, upload,
            
            ...Object.fromEntries(Object.entries(times).map(([name, list]) => [name, least(list)])) };
    }, { frames: FRAMES, drawn: DRAWN, pulled: picture ? 60 : 0 });
    if (picture) writeFileSync(picture, await page.screenshot({ timeout: 240000 }));
    const count = (number) => number.toLocaleString("en"), size = (name) => statSync(join(folder, name)).size;
    const row = (name, value) => console.log(`| ${name} | ${value} |`);
    row("particles, driver vertices, vertices", [result.particles, result.driver, result.vertices].map(count).join(", "));
    row("substeps of a frame, contacts at most", `${result.substeps}, ${result.contacts}`);
    row("worker: a frame of the physics, ms", result.step.toFixed(1));
    row("pose: matrices of the driver, ms", result.pose.toFixed(2));
    row("upload a frame, bytes", count(result.upload));
    row("three.js, until the picture is handed over, ms", result.draw.toFixed(1));
    row("a picture, drawn in software, ms", result.whole.toFixed(0));
    row("memory of the physics, MB", (result.bytes / 1e6).toFixed(1));
    row("page: script, bodies, bytes", [size("filigree.js"), size("model.live")].map(count).join(", "));
    row("from a server on this machine until the bodies can move, s", (opened / 1000).toFixed(1));
} finally {
    await browser.close();
    server.close();
}
