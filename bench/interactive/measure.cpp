// filigree bench: our figures on this machine, rivals (triad, memcpy, deforming every vertex) in the same run. The
// Google Benchmark programs in bench/ go through more sizes; scripts/bench-peers sets this beside other programs.
#include "measure.h"

#include "drivers.h"
#include "estimate.h"
#include "fidelity.h"
#include "simulate.h"
#include "timing.h"
#include "triad.h"

#include "filigree/blend/blend_code.h"
#include "filigree/file.h"
#include "filigree/io/model/model_file.h"
#include "filigree/mesh.h"
#include "filigree/pack/mesh_code.h"
#include "filigree/pose.h"
#include "filigree/restore.h"
#include "filigree/strip.h"

#include <array>
#include <cstring>
#include <random>

#include <fmt/format.h>

namespace filigree::bench {

namespace {

/// Measures on one mesh; models of it are made once.
class Bench {
public:
    Bench(Mesh mesh, std::optional<std::size_t> base, const RunContext& context)
        : mesh_(std::move(mesh)), base_(base), context_(context) {}

    void restore() {
        const double triad = measure_triad();
        restore_blend(triad);
        restore_reference(triad);
    }

    void strip_phases() {
        double simplify = 0, bind = 0;
        const double total = median_seconds([&] {
            const Stripped stripped = strip(mesh_, {}, context_).value();
            simplify = stripped.report.simplify_seconds;
            bind = stripped.report.bind_seconds;
        });
        add("strip.total", total, "s");
        add("strip.simplify", simplify, "s");
        add("strip.bind", bind, "s");
        const Model& model = blend_model();
        std::string bytes;
        add("strip.write_model", median_seconds([&] { bytes = write_model(model); }), "s");
        add("strip.read_model", median_seconds([&] { read_model(bytes, "model", context_).value(); }), "s");
    }

    void files() {
        for (const auto& [name, format] : {std::pair{"obj", MeshFormat::obj},
                                           {"ply", MeshFormat::ply},
                                           {"stl", MeshFormat::stl},
                                           {"off", MeshFormat::off}}) {
            std::string bytes;
            const double write = median_seconds([&] {
                bytes.clear();
                write_mesh(mesh_, format, bytes, {}, RunContext()).value();
            });
            const double read =
                median_seconds([&] { read_mesh(bytes, std::string("mesh.") + name, context_).value(); });
            std::string copy(bytes.size(), '\0');
            const double memcpy_seconds = median_seconds([&] { std::memcpy(copy.data(), bytes.data(), bytes.size()); });
            const double megabytes = double(bytes.size()) * 1e-6;
            add(fmt::format("files.read_{}", name), megabytes / read, "MB/s");
            add(fmt::format("files.write_{}", name), megabytes / write, "MB/s");
            add(fmt::format("files.read_{}_of_memcpy", name), memcpy_seconds / read, "ratio");
        }
    }

    /// Meshes in few bits.
    void coding() {
        const double vertices = double(mesh_.vertex_count()), diagonal = world_bounds(mesh_).diagonal();
        for (const unsigned bits : {12u, 14u})
            for (const bool levels : {false, true}) {
                const std::string name = (levels ? "coding.stream_" : "coding.") + std::to_string(bits);
                PackedMeshReport report;
                PackedMesh coded;
                const double encode = median_seconds(
                    [&] { coded = pack_mesh(mesh_, {.bits = bits, .levels = levels}, &report, context_).value(); });
                const double decode = median_seconds([&] { (void)unpack_mesh(coded, context_).value(); });
                std::size_t bytes = coded.connectivity.size() + coded.places.size() + coded.levels.connectivity.size() +
                                    coded.levels.places.size();
                for (const PackedLevel& level : coded.levels.levels)
                    bytes += level.splits.size() + level.refinement.size();
                add(name + "_bits", 8 * double(bytes) / vertices, "bits/vertex");
                add(name + "_rms", report.rms / diagonal, "of the diagonal");
                add(name + "_encode", vertices / encode, "vertices/s");
                add(name + "_decode", vertices / decode, "vertices/s");
            }
    }

    /// A deformer that costs something, over every vertex and over the driver alone.
    void deform() {
        const Model& model = blend_model();
        const Box box = world_bounds(mesh_);
        std::mt19937_64 random(1);
        std::vector<Vec3d> centres, displacements;
        for (int i = 0; i < 200; ++i) {
            const auto point = [&] {
                Vec3d p;
                for (int k = 0; k < 3; ++k) p[k] = double(random() >> 11) * 0x1p-53;
                return p;
            };
            centres.push_back(box.min + point().cwiseProduct(box.size()));
            displacements.push_back(0.05 * box.diagonal() * (point() - Vec3d::Constant(0.5)));
        }
        const auto rbf = make_rbf(centres, displacements);
        std::vector<std::unique_ptr<SpaceWarp>> chain;
        chain.push_back(make_twist(box, Axis::x, 90));
        chain.push_back(make_bend(box, Axis::x, 90));
        const auto bend = make_chain(std::move(chain));
        const Restorer restorer = Restorer::create(model, {}, context_).value();
        for (const auto& [name, warp] :
             {std::pair<const char*, const SpaceWarp*>{"rbf_200", rbf.get()}, {"bend_twist", bend.get()}}) {
            const double all = median_seconds([&] { warp_positions(*warp, mesh_.positions, mesh_.origin, context_); });
            std::vector<Vec3f> restored(mesh_.vertex_count());
            const double ours = median_seconds([&] {
                restorer
                    .positions(warp_pose(*warp, driver_positions(model), mesh_.origin, context_), restored, context_)
                    .value();
            });
            add(fmt::format("deform.{}_all", name), all, "s");
            add(fmt::format("deform.{}_driver_and_restore", name), ours, "s");
            add(fmt::format("deform.{}_speed_up", name), all / ours, "ratio");
        }
    }

    /// As-rigid-as-possible on the driver, restored in every round, as a hand would see it.
    void handles() {
        const Model& model = blend_model();
        const Mesh driver = level_mesh(model, 0);
        const std::vector<Triangle> triangles = triangulate(driver).triangles;
        const Box box = bounds(driver.positions);
        const int axis = static_cast<int>(longest_axis(box));
        std::vector<Index> ends;
        std::vector<Vec3f> targets;
        for (Index v = 0; v < driver.vertex_count(); ++v) {
            const double at = (driver.positions[v][axis] - box.min[axis]) / box.size()[axis];
            if (at > 0.05 && at < 0.95) continue;
            ends.push_back(v);
            targets.push_back(driver.positions[v]);
            if (at >= 0.95) targets.back()[(axis + 1) % 3] += static_cast<float>(0.2 * box.diagonal());
        }
        add("handles.setup",
            median_seconds([&] { HandleSolver::create(driver.positions, triangles, ends, context_).value(); }), "s");
        HandleSolver solver = HandleSolver::create(driver.positions, triangles, ends, context_).value();
        const Restorer restorer = Restorer::create(model, {}, context_).value();
        std::vector<Vec3f> restored(mesh_.vertex_count());
        add("handles.iteration", median_seconds([&] {
                const HandleResult result = solver.solve(targets, {.iterations = 1, .tolerance = 0}, context_).value();
                restorer.positions(result.pose, restored, context_).value();
            }),
            "s");
    }

    void fidelity() {
        const Model& model = blend_model();
        Mesh copy = mesh_;
        const Result<ReferenceModel> reference =
            strip_to_reference(std::move(copy), {.base = model.driver().vertices.size()}, context_);
        const std::vector<FidelityRow> rows = measure_fidelity(model, reference ? &*reference : nullptr, context_);
        Table table{"fidelity", {"method", "warp", "rms", "max", "normal_p95_deg"}, {}};
        for (const FidelityRow& row : rows)
            table.rows.push_back({row.method, row.warp, row.rms, row.max, row.normal_p95_deg});
        measured_.tables.push_back(std::move(table));
        for (const FidelitySummary& summary : summarise(rows)) {
            const std::string name = "fidelity." + summary.method;
            add(name + ".affine_rms", summary.affine_rms, "diagonals");
            add(name + ".curved_rms", summary.curved_rms, "diagonals");
            add(name + ".curved_normal_p95", summary.curved_normal_p95_deg, "degrees");
        }
    }

    void simulate(std::size_t particles) {
        for (Measurement& measurement : measure_simulation(mesh_, {.particles = particles, .base = base_}, context_))
            measured_.results.push_back(std::move(measurement));
    }

    Measured take() { return std::move(measured_); }

private:
    void add(std::string name, double value, std::string unit) {
        measured_.results.push_back({std::move(name), value, std::move(unit)});
    }

    const Model& blend_model() {
        if (!model_) model_ = strip(mesh_, {.base = base_}, context_).value().model;
        return *model_;
    }

    /// Bytes a second of the streaming triad; also reported with ordinary stores.
    double measure_triad() {
        Triad triad;
        const auto rate = [&](bool streams) {
            return double(Triad::bytes(streams)) / median_seconds([&] { triad.run(context_, streams); });
        };
        add("restore.triad", rate(false) * 1e-9, "GB/s");
        const double streaming = rate(true);
        add("restore.triad_streaming", streaming * 1e-9, "GB/s");
        return streaming;
    }

    void restore_blend(double triad) {
        const Model& model = blend_model();
        const auto& detail = model.detail;
        std::vector<BlendRestorer::Item> items(mesh_.vertex_count());
        for (Index v = 0; v < items.size(); ++v) items[v] = {v, v};
        const std::vector<Vec3f> normals(items.size(), Vec3f::UnitZ());
        const BlendRestorer restorer(detail, model.mesh.positions, model.driver().vertices, items, normals,
                                     RunContext());
        const std::vector<Vec3f> driver = driver_positions(model);
        const std::vector<Mat3f> gradients(driver.size(), Mat3f::Identity());
        std::vector<Vec3f> positions(items.size()), out_normals(items.size());
        const std::string name = "restore.float";
        const double count = double(items.size());
        const double record_bytes = 20;

        const double seconds =
            median_seconds([&] { restorer.restore(driver, gradients, positions, {}, false, context_); });
        add(name, count / seconds, "vertices/s");
        add(name + ".of_triad", count * (record_bytes + 12) / seconds / triad, "ratio");
        add(name + ".with_normals", count / median_seconds([&] {
                                        restorer.restore(driver, gradients, positions, out_normals, false, context_);
                                    }),
            "vertices/s");
        add(name + ".in_mesh_order",
            count / median_seconds([&] { restorer.restore(driver, gradients, positions, {}, true, context_); }),
            "vertices/s");
        add(name + ".in_mesh_order.with_normals",
            count /
                median_seconds([&] { restorer.restore(driver, gradients, positions, out_normals, true, context_); }),
            "vertices/s");
    }

    void restore_reference(double triad) {
        const unsigned resolution = 512;
        const ReferenceModel model =
            strip_to_reference(make_wavy_cube({.resolution = resolution}), {}, context_).value();
        const ReferenceDetail& detail = model.detail;
        const std::vector<Vec3f> driver = driver_positions(model);
        for (const HeightLaw law : {HeightLaw::inverse, HeightLaw::keep}) {
            const ReferenceRestorer restorer(detail, law, context_);
            std::vector<Vec3f> positions(6 * std::size_t(resolution + 1) * (resolution + 1));
            const double seconds =
                median_seconds([&] { restorer.restore_grids(driver, detail.patches.levels, positions, context_); });
            const std::string name = law == HeightLaw::keep ? "restore.reference_keep" : "restore.reference";
            add(name, double(positions.size()) / seconds, "vertices/s");
            // Records once; of the points a level writes, those of all but the finest are read again.
            const double bytes =
                double(restorer.code_bytes()) + double(positions.size() * sizeof(Vec3f)) * (4.0 / 3 + 1.0 / 3);
            add(name + ".of_triad", bytes / seconds / triad, "ratio");
        }
    }

    Mesh mesh_;
    std::optional<std::size_t> base_;
    const RunContext& context_;
    std::optional<Model> model_;
    Measured measured_;
};

} // namespace

const std::vector<std::string>& measure_names() {
    static const std::vector<std::string> names = {"all",    "restore",  "strip",    "files",    "deform",  "handles",
                                                   "coding", "fidelity", "simulate", "estimate", "drivers", "goals"};
    return names;
}

bool takes_many_meshes(const std::string& name) { return name == "estimate" || name == "drivers" || name == "goals"; }

Measured measure(std::vector<NamedMesh> meshes, const MeasureOptions& options, const RunContext& context) {
    if (options.name == "estimate") return measure_estimate(meshes, options.poses, context);
    if (options.name == "drivers") return measure_drivers(meshes, context);
    if (options.name == "goals") return measure_goals(meshes, context);
    Bench bench(std::move(meshes.front().mesh), options.base, context);
    const auto wants = [&](const char* name) { return options.name == "all" || options.name == name; };
    if (wants("restore")) bench.restore();
    if (wants("strip")) bench.strip_phases();
    if (wants("files")) bench.files();
    if (wants("coding")) bench.coding();
    if (wants("deform")) bench.deform();
    if (wants("handles")) bench.handles();
    if (wants("fidelity")) bench.fidelity();
    if (wants("simulate")) bench.simulate(options.particles);
    return bench.take();
}

} // namespace filigree::bench
