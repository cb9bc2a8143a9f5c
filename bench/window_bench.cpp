// What a window waits for while something moves: a pose, a preview, a pass; level by level of a model on 1,000 driver
// vertices, 1280 x 800. The first argument that is no flag is the mesh's file; none: a wavy cube of as many triangles
// as the Stanford dragon. `upload` is the graphics half of a drawable, `prepare` the other, which a window does in a
// thread of its own. The column CPU is all threads together: what stays the same when others use the processor too.
#include "filigree/file.h"
#include "filigree/mesh.h"
#include "filigree/mesh/ray_hit.h"
#include "filigree/render.h"
#include "filigree/strip.h"

#include <benchmark/benchmark.h>
#include <cstdio>
#include <epoxy/gl.h>
#include <map>
#include <string>

namespace {

using namespace filigree;

constexpr unsigned kWidth = 1280, kHeight = 800;

const RunContext context;
Model model;
std::optional<Renderer> renderer;
std::map<std::pair<unsigned, RestoreOn>, Drawable> drawables; // emptied while OpenGL is still there

const char* name_of(RestoreOn where) { return where == RestoreOn::cpu ? "cpu" : "gpu"; }

Drawable make(unsigned level, RestoreOn where) {
    return Drawable::upload(DrawData::model(model, {.level = level}, {}, where, context).value()).value();
}
Drawable& drawable_of(unsigned level, RestoreOn where) {
    const auto known = drawables.find({level, where});
    if (known != drawables.end()) return known->second;
    return drawables.emplace(std::pair(level, where), make(level, where)).first->second;
}

/// Bent a little more from call to call.
Pose next_pose() {
    static float more = 0;
    more = more > 0.5f ? 0 : more + 0.01f;
    Pose pose = rest_pose(model);
    const Box box = bounds(pose.positions);
    const auto size = static_cast<float>(box.diagonal());
    for (Vec3f& p : pose.positions) p.z() += more * p.x() * p.x() / size;
    return pose;
}

Scene scene_of(const Drawable& drawable, bool edges) {
    Scene scene;
    scene.objects.push_back({&drawable, {.edges = edges}});
    return scene;
}
Camera camera() {
    const CameraPoints points{model.mesh.positions, model.mesh.origin};
    return fit_camera({&points, 1}, view_direction(View::iso, UpAxis::y), up_vector(UpAxis::y),
                      double(kWidth) / kHeight);
}

void set_pose(benchmark::State& state, unsigned level, RestoreOn where) {
    Drawable& drawable = drawable_of(level, where);
    for (auto _ : state) {
        drawable.set_pose(next_pose(), context).value();
        glFinish();
    }
}

void preview(benchmark::State& state, unsigned level, RestoreOn where, bool edges) {
    const Scene scene = scene_of(drawable_of(level, where), edges);
    const Camera from = camera();
    for (auto _ : state) {
        renderer->preview(scene, from, kWidth, kHeight).value();
        glFinish();
    }
}

void pass(benchmark::State& state, unsigned level, RestoreOn where) {
    const Scene scene = scene_of(drawable_of(level, where), false);
    renderer->begin(scene, camera(), kWidth, kHeight, 1u << 20).value();
    for (auto _ : state) {
        renderer->add_pass();
        glFinish();
    }
}

void show(benchmark::State& state, bool of_preview) {
    const Scene scene = scene_of(drawable_of(0, RestoreOn::cpu), false);
    GLuint target = 0, framebuffer = 0;
    glGenRenderbuffers(1, &target);
    glBindRenderbuffer(GL_RENDERBUFFER, target);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, kWidth, kHeight);
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, target);
    if (of_preview) {
        renderer->preview(scene, camera(), kWidth, kHeight).value();
    } else {
        renderer->begin(scene, camera(), kWidth, kHeight, 4).value();
        renderer->add_pass();
    }
    for (auto _ : state) {
        renderer->show(framebuffer);
        glFinish();
    }
    glDeleteFramebuffers(1, &framebuffer);
    glDeleteRenderbuffers(1, &target);
}

void prepare(benchmark::State& state, unsigned level, RestoreOn where) {
    for (auto _ : state) benchmark::DoNotOptimize(DrawData::model(model, {.level = level}, {}, where, context).value());
}

void upload(benchmark::State& state, unsigned level, RestoreOn where) {
    for (auto _ : state) {
        state.PauseTiming();
        DrawData data = DrawData::model(model, {.level = level}, {}, where, context).value();
        state.ResumeTiming();
        const Drawable drawable = Drawable::upload(std::move(data)).value();
        glFinish();
    }
}

void pick(benchmark::State& state) {
    const std::vector<Triangle> triangles = triangulate(model.mesh).triangles;
    const Camera::Ray ray = camera().ray(0.5 * kWidth, 0.5 * kHeight, kWidth, kHeight);
    for (auto _ : state)
        benchmark::DoNotOptimize(
            first_hit(model.mesh.positions, triangles, ray.origin - model.mesh.origin, ray.direction, context));
}

void add(const std::string& name, auto function, auto... arguments) {
    benchmark::RegisterBenchmark(name.c_str(), function, arguments...)
        ->Unit(benchmark::kMillisecond)
        ->MeasureProcessCPUTime()
        ->UseRealTime();
}

void add_level(unsigned level) {
    const std::size_t triangles = drawable_of(level, RestoreOn::cpu).triangle_count();
    const std::string which = "/level:" + std::to_string(level) + "/triangles:" + std::to_string(triangles);
    for (const RestoreOn where : {RestoreOn::cpu, RestoreOn::gpu}) {
        const std::string on = std::string("/") + name_of(where) + which;
        add("set_pose" + on, set_pose, level, where);
        add("preview" + on, preview, level, where, false);
        add("pass" + on, pass, level, where);
    }
    add("preview_edges/cpu" + which, preview, level, RestoreOn::cpu, true);
}

} // namespace

int main(int argc, char** argv) {
    const Result<HeadlessContext> gl = HeadlessContext::create();
    if (!gl) {
        std::fprintf(stderr, "window_bench: %s\n", gl.error().message.c_str());
        return static_cast<int>(gl.error().code);
    }
    benchmark::AddCustomContext("renderer", gl->renderer_name());
    benchmark::Initialize(&argc, argv);
    Mesh mesh = make_wavy_cube({.resolution = 269});
    if (argc > 1) {
        Result<MeshFile> file = read_mesh(argv[1], context);
        if (!file) {
            std::fprintf(stderr, "window_bench: %s\n", file.error().message.c_str());
            return static_cast<int>(file.error().code);
        }
        mesh = std::move(file->mesh);
    }
    model = strip(std::move(mesh), {.base = 1000}, context).value().model;
    renderer = Renderer::create().value();
    for (unsigned level = 0; level <= model.finest_level(); ++level) add_level(level);
    for (const RestoreOn where : {RestoreOn::cpu, RestoreOn::gpu}) {
        add(std::string("prepare/") + name_of(where), prepare, model.finest_level(), where);
        add(std::string("upload/") + name_of(where), upload, model.finest_level(), where);
    }
    add("show/preview", show, true);
    add("show/sum", show, false);
    add("pick", pick);
    benchmark::RunSpecifiedBenchmarks();
    drawables.clear();
    renderer.reset();
    return 0;
}
