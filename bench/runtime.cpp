// The C runtime beside the library, in one run: opening, poses, and restoring by every vector width.
//   runtime [MODEL.fil...]      without a model: a wavy cube of 418,178 vertices
// Prints tables. Each figure is the best of many short calls, taken in turns: ratios count.
#include "filigree/blend/blend_code.h"
#include "filigree/blend/blend_kernel.h"
#include "filigree/blend/gradient_fit.h"
#include "filigree/file.h"
#include "filigree/mesh.h"
#include "filigree/restore.h"
#include "filigree/strip.h"

#include "filigree_rt.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

namespace {

using namespace filigree;

const RunContext kOneThread(1);

double milliseconds(const std::function<void()>& call) {
    const auto start = std::chrono::steady_clock::now();
    call();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// The best of each, taken in turns, three times in a row each: then its own memory is in the caches.
std::vector<double> best(int rounds, const std::vector<std::function<void()>>& calls) {
    std::vector<double> times(calls.size(), 1e9);
    for (int round = 0; round < rounds; ++round)
        for (std::size_t k = 0; k < calls.size(); ++k)
            for (int again = 0; again < 3; ++again) times[k] = std::min(times[k], milliseconds(calls[k]));
    return times;
}

/// A model opened by the runtime, with memory for a pose and its mesh.
struct Opened {
    flg_model* model = nullptr;
    flg_info info{};
    std::vector<std::max_align_t> pose, scratch;
    std::vector<float> positions, normals;

    Opened(const std::string& bytes, std::uint32_t lanes) {
        const flg_options options{sizeof options, 0, FLG_FINEST, lanes, nullptr, nullptr, nullptr};
        if (flg_open(bytes.data(), bytes.size(), &options, &model) != FLG_OK) return;
        info.struct_size = sizeof info;
        flg_get_info(model, &info);
        pose.resize(flg_pose_bytes(model) / sizeof(std::max_align_t) + 1);
        scratch.resize(flg_scratch_bytes(model) / sizeof(std::max_align_t) + 1);
        positions.resize(3 * std::size_t{info.vertices});
        normals.resize(3 * std::size_t{info.normals});
    }
    Opened(const Opened&) = delete;
    ~Opened() { flg_close(model); }
};

void measure_opening(const std::string& bytes) {
    const auto open = [&](std::uint32_t flags) {
        return [&bytes, flags] {
            const flg_options options{sizeof options, flags, FLG_FINEST, 0, nullptr, nullptr, nullptr};
            flg_model* model = nullptr;
            flg_open(bytes.data(), bytes.size(), &options, &model);
            flg_close(model);
        };
    };
    const std::vector<double> times =
        best(8, {[&] {
                     const Model model = read_model(bytes, "model", kOneThread).value();
                     (void)Restorer::create(model, {}, kOneThread);
                 },
                 open(FLG_WITHOUT_FIT | FLG_WITHOUT_NORMALS),
                 open(FLG_WITHOUT_FIT | FLG_WITHOUT_NORMALS | FLG_WITHOUT_CHECKSUMS), open(0)});
    std::printf(
        "\n| opening | ms |\n|---|---|\n| library: read_model and Restorer::create, no fit, no normals | %.1f |\n"
        "| runtime, no fit, no normals | %.1f |\n| runtime, no checksums either | %.1f |\n"
        "| runtime, with fit and normals | %.1f |\n",
        times[0], times[1], times[2], times[3]);
}

void measure_poses(const Model& model, Opened& opened) {
    const Mesh driver = level_mesh(model, 0);
    const std::vector<Vec3f> positions = driver_positions(model);
    const std::vector<double> fit = best(8, {[&] { const GradientFit made(driver, kOneThread); }});
    const Restorer restorer = Restorer::create(model, {}, kOneThread).value();
    const Pose pose{positions, {}};
    (void)restorer.gradients(pose, kOneThread);
    std::vector<Mat3f> gradients(positions.size());
    const std::vector<double> times =
        best(400, {[&] { (void)restorer.gradients(pose, kOneThread); },
                   [&] {
                       flg_gradients(opened.model, positions[0].data(), opened.info.driver_vertices, 0,
                                     opened.info.driver_vertices, gradients[0].data());
                   },
                   [&] {
                       flg_set_pose(opened.model, positions[0].data(), nullptr, opened.info.driver_vertices,
                                    opened.pose.data());
                   }});
    std::printf(
        "\n| %u driver vertices | ms |\n|---|---|\n| fit, once | %.1f |\n| gradients of a pose: library | %.3f |\n"
        "| gradients of a pose: runtime | %.3f |\n| flg_set_pose from positions | %.3f |\n",
        unsigned(opened.info.driver_vertices), fit[0], times[0], times[1], times[2]);
}

void measure_restoring(const Model& model, const std::string& bytes) {
    const Restorer restorer = Restorer::create(model, {}, kOneThread).value();
    Pose pose = rest_pose(model);
    pose.gradients.assign(pose.positions.size(), Mat3f::Identity());
    std::vector<Vec3f> positions(restorer.vertex_count()), normals(positions.size());
    std::vector<BlendRestorer::Item> items(positions.size());
    for (Index v = 0; v < items.size(); ++v) items[v] = {v, v};
    const std::vector<Vec3f> up(items.size(), Vec3f::UnitZ());
    const BlendRestorer with_normals(model.detail, model.mesh.positions, model.driver().vertices, items, up,
                                     kOneThread);
    std::printf(
        "\n| %zu vertices, one thread | positions, ms | M/s | with normals, ms | M/s |\n|---|---|---|---|---|\n",
        positions.size());
    std::vector<std::unique_ptr<Opened>> widths;
    for (const std::uint32_t lanes : {1u, 4u, 8u, 16u}) {
        widths.push_back(std::make_unique<Opened>(bytes, lanes));
        if (!widths.back()->model) widths.pop_back();
    }
    std::vector<std::function<void()>> calls = {
        [&] { (void)restorer.positions(pose, positions, kOneThread); },
        [&] { with_normals.restore(pose.positions, pose.gradients, positions, normals, true, kOneThread); }};
    for (const auto& width : widths) {
        Opened* opened = width.get();
        flg_set_pose(opened->model, pose.positions[0].data(), pose.gradients[0].data(), opened->info.driver_vertices,
                     opened->pose.data());
        calls.push_back([opened] {
            flg_restore(opened->model, opened->pose.data(), opened->positions.data(), nullptr, opened->scratch.data());
        });
        calls.push_back([opened] {
            flg_restore(opened->model, opened->pose.data(), opened->positions.data(), opened->normals.data(),
                        opened->scratch.data());
        });
    }
    const std::vector<double> times = best(100, calls);
    const auto row = [&](const std::string& name, std::size_t k) {
        const double count = double(positions.size()) / 1e3;
        std::printf("| %s | %.3f | %.0f | %.3f | %.0f |\n", name.c_str(), times[k], count / times[k], times[k + 1],
                    count / times[k + 1]);
    };
    row("library, " + std::to_string(blend_kernel::lane_counts().back()) + " lanes, with the pose", 0);
    for (std::size_t w = 0; w < widths.size(); ++w)
        row("runtime, " + std::to_string(widths[w]->info.lanes) + " lanes", 2 + 2 * w);
    measure_poses(model, *widths.back());
}

void measure(const std::string& name, const std::string& bytes) {
    const Result<Model> model = read_model(bytes, name, kOneThread);
    if (!model) {
        std::fprintf(stderr, "runtime: %s\n", model.error().message.c_str());
        return;
    }
    std::printf("\n%s, %.1f MB\n", name.c_str(), double(bytes.size()) / 1e6);
    measure_restoring(*model, bytes);
    measure_opening(bytes);
}

} // namespace

int main(int argc, char** argv) {
    for (int k = 1; k < argc; ++k) {
        std::ifstream file(argv[k], std::ios::binary);
        measure(argv[k], {std::istreambuf_iterator<char>(file), {}});
    }
    if (argc > 1) return 0;
    measure("wavy cube", write_model(strip(make_wavy_cube({.resolution = 264}), {.base = 1000})->model));
}
