// Surfaces whose vertices were lit (light_vertex.glsl).
in Surface { SURFACE_FIELDS } surface;
layout(location = 0) out vec4 result;

void main() {
#ifdef COVERED
    if (!is_covered()) discard;
#endif
    result = vec4(surface.light, 1.0);
}
