// filigree bench: our figures on this machine, rivals (triad, memcpy, deforming every vertex) in the same run. The
// Google Benchmark programs in bench/ go through more sizes; scripts/bench-peers sets this beside other programs.
#include "fidelity.h"
#include "session.h"
#include "simulate_bench.h"
#include "triad.h"

#include "filigree/deform/handles.h"
#include "filigree/deform/space_warp.h"
#include "filigree/hierarchy/blend_code.h"
#include "filigree/hierarchy/restore.h"
#include "filigree/hierarchy/strip.h"
#include "filigree/io/model_file.h"
#include "filigree/mesh/shapes.h"
#include "filigree/mesh/triangulate.h"

#include <cstring>
#include <random>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

constexpr unsigned kBenchResolution = 256; // of the wavy cube, unless there is a mesh

class Bench {
public:
    Bench(Mesh mesh, const RunContext& context) : mesh_(std::move(mesh)), context_(context) {}

    void restore() {
        const double triad = measure_triad();
        for (const Precision precision : {Precision::float32, Precision::int16}) restore_blend(precision, triad);
        restore_reference(triad);
    }

    void strip_phases() {
        double simplify = 0, bind = 0;
        const double total = median_seconds([&] {
            const Stripped stripped = require(strip(mesh_, {}, context_));
            simplify = stripped.report.simplify_seconds;
            bind = stripped.report.bind_seconds;
        });
        add("strip.total", total, "s");
        add("strip.simplify", simplify, "s");
        add("strip.bind", bind, "s");
        const Model& model = blend_model(Precision::float32);
        std::string bytes;
        add("strip.write_model", median_seconds([&] { bytes = write_model(model); }), "s");
        add("strip.read_model", median_seconds([&] { require(read_model(bytes, "model", context_)); }), "s");
    }

    void files() {
        for (const auto& [name, format] : {std::pair{"obj", MeshFormat::obj},
                                           {"ply", MeshFormat::ply},
                                           {"stl", MeshFormat::stl},
                                           {"off", MeshFormat::off}}) {
            std::string bytes;
            const double write = median_seconds([&] {
                bytes.clear();
                require(write_mesh(mesh_, format, bytes, {}, RunContext()));
            });
            const double read =
                median_seconds([&] { require(read_mesh(bytes, std::string("mesh.") + name, context_)); });
            std::string copy(bytes.size(), '\0');
            const double memcpy_seconds = median_seconds([&] { std::memcpy(copy.data(), bytes.data(), bytes.size()); });
            const double megabytes = double(bytes.size()) * 1e-6;
            add(fmt::format("files.read_{}", name), megabytes / read, "MB/s");
            add(fmt::format("files.write_{}", name), megabytes / write, "MB/s");
            add(fmt::format("files.read_{}_of_memcpy", name), memcpy_seconds / read, "ratio");
        }
    }

    /// A deformer that costs something, over every vertex and over the driver alone.
    void deform() {
        const Model& model = blend_model(Precision::float32);
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
        const Restorer restorer = require(Restorer::create(model, {}, context_));
        for (const auto& [name, warp] :
             {std::pair<const char*, const SpaceWarp*>{"rbf_200", rbf.get()}, {"bend_twist", bend.get()}}) {
            const double all = median_seconds([&] { warp_positions(*warp, mesh_.positions, mesh_.origin, context_); });
            std::vector<Vec3f> restored(mesh_.vertex_count());
            const double ours = median_seconds([&] {
                require(restorer.positions(warp_pose(*warp, driver_positions(model), mesh_.origin, context_), restored,
                                           context_));
            });
            add(fmt::format("deform.{}_all", name), all, "s");
            add(fmt::format("deform.{}_driver_and_restore", name), ours, "s");
            add(fmt::format("deform.{}_speed_up", name), all / ours, "ratio");
        }
    }

    /// As-rigid-as-possible on the driver, restored in every round, as a hand would see it.
    void handles() {
        const Model& model = blend_model(Precision::float32);
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
        add("handles.setup", median_seconds([&] { require(HandleSolver::create(driver.positions, triangles, ends)); }),
            "s");
        HandleSolver solver = require(HandleSolver::create(driver.positions, triangles, ends));
        const Restorer restorer = require(Restorer::create(model, {}, context_));
        std::vector<Vec3f> restored(mesh_.vertex_count());
        add("handles.iteration", median_seconds([&] {
                const HandleResult result = require(solver.solve(targets, {.iterations = 1, .tolerance = 0}, context_));
                require(restorer.positions(result.pose, restored, context_));
            }),
            "s");
    }

    void fidelity() {
        const Model& model = blend_model(Precision::float32);
        Mesh copy = mesh_;
        const Result<Stripped> reference =
            strip(std::move(copy), {.code = DetailCode::reference, .base = model.driver().vertices.size()}, context_);
        rows_ = measure_fidelity(model, reference ? &reference->model : nullptr, context_);
        for (const FidelitySummary& summary : summarise(rows_)) {
            const std::string name = "fidelity." + summary.method;
            add(name + ".affine_rms", summary.affine_rms, "diagonals");
            add(name + ".curved_rms", summary.curved_rms, "diagonals");
            add(name + ".curved_normal_p95", summary.curved_normal_p95_deg, "degrees");
        }
    }

    void simulate(std::size_t particles) {
        for (BenchFigure& figure : measure_simulation(mesh_, {.particles = particles, .base = base_}, context_))
            figures_.push_back(std::move(figure));
    }

    void set_base(std::optional<std::size_t> base) { base_ = base; }
    const std::vector<BenchFigure>& figures() const { return figures_; }
    const std::vector<FidelityRow>& fidelity_rows() const { return rows_; }

private:
    void add(std::string name, double value, std::string unit) {
        figures_.push_back({std::move(name), value, std::move(unit)});
    }

    const Model& blend_model(Precision precision) {
        std::optional<Model>& model = models_[static_cast<std::size_t>(precision)];
        if (!model) model = require(strip(mesh_, {.base = base_, .precision = precision}, context_)).model;
        return *model;
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

    void restore_blend(Precision precision, double triad) {
        const Model& model = blend_model(precision);
        const auto& detail = std::get<BlendDetail>(model.detail);
        std::vector<BlendRestorer::Item> items(mesh_.vertex_count());
        for (Index v = 0; v < items.size(); ++v) items[v] = {v, v};
        const std::vector<Vec3f> normals(items.size(), Vec3f::UnitZ());
        const BlendRestorer restorer(detail, model.mesh.positions, model.driver().vertices, items, normals);
        const std::vector<Vec3f> driver = driver_positions(model);
        const std::vector<Mat3f> gradients(driver.size(), Mat3f::Identity());
        std::vector<Vec3f> positions(items.size()), out_normals(items.size());
        const std::string name = precision == Precision::int16 ? "restore.int16" : "restore.float";
        const double count = double(items.size());
        const double record_bytes = precision == Precision::int16 ? 10 : 20;

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
    }

    void restore_reference(double triad) {
        const unsigned resolution = 512;
        const Stripped stripped =
            require(strip(make_wavy_cube({.resolution = resolution}), {.code = DetailCode::reference}, context_));
        const auto& detail = std::get<ReferenceDetail>(stripped.model.detail);
        const std::vector<Vec3f> driver = driver_positions(stripped.model);
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
    const RunContext& context_;
    std::optional<std::size_t> base_ = {};
    std::array<std::optional<Model>, 2> models_;
    std::vector<BenchFigure> figures_;
    std::vector<FidelityRow> rows_;
};

struct Options {
    std::string name = "all", mesh;
    std::optional<std::size_t> base = {};
    std::size_t particles = 0;
};

void report_figures(const Bench& bench, Report& report) {
    Json results = Json::array();
    for (const BenchFigure& figure : bench.figures()) {
        report.row(figure.name, fmt::format("{:10.4g} {}", figure.value, figure.unit));
        results.push_back({{"name", figure.name}, {"value", figure.value}, {"unit", figure.unit}});
    }
    report.set("results", results);
}

void report_fidelity(const std::vector<FidelityRow>& rows, Report& report) {
    Json values = Json::array();
    if (!rows.empty())
        report.say(fmt::format("\n{:<18} {:<12} {:>9} {:>9} {:>9}\n", "method", "warp", "rms", "max", "normals"));
    for (const FidelityRow& row : rows) {
        values.push_back({{"method", row.method},
                          {"warp", row.warp},
                          {"rms", row.rms},
                          {"max", row.max},
                          {"normal_p95_deg", row.normal_p95_deg}});
        report.say(fmt::format("{:<18} {:<12} {:>9.2e} {:>9.2e} {:>9.3g}\n", row.method, row.warp, row.rms, row.max,
                               row.normal_p95_deg));
    }
    report.set("fidelity", values);
}

void run(const Options& options, Session& session) {
    Mesh mesh =
        options.mesh.empty() ? make_wavy_cube({.resolution = kBenchResolution}) : session.read_mesh(options.mesh);
    const RunContext silent = session.silent_context(); // a bar would cost time that is measured
    Report report;
    report.set("mesh", {{"name", options.mesh.empty() ? "wavy-cube" : options.mesh},
                        {"vertices", mesh.vertex_count()},
                        {"faces", mesh.face_count()}});
    report.set("threads", silent.threads());
    Bench bench(std::move(mesh), silent);
    bench.set_base(options.base);
    const auto wants = [&](const char* name) { return options.name == "all" || options.name == name; };
    if (wants("restore")) bench.restore();
    if (wants("strip")) bench.strip_phases();
    if (wants("files")) bench.files();
    if (wants("deform")) bench.deform();
    if (wants("handles")) bench.handles();
    if (wants("fidelity")) bench.fidelity();
    if (wants("simulate")) bench.simulate(options.particles);
    if (silent.is_cancelled()) throw Failure{cancelled_error()};
    report_figures(bench, report);
    report_fidelity(bench.fidelity_rows(), report);
    session.print(report);
}

} // namespace

Command bench_command() {
    const auto options = std::make_shared<Options>();
    return {.name = "bench",
            .text = "Measure this machine: speeds with their rivals, and fidelity",
            .options = {Option("name", options->name, "What to measure")
                            .one_of({"all", "restore", "strip", "files", "deform", "handles", "fidelity", "simulate"})
                            .with_default(),
                        Option("--mesh", options->mesh,
                               fmt::format("Mesh to measure on (unset: the wavy cube with {} vertices)",
                                           with_commas(wavy_cube_vertices(kBenchResolution)))),
                        Option("--base", options->base, "Vertices of the driver (unset: as strip chooses)"),
                        Option("--particles", options->particles, "Particles of the bodies (unset: 1,000 to 200,000)")
                            .between(8, 1000000)},
            .examples = "  filigree bench restore --threads 1\n"
                        "  filigree bench fidelity --mesh scan.ply --base 1000\n"
                        "  filigree bench --json > figures.json",
            .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
