// Only the shadow: how much of the light that would reach the bare ground does not. Blurred, as the ground is even and
// each pass has but one direction.
in vec3 position;
layout(location = 0) out vec4 result;

const int kTaps = 8;
const mat2 kGoldenTurn = mat2(-0.737368878, 0.675490294, -0.675490294, -0.737368878); // by 2.39996323

float open_share(sampler2DShadow map, mat4 matrix, float blur, vec2 turn) {
    vec3 p = (matrix * vec4(position, 1.0)).xyz;
    if (any(lessThan(p, vec3(0.0))) || any(greaterThan(p, vec3(1.0)))) return 1.0;
    float sum = 0.0;
    vec2 way = blur * turn;
    for (int k = 0; k < kTaps; ++k) { // a spiral [Vogel 1979]
        sum += texture(map, vec3(p.xy + sqrt((float(k) + 0.5) / float(kTaps)) * way, p.z));
        way = kGoldenTurn * way;
    }
    return sum / float(kTaps);
}

void main() {
    float angle = 2.39996323 * frame.viewport.z * float(kTaps) + 6.2831853 * fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
    vec2 turn = vec2(cos(angle), sin(angle));
    float dark = frame.ground.x * (1.0 - open_share(key_shadow, frame.key_matrix, 0.010, turn)) +
                 frame.ground.y * (1.0 - open_share(sky_shadow, frame.sky_matrix, 0.05, turn));
    result = vec4(0.0, 0.0, 0.0, frame.ground.z * clamp(dark, 0.0, 1.0));
}
