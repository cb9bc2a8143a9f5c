#include "commands.h"
#include "output_folder.h"
#include "session.h"

#include "filigree/fracture.h"

#include <fmt/format.h>

namespace filigree::cli {

namespace {

struct FractureArguments {
    std::string input, output;
    FracturePattern pattern;
    std::vector<double> at, grain;
    FractureOptions cut;
    double explode = 0;
    std::size_t seed = 1;
};

bool is_folder(const std::string& output) { return output.ends_with('/'); }

void check(const FractureArguments& options) {
    if (options.at.size() % 3 != 0)
        refuse(fmt::format("--at takes a point X,Y,Z each time it is given, and there are {} numbers.",
                           options.at.size()));
    if (!is_folder(options.output))
        require(with_hint(mesh_format(path_of(options.output)), ErrorCode::unsupported,
                          "Or end the name in '/' (" + options.output + "/) for a file a piece."));
}

void report_fracture(const FracturedMesh& fractured, double seconds, Report& report) {
    const CutReport& r = fractured.report;
    const char* unit = r.is_sheet ? "area" : "volume";
    report.add("pieces",
               fmt::format("{}; {}: {:.3g} the smallest, {:.3g} the median, {:.3g} the largest",
                           with_commas(fractured.pieces), unit, r.smallest, r.median, r.largest),
               "pieces", fractured.pieces);
    report.set("cells", r.cells);
    report.set("islands", r.islands);
    report.set("joined", r.joined);
    report.set("smallest", r.smallest);
    report.set("median", r.median);
    report.set("largest", r.largest);
    report.set("sheet", r.is_sheet);
    if (r.is_sheet) report.row("", "the mesh has no inside: pieces are parts of its surface");
    if (r.islands > 0) report.row("", fmt::format("{} of them are separate parts of a cell", with_commas(r.islands)));
    if (r.joined > 0)
        report.row("", fmt::format("{} parts were too small and were joined to a neighbour", with_commas(r.joined)));
    report.add("cracks", fmt::format("{}, of {} faces", with_commas(r.facets), with_commas(r.inside_faces)), "facets",
               r.facets);
    report.set("inside_faces", r.inside_faces);
    report.set("cone_facets", r.fan_facets);
    report.add("closed",
               fmt::format("{} open edges; volumes add up to {:.1e}", with_commas(r.open_edges), r.volume_error),
               "open_edges", r.open_edges);
    report.set("volume", r.volume);
    report.set("volume_error", r.volume_error);
    if (r.closing_triangles > 0 && !r.is_sheet)
        report.row("", fmt::format("the mesh has open borders, and so have the pieces"));
    report.set("closing_triangles", r.closing_triangles);
    report.set("vertices", fractured.mesh.vertex_count());
    report.set("faces", fractured.mesh.face_count());
    report.add(
        "seconds",
        fmt::format("{:.2f}: {:.2f} surface, {:.2f} cracks, {:.2f} pieces", seconds, r.cut_seconds, r.facet_seconds,
                    r.assemble_seconds),
        "seconds",
        {{"total", seconds}, {"surface", r.cut_seconds}, {"cracks", r.facet_seconds}, {"pieces", r.assemble_seconds}});
}

/// Keeps what tells pieces apart where the format holds it, and leaves the rest out without a word, as the mesh had
/// none.
void fit_to_format(MeshFormat format, const Mesh& input, Mesh& mesh) {
    const bool is_ply = format == MeshFormat::ply;
    if (!is_ply) mesh.scalars.pop_back(); // "piece"
    if (format != MeshFormat::obj) mesh.groups = {};
    if (is_ply || format == MeshFormat::stl || format == MeshFormat::off) {
        mesh.objects = {};
        if (input.materials.empty()) {
            mesh.materials = {};
            mesh.embedded_materials = {};
        }
        if (input.normals.empty()) mesh.normals = {};
        if (input.uvs.empty()) mesh.uvs = {};
    }
}

/// A file a piece, together or not at all.
void write_folder(const FracturedMesh& fractured, const Mesh& input, const FractureArguments& options, Session& session,
                  Report& report) {
    const std::string extension = path_of(options.input).extension().string();
    const MeshFormat format = require(mesh_format(path_of("piece" + extension)));
    OutputFolder folder(path_of(options.output), path_of(options.input));
    std::vector<std::string> files;
    for (Index p = 0; p < fractured.pieces; ++p)
        files.push_back(folder.file(fmt::format("piece_{:04}{}", p, extension)));
    const RunContext quiet = session.silent_context();
    for (Index p = 0; p < fractured.pieces; ++p) {
        Mesh piece = piece_mesh(fractured, p);
        fit_to_format(format, input, piece);
        session.warn(
            require(write_mesh(piece, path_of(files[p]), {.materials_beside = path_of(options.input)}, quiet)));
        session.context().report("writing pieces", double(p + 1) / fractured.pieces);
    }
    folder.keep();
    report.set("files", files);
    report.row(options.output, fmt::format("{} files, {} and on", with_commas(files.size()), files.front()));
}

void run(FractureArguments options, Session& session) {
    check(options);
    const Mesh mesh = session.read_mesh(options.input);
    for (std::size_t k = 0; k + 2 < options.at.size(); k += 3)
        options.pattern.at.emplace_back(Vec3d(options.at[k], options.at[k + 1], options.at[k + 2]) - mesh.origin);
    if (!options.grain.empty()) options.pattern.grain = Vec3d(options.grain[0], options.grain[1], options.grain[2]);
    RunContext context = session.context();
    context.seed = options.seed;
    const double start = now_seconds();
    const FractureCells cells = require(make_fracture_cells(mesh, options.pattern, context));
    FracturedMesh fractured = require(fracture(mesh, cells, options.cut, context));
    const double seconds = now_seconds() - start;
    if (const std::string turned = outward_sentence(fractured.report.outward); !turned.empty())
        session.warn(options.input + ": " + turned);
    if (options.explode > 0) explode(fractured, options.explode);

    Report report;
    report.set("output", options.output);
    if (!mesh.objects.empty() || !mesh.groups.empty()) report.row("objects, groups", "replaced by the pieces");
    if (is_folder(options.output)) {
        write_folder(fractured, mesh, options, session, report);
    } else {
        fit_to_format(require(mesh_format(path_of(options.output))), mesh, fractured.mesh);
        session.write_mesh(fractured.mesh, options.output, options.input);
        report_mesh_written(fractured.mesh, options.output, report);
    }
    report_fracture(fractured, seconds, report);
    if (!(options.explode > 0) && fractured.pieces > 1)
        report.row("look", "cracks are closed and do not show; --explode 0.3 moves the pieces apart");
    session.print(report);
}

} // namespace

Command fracture_command() {
    const auto options = std::make_shared<FractureArguments>();
    FracturePattern& pattern = options->pattern;
    return {
        .name = "fracture",
        .text = "Break a mesh into pieces",
        .options = {Option("mesh", options->input, "Mesh file").required().is_read(),
                    output_option(options->output,
                                  "Mesh file to write, or a folder (\"pieces/\") with a file for each piece"),
                    Option("--pieces", pattern.pieces, "Number of pieces")
                        .between(1, static_cast<int>(FractureCells::kMostSeeds))
                        .with_default(),
                    choice<FracturePatternKind>(
                        "--pattern", pattern.kind,
                        {{"even", FracturePatternKind::even},
                         {"impact", FracturePatternKind::impact},
                         {"slabs", FracturePatternKind::slabs},
                         {"radial", FracturePatternKind::radial},
                         {"grains", FracturePatternKind::grains}},
                        "even (default): pieces of about one size; impact: small pieces around --at; slabs: long "
                        "pieces, like wood; radial: rays and rings around --at, like glass; grains: small pieces in "
                        "some places, large in others, like stone"),
                    Option("--clump", pattern.clump, "Number of cells in a piece; more cells make knobbly pieces")
                        .between(1, static_cast<int>(FracturePattern::kMostClump))
                        .with_default(),
                    Option("--at", options->at,
                           "Impact, radial: the point that was hit (default: a corner; radial: the middle). Impact: "
                           "may come several times")
                        .values(3, 3)
                        .comma_separated()
                        .one_at_a_time()
                        .named("X,Y,Z"),
                    Option("--grain", options->grain,
                           "Slabs: direction of the long sides (default: the longest axis of the mesh)")
                        .values(3)
                        .comma_separated()
                        .named("X,Y,Z"),
                    Option("--roughness", pattern.roughness, "Roughness of the cracks, 0 (planes) to 1")
                        .between(0.0, 1.0)
                        .with_default(),
                    Option("--edge", options->cut.edge,
                           "Length of edges on crack surfaces, model units (default: a twentieth of a piece, a sixth "
                           "if cracks are planes; 0: no vertices inside a crack surface)")
                        .between(0.0, 1e300),
                    Option("--smallest", options->cut.smallest,
                           "A part smaller than this share of the mean volume is joined to a neighbour")
                        .between(0.0, 1.0)
                        .with_default(),
                    Option("--explode", options->explode,
                           "Move each piece away from the middle by this multiple of its distance")
                        .between(0.0, 1e6)
                        .with_default(),
                    Option("--seed", options->seed, "Random seed: another number gives other pieces").with_default()},
        .examples = "  filigree fracture koala.obj -o broken.glb --pieces 30\n"
                    "  filigree fracture plate.ply -o broken.ply --pattern radial --at 0,0,0 --explode 0.3\n"
                    "  filigree fracture statue.ply -o pieces/ --pattern impact --at 0.2,1.4,0 --pieces 200",
        .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
