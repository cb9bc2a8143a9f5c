// What every stage of a pass knows. Positions are in scene space: the world, moved and scaled so that the scene's box
// has its centre at the origin and the diagonal 1.
layout(std140, binding = 0) uniform Frame {
    mat4 view_projection;
    mat4 key_matrix, sky_matrix; // scene space to the shadow maps' [0, 1]^3
    vec4 eye;                    // w 1: a position; w 0: the direction to the viewer
    vec4 key_direction;          // to the light; w: world size of a texel of its shadow map
    vec4 sky_direction;
    vec4 fill_direction;
    vec4 up;                     // w: level of the ground
    vec4 viewport;               // width, height in pixels; z: number of the pass; w: 1 in a shadow pass
    vec4 strength;               // of the light: key, sky, fill, bounce from the ground
    vec4 ground;                 // shares of this pass's light on the ground: key, sky; z: how dark shadow may be; w: 1 / sqrt(passes)
    vec4 near[3], far[3];        // where the ray through a place of [-1, 1]^2 begins and ends: middle, for x, for y
    vec4 along;                  // dot(along.xyz, p) + along.w: the part of that ray at which p is
} frame;

vec3 to_viewer(vec3 position) {
    return frame.eye.w > 0.5 ? normalize(frame.eye.xyz - position) : frame.eye.xyz;
}

/// Both normals of what is seen, of unit length and on the viewer's side; where there is none, another stands for it.
void turn_to_viewer(vec3 position, inout vec3 facing, inout vec3 normal) {
    vec3 view = to_viewer(position);
    float size = length(facing);
    facing = size > 0.0 ? facing / size : view;
    if (dot(facing, view) < 0.0) facing = -facing;
    float normal_size = length(normal);
    normal = normal_size > 1e-3 ? normal / normal_size : facing;
    if (dot(normal, facing) < 0.0) normal = -normal;
}

// What a surface's vertices hand on, from stage to stage.
#if defined(BY_VERTEX)
#define SURFACE_FIELDS vec3 light;
#elif defined(PLAIN)
#define SURFACE_FIELDS vec3 position; vec3 normal;
#else
#define SURFACE_FIELDS vec3 position; vec3 normal; vec2 uv; vec4 color; float scalar;
#endif
