// Runs in the browser: three.js' own loader and skinning, asked for every vertex.
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';

let scene, mixer, action, mesh;

/// Loads the model. Returns { vertices, triangles, joints, duration }.
export async function load(url) {
    const gltf = await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).loadAsync(url);
    scene = gltf.scene;
    scene.updateMatrixWorld(true);
    scene.traverse((node) => { if (node.isMesh && !mesh) mesh = node; });
    mixer = new THREE.AnimationMixer(scene);
    if (gltf.animations.length > 0) {
        action = mixer.clipAction(gltf.animations[0]);
        action.play();
    }
    return {
        vertices: mesh.geometry.attributes.position.count,
        triangles: mesh.geometry.index.count / 3,
        joints: mesh.skeleton?.bones.length ?? 0,
        duration: action?.getClip().duration ?? 0,
    };
}

/// Puts the animation at a time, its end included.
function play_to(seconds) {
    action.time = Math.min(seconds, action.getClip().duration);
    mixer.update(0);
    scene.updateMatrixWorld(true);
}

/// The first `count` vertices where three.js has them: morph targets, then the skin, in double.
function evaluated(count = mesh.geometry.attributes.position.count) {
    const positions = new Float64Array(3 * count), p = new THREE.Vector3();
    for (let i = 0; i < count; ++i) {
        mesh.getVertexPosition(i, p).applyMatrix4(mesh.matrixWorld).toArray(positions, 3 * i);
    }
    return positions;
}

let reference; // { points, frames, positions(frame) }

/// Reads a PC2. Returns { points, frames, diagonal }, the diagonal of its first frame.
export async function load_reference(url) {
    const bytes = await (await fetch(url)).arrayBuffer(), head = new DataView(bytes, 0, 32);
    if (new TextDecoder('latin1').decode(new Uint8Array(bytes, 0, 11)) !== 'POINTCACHE2') throw new Error('not a PC2');
    const points = head.getInt32(16, true), frames = head.getInt32(28, true);
    reference = { points, positions: (frame) => new Float32Array(bytes, 32 + 12 * points * frame, 3 * points) };
    const box = new THREE.Box3().setFromArray(reference.positions(0));
    return { points, frames, diagonal: box.getSize(new THREE.Vector3()).length() };
}

/// Largest and RMS distance from a frame of the reference, in the file's units, over all of the reference's vertices.
export function compare(frame, seconds) {
    play_to(seconds);
    const ours = reference.positions(frame), theirs = evaluated(reference.points);
    let largest = 0, sum = 0, at = 0;
    for (let i = 0; i < ours.length; i += 3) {
        const squared = (ours[i] - theirs[i]) ** 2 + (ours[i + 1] - theirs[i + 1]) ** 2
            + (ours[i + 2] - theirs[i + 2]) ** 2;
        sum += squared;
        if (!(squared <= largest)) { largest = squared; at = i / 3; }
    }
    return { largest: Math.sqrt(largest), rms: Math.sqrt(sum / reference.points), vertex: at };
}

let renderer;

/// Pictures of the skin and of the reference's frame as a plain mesh, shaded flat: how many pixels are covered, and in
/// how many they differ. This is what the graphics card makes of the skin, in float.
export function compare_pictures(frame, seconds, size = 640) {
    renderer ??= new THREE.WebGLRenderer({ antialias: false, alpha: true });
    renderer.setSize(size, size);
    play_to(seconds);
    const ours = reference.positions(frame);
    const baked = new THREE.BufferGeometry();
    // Copies along texture seams come after the mesh's own vertices and have no frame; their triangles are left out.
    const index = Array.from(mesh.geometry.index.array);
    const kept = [];
    for (let i = 0; i < index.length; i += 3) {
        if (Math.max(index[i], index[i + 1], index[i + 2]) < reference.points) kept.push(index[i], index[i + 1], index[i + 2]);
    }
    baked.setIndex(kept);
    baked.setAttribute('position', new THREE.BufferAttribute(ours, 3));
    const shown = mesh.geometry.clone();
    shown.setIndex(kept);

    const box = new THREE.Box3().setFromBufferAttribute(baked.attributes.position);
    const centre = box.getCenter(new THREE.Vector3()), radius = box.getSize(new THREE.Vector3()).length() / 2;
    const camera = new THREE.PerspectiveCamera(35, 1, radius / 10, radius * 10);
    camera.position.copy(centre).add(new THREE.Vector3(0.5, 0.4, 1).normalize().multiplyScalar(3.6 * radius));
    camera.lookAt(centre);
    const material = new THREE.MeshStandardMaterial({ color: 0xb0b0b0, flatShading: true, roughness: 0.8 });
    const stage = new THREE.Scene();
    const light = new THREE.DirectionalLight(0xffffff, 3);
    light.position.copy(camera.position);
    stage.add(light, new THREE.AmbientLight(0xffffff, 0.4));
    const picture = (object) => {
        stage.add(object);
        renderer.render(stage, camera);
        stage.remove(object);
        const gl = renderer.getContext(), pixels = new Uint8Array(4 * size * size);
        gl.readPixels(0, 0, size, size, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        return pixels;
    };
    // The mesh itself, with other triangles and material, so that its skeleton and its place stay as they were loaded.
    const { geometry: own_geometry, material: own_material, parent } = mesh;
    Object.assign(mesh, { geometry: shown, material, frustumCulled: false });
    const theirs = picture(mesh);
    parent.add(mesh);
    Object.assign(mesh, { geometry: own_geometry, material: own_material });
    const exact = picture(new THREE.Mesh(baked, material));
    let covered = 0, different = 0;
    for (let i = 0; i < exact.length; i += 4) {
        if (exact[i + 3] > 0 || theirs[i + 3] > 0) ++covered;
        if (exact[i] !== theirs[i] || exact[i + 1] !== theirs[i + 1] || exact[i + 2] !== theirs[i + 2]
            || exact[i + 3] !== theirs[i + 3]) ++different;
    }
    baked.dispose();
    shown.dispose();
    return { covered, different };
}
