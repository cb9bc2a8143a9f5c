#include "session.h"
#include "stage.h"

#include "filigree/sample/sample_inside.h"

#include <algorithm>

namespace filigree::cli {

namespace {

struct Options {
    std::string input, output, picture;
    double spacing = 0;
    std::size_t count = 0;
    std::vector<double> origin, eye;
    std::vector<std::size_t> frustum;
    double field_of_view = 30;
    InsideOptions inside;
    Pattern pattern = Pattern::lattice;
    std::uint64_t seed = 1;
    UpAxis up = UpAxis::y;
};

const char* method_name(InsideMethod method) {
    switch (method) {
    case InsideMethod::scan:
        return "scan";
    case InsideMethod::rays:
        return "rays";
    case InsideMethod::winding:
        return "winding";
    case InsideMethod::automatic:
        break;
    }
    return "auto";
}

std::string with_commas_64(std::uint64_t count) { return with_commas(static_cast<std::size_t>(count)); }

/// The report's points: in the view from the eye, in regular steps across the picture and in depth.
std::vector<Vec3d> points_in_view(const Mesh& mesh, const Options& options, const RunContext& context,
                                  InsideReport& report, std::size_t& tested) {
    const Box box = bounds(mesh.positions);
    InsideOptions inside = options.inside;
    if (inside.method == InsideMethod::automatic) inside.method = InsideMethod::rays;
    Frustum frustum;
    frustum.target = box.centre();
    frustum.eye = inside.eye.value_or(Vec3d(box.centre() + 2.2 * box.diagonal() * Vec3d(0.25, 0.2, 1).normalized()));
    inside.eye = frustum.eye;
    frustum.field_of_view_deg = options.field_of_view;
    const double distance = (frustum.eye - frustum.target).norm(), reach = 0.5 * box.diagonal();
    frustum.near = std::max(distance - reach, 1e-3 * distance);
    frustum.far = distance + reach;
    std::copy_n(options.frustum.begin(), 3, frustum.counts.begin());
    const std::vector<Vec3d> points = require(frustum_points(frustum));
    tested = points.size();
    const double begin = now_seconds();
    const InsideTest test = require(InsideTest::create(mesh, inside, context));
    const double start = now_seconds();
    report.setup_seconds = start - begin;
    const std::vector<std::uint8_t> answers = require(test.contains(points, context));
    report.used = test.used();
    report.seconds = now_seconds() - start;
    std::vector<Vec3d> chosen;
    for (std::size_t i = 0; i < points.size(); ++i)
        if (answers[i]) chosen.push_back(points[i]);
    return chosen;
}

/// Points blue, surface red, the half of the surface towards the viewer cut away.
void draw_points(const Mesh& mesh, const std::vector<Vec3f>& points, double spacing, UpAxis up, const std::string& path,
                 Session& session) {
    const RunContext& context = session.context();
    Stage stage(session);
    const Drawable surface = require(Drawable::surface(mesh, {}, context));
    Scene scene;
    const Vec3d direction = view_direction(View::iso, up), axis = up_vector(up);
    Appearance cut;
    cut.color = {0.80f, 0.22f, 0.18f};
    cut.own_colors = false;
    const Vec3d towards = (direction - axis * axis.dot(direction)).normalized();
    cut.clip = ClipPlane{towards, towards.dot(surface.box().centre())};
    scene.objects.push_back({&surface, cut});
    std::optional<Drawable> balls;
    if (!points.empty()) {
        balls = require(Drawable::points(points, mesh.origin, {.radius = static_cast<float>(0.32 * spacing)}, context));
        Appearance blue;
        blue.color = {0.20f, 0.42f, 0.80f};
        scene.objects.push_back({&*balls, blue});
    }
    scene.up = up;
    const CameraPoints all{mesh.positions, mesh.origin};
    const Camera camera = fit_camera(std::span(&all, 1), direction, axis, 4.0 / 3);
    session.begin_writing(path);
    write_picture(stage.take(scene, camera, {.width = 1280, .height = 960}), path, session);
}

void run_sample(Options options, Session& session) {
    RunContext context = session.context();
    context.seed = options.seed;
    const Mesh mesh = session.read_mesh(options.input);
    if (!options.eye.empty()) options.inside.eye = Vec3d(options.eye[0], options.eye[1], options.eye[2]) - mesh.origin;
    const Box box = bounds(mesh.positions);
    InsideReport report;
    std::vector<Vec3d> points;
    double spacing = options.spacing;
    std::size_t tested = 0;
    std::array<std::size_t, 3> counts = {};
    std::array<double, 3> origin = {};
    if (!options.frustum.empty()) {
        points = points_in_view(mesh, options, context, report, tested);
        spacing = box.diagonal() / double(options.frustum[2]);
    } else {
        if (options.count) spacing = require(spacing_for_count(mesh, options.count, options.inside, context));
        LatticeOptions lattice_options{.spacing = spacing};
        if (!options.origin.empty())
            lattice_options.origin = Vec3d(options.origin[0], options.origin[1], options.origin[2]) - mesh.origin;
        const Lattice lattice = require(make_lattice(box, lattice_options));
        points = require(spread_inside(mesh, lattice, options.pattern, options.inside, context, &report));
        spacing = lattice.spacing;
        counts = lattice.counts();
        for (int axis = 0; axis < 3; ++axis) origin[axis] = mesh.origin[axis] + lattice.coordinates[axis][0];
        tested = static_cast<std::size_t>(lattice.point_count());
    }
    Mesh cloud;
    cloud.origin = mesh.origin;
    cloud.positions.reserve(points.size());
    for (const Vec3d& p : points) cloud.positions.push_back(p.cast<float>());
    if (points.empty())
        session.warn(
            fmt::format("{}: no point is inside; take a smaller spacing than {:.4g}.", options.input, spacing));
    if (report.used == InsideMethod::winding && report.winding.open_edges > 0)
        session.warn(
            fmt::format("{}: is not closed ({} edges do not close), so winding numbers decided; {:.2g} % of the "
                        "points were near the border between inside and outside.",
                        options.input, with_commas(report.winding.open_edges), 100 * report.winding.near_half));
    session.write_mesh(cloud, options.output);
    if (!options.picture.empty()) draw_points(mesh, cloud.positions, spacing, options.up, options.picture, session);

    Table table;
    table.row("points inside", fmt::format("{} of {}", with_commas(points.size()), with_commas(tested)));
    table.row("spacing", fmt::format("{:.6g} units", spacing));
    table.row("method", fmt::format("{} in {}, set up in {}", method_name(report.used), seconds_text(report.seconds),
                                    seconds_text(report.setup_seconds)));
    if (report.used == InsideMethod::scan)
        table.row("crossings",
                  fmt::format("{} ({} decided in integers, {} in expansions)", with_commas_64(report.scan.crossings),
                              with_commas_64(report.scan.tally.integers),
                              with_commas_64(report.scan.tally.expansions)));
    session.print(table.text(), {{"output", options.output},
                                 {"points", points.size()},
                                 {"tested", tested},
                                 {"lattice", counts},
                                 {"lattice_origin", origin},
                                 {"spacing_units", spacing},
                                 {"method", method_name(report.used)},
                                 {"open_edges", report.closure.open_edges},
                                 {"crossings", report.scan.crossings},
                                 {"integers", report.scan.tally.integers},
                                 {"expansions", report.scan.tally.expansions},
                                 {"near_half", report.winding.near_half},
                                 {"setup_seconds", report.setup_seconds},
                                 {"seconds", report.seconds}});
}

} // namespace

void add_sample(CLI::App& app, Session& session) {
    auto options = std::make_shared<Options>();
    CLI::App* command =
        app.add_subcommand("sample", "Fill a mesh with points: those of a regular lattice that are inside");
    command->add_option("mesh", options->input, "Mesh")->required();
    command->add_option("-o,--output", options->output, "Points, as a mesh file without faces")->required();
    CLI::Option* spacing = command->add_option("--spacing", options->spacing, "Between lattice points, model units")
                               ->check(positive_number());
    CLI::Option* count =
        command->add_option("--count", options->count, "Choose the spacing so that about as many are inside")
            ->check(whole_number(1))
            ->excludes(spacing);
    command
        ->add_option("--frustum", options->frustum,
                     "Instead: the report's points in view, so many across, up and in depth")
        ->expected(3)
        ->check(whole_number(1))
        ->excludes(spacing)
        ->excludes(count);
    add_choice<InsideMethod>(
        *command, "--method",
        {{"auto", InsideMethod::automatic},
         {"scan", InsideMethod::scan},
         {"rays", InsideMethod::rays},
         {"winding", InsideMethod::winding}},
        [options](InsideMethod method) { options->inside.method = method; },
        "How to tell (unset: scan where the mesh is closed, else winding)");
    add_choice<Pattern>(
        *command, "--pattern",
        {{"lattice", Pattern::lattice}, {"jitter", Pattern::jitter}, {"poisson", Pattern::poisson}},
        [options](Pattern pattern) { options->pattern = pattern; }, "How the points are spread (unset: lattice)");
    add_choice<Overlap>(
        *command, "--overlap", {{"parity", Overlap::parity}, {"merged", Overlap::merged}},
        [options](Overlap overlap) { options->inside.overlap = overlap; },
        "scan: closed parts that overlap are hollow there, or merged (unset: parity)");
    command->add_option("--accuracy", options->inside.accuracy, "winding: largest error of a winding number")
        ->check(CLI::Range(1e-4, 0.1))
        ->capture_default_str();
    command->add_option("--origin", options->origin, "A lattice point (unset: half a spacing inside the box)")
        ->expected(3)
        ->delimiter(',')
        ->check(finite_number());
    command
        ->add_option("--eye", options->eye,
                     "rays and --frustum: where they start (unset: outside, in no special place)")
        ->expected(3)
        ->delimiter(',')
        ->check(finite_number());
    command->add_option("--seed", options->seed, "Seed of the patterns")->check(whole_number(0))->capture_default_str();
    command->add_option("--picture", options->picture, "Also draw the points, and the surface cut open (.png)");
    add_choice<UpAxis>(
        *command, "--up", {{"x", UpAxis::x}, {"y", UpAxis::y}, {"z", UpAxis::z}},
        [options](UpAxis up) { options->up = up; }, "Which axis is up in the picture (unset: y)");
    session.add_common_options(*command,
                               "  filigree sample scan.ply -o points.ply --count 100000\n"
                               "  filigree sample cube.obj -o points.ply --spacing 0.02 --picture points.png\n"
                               "  filigree sample open.obj -o points.ply --count 20000 --pattern poisson");
    command->callback([options, &session] {
        session.begin();
        if (!(options->spacing > 0) && !options->count && options->frustum.empty())
            throw Failure{{ErrorCode::usage, "Say how many points: --spacing S, --count N, or --frustum NX NY NZ."}};
        if (!options->frustum.empty() && options->pattern != Pattern::lattice)
            throw Failure{{ErrorCode::usage, "--pattern spreads the points of a lattice; leave --frustum out."}};
        if (!options->picture.empty() && !options->picture.ends_with(".png"))
            throw Failure{
                {ErrorCode::unsupported, options->picture + ": the picture is a PNG; let its name end in .png."}};
        run_sample(*options, session);
    });
}

} // namespace filigree::cli
