// Distances, in pixels, from each point of a triangle to those of its sides that are edges of the polygon
// [Baerentzen et al. 2006]: lines of even width without any fighting over depth.
layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;

uniform usamplerBuffer edge_flags; // one a triangle
uniform int first_triangle;

in Surface { SURFACE_FIELDS } corner[];

out Surface { SURFACE_FIELDS } surface;
noperspective out vec3 edge_distance;
flat out float smallest_height;

const float kFar = 1e6;

void main() {
    uint flags = texelFetch(edge_flags, first_triangle + gl_PrimitiveIDIn).r;
    vec2 p[3];
    bool in_front = true;
    for (int k = 0; k < 3; ++k) {
        vec4 c = gl_in[k].gl_Position;
        in_front = in_front && c.w > 0.0;
        p[k] = 0.5 * frame.viewport.xy * c.xy / c.w;
    }
    float area = abs((p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[2].x - p[0].x) * (p[1].y - p[0].y));
    // Side k runs from corner k to the next; the corner across from it is k + 2.
    vec3 height;
    for (int k = 0; k < 3; ++k) height[k] = area / max(distance(p[k], p[(k + 1) % 3]), 1e-6);
    float smallest = min(height.x, min(height.y, height.z));
    for (int k = 0; k < 3; ++k) {
        surface.position = corner[k].position;
        surface.normal = corner[k].normal;
#ifndef PLAIN
        surface.uv = corner[k].uv;
        surface.color = corner[k].color;
        surface.scalar = corner[k].scalar;
#endif
        gl_Position = gl_in[k].gl_Position;
#ifdef CLIPPED
        gl_ClipDistance[0] = gl_in[k].gl_ClipDistance[0];
#endif
        vec3 d = vec3(0.0);
        d[(k + 1) % 3] = height[(k + 1) % 3];
        for (int side = 0; side < 3; ++side)
            if (!in_front || (flags & (1u << side)) == 0u) d[side] = kFar;
        edge_distance = d;
        smallest_height = smallest;
        EmitVertex();
    }
    EndPrimitive();
}
