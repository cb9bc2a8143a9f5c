// The driver: the edges of the coarsest level, or the joints alone where the file has but one level.
import * as THREE from 'three';
import { LineMaterial } from 'three/addons/lines/LineMaterial.js';
import { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';

const kNearer = 0.02; // lines are drawn this much nearer, as a fraction of the diagonal: the driver cuts through the surface
const kHidden = 0.28; // opacity of what lies behind the surface

/// Lines that follow the coarsest level's mesh. Null where there is nothing to show.
export function make_driver(model, diagonal) {
  if (model.driver_level) return new DriverEdges(model.driver_level, kNearer * diagonal);
  if (model.is_stream) return null;
  if (model.levels.length > 1) return new DriverEdges(model.levels.at(-1), kNearer * diagonal);
  const skinned = model.levels[0].meshes.find((mesh) => mesh.isSkinnedMesh);
  return skinned ? new DriverJoints(skinned.skeleton) : null;
}

class DriverEdges {
  constructor(level, nearer) {
    this.segments = [];
    for (const mesh of level.meshes) {
      const seen = new Set(), index = mesh.geometry.index?.array ?? [];
      for (let corner = 0; corner < index.length; ++corner) {
        const [a, b] = [index[corner], index[corner % 3 === 2 ? corner - 2 : corner + 1]];
        const edge = Math.min(a, b) * 2 ** 26 + Math.max(a, b);
        if (seen.has(edge)) continue;
        seen.add(edge);
        this.segments.push([mesh, a, b]);
      }
    }
    const geometry = new LineSegmentsGeometry();
    this.ends = new Float32Array(6 * this.segments.length);
    geometry.setPositions(this.ends);
    this.buffer = geometry.attributes.instanceStart.data;
    this.materials = [line_material(nearer, {}), line_material(nearer, { opacity: kHidden, depthFunc: THREE.GreaterDepth })];
    this.object = new THREE.Group();
    for (const material of this.materials) {
      const lines = new LineSegments2(geometry, material);
      lines.frustumCulled = false;
      this.object.add(lines);
    }
  }
  color(color) { for (const material of this.materials) material.color.set(color); }

  /// Brings the lines to the present pose.
  follow() {
    const places = new Map(), p = new THREE.Vector3();
    const place = (mesh, vertex) => {
      let known = places.get(mesh);
      if (!known) places.set(mesh, (known = []));
      return (known[vertex] ??= mesh.getVertexPosition(vertex, p).applyMatrix4(mesh.matrixWorld).toArray());
    };
    this.segments.forEach(([mesh, a, b], i) => {
      this.ends.set(place(mesh, a), 6 * i);
      this.ends.set(place(mesh, b), 6 * i + 3);
    });
    this.buffer.array.set(this.ends);
    this.buffer.needsUpdate = true;
  }
}

function line_material(nearer, options) {
  const material = new LineMaterial({ linewidth: 1.4, transparent: true, depthWrite: false, ...options });
  const start = 'vec4 end = modelViewMatrix * vec4( instanceEnd, 1.0 );';
  material.vertexShader = material.vertexShader.replace(start, `${start}
    start.xyz *= 1.0 - ${nearer.toExponential()} / max(length(start.xyz), ${(4 * nearer).toExponential()});
    end.xyz *= 1.0 - ${nearer.toExponential()} / max(length(end.xyz), ${(4 * nearer).toExponential()});`);
  return material;
}

class DriverJoints {
  constructor(skeleton) {
    this.skeleton = skeleton;
    this.places = new Float32Array(3 * skeleton.bones.length);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(this.places, 3));
    this.materials = [new THREE.PointsMaterial({ size: 5, sizeAttenuation: false, depthTest: false, transparent: true })];
    this.object = new THREE.Points(geometry, this.materials[0]);
    this.object.frustumCulled = false;
  }
  color(color) { this.materials[0].color.set(color); }
  follow() {
    const p = new THREE.Vector3();
    this.skeleton.bones.forEach((bone, i) => p.setFromMatrixPosition(bone.matrixWorld).toArray(this.places, 3 * i));
    this.object.geometry.attributes.position.needsUpdate = true;
  }
}
