// three.js turns a skin's normals with the skin matrix itself, which is wrong under stretch. Its cofactor is right.
import { ShaderChunk } from 'three';

const kTheirs = 'objectNormal = vec4( skinMatrix * vec4( objectNormal, 0.0 ) ).xyz;';
const kOurs = `
  mat3 turned = mat3( skinMatrix );
  objectNormal = mat3( cross( turned[1], turned[2] ), cross( turned[2], turned[0] ), cross( turned[0], turned[1] ) )
                 * objectNormal;`;

/// To be called before the first picture: shaders that were compiled stay as they are.
export function correct_skinned_normals() {
  if (!ShaderChunk.skinnormal_vertex.includes(kTheirs)) throw new Error('another three.js: its skin shader has changed');
  ShaderChunk.skinnormal_vertex = ShaderChunk.skinnormal_vertex.replace(kTheirs, kOurs);
}
