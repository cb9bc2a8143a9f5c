// Lights what a pass has seen (seen.glsl).
layout(binding = 5) uniform usampler2D seen;
layout(location = 0) out vec4 result;

void main() {
    uvec4 here = texelFetch(seen, ivec2(gl_FragCoord.xy), 0);
    vec2 place = 2.0 * gl_FragCoord.xy / frame.viewport.xy - 1.0;
    vec3 near = frame.near[0].xyz + place.x * frame.near[1].xyz + place.y * frame.near[2].xyz;
    vec3 far = frame.far[0].xyz + place.x * frame.far[1].xyz + place.y * frame.far[2].xyz;
    vec3 position = near + uintBitsToFloat(here.w) * (far - near);
    vec3 normal = (vec3(here.x & 65535u, here.x >> 16, here.y & 65535u) - 32768.0) / 32767.0;
    vec2 side = vec2(here.y >> 16 & 255u, here.y >> 24) / 127.0 - 1.0;
    vec3 facing = vec3(side, 1.0 - abs(side.x) - abs(side.y));
    float fold = max(-facing.z, 0.0);
    facing.xy += mix(vec2(fold), vec2(-fold), greaterThanEqual(facing.xy, vec2(0.0)));
    facing = normalize(facing);
    turn_to_viewer(position, facing, normal);
    vec3 root = vec3(here.z & 511u, here.z >> 9 & 511u, here.z >> 18 & 511u) / 511.0;
    result = outgoing(shade(position, facing, normal, root * root, float(here.z >> 27) / 31.0));
}
