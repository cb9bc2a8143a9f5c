// All light at once, without shadows: the key light from its middle, the sky by how much of it a surface faces.

const float kFloor = 0.02;
const float kOpenKey = 0.98, kOpenSky = 0.90; // the share that is not in shadow, as it is on ordinary shapes
const vec3 kKeyColor = vec3(1.0, 0.955, 0.89), kSkyColor = vec3(0.90, 0.955, 1.0);

/// Light that leaves the surface, as `shade` of lighting.glsl has it on average.
vec3 shade(vec3 position, vec3 facing, vec3 normal, vec3 albedo, float gloss) {
    vec3 view = to_viewer(position);
    vec3 key_light = frame.strength.x * kOpenKey * max(dot(normal, frame.key_direction.xyz), 0.0) * kKeyColor;
    float half_open = 0.5 + 0.5 * dot(normal, frame.sky_direction.xyz);
    float open_share = kOpenSky * mix(half_open, 1.0, half_open); // what faces away is in the way of itself, too
    float sky = open_share * frame.strength.y * 0.5 * half_open +
                frame.strength.z * max(dot(normal, frame.fill_direction.xyz), 0.0);
    vec3 light = key_light + sky * kSkyColor + (kFloor + frame.strength.w * (0.5 - 0.5 * dot(normal, frame.up.xyz)));
    float exponent = exp2(2.0 + 6.0 * gloss);
    vec3 halfway = normalize(frame.key_direction.xyz + view);
    float glint = pow(max(dot(normal, halfway), 0.0), exponent) * (exponent + 8.0) / 25.0;
    float grazing = 1.0 - max(dot(normal, view), 0.0), square = grazing * grazing;
    return albedo * light + gloss * (0.07 + 0.30 * square * square * grazing) * glint * key_light;
}

/// As show_fragment.glsl: the shoulder, then sRGB, here by roots.
vec4 outgoing(vec3 light) {
    vec3 over = max(light - 0.7, 0.0);
    vec3 c = min(light, 0.7) + over / (1.0 + over / 0.3);
    vec3 root = sqrt(c), fourth = sqrt(root);
    return vec4(0.662002687 * root + 0.684122060 * fourth - 0.323583601 * sqrt(fourth) - 0.0225411470 * c, 1.0);
}
