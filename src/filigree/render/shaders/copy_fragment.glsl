layout(binding = 0) uniform sampler2D picture;
uniform vec2 corner; // where it goes, pixels
layout(location = 0) out vec4 result;

void main() { result = texelFetch(picture, ivec2(gl_FragCoord.xy - corner), 0); }
