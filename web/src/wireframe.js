// The edges of the level that is shown, over its surface.
import * as THREE from 'three';

export class Wireframe {
  constructor(model) {
    this.model = model;
    this.copies = new Map(); // of each mesh, made when it is first needed
    this.material = new THREE.MeshBasicMaterial({ wireframe: true, transparent: true, opacity: 0.35, depthWrite: false });
  }
  set_dark(dark) { this.material.color.set(dark ? 0xffffff : 0x101418); }

  show(shown) {
    this.is_shown = shown;
    this.follow_level();
  }

  /// Edges of the present level, none of the others.
  follow_level() {
    for (const copy of this.copies.values()) copy.visible = false;
    for (const mesh of this.model.shown_meshes) {
      for (const material of [mesh.material].flat()) { // the surface steps back behind its edges
        material.polygonOffset = this.is_shown;
        material.polygonOffsetFactor = material.polygonOffsetUnits = 1;
      }
      if (this.is_shown) this.copy(mesh).visible = true;
    }
  }

  copy(mesh) {
    if (!this.copies.has(mesh)) {
      const copy = new mesh.constructor(mesh.geometry, this.material);
      if (mesh.isSkinnedMesh) copy.bind(mesh.skeleton, mesh.bindMatrix);
      copy.morphTargetInfluences = mesh.morphTargetInfluences;
      copy.frustumCulled = false;
      if (mesh.boundingSphere !== undefined) copy.boundingSphere = mesh.boundingSphere;
      mesh.add(copy);
      this.copies.set(mesh, copy);
    }
    return this.copies.get(mesh);
  }
}
