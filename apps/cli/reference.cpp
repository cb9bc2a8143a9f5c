#include "reference.h"

#include "report.h"

#include "filigree/core/now_seconds.h"
#include "filigree/io/system/file.h"
#include "filigree/reference/height_law.h"

#include <fmt/format.h>

namespace filigree::cli {

bool is_reference_model(const FileReader& file, const std::string& path, const Session& session) {
    return is_model_file(file) && session.outline(file, path).references > 0;
}

ReferenceModel read_reference(const FileReader& file, const std::string& path, const Session& session) {
    return require(read_reference_model(file, path, session.context()));
}

Option law_option(std::optional<HeightLaw>& law) {
    std::vector<std::pair<std::string, HeightLaw>> laws;
    for (std::string_view name : kHeightLawNames) laws.emplace_back(name, *height_law_from_name(name));
    return choice("--law", law, laws,
                  "Reference code: height of the detail where the surface around it grows (default: inverse)");
}

void refuse_law(const std::string& path, const Session& session) {
    if (!session.first_given({"--law"}).empty())
        refuse("--law is for the reference code, and " + path + " has the blend code.");
}

void strip_with_reference_code(const std::string& input, const std::string& output, const ReferenceOptions& options,
                               Session& session) {
    const std::string given =
        session.first_given({"--error", "--fidelity", "--fidelity-from", "--driver", "--max-edge", "--reorder"});
    if (!given.empty()) refuse(given + " is for the blend code: leave out --code reference.");
    const double start = now_seconds();
    Mesh mesh = session.read_mesh(input);
    const double read = now_seconds();
    const ReferenceModel model = require(strip_to_reference(std::move(mesh), options, session.context()));
    const double done = now_seconds();
    session.begin_writing(output);
    require(write_reference_model(model, path_of(output), session.context()));
    const double written = now_seconds();

    Report report;
    report.set("output", output);
    report.count("vertices", "vertices", model.mesh.vertex_count());
    report.row("driver", fmt::format("{} vertices, {} faces", with_commas(model.driver().vertices.size()),
                                     with_commas(model.driver().face_count())));
    report.set("driver_vertices", model.driver().vertices.size());
    report.set("driver_faces", model.driver().face_count());
    Json levels = Json::array();
    for (const Level& level : model.levels) levels.push_back(level.vertices.size());
    report.add("levels", fmt::format("{} + the finest", model.levels.size()), "levels", levels);
    report.add("seconds",
               fmt::format("{:.3f} read, {:.3f} strip, {:.3f} write", read - start, done - read, written - done),
               "seconds", {{"read", read - start}, {"strip", done - read}, {"write", written - done}});
    session.print(report);
}

} // namespace filigree::cli
