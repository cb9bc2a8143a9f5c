// Makes the files that the other tests try: everything the program writes as GLB, and point caches to compare with.
// Usage: node own_files.mjs PROGRAM FOLDER
import { execFileSync } from 'node:child_process';
import { existsSync, mkdirSync, rmSync } from 'node:fs';
import { join } from 'node:path';
import { root } from './tools.mjs';

const [program, folder] = process.argv.slice(2);
const kFrames = 9, kRate = 12;

rmSync(folder, { recursive: true, force: true });
mkdirSync(join(folder, 'poses'), { recursive: true });
const filigree = (...words) => execFileSync(program, [...words, '--quiet'], { cwd: folder, stdio: ['ignore', 'ignore', 'inherit'] });

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
filigree('export', ...moving, '-o', 'page', '--web');

// With UVs, seams and a picture, where the corpus is there.
const fox = join(root, '../shared/corpus/good/gltf/Fox/Fox.gltf');
if (existsSync(fox)) {
    filigree('strip', fox, '-o', 'fox.fil', '--base', '100');
    filigree('export', 'fox.fil', '-o', 'fox.glb');
}
