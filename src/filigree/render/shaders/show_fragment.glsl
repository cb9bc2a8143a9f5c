// The mean of the passes over the background, as sRGB.
layout(binding = 0) uniform sampler2D sum;
uniform float passes;
uniform vec2 corner, size; // of the picture, pixels
uniform vec3 top, bottom; // sRGB
uniform bool is_transparent;
layout(location = 0) out vec4 result;

vec3 to_linear(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c)); }
vec3 to_srgb(vec3 c) { return mix(c * 12.92, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c)); }

/// Identity up to 0.7, then towards 1 without a corner.
vec3 shoulder(vec3 c) {
    vec3 over = max(c - 0.7, 0.0);
    return min(c, 0.7) + over / (1.0 + over / 0.3);
}

void main() {
    vec2 pixel = gl_FragCoord.xy - corner;
    vec4 mean = texelFetch(sum, ivec2(pixel), 0) / passes;
    if (is_transparent) {
        vec3 straight = mean.a > 0.0 ? mean.rgb / mean.a : vec3(0.0);
        result = vec4(to_srgb(shoulder(straight)), mean.a);
        return;
    }
    vec3 background = to_linear(mix(bottom, top, pixel.y / size.y));
    vec3 color = to_srgb(shoulder(mean.rgb) + (1.0 - mean.a) * background);
    // Half a step of an ordered pattern, so that the background's gradient has no bands.
    float dither = fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715)))) - 0.5;
    result = vec4(color + dither / 255.0, 1.0);
}
