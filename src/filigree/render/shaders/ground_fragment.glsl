// Only the shadow: how much of the light that would reach the bare ground does not. Each pass has but one direction of
// each light, so the shadow is blurred as far as the directions of its neighbours would carry it: further below what is
// high in the air [Fernando 2005].
in vec3 position;
layout(location = 0) out float result;
layout(binding = 0) uniform sampler2D key_depth;
layout(binding = 1) uniform sampler2D sky_depth;

const int kSearchTaps = 10, kTaps = 8;
const mat2 kGoldenTurn = mat2(-0.737368878, 0.675490294, -0.675490294, -0.737368878); // by 2.39996323
const float kKeySpread = 0.18, kSkySpread = 1.1; // tangents between the directions of two passes, for one pass

/// Places of a spiral [Vogel 1979].
vec2 place(int k, int taps, vec2 way) { return sqrt((float(k) + 0.5) / float(taps)) * way; }

float open_share(sampler2D map, mat4 matrix, float spread, float least, vec2 turn) {
    vec3 p = (matrix * vec4(position, 1.0)).xyz;
    mat4 rows = transpose(matrix);
    vec2 across = vec2(length(rows[0].xyz), length(rows[1].xyz));
    float far = spread / length(rows[2].xyz); // how far a shadow spreads from one end of the map's depth to the other
    vec2 reach = max(p.z * far * across, vec2(least));
    if (p.z < 0.0 || p.z > 1.0 || any(lessThan(p.xy, -reach)) || any(greaterThan(p.xy, 1.0 + reach))) return 1.0;
    float depths = 0.0, found = 0.0;
    vec2 way = turn;
    for (int k = 0; k < kSearchTaps; ++k) {
        float depth = texture(map, p.xy + reach * place(k, kSearchTaps, way)).x;
        if (depth < p.z) {
            depths += depth;
            found += 1.0;
        }
        way = kGoldenTurn * way;
    }
    if (found == 0.0) return 1.0;
    vec2 blur = max((p.z - depths / found) * far * across, vec2(least));
    float open = 0.0;
    for (int k = 0; k < kTaps; ++k) {
        open += texture(map, p.xy + blur * place(k, kTaps, way)).x < p.z ? 0.0 : 1.0;
        way = kGoldenTurn * way;
    }
    return open / float(kTaps);
}

void main() {
    float angle = 2.39996323 * frame.viewport.z * float(kTaps) + 6.2831853 * fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
    vec2 turn = vec2(cos(angle), sin(angle));
    float dark = frame.ground.x * (1.0 - open_share(key_depth, frame.key_matrix, kKeySpread * frame.ground.w, 0.010, turn)) +
                 frame.ground.y * (1.0 - open_share(sky_depth, frame.sky_matrix, kSkySpread * frame.ground.w, 0.05, turn));
    result = frame.ground.z * clamp(dark, 0.0, 1.0);
}
