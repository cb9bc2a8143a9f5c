// Runs in the browser: a model restored by three.js' vertex shader and by WebAssembly, in pictures of both.
import * as THREE from "three";
import { Model } from "filigree";
import { RestoredGeometry, RestoredMesh } from "filigree/three";

const SIZE = 256;

/** Pictures of normals by both, of a bend and a stretch. { covered, different }: pixels, and those off by more than 3. */
export async function compare(url) {
    const model = await Model.open(await (await fetch(url)).arrayBuffer());
    const driver = model.driverRest.slice();
    for (let k = 0; k < driver.length; k += 3) {
        const [x, y, z] = driver.subarray(k, k + 3);
        driver.set([2 * x + 0.5 * z * z, 0.7 * y, z - 0.4 * x * y], k);
    }
    const material = new THREE.MeshNormalMaterial({ side: THREE.DoubleSide });
    const shader = new RestoredMesh(model, material), box = new THREE.Box3();
    const processor = new THREE.Mesh(new RestoredGeometry(model), new THREE.MeshNormalMaterial({ side: THREE.DoubleSide }));
    const stage = new THREE.Scene(), camera = new THREE.OrthographicCamera(-2, 2, 2, -2, 0.1, 20);
    camera.position.set(3, 4, 6);
    camera.lookAt(0, 0, 0);
    const renderer = new THREE.WebGLRenderer({ alpha: true });
    renderer.setSize(SIZE, SIZE, false);
    const gl = renderer.getContext();
    const picture = (mesh) => {
        mesh.rotation.y = 0.5; // its own place counts
        stage.add(mesh);
        renderer.render(stage, camera);
        stage.remove(mesh);
        const pixels = new Uint8Array(4 * SIZE * SIZE);
        gl.readPixels(0, 0, SIZE, SIZE, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        return pixels;
    };
    const atRest = picture(shader);
    shader.update(driver);
    processor.geometry.update(driver);
    const a = picture(shader), b = picture(processor);
    let covered = 0, different = 0, moved = 0;
    for (let k = 0; k < a.length; k += 4) {
        if (b[k + 3] > 0) ++covered;
        const off = (other) => Math.max(...[0, 1, 2, 3].map((i) => Math.abs(a[k + i] - other[k + i])));
        if (off(b) > 3) ++different;
        if (off(atRest) > 3) ++moved;
    }
    box.setFromBufferAttribute(processor.geometry.attributes.position);
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((c) => new THREE.Vector3(box[c & 1 ? "max" : "min"].x,
        box[c & 2 ? "max" : "min"].y, box[c & 4 ? "max" : "min"].z));
    const place = new THREE.Vector3(), exact = new THREE.Vector3();
    let farthest = 0;
    for (let v = 0; v < processor.geometry.attributes.position.count; ++v)
        farthest = Math.max(farthest, shader.getVertexPosition(v, place).distanceTo(
            exact.fromBufferAttribute(processor.geometry.attributes.position, v)));
    const middle = box.getCenter(place);
    return { covered, different, moved, farthest, holds: shader.boundingSphere.containsPoint(middle) &&
        shader.boundingSphere.radius < 3 * Math.max(...corners.map((c) => c.distanceTo(middle))) };
}
