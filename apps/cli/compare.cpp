#include "session.h"

namespace filigree::cli {

void add_compare(CLI::App& app, Session& session) {
    struct Options {
        std::string a, b;
        std::size_t samples = 100'000;
    };
    auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("compare", "Say how far one mesh is from another");
    command->add_option("a", options->a, "Mesh")->required();
    command->add_option("b", options->b, "Mesh to measure against; fractions are of its diagonal")->required();
    command->add_option("--samples", options->samples, "Points on each surface, besides its vertices")
        ->check(whole_number(0))
        ->capture_default_str();
    session.add_common_options(*command, "  filigree compare restored.ply full.ply\n"
                                         "  filigree compare driver.ply scan.ply --json");
    command->callback([options, &session] {
        session.begin();
        const Mesh a = session.read_mesh(options->a), b = session.read_mesh(options->b);
        const MeshDistance distance = require(mesh_distance(a, b, options->samples, session.context()));
        Table table;
        Json json = {{"a", options->a}, {"b", options->b}, {"diagonal_units", distance.diagonal}};
        const auto add = [&](const char* key, const char* title, double units) {
            table.row(title, distance_text(distance, units));
            json[key] = distance.relative(units);
            json[std::string(key) + "_units"] = units;
        };
        if (const auto& v = distance.vertices) {
            add("rms", "rms, vertex to vertex", v->rms);
            add("max", "max, vertex to vertex", v->max);
            if (v->max_vertex != kNoIndex) json["max_vertex"] = v->max_vertex;
            table.row("normals, mean", fmt::format("{:.3g} degrees", v->normal_mean_deg));
            table.row("normals, 95 %", fmt::format("{:.3g} degrees", v->normal_p95_deg));
            json["normal_mean_deg"] = v->normal_mean_deg;
            json["normal_p95_deg"] = v->normal_p95_deg;
        } else {
            session.warn(fmt::format("The meshes have {} and {} vertices, so only their surfaces are compared.",
                                     with_commas(a.vertex_count()), with_commas(b.vertex_count())));
        }
        if (const auto& s = distance.surfaces) {
            add("hausdorff", "Hausdorff distance", s->hausdorff);
            add("mean_distance", "mean surface distance", s->mean_distance);
        }
        session.print(table.text(), json);
    });
}

} // namespace filigree::cli
