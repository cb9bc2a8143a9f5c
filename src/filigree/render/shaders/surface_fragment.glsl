in Surface { SURFACE_FIELDS } surface;
#ifdef EDGES
noperspective in vec3 edge_distance;
flat in float smallest_height;
uniform vec3 edge_color;
uniform float edge_width;
uniform bool has_surface;
#endif

uniform vec3 base_color; // all colours are linear
uniform bool has_colors, has_scalars, has_picture;
uniform float gloss;
#ifdef LOOK_GIVEN
uniform uint look; // look_of
#endif
layout(binding = 2) uniform sampler2D picture;
layout(binding = 3) uniform sampler1D scalar_colors;

#ifdef SEEN
layout(location = 0) out uvec4 result;
#else
layout(location = 0) out vec4 result;
#endif

const vec3 kNoValue = vec3(0.2);

void main() {
    // What compares pixels beside each other (derivatives, pictures in several sizes) comes before any pixel is
    // discarded; after that it is undefined, and GPUs differ from the software renderer.
    vec3 facing = cross(dFdx(surface.position), dFdy(surface.position));
#ifndef PLAIN
    vec4 texel = vec4(1.0);
    if (has_picture) texel = texture(picture, surface.uv);
#endif
#ifdef COVERED
    if (!is_covered()) discard;
#endif
#ifdef LOOK_GIVEN
    result = kept(surface.position, facing, surface.normal, look);
    return;
#endif
    vec3 albedo = base_color;
#ifndef PLAIN
    if (has_colors) albedo = surface.color.rgb;
    if (has_picture) {
        if (texel.a < 0.5) discard;
        albedo *= texel.rgb;
    }
    if (has_scalars)
        albedo = surface.scalar < -0.25
                     ? kNoValue
                     : texture(scalar_colors, (clamp(surface.scalar, 0.0, 1.0) * 255.0 + 0.5) / 256.0).rgb;
#endif
#ifdef CLIPPED
    if (!gl_FrontFacing) albedo *= vec3(0.80, 0.70, 0.64); // the inside of what was cut open
#endif
#ifdef EDGES
    float d = min(edge_distance.x, min(edge_distance.y, edge_distance.z));
    float line = 1.0 - smoothstep(0.5 * edge_width - 0.5, 0.5 * edge_width + 0.5, d);
    if (!has_surface) {
        if (line < 0.5) discard;
        albedo = edge_color;
        line = 0.0;
    } else { // where triangles are hardly wider than lines, lines are drawn thinner, or all would be line
        line *= clamp(smallest_height / (5.0 * edge_width), 0.12, 0.85);
    }
#endif
#ifdef SEEN
    result = kept(surface.position, facing, surface.normal, look_of(albedo, gloss));
#else
    vec3 normal = surface.normal;
    turn_to_viewer(surface.position, facing, normal);
    vec3 light = shade(surface.position, facing, normal, albedo, gloss);
#ifdef EDGES
    light = mix(light, edge_color, line);
#endif
    result = outgoing(light);
#endif
}
