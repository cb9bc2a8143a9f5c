// The model: its bytes, its levels of detail, its animations, and how far they reach.
import * as THREE from 'three';
import { correctSkinNormals } from '../filigree/three_skin.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

const kFramingMoments = 32, kFramingVertices = 1500;

/// The bytes of model.glb. on_bytes: told how many there are, as they come. A page that was opened from disk may not
/// read other files, but may run scripts: there they come from model.glb.js, all at once.
export async function load_bytes(on_bytes) {
  if (location.protocol.startsWith('http')) {
    const response = await fetch('model.glb');
    if (!response.ok) throw new Error(`model.glb cannot be fetched: the server answers ${response.status}.`);
    const pieces = [], reader = response.body.getReader();
    for (let count = 0; ;) {
      const { done, value } = await reader.read();
      if (done) break;
      pieces.push(value);
      on_bytes(count += value.length);
    }
    return new Blob(pieces).arrayBuffer();
  }
  const parts = [];
  window.filigree_part = (text) => parts.push(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)));
  await new Promise((resolve, reject) => {
    const script = document.createElement('script');
    script.src = 'model.glb.js';
    script.onload = resolve;
    script.onerror = () => reject(new Error('model.glb.js is not beside this page; it holds the model when the page is opened from disk.'));
    document.head.append(script);
  });
  return new Blob(parts).arrayBuffer();
}

export class Model {
  /// bytes: of a GLB.
  static async load(bytes) {
    const loader = new GLTFLoader();
    let gltf;
    try {
      gltf = await loader.parseAsync(bytes, '');
    } catch (cause) {
      throw new Error(`model.glb is damaged or no GLB: ${cause.message}`);
    }
    const model = new Model();
    model.bytes = bytes.byteLength;
    model.json = gltf.parser.json;
    model.scene = gltf.scene;
    model.levels = await levels_of(gltf);
    if (model.levels.length === 0) throw new Error('model.glb has nothing to show: no mesh in its scene.');
    model.clips = gltf.animations;
    model.key_frames = key_frames_of(gltf);
    model.mixer = new THREE.AnimationMixer(gltf.scene);
    gltf.scene.traverse((node) => {
      if (!node.isMesh && !node.isPoints) return;
      node.frustumCulled = false; // its bounding sphere is that of one pose
      node.castShadow = node.receiveShadow = true;
      prepare(node.material);
    });
    model.show_level(0);
    model.play(0);
    model.frame_motion();
    return model;
  }

  /// What Filigree's own exports say about themselves; an empty object where the file is another's.
  get report() {
    const report = this.json.asset?.extras?.filigree ?? {};
    return typeof report === 'object' ? report : {};
  }

  /// Chooses an animation, by its number; holds it at its beginning.
  play(number) {
    this.mixer.stopAllAction();
    this.action = undefined;
    this.times = [];
    if (number < this.clips.length) {
      this.action = this.mixer.clipAction(this.clips[number]).play();
      for (const track of this.clips[number].tracks) if (track.times.length > this.times.length) this.times = track.times;
      if (this.key_frames.length > 0) this.times = this.key_frames.map(({ time }) => time);
    }
    this.seek(0);
  }
  get duration() { return this.action?.getClip().duration ?? 0; }

  /// The pose at a time, in seconds, the animation's end included.
  seek(seconds) {
    if (this.action) {
      this.action.time = Math.min(Math.max(seconds, 0), this.duration);
      this.mixer.update(0);
    }
    for (const { node } of this.key_frames) node.visible = node.scale.x > 0; // what is scaled to nothing takes time to draw
    this.scene.updateMatrixWorld(true);
  }

  /// What is to be seen at the present moment: { vertices, triangles } of its key frame, or of the finest level.
  get shown_counts() { return this.key_frames.find(({ node }) => node.visible)?.counts ?? this.levels[0]; }

  get shown_meshes() { return this.levels[this.level].meshes; }

  /// Shows one level: 0 is the finest here, as in the file.
  show_level(number) {
    this.level = number;
    this.levels.forEach((level, i) => level.nodes.forEach((node) => { node.visible = i === number; }));
  }

  framing_moments() {
    if (!this.action) return [0];
    if (this.key_frames.length > 0) return this.times;
    return Array.from({ length: kFramingMoments + 1 }, (_, i) => (this.duration * i) / kFramingMoments);
  }

  /// `reached`, the places of some vertices in all moments; `box` holds them, with some room.
  frame_motion() {
    const box = new THREE.Box3(), p = new THREE.Vector3();
    this.reached = [];
    for (const moment of this.framing_moments()) {
      this.seek(moment);
      for (const mesh of this.levels[0].meshes) {
        if (!is_seen(mesh)) continue;
        const count = mesh.geometry.attributes.position.count, step = Math.max(1, Math.floor(count / kFramingVertices));
        for (let vertex = 0; vertex < count; vertex += step) {
          mesh.getVertexPosition(vertex, p);
          box.expandByPoint(p.applyMatrix4(mesh.matrixWorld));
          this.reached.push(p.x, p.y, p.z);
        }
      }
    }
    this.seek(0);
    this.box = box.expandByScalar(0.004 * box.getSize(p).length());
  }
}

/// [{ node, time, counts }] of a film whose faces change, by time: a node for each key, scaled to nothing but from its
/// time to the next one's (write_glb_moments). Empty where the file is no such film.
function key_frames_of({ animations, scene, parser }) {
  if (parser.json.asset?.extras?.filigree?.export !== 'key frames' || animations.length !== 1) return [];
  const keys = animations[0].tracks.filter(({ name }) => name.endsWith('.scale')).map(({ name, times, values }) => {
    const node = THREE.PropertyBinding.findNode(scene, THREE.PropertyBinding.parseTrackName(name).nodeName);
    const first = times.findIndex((_, i) => values[3 * i] > 0);
    return { node, time: times[first], counts: node && level_of([node]) };
  });
  return keys.every(({ node, time }) => node && time !== undefined) ? keys.sort((a, b) => a.time - b.time) : [];
}

function is_seen(object) {
  for (let at = object; at; at = at.parent) if (!at.visible) return false;
  return true;
}

/// [{ nodes, meshes, vertices, triangles }], finest first. Coarser levels are nodes that MSFT_lod names, which three.js
/// does not know: they are loaded here, on the same joints, and put beside the finest.
async function levels_of(gltf) {
  const { parser, scene } = gltf;
  const levels = [[]];
  for (const [number, node] of (parser.json.nodes ?? []).entries()) {
    const coarser = node.extensions?.MSFT_lod?.ids ?? [];
    const object = coarser.length > 0 ? await parser.getDependency('node', number) : undefined;
    if (!object?.parent) continue;
    levels[0].push(object);
    for (const [i, id] of coarser.entries()) {
      const level = await parser.getDependency('node', id);
      object.parent.add(level);
      (levels[i + 1] ??= []).push(level);
    }
  }
  if (levels.length === 1) levels[0] = [scene];
  return levels.map(level_of).filter((level) => level.meshes.length > 0);
}

function level_of(nodes) {
  const meshes = [];
  for (const node of nodes) node.traverse((object) => { if (object.isMesh) meshes.push(object); });
  let triangles = 0, vertices = 0;
  const counted = new Set(); // parts with different materials share their vertices
  for (const { geometry, userData } of meshes) {
    triangles += (geometry.index?.count ?? geometry.attributes.position.count) / 3;
    if (counted.has(geometry.attributes.position)) continue;
    counted.add(geometry.attributes.position);
    vertices += userData.filigree?.vertices ?? geometry.attributes.position.count;
  }
  return { nodes, meshes, vertices, triangles };
}

/// Materials are kept; only what a file left open is chosen here.
function prepare(material) {
  correctSkinNormals(material);
  material.side = THREE.DoubleSide; // cloth has two, and a mirrored part shows its inside
  material.shadowSide = THREE.DoubleSide;
  const is_default = material.userData.filigree === 'none' || (!material.name && material.metalness === 1 && !material.map);
  if (!is_default) {
    material.metalness = Math.min(material.metalness, 0.4); // there are no surroundings to mirror
    return;
  }
  material.metalness = 0;
  material.roughness = 0.62;
  if (!material.vertexColors) material.color.set(0xb9a58c);
}
