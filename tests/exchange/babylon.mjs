// Plays a GLB in Babylon.js, without drawing, and compares every vertex with a point cache of ours.
// Usage: node babylon.mjs FILE.glb REFERENCE.pc2 [--rate FRAMES_A_SECOND] [--frames 0,10,20] [--limit 1e-5]
// Skipped where web/node_modules has no @babylonjs/loaders; BABYLON names another folder of packages.
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { parseArgs } from 'node:util';
import { fail, root, skip } from './tools.mjs';

const { positionals, values } = parseArgs({
    allowPositionals: true,
    options: { rate: { type: 'string', default: '60' }, frames: { type: 'string' }, limit: { type: 'string', default: '1e-5' } },
});
if (positionals.length !== 2) fail('babylon.mjs: name a GLB and a PC2');
const packages = process.env.BABYLON ?? join(root, 'web/node_modules');
if (!existsSync(join(packages, '@babylonjs/loaders'))) skip('@babylonjs/loaders is not there');
const load = (name) => import(pathToFileURL(join(packages, '@babylonjs', name)));
const { NullEngine } = await load('core/Engines/nullEngine.js');
const { Scene } = await load('core/scene.js');
const { SceneLoader } = await load('core/Loading/sceneLoader.js');
const { Vector3 } = await load('core/Maths/math.vector.js');
await load('core/Animations/animatable.js');
await load('core/Materials/PBR/pbrMaterial.js');
await load('loaders/glTF/2.0/index.js');

const bytes = readFileSync(positionals[1]), head = new DataView(bytes.buffer, bytes.byteOffset, 32);
const points = head.getInt32(16, true), count = head.getInt32(28, true);
const frame_of = (frame) => new Float32Array(bytes.buffer.slice(bytes.byteOffset + 32 + 12 * points * frame, bytes.byteOffset + 32 + 12 * points * (frame + 1)));

const scene = new Scene(new NullEngine());
scene.useRightHandedSystem = true;
const file = `data:model/gltf-binary;base64,${readFileSync(positionals[0]).toString('base64')}`;
const container = await SceneLoader.LoadAssetContainerAsync('', file, scene, undefined, '.glb');
container.addAllToScene();
const mesh = container.meshes.find((one) => one.getTotalVertices() > 0);
if (mesh.getTotalVertices() < points) fail(`the file has ${mesh.getTotalVertices()} vertices, the reference ${points}`);
const group = container.animationGroups[0];
group.start(false);
group.pause();

const first = frame_of(0), least = [Infinity, Infinity, Infinity], most = [-Infinity, -Infinity, -Infinity];
for (let i = 0; i < first.length; ++i) {
    least[i % 3] = Math.min(least[i % 3], first[i]);
    most[i % 3] = Math.max(most[i % 3], first[i]);
}
const diagonal = Math.hypot(...least.map((x, k) => most[k] - x));
const frames = values.frames?.split(',').map(Number) ?? [0, 1, 2, 3, 4].map((i) => Math.round((i * (count - 1)) / 4));
const per_second = group.targetedAnimations[0].animation.framePerSecond;
for (const frame of frames) {
    group.goToFrame((frame / Number(values.rate)) * per_second);
    scene.animate();
    mesh.skeleton?.computeAbsoluteMatrices(true);
    for (const node of container.transformNodes) node.computeWorldMatrix(true);
    mesh.skeleton?.prepare(true);
    const positions = mesh.getPositionData(true, true), world = mesh.computeWorldMatrix(true), truth = frame_of(frame);
    let largest = 0, sum = 0;
    for (let v = 0; v < points; ++v) {
        const at = Vector3.TransformCoordinates(Vector3.FromArray(positions, 3 * v), world);
        const square = (at.x - truth[3 * v]) ** 2 + (at.y - truth[3 * v + 1]) ** 2 + (at.z - truth[3 * v + 2]) ** 2;
        largest = Math.max(largest, square);
        sum += square;
    }
    largest = Math.sqrt(largest) / diagonal;
    console.log(`  frame ${frame}: largest ${largest.toExponential(2)} of the diagonal, RMS ${(Math.sqrt(sum / points) / diagonal).toExponential(2)}`);
    if (!(largest <= Number(values.limit))) fail(`frame ${frame}: ${largest.toExponential(2)} is above ${values.limit}`);
}
process.exit(0); // the engine's timers would go on
