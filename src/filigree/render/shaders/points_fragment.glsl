in Ball {
    vec3 corner;
    flat vec3 centre;
    flat vec4 color;
    flat float scalar;
} ball;

uniform float radius;
uniform vec3 base_color;
uniform bool has_colors, has_scalars;
uniform float gloss;
layout(binding = 3) uniform sampler1D scalar_colors;

layout(location = 0) out vec4 result;

void main() {
    if (!is_covered()) discard;
    bool is_perspective = frame.eye.w > 0.5;
    vec3 from = is_perspective ? frame.eye.xyz : ball.corner + frame.eye.xyz;
    vec3 direction = normalize(ball.corner - from);
    vec3 to_centre = ball.centre - from;
    float along = dot(to_centre, direction);
    vec3 across = to_centre - along * direction;
    float inside = radius * radius - dot(across, across);
    if (inside < 0.0) discard;
    vec3 position = from + (along - sqrt(inside)) * direction;
    vec4 clip_position = frame.view_projection * vec4(position, 1.0);
    gl_FragDepth = 0.5 + 0.5 * clip_position.z / clip_position.w;
    if (frame.viewport.w > 0.5) {
        result = vec4(0.0);
        return;
    }
    vec3 albedo = base_color;
    if (has_colors) albedo = ball.color.rgb;
    if (has_scalars && ball.scalar < -0.25) albedo = vec3(0.2); // no value
    else if (has_scalars) albedo = texture(scalar_colors, (clamp(ball.scalar, 0.0, 1.0) * 255.0 + 0.5) / 256.0).rgb;
    vec3 normal = normalize(position - ball.centre);
    result = outgoing(shade(position, normal, normal, albedo, gloss));
}
