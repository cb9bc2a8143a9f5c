// The ground's shadow, which was drawn at half the size, as it is soft everywhere.
layout(binding = 0) uniform sampler2D shadow;
layout(location = 0) out vec4 result;

void main() {
    // Over three by three of its pixels, in which the noise of its taps evens out.
    vec2 at = gl_FragCoord.xy / frame.viewport.xy, step = 0.75 / vec2(textureSize(shadow, 0));
    float sum = texture(shadow, at - step).x + texture(shadow, at + step).x + texture(shadow, at + vec2(step.x, -step.y)).x +
                texture(shadow, at + vec2(-step.x, step.y)).x;
    result = vec4(0.0, 0.0, 0.0, 0.25 * sum);
}
