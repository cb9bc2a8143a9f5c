// Spheres: a square that faces the viewer and covers the sphere; the fragment shader finds where the ray meets it.
layout(location = 0) in vec3 in_position;
layout(location = 3) in vec4 in_color;
layout(location = 6) in float in_scalar;

uniform vec3 offset;
uniform float scale;
uniform float radius; // scene space
uniform vec4 clip;
uniform bool is_clipped;

out Ball {
    vec3 corner;
    flat vec3 centre;
    flat vec4 color;
    flat float scalar;
} ball;

vec3 to_linear(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c)); }

void main() {
    vec3 centre = (in_position + offset) * scale;
    vec3 back = to_viewer(centre);
    vec3 right = normalize(abs(back.x) < 0.7 ? cross(vec3(1, 0, 0), back) : cross(vec3(0, 1, 0), back));
    vec3 above = cross(back, right);
    vec2 side = vec2((gl_VertexID & 1) * 2 - 1, (gl_VertexID >> 1) * 2 - 1);
    float reach = radius;
    if (frame.eye.w > 0.5) { // in perspective the outline is wider than the sphere, and nearer
        float d = distance(frame.eye.xyz, centre);
        reach = d > radius * 1.01 ? radius * d / sqrt(d * d - radius * radius) : radius * 8.0;
    }
    ball.centre = centre;
    ball.corner = centre + reach * (side.x * right + side.y * above);
    ball.color = vec4(to_linear(in_color.rgb), in_color.a);
    ball.scalar = in_scalar;
    gl_Position = frame.view_projection * vec4(ball.corner, 1.0);
    if (is_clipped && dot(clip.xyz, centre) > clip.w) gl_Position = vec4(0.0, 0.0, 2.0, 1.0); // whole spheres are cut
}
