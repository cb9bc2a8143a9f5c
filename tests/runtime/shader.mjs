// An engine restores a model in its vertex shader as WebAssembly does, normals too. In Chromium; left out where it is
// missing.
//   node shader.mjs PACKAGE_FOLDER MODEL.fil PROBE.js      PROBE.js: what compares, beside this file
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { open_browser, serve } from "../exchange/browser.mjs";
import { require, root } from "../exchange/tools.mjs";

const [folder, path, probe] = process.argv.slice(2);
const { outputFiles } = await require("esbuild").build({
    entryPoints: [join(root, "tests/runtime", probe)], bundle: true, format: "iife", globalName: "probe",
    alias: { filigree: folder }, nodePaths: [join(root, "web/node_modules")], write: false, logLevel: "error",
});
const browser = await open_browser();
const server = await serve(undefined, {
    "/": Buffer.from('<!doctype html><title>probe</title><script src="probe.js"></script>'),
    "/probe.js": Buffer.from(outputFiles[0].contents),
    "/model.fil": path,
});
try {
    const page = await browser.newPage(), errors = [];
    page.on("console", (message) => {
        if (message.type() === "error" && !/favicon/.test(message.location().url)) errors.push(message.text());
    });
    await page.goto(server.url);
    const { covered, different, moved, farthest, holds } = await page.evaluate(() => probe.compare("model.fil"));
    console.log(`${probe}: ${different} of ${covered} pixels differ, ${moved} moved; vertices are off by ${farthest.toExponential(1)}`);
    if (errors.length > 0) throw new Error(errors.join("; "));
    if (covered < 5000 || moved < 0.2 * covered || different > 0.005 * covered || !(farthest < 1e-5) || !holds)
        throw new Error(`${probe}: the shader restores something else`);
} finally {
    await browser.close();
    server.close();
}
