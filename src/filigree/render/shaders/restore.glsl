// Restores the record of this vertex: blend/blend_kernel.cpp in GLSL. GpuRestorer::bind fills what is read here.

layout(location = 4) in uvec4 restore_record; // u, v, q.x, q.y
layout(location = 5) in uvec3 restore_more;   // q.z, cell, normal

// A driver vertex: t, the columns of A, half its rest position, and one float that nobody reads.
layout(std430, binding = 0) restrict readonly buffer RestoreTransforms { mat4 restore_transforms[]; };
// A cell: its three driver vertices, and one number that nobody reads.
layout(std430, binding = 1) restrict readonly buffer RestoreCells { uvec4 restore_cells[]; };
layout(std430, binding = 2) restrict readonly buffer RestoreScale { float restore_scale; }; // of restored positions

// Octahedral [Cigolle 2014]; not yet of unit length.
vec3 restore_rest_normal() {
    uint bits = restore_more.z;
    if (bits == 0x80008000u) return vec3(0.0); // a zero normal stays zero
    vec2 e = vec2(ivec2(int(bits << 16), int(bits)) >> 16) * (1.0 / 32767.0); // two signed integers of 16 bits
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    float fold = max(-n.z, 0.0);
    n.xy += mix(vec2(fold), vec2(-fold), greaterThanEqual(n.xy, vec2(0.0)));
    return n;
}

// The three driver vertices' transforms by the record's weights; its point before them.
void restore_blend(out mat4 transform, out vec3 q) {
    vec2 weights = uintBitsToFloat(restore_record.xy);
    uvec4 cell = restore_cells[restore_more.y];
    mat4 t0 = restore_transforms[cell.x];
    transform = t0 + weights.x * (restore_transforms[cell.y] - t0) + weights.y * (restore_transforms[cell.z] - t0);
    q = uintBitsToFloat(uvec3(restore_record.zw, restore_more.x));
}

mat3 restore_gradient(mat4 transform) {
    return mat3(vec3(transform[0].w, transform[1].xy), vec3(transform[1].zw, transform[2].x), transform[2].yzw);
}

vec3 restore_position(mat4 transform, vec3 q) {
    return restore_scale * (transform[0].xyz + restore_gradient(transform) * q);
}

vec3 restore_normal(mat4 transform) {
    mat3 a = restore_gradient(transform);
    vec3 n = mat3(cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1])) * restore_rest_normal();
    return n * inversesqrt(max(dot(n, n), 1e-30));
}

void restore_vertex(out vec3 position, out vec3 normal) {
    mat4 transform;
    vec3 q;
    restore_blend(transform, q);
    position = restore_position(transform, q);
    normal = restore_normal(transform);
}

vec3 restored_position() {
    mat4 transform;
    vec3 q;
    restore_blend(transform, q);
    return restore_position(transform, q);
}

vec3 restored_normal() {
    mat4 transform;
    vec3 q;
    restore_blend(transform, q);
    return restore_normal(transform);
}
