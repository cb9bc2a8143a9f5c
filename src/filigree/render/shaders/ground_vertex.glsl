// The ground: a square that fades into the background long before its rim.
uniform vec3 ground_right, ground_forward; // scene space, half a side long
out vec3 position;

void main() {
    vec2 side = vec2((gl_VertexID & 1) * 2 - 1, (gl_VertexID >> 1) * 2 - 1);
    position = frame.up.xyz * frame.up.w + side.x * ground_right + side.y * ground_forward;
    gl_Position = frame.view_projection * vec4(position, 1.0);
}
