#include "coding_report.h"
#include "commands.h"
#include "session.h"

#include "filigree/io/gltf/gltf.h"
#include "filigree/io/model/model_file.h"
#include "filigree/io/system/file.h"
#include "filigree/mesh.h"
#include "filigree/pose.h"
#include "filigree/remesh/quad_quality.h"
#include "filigree/sample.h"

#include <cmath>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

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
void describe_quads(const Mesh& mesh, Session& session, Report& report) {
    const QuadQuality quality = measure_quads(mesh, session.context());
    report.row("irregular vertices", with_commas(quality.irregular_vertices) + " inside, with other than four quads");
    report.row("scaled Jacobian",
               fmt::format("{:.3f} at least (face {}), {:.3f} for 99 %, {:.3f} on average", quality.min_scaled_jacobian,
                           quality.worst_quad, quality.low_scaled_jacobian, quality.mean_scaled_jacobian));
    report.row("inverted quads", with_commas(quality.inverted));
    report.set("quad_quality", {{"irregular_vertices", quality.irregular_vertices},
                                {"scaled_jacobian",
                                 {{"min", quality.min_scaled_jacobian},
                                  {"percentile_1", quality.low_scaled_jacobian},
                                  {"mean", quality.mean_scaled_jacobian}}},
                                {"inverted", quality.inverted},
                                {"worst_quad", quality.worst_quad}});
}

void describe_counts(const TopologyReport& topology, Report& report) {
    report.count("vertices", "vertices", topology.vertices);
    report.row("faces", fmt::format("{}  ({} triangles, {} quads, {} larger)", with_commas(topology.faces),
                                    with_commas(topology.triangles), with_commas(topology.quads),
                                    with_commas(topology.polygons)));
    report.set("faces", topology.faces);
    report.set("triangles", topology.triangles);
    report.set("quads", topology.quads);
    report.set("polygons", topology.polygons);
    report.count("edges", "edges", topology.edges);
    report.count("components", "components", topology.components);
    report.add("Euler number", std::to_string(topology.euler), "euler", topology.euler);
    const auto add = [&](const char* key, bool is) { report.add(key, is ? "yes" : "no", key, is); };
    add("closed", topology.is_closed());
    add("manifold", topology.is_manifold());
    add("oriented", topology.is_oriented());
}

void describe_size(const TopologyReport& topology, Report& report) {
    const Box& box = topology.box;
    if (!box.empty()) {
        report.add("box",
                   fmt::format("{:.6g} x {:.6g} x {:.6g}, diagonal {:.6g}, from ({:.9g}, {:.9g}, {:.9g})",
                               box.size()[0], box.size()[1], box.size()[2], box.diagonal(), box.min[0], box.min[1],
                               box.min[2]),
                   "box", {{"min", box.min}, {"max", box.max}});
        report.set("diagonal_units", box.diagonal());
    }
    report.add("area", fmt::format("{:.6g}", topology.area), "area", topology.area);
    report.set("volume", topology.volume);
}

/// What is inside, as sample, bodies and fracture see it; the volume of faces as they look is in the report as it was.
void describe_inside(const Mesh& mesh, const TopologyReport& topology, Session& session, Report& report) {
    constexpr double kSame = 1e-5; // of the volume: rounding
    const InsideVolume inside = require(inside_volume(mesh, session.context()));
    if (inside.volume) {
        const bool differs = std::abs(*inside.volume - topology.volume) > kSame * std::abs(*inside.volume);
        report.row("volume", differs ? fmt::format("{:.6g} inside ({:.6g} by the way the faces look)", *inside.volume,
                                                   topology.volume)
                                     : fmt::format("{:.6g}", *inside.volume));
        report.set("inside_volume", *inside.volume);
    } else {
        report.set("inside_volume", Json());
    }
    if (const std::string turned = outward_sentence(inside.outward); !turned.empty()) report.row("inside", turned);
    report.set("inside_said", outward_sentence(inside.outward));
}

void describe_mesh(const Mesh& mesh, Session& session, Report& report) {
    const TopologyReport topology = analyse_topology(mesh, session.context());
    describe_counts(topology, report);
    describe_size(topology, report);
    describe_inside(mesh, topology, session, report);
    const std::vector<std::string> attributes = attribute_names(mesh);
    if (!attributes.empty()) report.row("attributes", fmt::format("{}", fmt::join(attributes, ", ")));
    report.set("attributes", attributes);
    Json& defects = report.set("defects");
    defects = Json::object();
    for (const auto& [key, title, finding] : findings(topology)) {
        report.row(title, places_text(finding));
        defects[key] = {{"count", finding.count}, {"places", finding.places}};
    }
    if (topology.quads > 0) describe_quads(mesh, session, report);
}

void describe_levels(const ModelOutline& model, Report& report) {
    Json levels = Json::array();
    for (std::size_t k = 0; k < model.levels.size(); ++k) {
        const LevelCounts& counts = model.levels[k];
        report.row(fmt::format("level {}", k), fmt::format("{} vertices, {} faces{}", with_commas(counts.vertices),
                                                           with_commas(counts.faces), k == 0 ? "  (driver)" : ""));
        levels.push_back({{"vertices", counts.vertices}, {"faces", counts.faces}});
    }
    report.set("levels", levels);
}

/// How many vertices, and the first few.
Json vertices_json(const std::vector<Index>& ids) {
    constexpr std::ptrdiff_t kShown = 5;
    const auto end = ids.begin() + std::min(kShown, std::ptrdiff_t(ids.size()));
    return {{"count", ids.size()}, {"places", std::vector<Index>(ids.begin(), end)}};
}

/// What a coded file spends its bits on.
void describe_coding(const ModelOutline& model, Report& report) {
    const Packing& coding = *model.coding;
    report.add("packed",
               fmt::format("{} bits{}{}{}", coding.options.bits,
                           coding.options.records  ? ", for the runtime"
                           : coding.options.levels ? ", as a stream"
                                                   : "",
                           coding.options.surface ? ", by surface" : "",
                           coding.options.keep_order ? ", in the input's order" : ""),
               "coding",
               {{"bits", coding.options.bits},
                {"surface", coding.options.surface},
                {"keep_order", coding.options.keep_order},
                {"profile", coding.options.records  ? "runtime"
                            : coding.options.levels ? "stream"
                                                    : "compact"},
                {"step_units", coding.step}});
    add_coding_shares(coding.bytes, model.levels.back().vertices, std::nullopt, report);
    add_stream_marks(model, report);
}

void describe_code(const ModelOutline& model, Report& report) {
    if (model.lossless) {
        report.add("packed", "lossless", "coding", {{"profile", "lossless"}});
        add_coding_shares(*model.lossless, model.levels.back().vertices, model.bytes, report);
    }
    if (model.references > 0) {
        report.add("references", std::to_string(model.references), "references", model.references);
        return report.count("patches", "patches", model.patches);
    }
    if (model.coding) return describe_coding(model, report);
    report.add("bound across gaps", with_commas(model.across_gap.size()), "across_gap",
               vertices_json(model.across_gap));
    report.add("bound facing away", with_commas(model.facing_away.size()), "facing_away",
               vertices_json(model.facing_away));
}

constexpr std::size_t kQuickDriver = 20'000;  ///< vertices, of a driver that is judged in a second or so
constexpr std::size_t kQuickMesh = 2'000'000; ///< vertices, of a mesh read and judged in a second or so

bool is_judged_quickly(const ModelOutline& model) {
    return model.levels.back().vertices <= kQuickMesh && model.levels.front().vertices <= kQuickDriver;
}

/// What the driver is good for.
void describe_fidelity(const Model& model, Session& session, Report& report) {
    const DriverFidelity fidelity = require(driver_fidelity(model, session.context()));
    report.add("fidelity",
               fmt::format("{:.2g} of the diagonal from positions, {:.2g} with gradients", fidelity.positions,
                           fidelity.gradients),
               "fidelity", {{"positions", fidelity.positions}, {"gradients", fidelity.gradients}});
}

void describe_model(const ModelOutline& model, Report& report) {
    const char* code = model.references > 0 ? "reference" : "blend";
    report.add("code", code, "code", code);
    describe_levels(model, report);
    describe_code(model, report);
    if (model.frames > 0) {
        report.add("poses",
                   fmt::format("{} at {} frames a second{}", with_commas(model.frames), model.frames_per_second,
                               model.has_gradients ? ", with gradients" : ""),
                   "poses",
                   {{"frames", model.frames},
                    {"frames_per_second", model.frames_per_second},
                    {"gradients", model.has_gradients}});
    }
    report.count("bytes", "bytes", model.bytes);
}

/// What an export of ours measured about itself.
void describe_export(const Json& measured, Report& report) {
    report.set("export", measured);
    const auto count = [&](const char* key) {
        const Json* value = measured.find(key);
        if (value && value->count()) report.row(key, with_commas(*value->count()));
    };
    const auto row = [&](const char* title, const char* key, const char* unit) {
        const Json* value = measured.find(key);
        if (value && value->number()) report.row(title, fmt::format("{:.3g}{}", *value->number(), unit));
    };
    count("joints");
    count("keys");
    row("error at keys", "error_at_keys", " of the diagonal, as measured when it was exported");
    row("error between keys", "error_between_keys", " of the diagonal");
    row("normal error", "normal_error_degrees", " degrees (95th percentile) in viewers that do not correct them");
}

/// What a glTF file has beside its mesh.
void describe_scene(const GltfScene& scene, Report& report) {
    Json& animations = report.set("animations");
    animations = Json::array();
    for (const GltfAnimation& animation : scene.animations()) {
        report.row("animation",
                   fmt::format("{}, {:.4g} to {:.4g} s", animation.name.empty() ? "unnamed" : animation.name,
                               animation.first_key, animation.last_key));
        animations.push_back(
            {{"name", animation.name}, {"first_key", animation.first_key}, {"last_key", animation.last_key}});
    }
    const auto measured = Json::parse(scene.export_report());
    if (measured && measured->is_object()) describe_export(*measured, report);
}

struct InfoArguments {
    std::string path;
    bool fidelity = false; ///< also where it takes long
};

/// A mesh, and what else its file holds.
void describe_mesh_file(const FileReader& file, const std::string& path, Session& session, Report& report) {
    const std::string bytes = require(file.read_all());
    if (!is_gltf(bytes)) return describe_mesh(session.parse_mesh(bytes, path), session, report);
    const GltfScene scene = require(GltfScene::read(bytes, path, session.context()));
    session.warn(scene.warnings());
    describe_mesh(scene.mesh(), session, report);
    describe_scene(scene, report);
}

void run(const InfoArguments& options, Session& session) {
    const std::string& path = options.path;
    const FileReader file = session.open(path);
    Report report;
    report.add("file", path, "file", path);
    if (is_model_file(file)) {
        const ModelOutline model = session.outline(file, path);
        report.set("kind", "model");
        describe_model(model, report);
        if (model.references > 0) return session.print(report);
        if (options.fidelity || is_judged_quickly(model))
            describe_fidelity(session.read_model(file, path), session, report);
        else
            report.row("fidelity", "not measured: it would take long; --fidelity does");
    } else {
        if (options.fidelity) refuse(path + ": is a mesh, and --fidelity belongs to models.");
        report.set("kind", "mesh");
        describe_mesh_file(file, path, session, report);
    }
    session.print(report);
}

} // namespace

Command info_command() {
    const auto options = std::make_shared<InfoArguments>();
    return {.name = "info",
            .text = "Describe a mesh or a model, and list the defects of a mesh",
            .options = {Option("file", options->path, "Mesh or model").required(),
                        Option("--fidelity", options->fidelity,
                               fmt::format("Measure the restore error of large models too (more than {} vertices, or "
                                           "{} in the driver); small models are always measured",
                                           with_commas(kQuickMesh), with_commas(kQuickDriver)))},
            .examples = "  filigree info scan.ply\n"
                        "  filigree info scan.ply --json | jq .defects\n"
                        "  filigree info scan.fil",
            .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
