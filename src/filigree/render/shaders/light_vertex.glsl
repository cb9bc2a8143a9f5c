// Light vertex by vertex, for previews whose triangles are hardly larger than pixels: before surface_vertex.glsl.
uniform vec3 base_color;
uniform float gloss;
#ifndef PLAIN
uniform bool has_colors, has_scalars;
layout(binding = 3) uniform sampler1D scalar_colors;
#endif

/// As surface_fragment.glsl, as far as a vertex can know it.
vec3 light_at(vec3 position, vec3 normal, vec3 color, float scalar) {
    vec3 view = to_viewer(position);
    float cosine = dot(normal, view);
    if (dot(normal, normal) < 0.25) normal = view;
    else if (cosine < -0.2) normal = -normal; // just beyond the outline it still belongs to what is seen
    vec3 albedo = base_color;
#ifndef PLAIN
    if (has_colors) albedo = color;
    if (has_scalars)
        albedo = scalar < -0.25 ? vec3(0.2) : textureLod(scalar_colors, (clamp(scalar, 0.0, 1.0) * 255.0 + 0.5) / 256.0, 0.0).rgb;
#endif
    return outgoing(shade(position, normal, normal, albedo, gloss)).rgb;
}
