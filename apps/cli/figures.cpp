#include "commands.h"

#include "output_folder.h"
#include "picture_files.h"

#include "report/figures.h"

#include <algorithm>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

using report::FigureEntry;

/// figure_2_10 for "2.10".
std::string file_stem(const std::string& name) {
    std::string stem = "figure_" + name;
    std::replace(stem.begin(), stem.end(), '.', '_');
    return stem;
}

std::vector<FigureEntry> chosen_figures(const std::vector<std::string>& only) {
    const std::span<const FigureEntry> all = report::all_figures();
    if (only.empty()) return {all.begin(), all.end()};
    std::string known;
    for (const FigureEntry& figure : all) known += std::string(known.empty() ? "" : ", ") + figure.name;
    for (const std::string& name : only)
        if (std::none_of(all.begin(), all.end(), [&](const auto& f) { return f.name == name; }))
            refuse(fmt::format("There is no figure '{}'; --only takes {}.", name, known));
    std::vector<FigureEntry> chosen;
    for (const FigureEntry& figure : all)
        if (std::find(only.begin(), only.end(), figure.name) != only.end()) chosen.push_back(figure);
    return chosen;
}

struct FiguresArguments {
    std::string output = "filigree-figures", format = "png";
    std::vector<std::string> only;
    unsigned width = 1440, passes = 0;
    std::string scan;
    UpAxis up = UpAxis::y;
};

/// The scan as figures have it: z up, and without attributes that would take the colours' place.
std::optional<Mesh> read_scan(const FiguresArguments& options, Session& session) {
    if (options.scan.empty()) return {};
    const Mesh mesh = session.read_mesh(options.scan);
    if (mesh.face_count() == 0)
        refuse(ErrorCode::unsuitable, options.scan + ": has no faces; give a scan with a surface.");
    Mesh scan;
    scan.face_offsets = mesh.face_offsets;
    scan.corners = mesh.corners;
    const Vec3d front = view_direction(View::front, options.up), up = up_vector(options.up);
    Mat3f turn;
    turn << up.cross(front).transpose().cast<float>(), -front.transpose().cast<float>(), up.transpose().cast<float>();
    for (const Vec3f& p : mesh.positions) scan.positions.push_back(turn * p);
    return scan;
}

void run_figures(const FiguresArguments& options, Session& session) {
    const RunContext& context = session.context();
    const std::vector<FigureEntry> chosen = chosen_figures(options.only);
    OutputFolder folder(path_of(options.output));
    std::vector<std::string> paths;
    for (const FigureEntry& figure : chosen)
        paths.push_back(folder.file(file_stem(figure.name) + "." + options.format));

    const double scale = options.width / report::kFigureWidth;
    report::FigureRenderer renderer(scale, options.passes, read_scan(options, session), context);
    std::vector<report::Figure> drawn; // all of them before the first is written, so that a cancel changes nothing
    for (const FigureEntry& figure : chosen) {
        context.report("figures", double(drawn.size()) / double(chosen.size()));
        drawn.push_back(figure.draw(renderer));
        if (context.is_cancelled()) throw Failure{cancelled_error()};
    }
    Report report;
    report.set("output", options.output);
    Json figures = Json::array();
    for (std::size_t i = 0; i < chosen.size(); ++i) {
        session.begin_writing(paths[i]);
        require(drawn[i].page.write(path_of(paths[i]), scale));
        report.row(chosen[i].name, fmt::format("{}  ({})", paths[i], chosen[i].title));
        figures.push_back(
            {{"name", chosen[i].name}, {"file", paths[i]}, {"values", Json::parse(drawn[i].values.dump()).value()}});
    }
    context.report("figures", 1);
    folder.keep();
    report.set("figures", figures);
    session.print(report);
}

} // namespace

Command figures_command() {
    const auto options = std::make_shared<FiguresArguments>();
    return {
        .name = "figures",
        .text = "Draw the figures of the report Detail-Preserving Animation",
        .options = {Option("-o,--output", options->output, "Folder for the figures").with_default(),
                    Option("--only", options->only,
                           "Figures to draw: 1.1, 2.1, ... 3.1, border, codes, scan (default: all)")
                        .named("NAME"),
                    choice<std::string>("--format", options->format, {{"png", "png"}, {"svg", "svg"}, {"pdf", "pdf"}},
                                        "png (default), svg or pdf"),
                    Option("--width", options->width,
                           "Width of a figure in pixels; for SVG and PDF, of the pictures in the figure")
                        .between(180, 7200)
                        .with_default(),
                    Option("--passes", options->passes,
                           "Number of passes of rendered figures (default: by the size of the mesh)")
                        .between(1, 4096),
                    Option("--scan", options->scan, "Mesh for figure 'scan' (default: a built-in shape)"),
                    up_option(options->up, "Up axis of the scan (default: y)")},
        .examples = "  filigree figures -o figures\n"
                    "  filigree figures --only 1.1 2.10 --format pdf\n"
                    "  filigree figures --only scan --scan koala.obj",
        .run = [options](Session& session) { run_figures(*options, session); }};
}

} // namespace filigree::cli
