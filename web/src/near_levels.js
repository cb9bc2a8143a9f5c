// What a view needs of a stream's levels: a level for each region of the surface, fine where it is near, coarse elsewhere,
// and triangles without cracks between them. A region is what came out of one vertex of the coarsest level; a vertex that
// its region's level lacks is drawn where the vertex that it came from is, and so on.
import * as THREE from 'three';

const kNone = 0xffffffff;
const kSeen = 0.05; // pixels (rms, and the light shows slopes): a smaller error is not seen
const kSeenAsShadow = 4; // the same of what is out of the picture: its shadow may fall into it
const kRoom = 1.25; // of a region's reach, for what an animation draws out

export class NearLevels {
  constructor() {
    this.errors = []; // of all levels that have come, coarse to fine
    this.levels = []; // { corners, runs }: those of them that have triangles of their own
    this.materials = [];
    this.frustum = new THREE.Frustum();
    this.matrix = new THREE.Matrix4();
    this.sphere = new THREE.Sphere();
  }

  /// A level that the decoder has just read. has_triangles: false where it only makes places more precise.
  add(decoder, corners, error, has_triangles) {
    this.errors.push(error);
    this.is_new = true; // corners have to be put together again, whatever is chosen
    if (!has_triangles) return;
    const runs = decoder.runs.slice();
    this.levels.push({ corners, runs });
    this.materials = [...new Set([...this.materials, ...runs.filter((_, k) => k % 3 === 0)])].sort((a, b) => a - b);
    this.parents = decoder.parents.slice();
    this.vertex_levels = decoder.levels.slice();
    this.regions = decoder.regions.slice();
    this.reaches = decoder.reaches.slice();
    if (!this.anchors) { // a vertex of each region
      this.anchors = new Uint32Array(this.reaches.length).fill(kNone);
      this.regions.forEach((region, vertex) => { if (this.anchors[region] === kNone) this.anchors[region] = vertex; });
      this.chosen = new Uint8Array(this.reaches.length);
    }
  }

  /// Chooses a level for each region: the coarsest whose error is not seen where the region's nearest point may be, nor
  /// in its shadow where it is out of the picture. place(vertex, point): where it is in the present pose.
  /// Returns whether the choice changed, the finest level of all, and whether one that has not come would be seen.
  choose(camera, height, place) {
    camera.updateMatrixWorld();
    this.frustum.setFromProjectionMatrix(this.matrix.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse));
    const { errors, anchors, chosen, sphere } = this, eye = camera.position, coarse_to_fine = this.levels.length - 1;
    const pixel = (2 * Math.tan((camera.fov / 2) * (Math.PI / 180))) / height; // at a distance of 1
    let changed = this.is_new, finest = 0, wants_more = false;
    for (let region = 0; region < anchors.length; ++region) {
      if (anchors[region] === kNone) continue;
      place(anchors[region], sphere.center);
      sphere.radius = kRoom * this.reaches[region];
      const is_seen = this.frustum.intersectsSphere(sphere);
      const nearest = Math.max(sphere.center.distanceTo(eye) - sphere.radius, camera.near);
      const seen = (is_seen ? kSeen : kSeenAsShadow) * pixel * nearest;
      let level = 0;
      while (level < errors.length && errors[level] > seen) ++level;
      if (level === errors.length) {
        --level;
        wants_more ||= is_seen;
      }
      finest = Math.max(finest, level);
      const triangles = Math.min(level, coarse_to_fine);
      changed ||= chosen[region] !== triangles;
      chosen[region] = triangles;
    }
    this.is_new = false;
    return { changed, finest, wants_more };
  }

  /// Puts the corners of all triangles of the choice into `target`. Returns [{ material, start, count }].
  assemble(target) {
    const groups = [];
    let at = 0;
    for (const material of this.materials) {
      const start = at;
      this.levels.forEach(({ corners, runs }, level) => {
        for (let k = 0, begin = 0; k < runs.length; begin += runs[k + 2], k += 3) {
          if (runs[k] !== material) continue;
          const end = begin + runs[k + 2];
          if (runs[k + 1] === kNone) at = this.add_border(corners, begin, end, level, target, at);
          else if (this.chosen[runs[k + 1]] === level) {
            target.set(corners.subarray(begin, end), at);
            at += end - begin;
          }
        }
      });
      if (at > start) groups.push({ material, start, count: at - start });
    }
    return groups;
  }

  /// Between regions the finest of their levels has the triangles: all of a finer one come of one of it.
  add_border(corners, begin, end, level, target, at) {
    const { chosen, regions } = this;
    for (let c = begin; c < end; c += 3) {
      let a = corners[c], b = corners[c + 1], d = corners[c + 2];
      const of_a = chosen[regions[a]], of_b = chosen[regions[b]], of_d = chosen[regions[d]];
      if (Math.max(of_a, of_b, of_d) !== level) continue;
      a = this.shown(a, of_a);
      b = this.shown(b, of_b);
      d = this.shown(d, of_d);
      if (a === b || b === d || d === a) continue;
      target[at] = a;
      target[at + 1] = b;
      target[at + 2] = d;
      at += 3;
    }
    return at;
  }
  shown(vertex, level) {
    while (this.vertex_levels[vertex] > level) vertex = this.parents[vertex];
    return vertex;
  }
}
