#include "commands.h"
#include "session.h"

#include "filigree/mesh/shapes.h"

#include "interactive/measure.h"

#include <fmt/format.h>

namespace filigree::cli {

namespace {

constexpr unsigned kBenchResolution = 256; // of the wavy cube, unless there is a mesh

struct BenchArguments {
    std::string mesh;
    bench::MeasureOptions measure;
};

void report_results(const std::vector<bench::Measurement>& measured, Report& report) {
    Json results = Json::array();
    for (const bench::Measurement& result : measured) {
        report.row(result.name, fmt::format("{:10.4g} {}", result.value, result.unit));
        results.push_back({{"name", result.name}, {"value", result.value}, {"unit", result.unit}});
    }
    report.set("results", results);
}

void report_fidelity(const std::vector<bench::FidelityRow>& rows, Report& report) {
    Json values = Json::array();
    if (!rows.empty())
        report.say(fmt::format("\n{:<18} {:<12} {:>9} {:>9} {:>9}\n", "method", "warp", "rms", "max", "normals"));
    for (const bench::FidelityRow& row : rows) {
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

void run(const BenchArguments& options, Session& session) {
    Mesh mesh =
        options.mesh.empty() ? make_wavy_cube({.resolution = kBenchResolution}) : session.read_mesh(options.mesh);
    const RunContext silent = session.silent_context(); // a bar would cost time that is measured
    Report report;
    report.set("mesh", {{"name", options.mesh.empty() ? "wavy-cube" : options.mesh},
                        {"vertices", mesh.vertex_count()},
                        {"faces", mesh.face_count()}});
    report.set("threads", silent.threads());
    const bench::Measured measured = bench::measure(std::move(mesh), options.measure, silent);
    if (silent.is_cancelled()) throw Failure{cancelled_error()};
    report_results(measured.results, report);
    report_fidelity(measured.fidelity, report);
    session.print(report);
}

} // namespace

Command bench_command() {
    const auto options = std::make_shared<BenchArguments>();
    return {.name = "bench",
            .text = "Measure this machine: speeds with their rivals, and fidelity",
            .options =
                {Option("name", options->measure.name, "What to measure").one_of(bench::measure_names()).with_default(),
                 Option("--mesh", options->mesh,
                        fmt::format("Mesh to measure on (unset: the wavy cube with {} vertices)",
                                    with_commas(wavy_cube_vertices(kBenchResolution)))),
                 Option("--base", options->measure.base, "Vertices of the driver (unset: as strip chooses)"),
                 Option("--particles", options->measure.particles, "Particles of the bodies (unset: 1,000 to 200,000)")
                     .between(8, 1000000)},
            .examples = "  filigree bench restore --threads 1\n"
                        "  filigree bench fidelity --mesh scan.ply --base 1000\n"
                        "  filigree bench --json > figures.json",
            .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
