// What a frame of examples/web/rapier_three.html takes in headless Chromium (software GL): the table of docs/runtime.md.
//   node runtime_page.mjs PACKAGES MODEL.fil [PICTURE.png]       PACKAGES: a folder with node_modules, as the page says
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { open_browser, serve } from "../tests/exchange/browser.mjs";
import { root } from "../tests/exchange/tools.mjs";

const [packages, model, picture] = process.argv.slice(2);
const FRAMES = 45, DRAWN = 15; // of these every 15th is drawn: software GL takes seconds for it
const folder = join(root, "examples/web");
const server = await serve(packages, { "/scan.fil": model, "/": join(folder, "rapier_three.html"),
    "/rapier_three.js": join(folder, "rapier_three.js") });
const browser = await open_browser();
try {
    const page = await browser.newPage({ viewport: { width: 960, height: 600 } });
    page.on("pageerror", (error) => console.error(error.message));
    page.on("console", (message) => {
        if (message.type() === "error") console.error(message.text(), message.location().url);
    });
    await page.goto(server.url);
    await page.waitForFunction(() => window.example, null, { timeout: 240000 });
    const result = await page.evaluate(({ frames, drawn }) => {
        const { renderer, frame, model, embedding, body, mesh } = window.example;
        renderer.setAnimationLoop(null);
        const least = (list) => Math.min(...list); // the machine may be busy
        const times = { step: [], follow: [], pose: [], draw: [] }, restored = [];
        for (let k = 0; k < frames; ++k)
            for (const [name, time] of Object.entries(frame(k % drawn === 0)))
                if (name !== "draw" || k % drawn === 0) times[name].push(time);
        for (let k = 0; k < 15; ++k) {
            const start = performance.now();
            model.restore(embedding.positions, { gradients: embedding.gradients });
            restored.push(performance.now() - start);
        }
        const pixel = new Uint8Array(4), gl = renderer.getContext();
        const wait = () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // until all is drawn
        wait();
        const start = performance.now();
        frame(true);
        wait();
        const whole = performance.now() - start;
        return { whole, vertices: model.info.vertices, driver: model.info.driverVertices, particles: body.numParticles(),
            upload: mesh.skeleton.boneMatrices.byteLength, restored: least(restored),
            ...Object.fromEntries(Object.entries(times).map(([name, list]) => [name, least(list)])) };
    }, { frames: FRAMES, drawn: DRAWN });
    if (picture) {
        const url = await page.evaluate(() => {
            window.example.frame();
            return window.example.renderer.domElement.toDataURL();
        });
        writeFileSync(picture, Buffer.from(url.slice(url.indexOf(",") + 1), "base64"));
    }
    console.log(`${result.vertices} vertices, ${result.driver} driver vertices, ${result.particles} particles; ` +
        "ms, the least of several\n");
    console.log("| part of a frame | ms |\n|---|---|");
    for (const [name, key] of [["Rapier's step", "step"], ["embedding", "follow"],
        ["pose: matrices of the driver", "pose"], ["three.js, until the frame is handed over", "draw"],
        ["a whole frame, drawn in software", "whole"],
        ["instead of the shader: restore in WebAssembly, normals too", "restored"]])
        console.log(`| ${name} | ${result[key].toFixed(1)} |`);
    console.log(`\nuploaded each frame: ${result.upload} bytes`);
} finally {
    await browser.close();
    server.close();
}
