#include "session.h"

#include "filigree/io/gltf.h"
#include "filigree/mesh/topology.h"
#include "filigree/remesh/quad_quality.h"

namespace filigree::cli {

namespace {

Json vec_json(const Vec3d& v) { return {v[0], v[1], v[2]}; }

struct NamedFinding {
    const char* key;
    const char* title;
    const Finding& finding;
};

std::vector<NamedFinding> findings(const TopologyReport& report) {
    return {{"open_edges", "open edges", report.open_edges},
            {"nonmanifold_edges", "non-manifold edges", report.nonmanifold_edges},
            {"inconsistent_edges", "inconsistent edges", report.inconsistent_edges},
            {"nonmanifold_vertices", "non-manifold vertices", report.nonmanifold_vertices},
            {"degenerate_faces", "degenerate faces", report.degenerate_faces},
            {"duplicate_faces", "duplicate faces", report.duplicate_faces},
            {"unused_vertices", "unused vertices", report.unused_vertices},
            {"duplicate_vertices", "duplicate vertices", report.duplicate_vertices}};
}

std::string places_text(const Finding& finding) {
    std::string text = with_commas(finding.count);
    if (finding.count == 0) return text;
    text += "  at";
    for (const std::vector<Index>& place : finding.places) {
        text += ' ';
        for (std::size_t k = 0; k < place.size(); ++k) text += fmt::format("{}{}", k ? "-" : "", place[k]);
    }
    return finding.count > finding.places.size() ? text + " ..." : text;
}

std::vector<std::string> attribute_names(const Mesh& mesh) {
    std::vector<std::string> names;
    const auto add = [&](bool present, std::string name) {
        if (present) names.push_back(std::move(name));
    };
    add(!mesh.uvs.empty(), mesh.uvs.per_vertex() ? "uvs" : "uvs of corners");
    add(!mesh.normals.empty(), mesh.normals.per_vertex() ? "normals" : "normals of corners");
    add(!mesh.colors.empty(), "colors");
    add(!mesh.objects.empty(), fmt::format("{} objects", mesh.objects.names.size()));
    add(!mesh.groups.empty(), fmt::format("{} groups", mesh.groups.names.size()));
    add(!mesh.materials.empty(), fmt::format("{} materials", mesh.materials.names.size()));
    add(!mesh.smoothing.empty(), "smoothing groups");
    for (const VertexScalar& scalar : mesh.scalars) add(true, "scalar " + scalar.name);
    return names;
}

/// Shape and regularity of a mesh's quads.
void describe_quads(const Mesh& mesh, Session& session, Table& table, Json& json) {
    const QuadQuality quality = measure_quads(mesh, session.context());
    table.row("irregular vertices", with_commas(quality.irregular_vertices) + " inside, with other than four quads");
    table.row("scaled Jacobian",
              fmt::format("{:.3f} at least (face {}), {:.3f} for 99 %, {:.3f} on average", quality.min_scaled_jacobian,
                          quality.worst_quad, quality.low_scaled_jacobian, quality.mean_scaled_jacobian));
    table.row("inverted quads", with_commas(quality.inverted));
    json["quad_quality"] = {{"irregular_vertices", quality.irregular_vertices},
                            {"scaled_jacobian",
                             {{"min", quality.min_scaled_jacobian},
                              {"percentile_1", quality.low_scaled_jacobian},
                              {"mean", quality.mean_scaled_jacobian}}},
                            {"inverted", quality.inverted},
                            {"worst_quad", quality.worst_quad}};
}

void describe_mesh(const Mesh& mesh, Session& session, Table& table, Json& json) {
    const TopologyReport report = analyse_topology(mesh, session.context());
    table.row("vertices", with_commas(report.vertices));
    table.row("faces",
              fmt::format("{}  ({} triangles, {} quads, {} larger)", with_commas(report.faces),
                          with_commas(report.triangles), with_commas(report.quads), with_commas(report.polygons)));
    table.row("edges", with_commas(report.edges));
    table.row("components", with_commas(report.components));
    table.row("Euler number", std::to_string(report.euler));
    table.row("closed", report.is_closed() ? "yes" : "no");
    table.row("manifold", report.is_manifold() ? "yes" : "no");
    table.row("oriented", report.is_oriented() ? "yes" : "no");
    const Vec3d size = report.box.size();
    if (!report.box.empty())
        table.row("box", fmt::format("{:.6g} x {:.6g} x {:.6g}, diagonal {:.6g}, from ({:.9g}, {:.9g}, {:.9g})",
                                     size[0], size[1], size[2], report.box.diagonal(), report.box.min[0],
                                     report.box.min[1], report.box.min[2]));
    table.row("area", fmt::format("{:.6g}", report.area));
    if (report.is_closed() && report.is_oriented()) table.row("volume", fmt::format("{:.6g}", report.volume));
    const std::vector<std::string> attributes = attribute_names(mesh);
    if (!attributes.empty()) table.row("attributes", fmt::format("{}", fmt::join(attributes, ", ")));
    json["vertices"] = report.vertices;
    json["faces"] = report.faces;
    json["triangles"] = report.triangles;
    json["quads"] = report.quads;
    json["polygons"] = report.polygons;
    json["edges"] = report.edges;
    json["components"] = report.components;
    json["euler"] = report.euler;
    json["closed"] = report.is_closed();
    json["manifold"] = report.is_manifold();
    json["oriented"] = report.is_oriented();
    if (!report.box.empty()) {
        json["box"] = {{"min", vec_json(report.box.min)}, {"max", vec_json(report.box.max)}};
        json["diagonal_units"] = report.box.diagonal();
    }
    json["area"] = report.area;
    json["volume"] = report.volume;
    json["attributes"] = attributes;
    Json& defects = json["defects"] = Json::object();
    for (const auto& [key, title, finding] : findings(report)) {
        table.row(title, places_text(finding));
        defects[key] = {{"count", finding.count}, {"places", finding.places}};
    }
    if (report.quads > 0) describe_quads(mesh, session, table, json);
}

void describe_model(const Model& model, const PoseSequence& poses, std::size_t bytes, Table& table, Json& json) {
    table.row("code", model.code() == DetailCode::blend ? "blend" : "reference");
    Json levels = Json::array();
    for (unsigned k = 0; k <= model.finest_level(); ++k) {
        const bool finest = k == model.finest_level();
        const std::size_t vertices = finest ? model.mesh.vertex_count() : model.levels[k].vertices.size();
        const std::size_t faces = finest ? model.mesh.face_count() : model.levels[k].face_count();
        table.row(fmt::format("level {}", k), fmt::format("{} vertices, {} faces{}", with_commas(vertices),
                                                          with_commas(faces), k == 0 ? "  (driver)" : ""));
        levels.push_back({{"vertices", vertices}, {"faces", faces}});
    }
    json["levels"] = levels;
    if (const auto* blend = std::get_if<BlendDetail>(&model.detail)) {
        const bool int16 = blend->precision == Precision::int16;
        table.row("precision", int16 ? "int16, 10 bytes a vertex" : "float, 20 bytes a vertex");
        table.row("bound across gaps", with_commas(blend->across_gap.size()));
        table.row("bound facing away", with_commas(blend->facing_away.size()));
        json["precision"] = int16 ? "int16" : "float";
        const auto list = [](const std::vector<Index>& ids) {
            return Json{{"count", ids.size()},
                        {"places", std::vector<Index>(ids.begin(), ids.begin() + std::min<std::ptrdiff_t>(
                                                                                     5, std::ptrdiff_t(ids.size())))}};
        };
        json["across_gap"] = list(blend->across_gap);
        json["facing_away"] = list(blend->facing_away);
    } else {
        const auto& reference = std::get<ReferenceDetail>(model.detail);
        table.row("references", std::to_string(reference.references));
        table.row("patches", with_commas(reference.patches.patch_count()));
        json["references"] = reference.references;
        json["patches"] = reference.patches.patch_count();
    }
    if (!poses.empty()) {
        table.row("poses",
                  fmt::format("{} at {} frames a second{}", with_commas(poses.frames.size()), poses.frames_per_second,
                              poses.frames[0].gradients.empty() ? "" : ", with gradients"));
        json["poses"] = {{"frames", poses.frames.size()},
                         {"frames_per_second", poses.frames_per_second},
                         {"gradients", !poses.frames[0].gradients.empty()}};
    }
    table.row("bytes", with_commas(bytes));
    json["bytes"] = bytes;
}

/// What a glTF file has beside its mesh: animations, and what an export of ours measured about itself.
void describe_scene(const GltfScene& scene, Table& table, Json& json) {
    json["animations"] = Json::array();
    for (const GltfAnimation& animation : scene.animations()) {
        table.row("animation",
                  fmt::format("{}, {:.4g} to {:.4g} s", animation.name.empty() ? "unnamed" : animation.name,
                              animation.first_key, animation.last_key));
        json["animations"].push_back(
            {{"name", animation.name}, {"first_key", animation.first_key}, {"last_key", animation.last_key}});
    }
    const Json report = Json::parse(scene.export_report(), nullptr, false);
    if (!report.is_object()) return;
    json["export"] = report;
    const auto number = [&](const char* key) -> std::optional<double> {
        const auto found = report.find(key);
        return found != report.end() && found->is_number() ? std::optional(found->get<double>()) : std::nullopt;
    };
    const auto count = [&](const char* key) {
        const auto found = report.find(key);
        if (found != report.end() && found->is_number_unsigned())
            table.row(key, with_commas(found->get<std::size_t>()));
    };
    const auto row = [&](const char* title, const char* key, const char* unit) {
        if (const auto value = number(key)) table.row(title, fmt::format("{:.3g}{}", *value, unit));
    };
    count("joints");
    count("keys");
    row("error at keys", "error_at_keys", " of the diagonal, as measured when it was exported");
    row("error between keys", "error_between_keys", " of the diagonal");
    row("normals off by", "normal_error_degrees", " degrees (95th percentile) in viewers that do not correct them");
}

} // namespace

void add_info(CLI::App& app, Session& session) {
    auto path = std::make_shared<std::string>();
    CLI::App* command = app.add_subcommand("info", "Say what a mesh or a model is, and what is wrong with it");
    command->add_option("file", *path, "Mesh or model")->required();
    session.add_common_options(*command, "  filigree info scan.ply\n"
                                         "  filigree info scan.ply --json | jq .defects\n"
                                         "  filigree info scan.fil");
    command->callback([path, &session] {
        session.begin();
        const Session::Content content = session.read_any(*path, true);
        Table table;
        Json json = {{"file", *path}};
        table.row("file", *path);
        if (const auto* mesh = std::get_if<Mesh>(&content.value)) {
            json["kind"] = "mesh";
            describe_mesh(*mesh, session, table, json);
            if (content.scene) describe_scene(*content.scene, table, json);
        } else {
            json["kind"] = "model";
            const auto& model = std::get<Model>(content.value);
            json["code"] = model.code() == DetailCode::blend ? "blend" : "reference";
            describe_model(model, content.poses, content.bytes, table, json);
        }
        session.print(table.text(), json);
    });
}

} // namespace filigree::cli
