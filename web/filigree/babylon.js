// What follows a model's driver in Babylon.js: a mesh restored in the vertex shader, and a geometry restored on the
// processor, in WebAssembly.
import { Skeleton } from "@babylonjs/core/Bones/skeleton.js";
import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import { BoundingInfo } from "@babylonjs/core/Culling/boundingInfo.js";
import { Constants } from "@babylonjs/core/Engines/constants.js";
import { MaterialPluginBase } from "@babylonjs/core/Materials/materialPluginBase.js";
import { RawTexture } from "@babylonjs/core/Materials/Textures/rawTexture.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { Geometry } from "@babylonjs/core/Meshes/geometry.js";
import { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import { VertexData } from "@babylonjs/core/Meshes/mesh.vertexData.js";
import { copyPoints, drawnSkin, drawnUvs, drawnVertices, restGradients } from "./drawn.js";

const PLUGIN = "FiligreeSkinNormals";
// Babylon turns normals with the skin's matrix itself; its cofactor is right. A mirrored world turns them inside out.
const CORRECTED = `
#if defined(NORMAL) && NUM_BONE_INFLUENCERS > 0 && !defined(BAKED_VERTEX_ANIMATION_TEXTURE)
{
    mat3 turned = mat3(finalWorld);
    mat3 cofactor = mat3(cross(turned[1], turned[2]), cross(turned[2], turned[0]), cross(turned[0], turned[1]));
    #ifdef INSTANCES
    mat3 placed = mat3(mat4(world0, world1, world2, world3));
    #else
    mat3 placed = mat3(world);
    #endif
    vNormalW = normalize((dot(cross(placed[0], placed[1]), placed[2]) < 0.0 ? -1.0 : 1.0) * (cofactor * normalUpdated));
}
#endif`;

class SkinNormals extends MaterialPluginBase {
    constructor(material) {
        super(material, PLUGIN, 200, {});
        this._enable(true);
    }
    getClassName() { return PLUGIN; }
    isCompatible(language) { return language === 0; } // GLSL, which WebGPU takes too
    getCustomCode(shader) { return shader === "vertex" ? { CUSTOM_VERTEX_UPDATE_WORLDPOS: CORRECTED } : null; }
}

/** Makes a material turn the normals of skins as they have to be under stretch. Before it is drawn. */
export function correctSkinNormals(material) {
    for (const each of material.subMaterials ?? [material])
        if (each && !each.pluginManager?.getPlugin(PLUGIN)) new SkinNormals(each);
    return material;
}

/** Matrices of the driver's vertices, 16 numbers each, as a skeleton's: there are no bones. */
class DriverSkeleton extends Skeleton {
    constructor(name, count, scene) {
        super(name, name, scene);
        if (!this.isUsingTextureForMatrices)
            throw new Error("This device has no textures of floats in vertex shaders: use RestoredGeometry.");
        this._textureWidth = Math.max(4, 4 * Math.ceil(Math.sqrt(4 * count) / 4));
        this._textureHeight = Math.ceil(4 * count / this._textureWidth);
        this._transformMatrices = new Float32Array(4 * this._textureWidth * this._textureHeight);
        this._transformMatrixTexture = RawTexture.CreateRGBATexture(this._transformMatrices, this._textureWidth,
            this._textureHeight, scene, false, false, Constants.TEXTURE_NEAREST_SAMPLINGMODE, Constants.TEXTURETYPE_FLOAT);
    }
    prepare() {}
    getTransformMatrices() { return this._transformMatrices; }
    getTransformMatrixTexture() { return this._transformMatrixTexture; }
    set(matrices) {
        this._transformMatrices.set(matrices);
        this._transformMatrixTexture.update(this._transformMatrices);
    }
}

/** Restored in the vertex shader: each frame uploads 64 bytes a driver vertex. */
export class RestoredMesh extends Mesh {
    #reach; // of the mesh from its driver

    /** model: a Model that was opened with triangles. material: one of Babylon's, also a MultiMaterial. */
    constructor(name, model, scene, material) {
        super(name, scene);
        const { corners, index } = drawnVertices(model);
        const { position, normal, joint, weight, count, reach } = drawnSkin(model, corners);
        const data = new VertexData();
        Object.assign(data, { positions: position, indices: index, // positions of the skin: the shader makes places of them
            matricesIndices: Float32Array.from(joint), matricesWeights: weight });
        if (normal) data.normals = normal;
        if (model.uvs) data.uvs = drawnUvs(model, corners, count);
        data.applyToMesh(this, false);
        this.model = model;
        this.#reach = reach;
        this.numBoneInfluencers = 3;
        this.skeleton = new DriverSkeleton(name, model.info.driverVertices, scene);
        this.alwaysSelectAsActiveMesh = true;
        this.material = correctSkinNormals(material);
        this.update(model.driverRest, model.info.hasFit ? null : restGradients(model));
    }

    /** Moves the mesh to where the driver is, with gradients where there are any. */
    update(driver, gradients = null) {
        this.skeleton.set(this.model.skinMatrices(driver.slice(), gradients));
        const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
        for (let k = 0; k < driver.length; ++k) {
            low[k % 3] = Math.min(low[k % 3], driver[k]);
            high[k % 3] = Math.max(high[k % 3], driver[k]);
        }
        const room = 2 * this.#reach; // twice: detail may be stretched
        this.setBoundingInfo(new BoundingInfo(new Vector3(low[0] - room, low[1] - room, low[2] - room),
            new Vector3(high[0] + room, high[1] + room, high[2] + room), this.computeWorldMatrix(true)));
        return this;
    }

    dispose(...how) {
        this.skeleton?.dispose();
        super.dispose(...how);
    }
}

/** One vertex for each pair of a vertex and its normal and UV, where corners have their own; else the model's. */
export class RestoredGeometry extends Geometry {
    #corners;
    #positions;
    #normals = null;

    /** model: a Model that was opened with triangles. */
    constructor(id, model, scene) {
        super(id, scene, null, true);
        this.model = model;
        const { corners, index } = drawnVertices(model);
        const count = corners ? corners.vertex.length : model.info.vertices;
        this.#corners = corners;
        this.#positions = new Float32Array(3 * count);
        if (model.info.normals > 0) this.#normals = new Float32Array(3 * count);
        this.#restore(model.driverRest, null);
        const data = new VertexData();
        Object.assign(data, { positions: this.#positions, indices: index });
        if (this.#normals) data.normals = this.#normals;
        if (model.uvs) data.uvs = drawnUvs(model, corners, count);
        data.applyToGeometry(this, true);
    }

    #restore(driver, gradients) {
        this.model.restore(driver.slice(), { gradients });
        copyPoints(this.model.positions, this.#corners?.vertex, this.#positions);
        if (this.#normals) copyPoints(this.model.normals, this.#corners?.normal, this.#normals);
    }

    /** Restores for driver positions, and gradients where there are any. */
    update(driver, gradients = null) {
        this.#restore(driver, gradients);
        this.updateVerticesData(VertexBuffer.PositionKind, this.#positions, true);
        if (this.#normals) this.updateVerticesData(VertexBuffer.NormalKind, this.#normals);
        return this;
    }
}
