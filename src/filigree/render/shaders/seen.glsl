// What a pass keeps of the surface seen at a pixel, until it is lit: then every pixel is lit once, whole rows of them at
// a time. Where triangles are hardly larger than pixels, lighting the pixels of each triangle takes several times as
// long. As little as possible is computed here. x, y: the normal, 16 bits each; y: geometric normal, octahedral, 8 bits
// each; z: albedo by roots, 9 bits each, and gloss; w: the place along the ray through the pixel.

uint look_of(vec3 albedo, float gloss) {
    uvec3 root = uvec3(sqrt(clamp(albedo, 0.0, 1.0)) * 511.0 + 0.5);
    return root.x | root.y << 9 | root.z << 18 | uint(gloss * 31.0 + 0.5) << 27;
}

uvec4 kept(vec3 position, vec3 facing, vec3 normal, uint look) {
    vec2 e = facing.xy / max(abs(facing.x) + abs(facing.y) + abs(facing.z), 1e-30);
    if (facing.z < 0.0) e = (1.0 - abs(e.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(e, vec2(0.0)));
    uvec2 side = uvec2(e * 127.0 + 127.5);
    uvec3 n = uvec3(normal * 32767.0 + 32768.0);
    return uvec4(n.x | n.y << 16, n.z | side.x << 16 | side.y << 24, look,
                 floatBitsToUint(dot(frame.along.xyz, position) + frame.along.w));
}
