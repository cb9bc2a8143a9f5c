// Parts of an object's pixels, for objects that melt into each other.
uniform float coverage; // 0 to 1: this part; below 0: what is not drawn with -coverage

bool is_covered() {
    vec2 at = gl_FragCoord.xy + 5.588238 * frame.viewport.z; // interleaved gradient noise [Jimenez 2014]
    float place = fract(52.9829189 * fract(dot(at, vec2(0.06711056, 0.00583715))));
    return coverage >= 0.0 ? place < coverage : place >= -coverage;
}
