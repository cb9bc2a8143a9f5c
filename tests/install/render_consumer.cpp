// Uses what can be used without OpenGL, and asks for OpenGL.
#include <filigree/render.h>

#include <iostream>

int main() {
    const filigree::Picture picture(2, 2);
    if (filigree::encode_png(picture).empty()) return 1;
    const filigree::Camera camera = filigree::fit_camera({}, {0, 0, 1}, {0, 1, 0}, 1);
    if (!(camera.eye.z() > camera.target.z())) return 1;
    const auto gl = filigree::HeadlessContext::create();
    std::cout << (gl ? gl->renderer_name() : gl.error().message) << '\n';
    return 0;
}
