// A model that comes level by level, and moves from its first level on.
import * as THREE from 'three';
import { Decoder } from './decoder.js';
import { StreamFile } from './stream_file.js';
import { StreamMaterials } from './stream_materials.js';

const kFramingMoments = 32;
const kSeen = 0.05; // pixels (rms, and the light shows slopes): a smaller error is not seen

/// Matrices of the driver's vertices as a skeleton's: there are no bones.
class DriverSkeleton extends THREE.Skeleton {
  constructor(count) {
    super([]);
    const side = Math.max(4, 4 * Math.ceil(Math.sqrt(4 * count) / 4));
    this.boneMatrices = new Float32Array(4 * side * side);
    this.boneTexture = new THREE.DataTexture(this.boneMatrices, side, side, THREE.RGBAFormat, THREE.FloatType);
    this.boneTexture.needsUpdate = true;
    this.boneCount = count;
  }
  init() {}
  update() {}
  computeBoneTexture() { return this; }
  set(matrices) {
    this.boneMatrices.set(matrices);
    this.boneTexture.needsUpdate = true;
  }
}

class DrivenMesh extends THREE.SkinnedMesh {
  /// Where a vertex is in the present pose.
  getVertexPosition(vertex, target) {
    const { position, skinIndex, skinWeight } = this.geometry.attributes, at = this.skeleton.boneMatrices;
    const p = new THREE.Vector3().fromBufferAttribute(position, vertex), q = new THREE.Vector3();
    target.set(0, 0, 0);
    for (let k = 0; k < 3; ++k) {
      const matrix = new THREE.Matrix4().fromArray(at, 16 * skinIndex.getComponent(vertex, k));
      target.addScaledVector(q.copy(p).applyMatrix4(matrix), skinWeight.getComponent(vertex, k));
    }
    return target;
  }
}

/// sRGB bytes as linear numbers, which shaders mix.
function linear_colors(bytes) {
  const linear = Uint16Array.from({ length: 256 }, (_, byte) => {
    const c = byte / 255;
    return Math.round(65535 * (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
  });
  return Uint16Array.from(bytes, (byte, k) => k % 4 === 3 ? 257 * byte : linear[byte]);
}

export class StreamModel {
  static async load() {
    const model = new StreamModel();
    model.file = await StreamFile.open();
    model.decoder = await Decoder.make();
    await model.begin();
    await model.next_level();
    model.show_level(0);
    model.box = model.animated_box();
    return model;
  }

  async begin() {
    const { file, decoder } = this;
    const par = await file.view('cd.par');
    const count = (at) => Number(par.getBigUint64(at, true));
    const low = [24, 32, 40].map((at) => par.getFloat64(at, true)), is_by_surface = par.getUint32(60, true) !== 0;
    this.counts = { vertices: count(0), faces: count(8), corners: count(16), driver: count(72) };
    decoder.begin({ normal: is_by_surface ? 1 : 4, tangential: 4, is_refined: is_by_surface ? 0 : 1 }, low,
      par.getFloat64(48, true), 2 * this.counts.corners + 2);
    const table = await file.view('cd.stm');
    this.table = [];
    for (let at = 0; at < table.byteLength; at += 16)
      this.table.push({ batches: table.getUint32(at + 8, true), error: table.getFloat32(at + 12, true) });

    this.scene = new THREE.Group();
    this.levels = [];
    this.arrived = 0;
    this.arrivals = []; // when each level was there, seconds of the page's clock
    this.chooses = true;
    this.materials = await StreamMaterials.load(file);
    this.times = [];
    this.clips = [];
    if (!file.has('cd.pose')) return;
    Object.assign(this.counts, { driver_faces: count(80), driver_corners: count(88) });
    await this.read_poses();
    const fps = (await file.view('pose.fps')).getFloat64(0, true);
    this.times = Array.from({ length: decoder.frame_count }, (_, frame) => frame / fps);
    this.skeleton = new DriverSkeleton(this.counts.driver);
    this.action = { name: '' };
    this.driver_level = { meshes: [this.driver_mesh()] };
    this.seek(0);
  }

  async read_poses() {
    const { file, decoder, counts } = this, clip = await file.view('cd.pose');
    this.pose_sections ??= [await file.section('cd.drv')];
    const [driver, ...blocks] = this.pose_sections;
    decoder.read('read_driver', [driver], counts.driver, counts.driver_faces, counts.driver_corners, counts.vertices);
    for (let k = 0; file.has('cd.clip', k); ++k) {
      blocks[k] ??= await file.section('cd.clip', k);
      decoder.read_clip(blocks[k], clip.getUint32(4, true));
    }
    this.pose_sections = [driver, ...blocks];
  }

  get is_stream() { return true; }
  get bytes() { return this.file.bytes; }
  get bytes_read() { return this.arrived > 0 ? this.ends[this.arrived - 1] : 0; }
  get ends() {
    return this.table.map(({ batches }, k) => k === 0 ? this.file.end_of(this.file.has('cd.batt') ? 'cd.batt' : 'cd.bpos')
      : batches > 0 ? this.file.end_of('cd.lev', k) : this.file.end_of('cd.ref', k - 1));
  }
  get report() { return { vertices: this.counts.vertices, joints: this.skeleton ? this.counts.driver : 0 }; }
  get duration() { return this.times.at(-1) ?? 0; }
  get is_whole() { return this.arrived === this.table.length; }

  play() { this.seek(0); }
  seek(seconds) {
    if (!this.skeleton) return;
    const rate = this.times.length > 1 ? 1 / this.times[1] : 1, at = Math.min(seconds * rate, this.times.length - 1);
    const frame = Math.floor(at);
    this.skeleton.set(this.decoder.pose(frame, at - frame, this.counts.driver));
  }

  /// The driver, each vertex with its own matrix.
  driver_mesh() {
    const count = this.counts.driver, joints = new Uint16Array(4 * count), weights = new Uint16Array(4 * count);
    for (let v = 0; v < count; ++v) {
      joints[4 * v] = v;
      weights[4 * v] = 65535;
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(this.decoder.driver_rest(count).slice(), 3));
    geometry.setAttribute('skinIndex', new THREE.BufferAttribute(joints, 4));
    geometry.setAttribute('skinWeight', new THREE.BufferAttribute(weights, 4, true));
    geometry.setIndex(new THREE.BufferAttribute(this.decoder.driver_triangles.slice(), 1));
    const mesh = new DrivenMesh(geometry, this.materials.plain);
    mesh.bind(this.skeleton, new THREE.Matrix4());
    return mesh;
  }

  /// Fetches the next level and puts it in front; false: all are there.
  async next_level() {
    if (this.is_whole) return false;
    const { file, decoder } = this, k = this.arrived, { batches, error } = this.table[k];
    if (k === 0)
      decoder.read('read_coarsest', [await file.section('cd.bcon'), await file.section('cd.bpos'), await file.section('cd.batt')]);
    else if (batches > 0)
      decoder.read('read_level', [await file.section('cd.lev', k)], batches);
    else
      for (let level = 1; level < k; ++level)
        decoder.read('read_refinement', [await file.section('cd.ref', level)], level === k - 1 ? 1 : 0);
    ++this.arrived;
    this.add_level(error);
    this.arrivals.push({ seconds: performance.now() / 1000, error });
    if (this.is_whole) await this.free_decoder();
    return true;
  }

  /// A new decoder, which has the poses alone: memory that one took is only given back with it.
  async free_decoder() {
    this.decoder = await Decoder.make();
    if (this.skeleton) await this.read_poses();
  }

  add_level(error) {
    const { decoder } = this;
    const shared = {
      position: new THREE.BufferAttribute(decoder.positions.slice(), 3),
      normal: new THREE.InterleavedBufferAttribute(new THREE.InterleavedBuffer(decoder.normals.slice(), 4), 3, 0, true),
    };
    if (this.skeleton) {
      const skins = new THREE.InterleavedBuffer(decoder.skins.slice(), 8);
      shared.skinIndex = new THREE.InterleavedBufferAttribute(skins, 4, 0, false);
      shared.skinWeight = new THREE.InterleavedBufferAttribute(skins, 4, 4, true);
    }
    if (decoder.uvs) shared.uv = new THREE.BufferAttribute(decoder.uvs.slice(), 2);
    if (decoder.colors) {
      shared.color = new THREE.BufferAttribute(linear_colors(decoder.colors), 4, true);
      this.materials.color_by_vertices();
    }
    const geometry = new THREE.BufferGeometry(), corners = decoder.corners.slice();
    geometry.setIndex(new THREE.BufferAttribute(corners, 1));
    const material = this.materials.of(decoder.groups, geometry);
    const mesh = this.skeleton ? new DrivenMesh(geometry, material) : new THREE.Mesh(geometry, material);
    if (this.skeleton) mesh.bind(this.skeleton, new THREE.Matrix4());
    mesh.frustumCulled = false;
    mesh.boundingSphere = new THREE.Sphere(); // three.js would ask every vertex where it is
    mesh.castShadow = mesh.receiveShadow = true;
    mesh.visible = false;
    this.scene.add(mesh);
    this.levels.unshift({ nodes: [mesh], meshes: [mesh], vertices: decoder.surface_vertex_count, triangles: corners.length / 3, error });
    // Vertices of coarser levels are the first ones: all levels share one set, the finest's.
    for (const level of this.levels)
      for (const { geometry: theirs } of level.meshes) {
        theirs.dispose();
        for (const [name, attribute] of Object.entries(shared)) theirs.setAttribute(name, attribute);
      }
    if (this.level !== undefined) this.level += 1;
  }

  show_level(number) {
    this.level = number;
    this.levels.forEach((level, i) => level.nodes.forEach((node) => { node.visible = i === number; }));
  }

  /// The coarsest level whose error is not seen, and whether an even finer one that has not come would be.
  choose_level(camera, height) {
    const nearest = this.box.distanceToPoint(camera.position);
    const pixel = (2 * Math.tan((camera.fov / 2) * (Math.PI / 180)) * Math.max(nearest, camera.near)) / height;
    const number = this.levels.findLastIndex(({ error }) => error <= kSeen * pixel);
    return { number: Math.max(number, 0), wants_more: number < 0 && !this.is_whole };
  }

  /// The box of all moments, from the coarsest level's vertices, with some room.
  animated_box() {
    const box = new THREE.Box3(), p = new THREE.Vector3(), [{ meshes: [mesh] }] = this.levels;
    const moments = this.action ? kFramingMoments : 0, used = new Set(mesh.geometry.index.array);
    for (let i = 0; i <= moments; ++i) {
      this.seek((this.duration * i) / Math.max(moments, 1));
      for (const vertex of used) box.expandByPoint(mesh.getVertexPosition(vertex, p));
    }
    this.seek(0);
    return box.expandByScalar(0.02 * box.getSize(p).length());
  }
}
