#include "quads.h"

#include "words.h"

#include <chrono>

namespace filigree::studio {

namespace {

constexpr const char* kAsQuads = ", as quads";

double share(std::size_t part, std::size_t whole) { return double(part) / double(std::max<std::size_t>(1, whole)); }

QString grid_text(const QuadRemeshReport& report) {
    const std::size_t side = std::size_t{1} << report.levels;
    return QStringLiteral("%1 × %1").arg(with_commas(side));
}

QString percent(double fraction) { return number_text(100 * fraction, 2) + QStringLiteral(" %"); }

/// "3 open borders": what a topology has that another has not.
void add_change(QStringList& lines, std::int64_t before, std::int64_t after, const QString& what) {
    if (before == after) return;
    lines << QStringLiteral("%1: %2 of the mesh, %3 of the quads.")
                 .arg(what, QString::number(before), QString::number(after));
}

} // namespace

std::shared_ptr<const Source> input_of_quads(std::shared_ptr<const Source> source) {
    return source && source->quads ? source->quads->input : source;
}

Result<std::shared_ptr<const Source>> make_quads_of(std::shared_ptr<const Source> input,
                                                    const QuadRemeshOptions& options, const RunContext& context) {
    const auto begin = std::chrono::steady_clock::now();
    Result<QuadRemeshed> remeshed = quad_remesh(input->mesh, options, context);
    if (!remeshed && remeshed.error().code == ErrorCode::cancelled) return remeshed.error();
    if (!remeshed) return Error{remeshed.error().code, "No quads can be made of this: " + remeshed.error().message};
    auto quads = std::make_shared<MadeQuads>();
    quads->report = std::move(remeshed->report);
    quads->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    auto source = source_of(std::move(remeshed->mesh), input->path, input->name + kAsQuads, context);
    source->warnings = source->materials.warnings;
    quads->input = std::move(input);
    source->quads = std::move(quads);
    if (context.is_cancelled()) return cancelled_error();
    return std::shared_ptr<const Source>(std::move(source));
}

QString quads_summary(const Source& source) {
    const MadeQuads& quads = *source.quads;
    return QStringLiteral("%1 in %2 of %3, made in %4 s.")
        .arg(counted(source.mesh.face_count(), "quad", "quads"), counted(quads.report.patches, "patch", "patches"),
             grid_text(quads.report), number_text(quads.seconds, 2));
}

QString quads_table(const MadeQuads& quads) {
    const QuadRemeshReport& report = quads.report;
    const QuadQuality& quality = report.quality;
    return rich_table({{"Quads", with_commas(quality.quads)},
                       {"Patches", with_commas(report.patches) + QStringLiteral(" of ") + grid_text(report)},
                       {"Irregular vertices", with_commas(quality.irregular_vertices)},
                       {"… a patch", number_text(share(quality.irregular_vertices, report.patches), 2)},
                       {"Scaled Jacobian, least", number_text(quality.min_scaled_jacobian, 2)},
                       {"… 1 % are below", number_text(quality.low_scaled_jacobian, 2)},
                       {"… mean", number_text(quality.mean_scaled_jacobian, 3)},
                       {"Seconds", number_text(quads.seconds, 2)}}) +
           rich_table({{"<b>Of the diagonal</b>", "RMS", "max"},
                       {"Quads to mesh", percent(report.to_input.rms), percent(report.to_input.max)},
                       {"Mesh to quads", percent(report.from_input.rms), percent(report.from_input.max)}});
}

QString quads_remarks(const MadeQuads& quads) {
    const QuadRemeshReport& report = quads.report;
    const CleanReport& clean = report.clean;
    QStringList lines;
    const auto add = [&lines](std::size_t count, const char* one, const char* many) {
        if (count > 0) lines << counted(count, QString::fromUtf8(one), QString::fromUtf8(many));
    };
    add(clean.welded_vertices, "vertex welded to another at its place.", "vertices welded to others at their places.");
    add(clean.unused_vertices, "vertex in no face left out.", "vertices in no face left out.");
    add(clean.degenerate_faces, "face without area left out.", "faces without area left out.");
    add(clean.duplicate_faces, "face that was there twice left out.", "faces that were there twice left out.");
    add(clean.flipped_faces, "face turned.", "faces turned.");
    add(clean.cut_edges, "edge of three faces or more cut.", "edges of three faces or more cut.");
    add(clean.separated_edges, "edge where surfaces touch parted.", "edges where surfaces touch parted.");
    add(clean.split_vertices, "vertex where surfaces touch parted.", "vertices where surfaces touch parted.");
    add(clean.removed_components, "small part removed.", "small parts removed.");
    add(clean.closed_handles, "small handle closed.", "small handles closed.");
    add(report.feature_edges, "edge kept as a feature.", "edges kept as features.");
    add_change(lines, report.input.border_loops, report.output.border_loops, "Open borders");
    add_change(lines, report.input.genus(), report.output.genus(), "Handles");
    add_change(lines, report.input.components, report.output.components, "Parts");
    if (report.wrapped) lines << QStringLiteral("These are the quads of a closed wrap around the mesh.");
    if (report.tries > 1)
        lines << QStringLiteral("Made at try %1; the one before failed: %2")
                     .arg(report.tries)
                     .arg(QString::fromStdString(report.retried));
    return lines.join('\n');
}

} // namespace filigree::studio
