#include "commands.h"
#include "session.h"

#include "filigree/file.h"
#include "filigree/mesh.h"

#include "interactive/measure.h"

#include <filesystem>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

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

/// A number as in a figure's row; whole numbers whole.
std::string cell_text(const std::variant<std::string, double>& cell) {
    if (const auto* word = std::get_if<std::string>(&cell)) return *word;
    return fmt::format("{:.4g}", std::get<double>(cell));
}

void report_table(const bench::Table& table, Report& report) {
    std::vector<std::size_t> widths;
    for (std::size_t k = 0; k < table.columns.size(); ++k) {
        widths.push_back(table.columns[k].size());
        for (const auto& row : table.rows) widths[k] = std::max(widths[k], cell_text(row[k]).size());
    }
    std::string text = "\n";
    for (std::size_t k = 0; k < widths.size(); ++k) text += fmt::format("{:<{}}  ", table.columns[k], widths[k]);
    Json values = Json::array();
    for (const auto& row : table.rows) {
        text += '\n';
        Json object = Json::object();
        for (std::size_t k = 0; k < row.size(); ++k) {
            text += fmt::format("{:<{}}  ", cell_text(row[k]), widths[k]);
            std::visit([&](const auto& value) { object[table.columns[k]] = value; }, row[k]);
        }
        values.push_back(object);
    }
    report.say(text + '\n');
    report.set(table.name, values);
}

bench::NamedMesh named_mesh(const std::string& path, Session& session) {
    return {path_of(path).filename().string(), session.read_mesh(path)};
}

/// The meshes in a folder and the folders in it, by name. What cannot be read is left out, with a warning.
std::vector<bench::NamedMesh> meshes_in(const std::string& folder, Session& session) {
    std::vector<std::string> paths;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(path_of(folder)))
        if (entry.is_regular_file() && mesh_format(entry.path()).ok()) paths.push_back(entry.path().string());
    std::sort(paths.begin(), paths.end());
    std::vector<bench::NamedMesh> meshes;
    for (const std::string& path : paths) {
        try {
            meshes.push_back(named_mesh(path, session));
        } catch (const Failure& failure) {
            if (failure.error.code == ErrorCode::cancelled) throw;
            session.warn(failure.error.message + " Left out.");
        }
    }
    if (meshes.empty()) refuse(folder + ": holds no meshes.");
    return meshes;
}

std::vector<bench::NamedMesh> meshes_for(const BenchArguments& options, Session& session) {
    const bool many = bench::takes_many_meshes(options.measure.name);
    std::error_code ignored;
    if (many && fs::is_directory(path_of(options.mesh), ignored)) return meshes_in(options.mesh, session);
    std::vector<bench::NamedMesh> meshes;
    if (!options.mesh.empty())
        meshes.push_back(named_mesh(options.mesh, session));
    else if (many)
        meshes = bench::built_in_meshes();
    else
        meshes.push_back({"wavy-cube", make_wavy_cube({.resolution = kBenchResolution})});
    return meshes;
}

void run(const BenchArguments& options, Session& session) {
    std::vector<bench::NamedMesh> meshes = meshes_for(options, session);
    const RunContext silent = session.silent_context(); // a bar would cost time that is measured
    Report report;
    Json named = Json::array();
    for (const bench::NamedMesh& one : meshes)
        named.push_back({{"name", one.name}, {"vertices", one.mesh.vertex_count()}, {"faces", one.mesh.face_count()}});
    if (bench::takes_many_meshes(options.measure.name))
        report.set("meshes", named);
    else
        report.set("mesh", named.at(0));
    report.set("threads", silent.threads());
    const bench::Measured measured = bench::measure(std::move(meshes), options.measure, silent);
    if (silent.is_cancelled()) throw Failure{cancelled_error()};
    report_results(measured.results, report);
    for (const bench::Table& table : measured.tables) report_table(table, report);
    session.print(report);
}

} // namespace

Command bench_command() {
    const auto options = std::make_shared<BenchArguments>();
    return {.name = "bench",
            .text = "Measure speed on this machine, beside other methods, and fidelity",
            .options =
                {Option("name", options->measure.name, "What to measure").one_of(bench::measure_names()).with_default(),
                 Option("--mesh", options->mesh,
                        fmt::format("Mesh to measure (default: the wavy cube with {} vertices). For estimate, drivers "
                                    "and goals also a folder of meshes (default: six built-in shapes)",
                                    with_commas(wavy_cube_vertices(kBenchResolution)))),
                 Option("--base", options->measure.base, "Vertices of the driver (default: as for strip)"),
                 Option("--particles", options->measure.particles,
                        "Number of particles of simulate (default: several, from 1,000 to 200,000)")
                     .between(8, 1000000),
                 Option("--poses", options->measure.poses, "Number of random poses of estimate (default: 1,000)")
                     .between(1, 1000000)},
            .examples = "  filigree bench restore --threads 1\n"
                        "  filigree bench fidelity --mesh scan.ply --base 1000\n"
                        "  filigree bench drivers --mesh scans/\n"
                        "  filigree bench --json > figures.json",
            .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
