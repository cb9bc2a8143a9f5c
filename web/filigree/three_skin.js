// A restore in the vertex shader of three.js: its skin, with a matrix for each driver vertex in place of bones, and with
// normals that are right under stretch. Needs nothing but three.
import { DataTexture, DetachedBindMode, FloatType, Matrix4, RGBAFormat, Skeleton, SkinnedMesh, Sphere } from "three";

const CHUNK = "#include <skinnormal_vertex>";
// three.js turns normals with the skin matrix itself; its cofactor is right.
const CORRECTED = `
#ifdef USE_SKINNING
  vec3 restNormal = objectNormal;
#endif
${CHUNK}
#ifdef USE_SKINNING
  mat3 turned = mat3( skinMatrix );
  objectNormal = mat3( cross( turned[1], turned[2] ), cross( turned[2], turned[0] ), cross( turned[0], turned[1] ) )
                 * restNormal;
#endif`;

// Of a material, also by another copy of this file. Not in userData: a clone would have that, without the function.
const CORRECTED_BY = Symbol.for("filigree.correctSkinNormals");

/** Makes a material turn the normals of skins as they have to be under stretch. Before it is drawn. */
export function correctSkinNormals(material) {
    if (material[CORRECTED_BY]) return material;
    material[CORRECTED_BY] = true;
    const before = material.onBeforeCompile, key = material.customProgramCacheKey();
    material.onBeforeCompile = function (shader, renderer) {
        before.call(this, shader, renderer);
        shader.vertexShader = shader.vertexShader.replace(CHUNK, CORRECTED);
    };
    material.customProgramCacheKey = () => `${key} filigree`;
    return material;
}

/** Matrices of the driver's vertices, 16 numbers each, as a skeleton's: there are no bones. */
export class DriverSkeleton extends Skeleton {
    constructor(count) {
        super([]);
        const side = Math.max(4, 4 * Math.ceil(Math.sqrt(4 * count) / 4));
        this.boneMatrices = new Float32Array(4 * side * side);
        this.boneTexture = new DataTexture(this.boneMatrices, side, side, RGBAFormat, FloatType);
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

/** A mesh that follows the driver: attributes skinIndex (driver vertices) and skinWeight, three of four used. */
export class DrivenMesh extends SkinnedMesh {
    /** material: one, or an array. skeleton: of the driver, which other meshes may share. */
    constructor(geometry, material, skeleton) {
        super(geometry, material);
        for (const each of material ? [material].flat() : []) correctSkinNormals(each);
        this.bindMode = DetachedBindMode; // matrices are in the mesh's own space
        if (skeleton) this.bind(skeleton, new Matrix4());
        this.frustumCulled = false;
        this.boundingSphere = new Sphere(); // three.js would ask every vertex where it is
    }

    /** Where a vertex is in the present pose. */
    getVertexPosition(vertex, target) {
        const { position, skinIndex, skinWeight } = this.geometry.attributes, at = this.skeleton.boneMatrices;
        const x = position.getX(vertex), y = position.getY(vertex), z = position.getZ(vertex);
        target.set(0, 0, 0);
        for (let k = 0; k < 3; ++k) {
            const m = 16 * skinIndex.getComponent(vertex, k), weight = skinWeight.getComponent(vertex, k);
            target.x += weight * (at[m] * x + at[m + 4] * y + at[m + 8] * z + at[m + 12]);
            target.y += weight * (at[m + 1] * x + at[m + 5] * y + at[m + 9] * z + at[m + 13]);
            target.z += weight * (at[m + 2] * x + at[m + 6] * y + at[m + 10] * z + at[m + 14]);
        }
        return target;
    }
}
