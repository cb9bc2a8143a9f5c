// Khronos' glTF-Validator on files: fails unless there are no errors and no warnings. Infos are printed.
// Usage: node validate.mjs FILE...     (of a folder, all .glb and .gltf in it and below)
import { readdirSync, statSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { dirname, join, basename } from 'node:path';
import { fileURLToPath } from 'node:url';
import { require, fail } from './tools.mjs';

const validator = require('gltf-validator');
const kSeverities = ['error', 'warning', 'info', 'hint'];

/// How many issues of each severity a file has; says each kind once.
export async function validate(file) {
    const report = await validator.validateBytes(new Uint8Array(await readFile(file)), {
        uri: basename(file),
        maxIssues: 10000,
        externalResourceFunction: async (uri) =>
            new Uint8Array(await readFile(join(dirname(file), decodeURIComponent(uri)))),
    });
    const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
    const { totalVertexCount, totalTriangleCount, animationCount, hasSkins, hasMorphTargets } = report.info;
    const parts = [`${totalVertexCount} vertices`, `${totalTriangleCount} triangles`];
    if (hasSkins) parts.push('skin');
    if (hasMorphTargets) parts.push('morph targets');
    if (animationCount) parts.push(`${animationCount} animations`);
    console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos, ${numHints} hints `
        + `(${parts.join(', ')})`);
    const kinds = new Map();
    for (const message of messages) {
        const kind = kinds.get(message.code);
        if (kind) ++kind.count;
        else kinds.set(message.code, { ...message, count: 1 });
    }
    for (const { code, severity, message, pointer, count } of kinds.values())
        console.log(`  ${kSeverities[severity]} ${code}, ${count} times, first at ${pointer}: ${message}`);
    return { errors: numErrors, warnings: numWarnings };
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
    const files = process.argv.slice(2).flatMap((path) => (statSync(path).isDirectory()
        ? readdirSync(path, { recursive: true }).filter((name) => /\.(glb|gltf)$/.test(name)).map((name) => join(path, name))
        : path));
    if (files.length === 0) fail('validate.mjs: there is nothing to validate');
    let wrong = 0;
    for (const file of files) {
        const { errors, warnings } = await validate(file);
        if (errors + warnings > 0) ++wrong;
    }
    if (wrong > 0) fail(`${wrong} of ${files.length} files have errors or warnings`);
}
