// Rapier drops a soft body onto the ground; each frame its particles move the driver, and the vertex shader of three.js
// restores the mesh. rapier_three.html says how to start it.
import RAPIER from "@dimforge/rapier3d-compat";
import { Model } from "filigree";
import { Embedding } from "filigree/embedding.js";
import { RestoredMesh } from "filigree/three.js";
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const SIZE = 2; // metres, of the body's longest side
const HEIGHT = 1; // metres, that it falls
const CELLS = 12; // along its longest side

const model = await Model.open(await (await fetch("scan.fil")).arrayBuffer());
await RAPIER.init();

// The model's units to metres, its middle over the origin.
const box = new THREE.Box3().setFromArray(model.driverRest), side = box.getSize(new THREE.Vector3());
const scale = SIZE / Math.max(side.x, side.y, side.z), middle = box.getCenter(new THREE.Vector3());
const shift = [-scale * middle.x, HEIGHT - scale * box.min.y, -scale * middle.z];
const inWorld = (points) => points.map((x, k) => scale * x + shift[k % 3]);
const inModel = (points) => points.map((x, k) => (x - shift[k % 3]) / scale);

const world = new RAPIER.World({ x: 0, y: -9.81, z: 0 });
world.createCollider(RAPIER.ColliderDesc.cuboid(20, 1, 20).setTranslation(0, -1, 0));
const description = RAPIER.SoftBodyDesc.volumetric(inWorld(model.driverRest), model.driverTriangles.slice(), SIZE / CELLS);
description.setSoftness(12, 0.15);
const body = world.createSoftBody(description);
// Built in the model's space and followed in the world's, so the gradients carry the scale.
const embedding = new Embedding(model.driverRest, inModel(body.particlePositions()), { cells: body.cells() });

const renderer = new THREE.WebGLRenderer({ antialias: true });
renderer.shadowMap.enabled = true;
document.body.append(renderer.domElement);
const scene = new THREE.Scene();
scene.background = new THREE.Color(0xdfe4ea);
const camera = new THREE.PerspectiveCamera(35, 1, 0.1, 50);
camera.position.set(1.2, 1.2, 3.3);
const controls = new OrbitControls(camera, renderer.domElement);
controls.target.set(0, 0.55, 0);
controls.update();
const sun = new THREE.DirectionalLight(0xffffff, 2.6);
sun.position.set(2, 5, 3);
sun.castShadow = true;
sun.shadow.mapSize.set(2048, 2048);
Object.assign(sun.shadow.camera, { left: -2.5, right: 2.5, top: 2.5, bottom: -2.5 });
sun.shadow.normalBias = 0.01;
const ground = new THREE.Mesh(new THREE.CircleGeometry(8, 64), new THREE.MeshStandardMaterial({ color: 0xc8ced6 }));
ground.rotation.x = -Math.PI / 2;
ground.receiveShadow = true;
const mesh = new RestoredMesh(model, new THREE.MeshStandardMaterial({ color: 0xb9a58c, roughness: 0.6, side: THREE.DoubleSide }));
mesh.castShadow = mesh.receiveShadow = true;
scene.add(sun, new THREE.HemisphereLight(0xffffff, 0x9aa0a8, 1.2), ground, mesh);

/** One frame. Times of its parts in milliseconds. */
function frame(draws = true) {
    const times = [performance.now()];
    const done = () => times.push(performance.now());
    world.step();
    done();
    embedding.follow(body.particlePositions()); // your simulator's arrays in
    done();
    mesh.update(embedding.positions, embedding.gradients); // vertices out
    done();
    if (draws) renderer.render(scene, camera);
    done();
    const [step, follow, pose, draw] = times.slice(1).map((time, k) => time - times[k]);
    return { step, follow, pose, draw };
}

function resize() {
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    renderer.setSize(innerWidth, innerHeight);
    camera.aspect = innerWidth / innerHeight;
    camera.updateProjectionMatrix();
}
addEventListener("resize", resize);
resize();
const facts = `${model.info.vertices.toLocaleString("en")} vertices follow ${body.numParticles()} particles`;
let frames = 0, since = performance.now();
renderer.setAnimationLoop(() => {
    frame();
    if (++frames % 30 > 0) return;
    const now = performance.now();
    document.getElementById("facts").textContent = `${facts}, ${Math.round(30000 / (now - since))} frames a second`;
    since = now;
});
window.example = { frame, model, embedding, body, renderer, mesh }; // for the console, and for bench/runtime_page.mjs
