// Chromium without a window, drawing in software, and a server for it that no other machine can reach.
import { createServer } from 'node:http';
import { existsSync, statSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { extname, join, normalize } from 'node:path';
import { require, skip } from './tools.mjs';

const kTypes = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.css': 'text/css', '.glb': 'model/gltf-binary' };

/// Opens Chromium; ends the script as skipped where there is none.
export async function open_browser() {
    const places = [process.env.CHROMIUM, '/usr/bin/chromium-headless-shell', '/usr/bin/chromium', '/usr/bin/chromium-browser',
        '/usr/bin/google-chrome'];
    const program = places.find((place) => place && existsSync(place));
    if (!program) skip('chromium is not installed; run scripts/setup');
    if (Number.parseInt(process.versions.node) < 20) skip(`playwright needs node 20 or later; this is ${process.versions.node}`);
    const { chromium } = require('playwright-core');
    return chromium.launch({
        executablePath: program,
        args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
            '--disable-dev-shm-usage'],
    });
}

/// Serves a folder, and `extra` (path to bytes, a file's name or a function that gives bytes). { url, close, paths },
/// where `paths` collects what was asked for. Ranges are given where they are asked for, unless has_ranges is false;
/// rate: bytes a second, all answers together.
export async function serve(folder, extra = {}, { rate, has_ranges = true } = {}) {
    const paths = [];
    let busy_until = 0;
    const server = createServer(async (request, response) => {
        const path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
        paths.push(path);
        const given = extra[path];
        let body = Buffer.isBuffer(given) ? given : undefined;
        const file = typeof given === 'string' ? given : folder && join(folder, path.endsWith('/') ? path + 'index.html' : path);
        if (!body && file && existsSync(file) && statSync(file).isFile()) body = await readFile(file);
        const range = has_ranges && body && /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? '');
        if (range) body = body.subarray(Number(range[1]), Number(range[2]) + 1);
        response.writeHead(!body ? 404 : range ? 206 : 200, {
            'Content-Type': kTypes[extname(path) || '.html'] ?? 'application/octet-stream' });
        const kPiece = 16384;
        for (let at = 0; rate && body && at < body.length; at += kPiece) {
            const now = Date.now();
            busy_until = Math.max(busy_until, now) + (1000 * Math.min(kPiece, body.length - at)) / rate;
            await new Promise((sent) => setTimeout(sent, busy_until - now));
            response.write(body.subarray(at, at + kPiece));
        }
        response.end(rate ? undefined : body);
    });
    await new Promise((ready) => server.listen(0, '127.0.0.1', ready));
    return { url: `http://127.0.0.1:${server.address().port}`, paths, close: () => server.close() };
}
