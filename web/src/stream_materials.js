// What a stream's surface looks like: one material for each that its file names, pictures when they have come.
import * as THREE from 'three';
import { correctSkinNormals } from '../filigree/three_skin.js';

const kMaterialBytes = 32, kNone = 0xffffffff;
const kSides = { side: THREE.DoubleSide, shadowSide: THREE.DoubleSide }; // cloth has two, and a mirrored part shows its inside

export class StreamMaterials {
  /// Of all materials, in the file's order; behind them that of faces which have none.
  static async load(file) {
    const made = new StreamMaterials();
    made.file = file;
    made.plain = new THREE.MeshStandardMaterial({ color: 0xb9a58c, metalness: 0, roughness: 0.62, ...kSides });
    made.all = [correctSkinNormals(made.plain)];
    made.pictures = []; // [{ section, materials }]
    const records = await file.view('mat.emb');
    for (let at = 0; at + kMaterialBytes <= records.byteLength; at += kMaterialBytes) made.add(records, at);
    return made;
  }

  add(records, at) {
    const real = (k) => records.getFloat32(at + 4 * k, true), picture = records.getUint32(at + 28, true);
    const color = new THREE.Color().setRGB(real(0), real(1), real(2), THREE.SRGBColorSpace), opacity = real(3);
    const material = new THREE.MeshStandardMaterial({ color, opacity, transparent: opacity < 1, roughness: real(5),
      metalness: Math.min(real(4), 0.4), ...kSides }); // there are no surroundings to mirror
    this.all.splice(-1, 0, correctSkinNormals(material));
    if (picture === kNone) return;
    const known = this.pictures.find(({ section }) => section === picture);
    if (known) known.materials.push(material);
    else this.pictures.push({ section: picture, materials: [material] });
  }

  /// Of a mesh whose corners come in such groups, for its geometry; the file's numbers may be anything.
  of(groups, geometry) {
    if (this.all.length === 1) return this.plain;
    for (const { material, start, count } of groups)
      geometry.addGroup(start, count, Math.min(material, this.all.length - 1));
    return this.all;
  }
  color_by_vertices() {
    for (const material of this.all) material.vertexColors = true;
    this.plain.color.set(0xffffff);
  }

  /// Reads the pictures, one after the other, and puts them on: surfaces are seen without them until then.
  async read_pictures(tell) {
    for (const { section, materials } of this.pictures) {
      const blob = new Blob([await this.file.section('mat.pic', section)]);
      const image = await createImageBitmap(blob, { imageOrientation: 'flipY', colorSpaceConversion: 'none' }).catch(() => null);
      if (!image) throw new Error('model.fil has a picture that the browser cannot show.');
      const texture = new THREE.Texture(image);
      Object.assign(texture, { flipY: false, colorSpace: THREE.SRGBColorSpace, wrapS: THREE.RepeatWrapping,
        wrapT: THREE.RepeatWrapping, anisotropy: 4, needsUpdate: true });
      for (const material of materials) Object.assign(material, { map: texture, needsUpdate: true });
      tell();
    }
    this.pictures = [];
  }
}
