layout(binding = 0) uniform sampler2D pass;
layout(location = 0) out vec4 result;

void main() { result = texelFetch(pass, ivec2(gl_FragCoord.xy), 0); }
