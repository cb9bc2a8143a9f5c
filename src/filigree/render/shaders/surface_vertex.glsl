// A surface's vertices: given, or restored from the driver's pose (with RESTORED, after restore.glsl).
layout(location = 0) in vec3 in_position;
layout(location = 1) in vec2 in_normal; // octahedral, times 32767; -32768 for none
layout(location = 2) in vec2 in_uv;
layout(location = 3) in vec4 in_color;
layout(location = 6) in float in_scalar;

uniform vec3 offset;    // of the object: its origin minus the scene's centre
uniform float scale;    // 1 / the scene's diagonal
uniform vec4 clip;      // in scene space; what lies where dot(clip.xyz, p) > clip.w is cut away

out Surface { SURFACE_FIELDS } surface;

vec3 from_octahedron(vec2 steps) {
    if (steps.x < -32767.5) return vec3(0.0);
    vec2 e = steps * (1.0 / 32767.0);
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    float t = max(-n.z, 0.0);
    n.xy += mix(vec2(t), vec2(-t), greaterThanEqual(n.xy, vec2(0.0)));
    return normalize(n);
}

vec3 to_linear(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c)); }

void main() {
#ifdef RESTORED
    vec3 position, normal;
    restore_vertex(position, normal);
#else
    vec3 position = in_position, normal = from_octahedron(in_normal);
#endif
    position = (position + offset) * scale;
#ifdef BY_VERTEX
#ifdef PLAIN
    surface.light = light_at(position, normal, vec3(0.0), 0.0);
#else
    surface.light = light_at(position, normal, to_linear(in_color.rgb), in_scalar);
#endif
#else
    surface.position = position;
    surface.normal = normal;
#ifndef PLAIN
    surface.uv = in_uv;
    surface.color = vec4(to_linear(in_color.rgb), in_color.a);
    surface.scalar = in_scalar;
#endif
#endif
    gl_Position = frame.view_projection * vec4(position, 1.0);
#ifdef CLIPPED
    gl_ClipDistance[0] = clip.w - dot(clip.xyz, position);
#endif
}
