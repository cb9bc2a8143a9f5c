// What a live page draws: the bodies, restored in the vertex shader, and the obstacles.
import * as THREE from 'three';
import { Model } from 'filigree';
import { RestoredMesh } from 'filigree/three';
import { StreamMaterials } from '../src/stream_materials.js';
import { BytesFile } from './bytes_file.js';

const kUp = { x: new THREE.Vector3(1, 0, 0), y: new THREE.Vector3(0, 1, 0), z: new THREE.Vector3(0, 0, 1) };
const kPlaneReach = 40; // times the size of the bodies
const kSides = { side: THREE.DoubleSide, shadowSide: THREE.DoubleSide };

export class LiveScene {
  /// file: of open_page_file.
  static async load({ head, part }) {
    const made = new LiveScene();
    made.scene = new THREE.Group(); // y is up in the picture, whatever is up in the world
    made.scene.quaternion.setFromUnitVectors(kUp[head.up], kUp.y);
    made.models = [];
    for (const place of head.models) {
      const bytes = part(place);
      made.models.push({ model: await Model.open(bytes, { fit: false }), file: new BytesFile(bytes) });
    }
    made.bodies = [];
    for (const body of head.bodies) made.bodies.push(await made.body(body));
    made.obstacles = head.obstacles.map((obstacle) => made.obstacle(obstacle, part));
    made.scene.updateMatrixWorld(true);
    return made;
  }

  async body({ name, model: number, scale, color, own_color, breaks }) {
    const { model, file } = this.models[number];
    const materials = await StreamMaterials.load(file);
    if (!own_color || materials.all.length === 1) materials.plain.color.setRGB(...color, THREE.SRGBColorSpace);
    const mesh = new RestoredMesh(model, materials.plain);
    mesh.castShadow = mesh.receiveShadow = true;
    if (own_color) {
      dress(mesh, model, file, materials);
      await materials.read_pictures(() => {});
    }
    this.scene.add(mesh);
    return { name, model, mesh, scale, breaks, driver: new Float32Array(3 * model.info.driverVertices), triangles: model.driverTriangles.slice() };
  }

  obstacle({ number, color, point, normal, positions, triangles }, part) {
    const material = new THREE.MeshStandardMaterial({ color: new THREE.Color().setRGB(...color, THREE.SRGBColorSpace), roughness: 0.9, ...kSides });
    const made = { number, color, is_ground: point !== undefined };
    if (made.is_ground) {
      made.point = new THREE.Vector3(...point);
      made.normal = new THREE.Vector3(...normal).normalize();
      made.mesh = new THREE.Mesh(new THREE.PlaneGeometry(1, 1), material);
      made.mesh.position.copy(made.point);
      made.mesh.quaternion.setFromUnitVectors(kUp.z, made.normal);
      made.is_level = made.normal.clone().applyQuaternion(this.scene.quaternion).y > 0.9999;
      made.mesh.visible = !made.is_level; // the stage draws the floor
    } else {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(part(positions).buffer), 3));
      geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(part(triangles).buffer), 1));
      made.mesh = new THREE.Mesh(geometry.toNonIndexed(), material);
      made.mesh.geometry.computeVertexNormals();
    }
    made.mesh.castShadow = !made.is_ground;
    made.mesh.receiveShadow = true;
    made.mesh.matrixAutoUpdate = false;
    made.start = new THREE.Matrix4().compose(made.mesh.position, made.mesh.quaternion, made.mesh.scale);
    made.mesh.matrix.copy(made.start);
    this.scene.add(made.mesh);
    return made;
  }

  /// Places bodies and obstacles. drivers: of each body positions (m), then gradients from metres to metres. Returns the
  /// milliseconds that the poses took.
  place(drivers, poses) {
    const start = performance.now();
    this.bodies.forEach((body, number) => {
      const count = body.driver.length;
      body.driver.set(drivers[number].subarray(0, count));
      const gradients = (body.gradients ??= new Float32Array(3 * count));
      const values = drivers[number];
      for (let k = 0; k < 3 * count; ++k) gradients[k] = values[count + k] * body.scale;
      body.mesh.update(body.driver, gradients);
    });
    this.obstacles.forEach((obstacle, k) => {
      obstacle.mesh.matrix.fromArray(poses[k]).multiply(obstacle.start);
      obstacle.mesh.matrixWorldNeedsUpdate = true;
    });
    return performance.now() - start;
  }

  /// Where all bodies are, in the picture's axes.
  body_box() {
    const box = new THREE.Box3();
    for (const { driver } of this.bodies) box.union(new THREE.Box3().setFromArray(driver));
    return box.applyMatrix4(this.scene.matrixWorld);
  }

  /// What the picture shows at the start: the bodies, the obstacles, and room beside them to fall and roll.
  room() {
    const box = this.body_box(), size = box.getSize(new THREE.Vector3()), longest = Math.max(size.x, size.y, size.z);
    for (const { is_ground, is_level, point, mesh } of this.obstacles) {
      if (!is_ground) box.union(new THREE.Box3().setFromObject(mesh));
      else if (is_level) box.expandByPoint(box.getCenter(new THREE.Vector3()).setY(point.clone().applyMatrix4(this.scene.matrixWorld).y));
    }
    for (const { is_ground, is_level, mesh, start } of this.obstacles) {
      if (!is_ground || is_level) continue;
      start.scale(new THREE.Vector3(kPlaneReach * longest, kPlaneReach * longest, 1));
      mesh.matrix.copy(start);
    }
    box.expandByVector(new THREE.Vector3(0.2 * longest, 0, 0.2 * longest));
    box.max.y += 0.15 * longest;
    return box;
  }
  /// Height of the level ground in the picture's axes; null: there is none.
  get floor() {
    const ground = this.obstacles.find(({ is_level }) => is_level);
    return ground ? ground.point.clone().applyMatrix4(this.scene.matrixWorld).y : null;
  }

  /// What a ray of the picture's axes hits first, by the drivers: { body, rest, at }, the number of the body, the point on
  /// the body at rest (m), and where it is now, in the picture's axes. Null: nothing.
  hit(ray) {
    const local = this.to_world(ray), [a, b, c, at, shares] = [0, 0, 0, 0, 0].map(() => new THREE.Vector3());
    let nearest = null;
    this.bodies.forEach(({ model, driver, triangles, scale }, body) => {
      const corners = (points, t) => [a, b, c].forEach((corner, k) => corner.fromArray(points, 3 * triangles[t + k]));
      for (let t = 0; t < triangles.length; t += 3) {
        corners(driver, t);
        if (!local.intersectTriangle(a, b, c, false, at)) continue;
        const distance = at.distanceTo(local.origin);
        if (nearest && distance >= nearest.distance) continue;
        THREE.Triangle.getBarycoord(at, a, b, c, shares);
        corners(model.driverRest, t);
        const rest = a.clone().multiplyScalar(shares.x).addScaledVector(b, shares.y).addScaledVector(c, shares.z);
        nearest = { distance, body, rest: rest.multiplyScalar(scale), at: at.clone().applyMatrix4(this.scene.matrixWorld) };
      }
    });
    return nearest;
  }
  /// A ray or a point of the picture's axes in the world's.
  to_world(thing) { return thing.clone().applyMatrix4(this.scene.matrixWorld.clone().invert()); }
  direction_to_world(direction) { return direction.clone().applyQuaternion(this.scene.quaternion.clone().invert()); }

  get vertices() { return this.bodies.reduce((sum, { model }) => sum + model.info.vertices, 0); }
  get triangles() { return this.bodies.reduce((sum, { model }) => sum + model.info.triangles, 0); }
  get driver_vertices() { return this.bodies.reduce((sum, { model }) => sum + model.info.driverVertices, 0); }
}

/// Colours of vertices and materials of faces, where the model's file has some.
function dress(mesh, model, file, materials) {
  const { geometry } = mesh, colors = file.floats('col.val');
  const { vertices } = model.info;
  if (colors && geometry.attributes.position.count === vertices) { // corners are not split
    const linear = new Float32Array(3 * vertices), color = new THREE.Color();
    for (let v = 0; v < vertices; ++v)
      color.setRGB(colors[4 * v], colors[4 * v + 1], colors[4 * v + 2], THREE.SRGBColorSpace).toArray(linear, 3 * v);
    geometry.setAttribute('color', new THREE.BufferAttribute(linear, 3));
    materials.color_by_vertices();
  }
  if (materials.all.length === 1) return;
  const of_face = file.indices('mat.fac'), faces = model.triangleFaces, from = geometry.index.array;
  if (!of_face || !faces) return;
  const material_of = (triangle) => Math.min(of_face[faces[triangle]], materials.all.length - 1);
  const order = Uint32Array.from(faces, (_, triangle) => triangle).sort((p, q) => material_of(p) - material_of(q) || p - q);
  const index = new Uint32Array(from.length), groups = [];
  order.forEach((triangle, k) => {
    index.set(from.subarray(3 * triangle, 3 * triangle + 3), 3 * k);
    const material = material_of(triangle);
    if (groups.at(-1)?.material !== material) groups.push({ material, start: 3 * k, count: 0 });
    groups.at(-1).count += 3;
  });
  geometry.setIndex(new THREE.BufferAttribute(index, 1));
  mesh.material = materials.of(groups, geometry);
}
