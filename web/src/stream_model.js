// A model that comes level by level, and moves from its first level on.
import * as THREE from 'three';
import { DrivenMesh, DriverSkeleton } from '../filigree/three_skin.js';
import { Decoder } from './decoder.js';
import { NearLevels } from './near_levels.js';
import { StreamFile } from './stream_file.js';
import { StreamMaterials } from './stream_materials.js';

const kFramingMoments = 32;
const kPause = 120; // milliseconds between two choices of what is drawn: memory is moved

/// sRGB bytes as linear numbers, which shaders mix.
function linear_colors(bytes) {
  const linear = Uint16Array.from({ length: 256 }, (_, byte) => {
    const c = byte / 255;
    return Math.round(65535 * (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
  });
  return Uint16Array.from(bytes, (byte, k) => k % 4 === 3 ? 257 * byte : linear[byte]);
}

/// Runs of corners by their materials alone.
function groups_of(runs) {
  const groups = [];
  for (let k = 0, start = 0; k < runs.length; start += runs[k + 2], k += 3) {
    if (groups.at(-1)?.material !== runs[k]) groups.push({ material: runs[k], start, count: 0 });
    groups.at(-1).count += runs[k + 2];
  }
  return groups;
}

export class StreamModel {
  static async load() {
    const model = new StreamModel();
    model.file = await StreamFile.open();
    model.decoder = await Decoder.make();
    await model.begin();
    await model.next_level();
    model.show_level(0);
    model.frame_motion();
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
    this.chooses = true; // what is near is drawn fine; else one level is drawn
    this.near = new NearLevels();
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
    return new DrivenMesh(geometry, this.materials.plain, this.skeleton);
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
    this.add_level(error, k === 0 || batches > 0);
    this.arrivals.push({ seconds: performance.now() / 1000, error });
    if (this.is_whole) await this.free_decoder();
    return true;
  }

  /// A new decoder, which has the poses alone: memory that one took is only given back with it.
  async free_decoder() {
    this.decoder = await Decoder.make();
    if (this.skeleton) await this.read_poses();
  }

  add_level(error, has_triangles) {
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
    const corners = has_triangles ? decoder.corners.slice() : this.levels[0].meshes[0].geometry.index.array;
    this.near.add(decoder, corners, error, has_triangles);
    const mesh = this.mesh(new THREE.BufferGeometry().setIndex(new THREE.BufferAttribute(corners, 1)));
    mesh.material = this.materials.of(groups_of(decoder.runs), mesh.geometry);
    this.levels.unshift({ nodes: [mesh], meshes: [mesh], vertices: decoder.surface_vertex_count, triangles: corners.length / 3, error });
    this.near_mesh ??= this.mesh(new THREE.BufferGeometry());
    // Vertices of coarser levels are the first ones: all levels share one set, the finest's.
    for (const { geometry } of [this.near_mesh, ...this.levels.flatMap(({ meshes }) => meshes)]) {
      geometry.dispose();
      for (const [name, attribute] of Object.entries(shared)) geometry.setAttribute(name, attribute);
    }
    this.near_mesh.geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(corners.length), 1));
    this.near_choice = undefined;
    if (this.level !== undefined) this.level += 1;
  }

  mesh(geometry) {
    const { plain } = this.materials;
    const mesh = this.skeleton ? new DrivenMesh(geometry, plain, this.skeleton) : new THREE.Mesh(geometry, plain);
    mesh.frustumCulled = false;
    mesh.boundingSphere ??= new THREE.Sphere(); // three.js would ask every vertex where it is
    mesh.castShadow = mesh.receiveShadow = true;
    mesh.visible = false;
    this.scene.add(mesh);
    return mesh;
  }

  show_level(number) {
    this.level = number;
    this.near_mesh.visible = false;
    this.near_choice = undefined;
    this.levels.forEach((level, i) => level.nodes.forEach((node) => { node.visible = i === number; }));
  }
  get shown_meshes() { return this.chooses ? [this.near_mesh] : this.levels[this.level].meshes; }

  /// Puts fine triangles where they are near. Returns whether others are drawn than before, whether a level that has not
  /// come would be seen, and whether it was too soon to choose.
  choose_near(camera, height) {
    const now = performance.now(), is_soon = this.near_choice && now - this.near_choice.time < kPause;
    if (is_soon) return { ...this.near_choice, changed: false, is_soon };
    const { changed, finest, wants_more } = this.near.choose(camera, height, (vertex, point) => this.place(vertex, point));
    const { geometry } = this.near_mesh, is_changed = changed || !this.near_mesh.visible;
    if (changed) {
      const groups = this.near.assemble(geometry.index.array), { start, count } = groups.at(-1) ?? { start: 0, count: 0 };
      geometry.clearGroups();
      this.near_mesh.material = this.materials.of(groups, geometry);
      geometry.setDrawRange(0, start + count);
      geometry.index.clearUpdateRanges();
      geometry.index.addUpdateRange(0, start + count);
      geometry.index.needsUpdate = true;
    }
    if (is_changed) for (const { nodes } of this.levels) for (const node of nodes) node.visible = false;
    this.near_mesh.visible = true;
    this.level = this.levels.length - 1 - finest;
    this.near_choice = { time: now, wants_more: wants_more && !this.is_whole };
    return { ...this.near_choice, changed: is_changed };
  }
  get near_triangles() { return this.near_mesh.geometry.drawRange.count / 3; }

  /// Where a vertex is in the present pose.
  place(vertex, point) {
    const { position } = this.near_mesh.geometry.attributes;
    return this.skeleton ? this.near_mesh.getVertexPosition(vertex, point) : point.fromBufferAttribute(position, vertex);
  }

  /// `reached`, the places of the coarsest level's vertices in all moments; `box` holds them, with some room.
  frame_motion() {
    this.reached = [];
    const box = new THREE.Box3(), p = new THREE.Vector3(), [{ meshes: [mesh] }] = this.levels;
    const moments = this.action ? kFramingMoments : 0, used = new Set(mesh.geometry.index.array);
    for (let i = 0; i <= moments; ++i) {
      this.seek((this.duration * i) / Math.max(moments, 1));
      for (const vertex of used) {
        box.expandByPoint(mesh.getVertexPosition(vertex, p));
        this.reached.push(p.x, p.y, p.z);
      }
    }
    this.seek(0);
    this.box = box.expandByScalar(0.02 * box.getSize(p).length());
  }
}
