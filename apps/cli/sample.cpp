#include "commands.h"
#include "drawing.h"
#include "session.h"

#include "filigree/sample.h"
#include "filigree/sample/frustum.h"

#include <algorithm>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

struct SampleArguments {
    std::string input, output, picture;
    double spacing = 0;
    std::size_t count = 0;
    std::vector<double> origin, eye;
    std::vector<std::size_t> frustum;
    InsideOptions inside;
    Pattern pattern = Pattern::lattice;
    std::size_t seed = 1;
    std::optional<UpAxis> up;
};

const std::vector<std::pair<std::string, InsideMethod>> kMethods = {{"auto", InsideMethod::automatic},
                                                                    {"scan", InsideMethod::scan},
                                                                    {"rays", InsideMethod::rays},
                                                                    {"winding", InsideMethod::winding}};

/// Points inside, and how they were found.
struct Found {
    std::vector<Vec3d> points;
    InsideReport inside;
    std::size_t tested = 0;
    double spacing = 0;
    std::array<std::size_t, 3> counts = {};
    std::array<double, 3> origin = {};
};

/// The report's points: in the view from the eye, in regular steps across the picture and in depth.
Found find_in_view(const Mesh& mesh, const SampleArguments& options, const RunContext& context) {
    const Box box = bounds(mesh);
    InsideOptions inside = options.inside;
    Frustum frustum = frustum_around(box, inside.eye);
    inside.eye = frustum.eye;
    std::copy_n(options.frustum.begin(), 3, frustum.counts.begin());
    const std::vector<Vec3d> points = require(frustum_points(frustum));
    Found found;
    found.points = require(points_inside(mesh, points, inside, context, &found.inside));
    found.tested = points.size();
    found.spacing = box.diagonal() / double(options.frustum[2]);
    return found;
}

Found find_on_lattice(const Mesh& mesh, const SampleArguments& options, const RunContext& context) {
    Found found;
    LatticeOptions lattice_options{.spacing = options.spacing};
    if (options.count)
        lattice_options.spacing = require(spacing_for_count(mesh, options.count, options.inside, context));
    if (!options.origin.empty())
        lattice_options.origin = Vec3d(options.origin[0], options.origin[1], options.origin[2]) - mesh.origin;
    const Lattice lattice = require(make_lattice(bounds(mesh), lattice_options));
    found.points = require(spread_inside(mesh, lattice, options.pattern, options.inside, context, &found.inside));
    found.spacing = lattice.spacing;
    found.counts = lattice.counts();
    for (int axis = 0; axis < 3; ++axis) found.origin[axis] = mesh.origin[axis] + lattice.coordinates[axis][0];
    found.tested = static_cast<std::size_t>(lattice.point_count());
    return found;
}

constexpr double kManyNearBorder = 0.01; // of the points, from which on an open mesh is told of

void warn_of_doubts(const Found& found, const std::string& input, Session& session) {
    if (const std::string turned = outward_sentence(found.inside.outward); !turned.empty())
        session.warn(input + ": " + turned);
    if (found.points.empty())
        session.warn(fmt::format("{}: no point is inside; take a smaller spacing than {:.4g}.", input, found.spacing));
    const auto& winding = found.inside.winding;
    if (found.inside.used == InsideMethod::winding && winding.open_edges > 0 && winding.near_half > kManyNearBorder)
        session.warn(
            fmt::format("{}: is not closed ({} edges do not close), so winding numbers decided; {:.2g} % of the "
                        "points were near the border between inside and outside.",
                        input, with_commas(winding.open_edges), 100 * winding.near_half));
}

Report make_report(const Found& found, const std::string& output) {
    const InsideReport& inside = found.inside;
    const ScanReport& scan = inside.scan;
    const std::string& method = kMethods[std::size_t(inside.used)].first;
    Report report;
    report.set("output", output);
    report.row("points inside", fmt::format("{} of {}", with_commas(found.points.size()), with_commas(found.tested)));
    report.set("points", found.points.size());
    report.set("tested", found.tested);
    report.set("lattice", found.counts);
    report.set("lattice_origin", found.origin);
    report.add("spacing", fmt::format("{:.6g} units", found.spacing), "spacing_units", found.spacing);
    report.add("method",
               fmt::format("{}{} in {}, set up in {}", method,
                           inside.winding.open_edges > 0
                               ? fmt::format(", as {} edges do not close", with_commas(inside.winding.open_edges))
                               : "",
                           seconds_text(inside.seconds), seconds_text(inside.setup_seconds)),
               "method", method);
    if (inside.used == InsideMethod::scan)
        report.row("crossings",
                   fmt::format("{} ({} decided in integers, {} in expansions)", with_commas(scan.crossings),
                               with_commas(scan.tally.integers), with_commas(scan.tally.expansions)));
    report.set("open_edges", inside.closure.open_edges);
    report.set("crossings", scan.crossings);
    report.set("integers", scan.tally.integers);
    report.set("expansions", scan.tally.expansions);
    report.set("near_half", inside.winding.near_half);
    report.set("setup_seconds", inside.setup_seconds);
    report.set("seconds", inside.seconds);
    return report;
}

void check(const SampleArguments& options) {
    if (!(options.spacing > 0) && !options.count && options.frustum.empty())
        refuse("Say how many points: --spacing S, --count N, or --frustum NX NY NZ.");
    if (!options.frustum.empty() && options.pattern != Pattern::lattice)
        refuse("--pattern spreads the points of a lattice; leave --frustum out.");
    if (!options.picture.empty()) check_png_path(options.picture);
}

void run(SampleArguments options, Session& session) {
    check(options);
    RunContext context = session.context();
    context.seed = options.seed;
    const Mesh mesh = session.read_mesh(options.input);
    if (!options.eye.empty()) options.inside.eye = Vec3d(options.eye[0], options.eye[1], options.eye[2]) - mesh.origin;
    const Found found =
        options.frustum.empty() ? find_on_lattice(mesh, options, context) : find_in_view(mesh, options, context);
    warn_of_doubts(found, options.input, session);
    Mesh cloud;
    cloud.origin = mesh.origin;
    cloud.positions.reserve(found.points.size());
    for (const Vec3d& p : found.points) cloud.positions.push_back(p.cast<float>());
    session.write_mesh(cloud, options.output);
    Report report = make_report(found, options.output);
    if (!options.picture.empty()) {
        const UpAxis up = up_of(options.up, mesh, options.input);
        draw_points_inside(mesh, cloud.positions, found.spacing, up, options.picture, session);
        report_picture(options.picture, up, report);
    }
    session.print(report);
}

OptionList point_options(SampleArguments& options) {
    return {Option("--spacing", options.spacing, "Distance between lattice points, model units").above_zero(),
            Option("--count", options.count, "Choose the spacing so that about this many points are inside")
                .whole_from(1)
                .excludes({"--spacing"}),
            Option("--frustum", options.frustum,
                   "Instead of a lattice: points in the view of a camera; their numbers across, up and in depth")
                .values(3)
                .whole_from(1)
                .excludes({"--spacing", "--count"})};
}

OptionList inside_options(SampleArguments& options) {
    return {choice<InsideMethod>("--method", options.inside.method, kMethods,
                                 "How inside is decided (default: scan if the mesh is closed, else winding)"),
            choice<Pattern>("--pattern", options.pattern,
                            {{"lattice", Pattern::lattice}, {"jitter", Pattern::jitter}, {"poisson", Pattern::poisson}},
                            "How the points are placed (default: lattice)"),
            choice<Overlap>("--overlap", options.inside.overlap,
                            {{"parity", Overlap::parity}, {"merged", Overlap::merged}},
                            "Where closed parts overlap: parity (hollow, default) or merged (solid)"),
            Option("--accuracy", options.inside.accuracy, "winding: largest error of a winding number")
                .between(1e-4, 0.1)
                .with_default(),
            Option("--origin", options.origin, "Position of a lattice point (default: half a spacing inside the box)")
                .values(3)
                .comma_separated()
                .finite(),
            Option("--eye", options.eye,
                   "rays and --frustum: the point where rays start (default: a point outside the mesh)")
                .values(3)
                .comma_separated()
                .finite(),
            Option("--seed", options.seed, "Seed of the patterns").whole_from(0).with_default()};
}

} // namespace

Command sample_command() {
    const auto options = std::make_shared<SampleArguments>();
    return {.name = "sample",
            .text = "Fill a mesh with the points of a regular lattice that are inside",
            .options = OptionList{Option("mesh", options->input, "Mesh").is_read().required(),
                                  output_option(options->output, "File to write: a mesh of points, without faces")} +
                       point_options(*options) + inside_options(*options) +
                       OptionList{Option("--picture", options->picture,
                                         "Also draw the points, and the surface cut open (.png)")
                                      .is_written(),
                                  found_up_option(options->up)},
            .examples = "  filigree sample scan.ply -o points.ply --count 100000\n"
                        "  filigree sample cube.obj -o points.ply --spacing 0.02 --picture points.png\n"
                        "  filigree sample open.obj -o points.ply --count 20000 --pattern poisson",
            .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
