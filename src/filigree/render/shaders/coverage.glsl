// Parts of an object's pixels, for objects that melt into each other.
uniform float coverage; // 0 to 1: this part; below 0: what is not drawn with -coverage

bool is_covered() {
    // Interleaved gradient noise [Jimenez 2014]; from pass to pass by the golden ratio, which fills a pixel evenly.
    float noise = 52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715)));
    float place = fract(noise + 0.618034 * frame.viewport.z);
    return coverage >= 0.0 ? place < coverage : place >= -coverage;
}
