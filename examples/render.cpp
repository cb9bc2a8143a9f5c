// Draws a mesh into a PNG file, without a window.
#include <filigree/filigree.h>
#include <filigree/render.h>

#include <iostream>

using namespace filigree;

int main(int argc, char** argv) {
    const RunContext context;
    const Mesh mesh = make_wavy_cube({.resolution = 32});

    const Result<HeadlessContext> gl = HeadlessContext::create();
    if (!gl) {
        std::cerr << gl.error().message << '\n';
        return static_cast<int>(gl.error().code);
    }
    Renderer renderer = Renderer::create().value();
    const Drawable drawable = Drawable::surface(mesh, {}, context).value();

    Scene scene;
    scene.objects.push_back({&drawable, {.edges = true}});
    const CameraPoints points{mesh.positions, mesh.origin};
    const Camera camera = fit_camera({&points, 1}, view_direction(View::iso, UpAxis::y), up_vector(UpAxis::y), 4.0 / 3);
    const Picture picture = renderer.picture(scene, camera, {.width = 640, .height = 480}, context).value();

    const Status written = write_file(argc > 1 ? argv[1] : "cube.png", encode_png(picture));
    if (!written)
        std::cerr << written.error().message << '\n';
    else
        std::cout << "drawn by " << gl->renderer_name() << '\n';
    return written ? 0 : 1;
}
