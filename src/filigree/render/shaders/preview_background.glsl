// The background of a preview, already as it is shown.
uniform float height;
uniform vec3 top, bottom; // sRGB
layout(location = 0) out vec4 result;

void main() {
    float dither = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715)))) - 0.5;
    result = vec4(mix(bottom, top, gl_FragCoord.y / height) + dither / 255.0, 1.0);
}
