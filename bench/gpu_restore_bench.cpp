// Restoring in the vertex shader, against copying as many bytes within the GPU's memory in the same run. `shaded` draws
// points that lie outside the picture: reading records and restoring them, and no more. `captured` writes positions and
// normals to memory as well (transform feedback). Counters: vertices/s, bytes moved a vertex, fraction of the copy.
#include "filigree/mesh.h"
#include "filigree/mesh/normals.h"
#include "filigree/render.h"
#include "filigree/render/gl_objects.h"
#include "filigree/render/gpu_restore.h"
#include "filigree/strip.h"

#include <algorithm>
#include <benchmark/benchmark.h>
#include <chrono>
#include <cstdio>
#include <map>
#include <numeric>
#include <optional>

namespace {

using namespace filigree;

/// A wavy cube on 1,000 driver vertices in GPU memory, bent, with normals.
struct Scene {
    Model model;
    std::optional<GpuRestorer> restorer;
};
/// Kept from run to run; emptied while OpenGL is still there.
std::map<unsigned, Scene> scenes;

const GpuRestorer& restorer_of(unsigned resolution) {
    Scene& scene = scenes[resolution];
    if (scene.restorer) return *scene.restorer;
    const RunContext context;
    Mesh mesh = make_wavy_cube({.resolution = resolution});
    const std::vector<Vec3f> normals = vertex_normals(mesh, mesh.positions, context);
    scene.model = strip(std::move(mesh), {.base = 1000}, context).value().model;
    std::vector<Index> vertices(scene.model.mesh.vertex_count());
    std::iota(vertices.begin(), vertices.end(), Index{0});
    scene.restorer.emplace(GpuRestorer::create(scene.model, vertices, normals, {}, context).value());
    Pose pose = rest_pose(scene.model);
    for (Vec3f& p : pose.positions) p.z() += 0.3f * p.x() * p.x();
    scene.restorer->set_pose(pose, context).value();
    return *scene.restorer;
}

double seconds(auto&& body) {
    const auto start = std::chrono::steady_clock::now();
    body();
    glFinish();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Seconds of one `body`, from so many in a row that starting and waiting count for nothing.
double seconds_each(auto&& body) {
    const double once = seconds(body);
    const int count = std::clamp(static_cast<int>(0.02 / once), 1, 500);
    return seconds([&] {
               for (int i = 0; i < count; ++i) body();
           }) /
           count;
}

void BM_gpu_restore(benchmark::State& state) {
    const bool captured = state.range(1) != 0;
    const GpuRestorer& restorer = restorer_of(static_cast<unsigned>(state.range(0)));
    const std::size_t count = restorer.item_count();

    const gl::Program::Stage stage{
        GL_VERTEX_SHADER, "#version 430 core\n" + GpuRestorer::shader_source() +
                              (captured ? "out vec3 position, normal;\n"
                                          "void main() { restore_vertex(position, normal); }\n"
                                        : "void main() {\n"
                                          "    vec3 position, normal;\n"
                                          "    restore_vertex(position, normal);\n"
                                          "    gl_Position = vec4(10.0 + 0.1 * position + 0.1 * normal, 1.0);\n"
                                          "}\n")};
    const char* const outputs[] = {"position", "normal"};
    const gl::Program program = gl::Program::link({&stage, 1}, std::span(outputs).first(captured ? 2 : 0));

    const std::size_t record = 24 + 4;
    const std::size_t bytes = count * (record + (captured ? 24 : 0)); // read and written
    const gl::Buffer results = gl::make_buffer(nullptr, captured ? count * 24 : 4).value();
    const std::vector<char> zeros(bytes / 2);
    const gl::Buffer from = gl::make_buffer(std::span<const char>(zeros)).value(),
                     to = gl::make_buffer(std::span<const char>(zeros)).value();

    const gl::Framebuffer framebuffer = gl::Framebuffer::make(); // without one, nothing is drawn
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer.name());
    glFramebufferParameteri(GL_DRAW_FRAMEBUFFER, GL_FRAMEBUFFER_DEFAULT_WIDTH, 1);
    glFramebufferParameteri(GL_DRAW_FRAMEBUFFER, GL_FRAMEBUFFER_DEFAULT_HEIGHT, 1);
    const gl::VertexArray inputs = gl::VertexArray::make();
    glBindVertexArray(inputs.name());
    restorer.bind();
    glUseProgram(program.name());
    if (captured) {
        glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, results.name());
        glEnable(GL_RASTERIZER_DISCARD);
    }
    const auto restore = [&] {
        if (captured) glBeginTransformFeedback(GL_POINTS);
        glDrawArrays(GL_POINTS, 0, static_cast<GLsizei>(count));
        if (captured) glEndTransformFeedback();
    };
    const auto copy = [&] {
        glBindBuffer(GL_COPY_READ_BUFFER, from.name());
        glBindBuffer(GL_COPY_WRITE_BUFFER, to.name());
        glCopyBufferSubData(GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER, 0, 0, static_cast<GLsizeiptr>(zeros.size()));
    };

    double best = 1e9, best_copy = 1e9;
    for (auto _ : state) {
        const double each = seconds_each(restore);
        state.SetIterationTime(each);
        best = std::min(best, each);
        best_copy = std::min(best_copy, seconds_each(copy));
    }
    glDisable(GL_RASTERIZER_DISCARD);
    glUseProgram(0);
    if (glGetError() != GL_NO_ERROR) state.SkipWithError("OpenGL refused a call");

    state.counters["vertices/s"] = static_cast<double>(count) / best;
    state.counters["bytes/vertex"] = static_cast<double>(bytes) / static_cast<double>(count);
    state.counters["bytes/s"] = static_cast<double>(bytes) / best;
    state.counters["copy_bytes/s"] = static_cast<double>(bytes) / best_copy;
    state.counters["of_copy"] = best_copy / best;
    state.SetLabel(std::to_string(count) + " vertices, " + (captured ? "captured" : "shaded"));
}
BENCHMARK(BM_gpu_restore)
    ->ArgNames({"resolution", "captured"})
    ->ArgsProduct({{264, 707, 1291}, {0, 1}})
    ->Iterations(20)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

} // namespace

int main(int argc, char** argv) {
    const Result<HeadlessContext> context = HeadlessContext::create();
    if (!context) {
        std::fprintf(stderr, "gpu_restore_bench: %s\n", context.error().message.c_str());
        return static_cast<int>(context.error().code);
    }
    benchmark::AddCustomContext("renderer", context->renderer_name());
    benchmark::Initialize(&argc, argv);
    benchmark::RunSpecifiedBenchmarks();
    scenes.clear();
    return 0;
}
