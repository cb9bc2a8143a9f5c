// Runs in the browser: a model restored by Babylon's vertex shader and by WebAssembly, in pictures of both.
import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { Engine } from "@babylonjs/core/Engines/engine.js";
import { HemisphericLight } from "@babylonjs/core/Lights/hemisphericLight.js";
import { StandardMaterial } from "@babylonjs/core/Materials/standardMaterial.js";
import { Color3, Color4 } from "@babylonjs/core/Maths/math.color.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import { Scene } from "@babylonjs/core/scene.js";
import { Model } from "filigree";
import { RestoredGeometry, RestoredMesh } from "filigree/babylon";

const SIZE = 256;

/** Three lights, so that a colour is half a normal and a half. */
function light(scene) {
    for (const [k, axis] of [Vector3.Right(), Vector3.Up(), Vector3.Forward()].entries()) {
        const lamp = new HemisphericLight(`axis ${k}`, axis, scene);
        lamp.diffuse = new Color3(...[0, 1, 2].map((i) => Number(i === k)));
        lamp.groundColor = lamp.specular = Color3.Black();
    }
}

/** As compare of three_probe.js, with a mirrored and turned mesh. */
export async function compare(url) {
    const model = await Model.open(await (await fetch(url)).arrayBuffer());
    const driver = model.driverRest.slice();
    for (let k = 0; k < driver.length; k += 3) {
        const [x, y, z] = driver.subarray(k, k + 3);
        driver.set([2 * x + 0.5 * z * z, 0.7 * y, z - 0.4 * x * y], k);
    }
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = SIZE;
    const engine = new Engine(canvas, false, { preserveDrawingBuffer: true, alpha: true });
    const scene = new Scene(engine);
    scene.useRightHandedSystem = true;
    scene.clearColor = new Color4(0, 0, 0, 0);
    light(scene);
    const camera = new FreeCamera("camera", new Vector3(3, 4, 6), scene);
    camera.setTarget(Vector3.Zero());
    camera.mode = FreeCamera.ORTHOGRAPHIC_CAMERA;
    camera.orthoLeft = camera.orthoBottom = -2;
    camera.orthoRight = camera.orthoTop = 2;
    const painted = () => {
        const material = new StandardMaterial("painted", scene);
        material.backFaceCulling = false;
        return material;
    };
    const shader = new RestoredMesh("shader", model, scene, painted());
    const geometry = new RestoredGeometry("processor", model, scene), processor = new Mesh("processor", scene);
    geometry.applyToMesh(processor);
    processor.material = painted();
    const gl = engine._gl;
    const picture = async (mesh) => {
        for (const other of [shader, processor]) other.setEnabled(other === mesh);
        mesh.rotation.y = 0.5; // its own place counts
        await scene.whenReadyAsync();
        scene.render();
        const pixels = new Uint8Array(4 * SIZE * SIZE);
        gl.readPixels(0, 0, SIZE, SIZE, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        return pixels;
    };
    const atRest = await picture(shader);
    shader.update(driver);
    geometry.update(driver);
    let covered = 0, different = 0, moved = 0;
    for (const side of [1, -1]) {
        shader.scaling.z = processor.scaling.z = side; // a mirrored world, as left-handed scenes have it
        const a = await picture(shader), b = await picture(processor);
        for (let k = 0; k < a.length; k += 4) {
            if (b[k + 3] > 0) ++covered;
            const off = (other) => Math.max(...[0, 1, 2, 3].map((i) => Math.abs(a[k + i] - other[k + i])));
            if (off(b) > 3) ++different;
            if (side > 0 && off(atRest) > 3) ++moved;
        }
    }
    const exact = geometry.getVerticesData(VertexBuffer.PositionKind), found = shader.getPositionData(true);
    let farthest = 0;
    for (let k = 0; k < exact.length; ++k) farthest = Math.max(farthest, Math.abs(exact[k] - found[k]));
    const { minimum, maximum } = shader.getBoundingInfo().boundingBox;
    let inBox = true;
    for (let k = 0; k < exact.length; ++k) {
        const axis = ["x", "y", "z"][k % 3];
        inBox &&= exact[k] >= minimum[axis] && exact[k] <= maximum[axis];
    }
    return { covered: covered / 2, different: different / 2, moved, farthest, holds: inBox };
}
