// Makes the files that the other tests try: everything the program writes as GLB, and point caches to compare with.
// Usage: node own_files.mjs PROGRAM FOLDER
import { execFileSync } from 'node:child_process';
import { existsSync, mkdirSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { deflateSync } from 'node:zlib';
import { made_skin } from './made_glb.mjs';
import { root } from './tools.mjs';

const [program, folder] = process.argv.slice(2);
const kFrames = 9, kRate = 12;
const kPageTitle = '"Cube" <script>alert(3)</script> & {{model}}'; // as CMakeLists.txt has it

rmSync(folder, { recursive: true, force: true });
mkdirSync(join(folder, 'poses'), { recursive: true });
const filigree = (...words) => execFileSync(program, [...words, '--quiet'], { cwd: folder, stdio: ['ignore', 'ignore', 'inherit'] });

/// A picture of one row.
function png_of_columns(colors) {
    const number = (value) => { const bytes = Buffer.alloc(4); bytes.writeUInt32BE(value >>> 0); return bytes; };
    const checked = (kind, bytes) => {
        const all = Buffer.concat([Buffer.from(kind), bytes]);
        let crc = 0xffffffff;
        for (const byte of all) {
            crc ^= byte;
            for (let bit = 0; bit < 8; ++bit) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
        }
        return Buffer.concat([number(bytes.length), all, number(~crc)]);
    };
    return Buffer.concat([Buffer.from('\x89PNG\r\n\x1a\n', 'latin1'),
        checked('IHDR', Buffer.concat([number(colors.length), number(1), Buffer.from([8, 2, 0, 0, 0])])),
        checked('IDAT', deflateSync(Buffer.from([0, ...colors.flat()]))), checked('IEND', Buffer.alloc(0))]);
}

// A cube that is squeezed, bent and twisted more and more, and comes half the way back.
filigree('make', 'wavy-cube', '-o', 'cube.ply', '--resolution', '24');
filigree('strip', 'cube.ply', '-o', 'cube.fil', '--base', '150');
for (let frame = 0; frame < kFrames; ++frame) {
    const strength = Math.sin((frame / (kFrames - 1)) * 0.8 * Math.PI);
    filigree('deform', 'cube.fil', '-o', 'moved.ply', '--pose', `poses/pose_${String(frame + 1).padStart(4, '0')}.ply`,
        '--squeeze', String(1 - 0.35 * strength), '--bend', String(60 * strength), '--twist', String(80 * strength));
}
const moving = ['cube.fil', '--poses', 'poses/pose_####.ply', '--frame-rate', String(kRate)];
filigree('restore', ...moving, '-o', 'moving.pc2');

filigree('make', 'wavy-cube', '-o', 'mesh.glb', '--resolution', '12');
filigree('level', 'cube.fil', '0', '-o', 'level_0.glb');
filigree('export', 'cube.fil', '-o', 'levels.glb');
filigree('export', ...moving, '-o', 'skin.glb');
filigree('export', ...moving, '-o', 'skin_levels.glb', '--all-levels', '--interpolation', 'cubic');
filigree('export', ...moving, '-o', 'skin_6.glb', '--influences', '6', '--full-precision');
filigree('export', ...moving, '-o', 'skin_flat.glb', '--no-normals', '--key-rate', '6');
filigree('export', ...moving, '-o', 'morph.glb', '--as', 'morph', '--morph-normals');
writeFileSync(join(folder, 'mark.svg'), '<svg xmlns="http://www.w3.org/2000/svg" width="40" height="40" onload="alert(1)"><script>alert(2)</script><circle cx="20" cy="20" r="18"/></svg>');
filigree('export', ...moving, '-o', 'page', '--web', '--title', kPageTitle, '--logo', 'mark.svg');
filigree('export', ...moving, '-o', 'stream_page', '--web', '--stream', '--no-poster');
filigree('make', 'wavy-sphere', '-o', 'sphere.ply', '--resolution', '48');
filigree('strip', 'sphere.ply', '-o', 'sphere.fil', '--base', '150');
filigree('deform', 'sphere.fil', '-o', 'sphere_moved.fil', '--twist', '60', '--frames', '5');
filigree('export', 'sphere_moved.fil', '-o', 'near_page', '--web', '--stream', '--no-poster');
filigree('restore', 'stream_page/model.fil', '--frame', String(kFrames), '-o', 'stream_last.obj');
filigree('export', ...moving, '-o', 'compressed.glb', '--compress');

// What was moved, fitted anew: every program has to show what the fit restores.
filigree('fit', 'moving.pc2', '--mesh', 'cube.ply', '--frame-rate', String(kRate), '--base', '100', '-o', 'fitted.fil',
    '-o', 'fitted.glb', '--full-precision');
filigree('restore', 'fitted.fil', '--frames', '-o', 'fitted.pc2');

// A skin with a morph target and a joint that stretches, as flesh.
writeFileSync(join(folder, 'swelling.glb'), made_skin(true).glb);
filigree('flesh', 'swelling.glb', '-o', 'flesh.glb', '--particles', '400', '--joints', '60', '--no-check');

// Two objects, two materials and a UV seam: a tube of which each half is an object, its texture's ends at one edge.
function tube(around, rings, library) {
    const lines = [`mtllib ${library}`];
    for (let ring = 0; ring <= rings; ++ring)
        for (let i = 0; i < around; ++i) {
            const angle = (2 * Math.PI * i) / around;
            lines.push(`v ${0.3 * Math.cos(angle)} ${(2 * ring) / rings} ${0.3 * Math.sin(angle)}`);
        }
    for (let ring = 0; ring <= rings; ++ring)
        for (let i = 0; i <= around; ++i) lines.push(`vt ${i / around} ${ring / rings}`);
    for (let ring = 0; ring < rings; ++ring) {
        if (ring === 0) lines.push('o lower', 'usemtl red');
        if (ring === rings / 2) lines.push('o upper', 'usemtl blue');
        for (let i = 0; i < around; ++i) {
            const corner = (up, along) => `${(ring + up) * around + ((i + along) % around) + 1}/${(ring + up) * (around + 1) + i + along + 1}`;
            lines.push(`f ${corner(0, 0)} ${corner(1, 0)} ${corner(1, 1)}`, `f ${corner(0, 0)} ${corner(1, 1)} ${corner(0, 1)}`);
        }
    }
    return lines.join('\n') + '\n';
}
writeFileSync(join(folder, 'tube.obj'), tube(24, 16, 'tube.mtl'));
writeFileSync(join(folder, 'tube.mtl'), 'newmtl red\nKd 0.8 0.1 0.1\nnewmtl blue\nKd 0.1 0.2 0.8\n');
filigree('deform', 'tube.obj', '-o', 'tube_bent.glb', '--bend', '60');
filigree('strip', 'tube.obj', '-o', 'tube.fil', '--base', '60');
// A finer one, with a picture on its lower half: yellow, and green on the left of what is seen from the front.
const kYellow = [250, 220, 0], kGreen = [0, 160, 0];
writeFileSync(join(folder, 'stripes.png'), png_of_columns(Array.from({ length: 16 }, (_, i) => (i < 3 || i > 7 ? kYellow : kGreen))));
writeFileSync(join(folder, 'painted.mtl'), 'newmtl red\nKd 1 1 1\nmap_Kd stripes.png\nnewmtl blue\nKd 0.05 0.1 0.9\n');
writeFileSync(join(folder, 'painted.obj'), tube(96, 64, 'painted.mtl'));
filigree('strip', 'painted.obj', '-o', 'painted.fil', '--base', '60');
filigree('deform', 'painted.fil', '-o', 'painted_moved.fil', '--bend', '20', '--frames', '5');
filigree('export', 'painted_moved.fil', '-o', 'painted_page', '--web', '--stream', '--no-poster');
filigree('export', 'tube.fil', '-o', 'tube.glb');
filigree('deform', 'tube.fil', '-o', 'tube_moved.fil', '--bend', '60', '--frames', '5');
filigree('export', 'tube_moved.fil', '-o', 'tube_skin.glb');
filigree('export', 'tube_moved.fil', '-o', 'tube_morph.glb', '--as', 'morph', '--morph-normals');

// What falls: poses that a scene makes.
writeFileSync(join(folder, 'fall.toml'), '[simulation]\nduration = 0.2\n\n[[body]]\nmesh = "tube.fil"\nmaterial = "rubber"\nparticles = 300\n');
filigree('simulate', 'fall.toml', '-o', 'simulated.glb');

// What melts: key frames whose faces change.
writeFileSync(join(folder, 'melt.toml'), `[simulation]
duration = 0.6

[world]
air_temperature = 450
air_heat_transfer = 100
heat_pace = 3000

[[body]]
shape = "wavy-cube"
size = 0.2
resolution = 12
material = "wax"
particles = 1000
centre = [0, 0.12, 0]

[[obstacle]]
shape = "ground"
`);
filigree('simulate', 'melt.toml', '-o', 'melt.glb');
filigree('export', 'melt.glb', '-o', 'melt_page', '--web', '--no-poster');

// Far from the origin, where 32-bit float is coarse.
const far = tube(24, 16, 'tube.mtl').trimEnd().split('\n').map((line) => line.replace(/^v (\S+) (\S+) (\S+)$/, (_, x, y, z) => `v ${Number(x) + 1e5} ${Number(y) - 2e5} ${Number(z) + 3e5}`));
writeFileSync(join(folder, 'far.obj'), far.join('\n') + '\n');
filigree('strip', 'far.obj', '-o', 'far.fil', '--base', '60');
filigree('deform', 'far.fil', '-o', 'far_moved.fil', '--bend', '60', '--frames', '5');
filigree('export', 'far_moved.fil', '-o', 'far_skin.glb');

// With UVs, seams and a picture, where the corpus is there.
const fox = join(root, '../shared/corpus/good/gltf/Fox/Fox.gltf');
if (existsSync(fox)) {
    filigree('strip', fox, '-o', 'fox.fil', '--base', '100');
    filigree('export', 'fox.fil', '-o', 'fox.glb');
    filigree('deform', 'fox.fil', '-o', 'fox_moved.fil', '--bend', '40', '--frames', '5');
    filigree('export', 'fox_moved.fil', '-o', 'fox_skin.glb', '--all-levels');
} else {
    console.log('the corpus is not there: files without the Fox');
}
