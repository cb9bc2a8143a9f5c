// One pass's share of the light: a sample of the key light, a sample of the sky, and a little that has no shadow.
layout(binding = 0) uniform sampler2DShadow key_shadow;
layout(binding = 1) uniform sampler2DShadow sky_shadow;

const float kFloor = 0.02;
const vec3 kKeyColor = vec3(1.0, 0.955, 0.89), kSkyColor = vec3(0.90, 0.955, 1.0);

/// Share of the light that comes through at a point of a surface with that geometric normal. The point is moved off
/// the surface by about as far as it looks around in the map, further where the light grazes. Where it looks differs
/// from pixel to pixel and pass to pass, so that the shadows' rims melt into each other.
float visibility(sampler2DShadow map, mat4 matrix, vec3 position, vec3 normal, vec4 light, float around) {
    float cosine = clamp(dot(normal, light.xyz), 0.0, 1.0), reach = light.w * around;
    vec3 off = normal * reach * (1.0 + 2.0 * sqrt(1.0 - cosine * cosine)) + light.xyz * reach;
    vec3 p = (matrix * vec4(position + off, 1.0)).xyz;
    float turn = fract(52.9829189 * fract(dot(gl_FragCoord.xy + 5.588238 * frame.viewport.z, vec2(0.06711056, 0.00583715))));
    float angle = 6.2831853 * turn, radius = around * sqrt(fract(turn * 7.31 + 0.618034 * frame.viewport.z));
    p.xy += radius * vec2(cos(angle), sin(angle)) / vec2(textureSize(map, 0));
    if (any(lessThan(p, vec3(0.0))) || any(greaterThan(p, vec3(1.0)))) return 1.0;
    return texture(map, p);
}

/// Light that leaves the surface. facing: the geometric normal, towards the viewer; normal: the one to shade with.
vec3 shade(vec3 position, vec3 facing, vec3 normal, vec3 albedo, float gloss) {
    vec3 view = to_viewer(position), up = frame.up.xyz;
    float key_cosine = max(dot(normal, frame.key_direction.xyz), 0.0);
    float sky_cosine = max(dot(normal, frame.sky_direction.xyz), 0.0);
    float key = key_cosine > 0.0 ? visibility(key_shadow, frame.key_matrix, position, facing, frame.key_direction, 1.5) : 0.0;
    float sky = sky_cosine > 0.0 ? visibility(sky_shadow, frame.sky_matrix, position, facing, frame.sky_direction, 3.0) : 0.0;

    vec3 key_light = frame.strength.x * key_cosine * key * kKeyColor;
    vec3 light = key_light;
    light += frame.strength.y * sky_cosine * sky * kSkyColor;
    light += frame.strength.z * max(dot(normal, frame.fill_direction.xyz), 0.0) * kSkyColor;
    light += kFloor + frame.strength.w * (0.5 - 0.5 * dot(normal, up));

    // The key light's highlight: Blinn-Phong, normalised, with Schlick's Fresnel factor.
    float exponent = exp2(2.0 + 6.0 * gloss);
    vec3 halfway = normalize(frame.key_direction.xyz + view);
    float glint = pow(max(dot(normal, halfway), 0.0), exponent) * (exponent + 8.0) / 25.0;
    float grazing = 1.0 - max(dot(normal, view), 0.0), square = grazing * grazing;
    float strength = gloss * (0.07 + 0.30 * square * square * grazing);
    return albedo * light + strength * glint * key_light;
}

vec4 outgoing(vec3 light) { return vec4(light, 1.0); }
