#include "viewport_overlay.h"

#include "coloring.h"
#include "pins.h"
#include "words.h"

#include <algorithm>

namespace filigree::studio {

namespace {

constexpr std::size_t kMostDefects = 5'000; // edges drawn

class OverlayWriter {
public:
    OverlayWriter(const PictureParts& parts, unsigned drawn_level)
        : workbench_(parts.workbench), drawn_(parts.drawn), camera_(parts.camera), pointer_(parts.pointer),
          settings_(workbench_.view().settings()), drawn_level_(drawn_level) {}

    OverlayContent content;

    void add_all() {
        add_triad();
        if (drawn_.shown()) {
            add_captions();
            add_legend();
            add_pins();
            pointer_.draw(content);
            if (settings_.defects) add_defects();
        }
        add_note();
        if (drawn_.shown()) content.warning = workbench_.expected_error().warning();
    }

private:
    const LevelFacts& facts() const {
        return drawn_.shown()->facts()[std::min(drawn_level_, drawn_.shown()->finest_level())];
    }

    void add_triad() {
        const Mat3d basis = camera_.camera().basis();
        content.shows_triad = true;
        for (int axis = 0; axis < 3; ++axis) {
            const auto k = static_cast<std::size_t>(axis);
            content.triad[k] = {basis(axis, 0), -basis(axis, 1)};
            content.triad_depth[k] = basis(axis, 2);
        }
    }

    void add_captions() {
        if (!settings_.split) return;
        const PictureSize size = camera_.tile_size();
        const auto tile = [&](int i) { return QRectF(i * size.width, 0, size.width, size.height); };
        const auto vertices = [](std::size_t count) { return with_commas(count) + " vertices"; };
        const ShownModel& shown = *drawn_.shown();
        const std::string problem = drawn_.full_problem();
        content.captions = {{"Driver", vertices(shown.facts()[0].vertices), tile(0)},
                            {"Restored", vertices(facts().vertices), tile(1)},
                            {"Full deformation",
                             problem.empty() ? vertices(shown.model().vertex_count()) : QString::fromStdString(problem),
                             tile(2)}};
    }

    void add_legend() {
        const LegendWords& words = settings_.coloring->legend;
        const VertexColors& colors = drawn_.colors();
        if (words.title && !colors.values.empty())
            content.legend =
                OverlayContent::Legend{words.title, words.unit, colors.map, colors.range, words.per_value, words.whole};
    }

    void add_pins() {
        if (workbench_.mode() == Mode::deform)
            content.pins = camera_.places_of(pinned_vertices(workbench_.state().handles), drawn_.pose().positions,
                                             drawn_.origin());
    }

    void add_defects() {
        const TopologyReport& topology = workbench_.state().source->topology;
        std::vector<QString> found;
        for (const auto& [finding, name] : {std::pair(&topology.open_edges, "open edges (orange)"),
                                            std::pair(&topology.nonmanifold_edges, "non-manifold edges (violet)"),
                                            std::pair(&topology.inconsistent_edges, "edges of opposed faces (blue)"),
                                            std::pair(&topology.degenerate_faces, "faces without area (dots)")})
            if (finding->count > 0) found.push_back(with_commas(finding->count) + ' ' + name);
        content.defect_summary = found.empty() ? "No defects: the mesh is closed and manifold"
                                               : QStringList(found.begin(), found.end()).join('\n');
        const std::span<const DefectEdge> defects = drawn_.defects();
        const std::span<const Vec3f> positions = drawn_.positions(drawn_.shown()->finest_level());
        if (defects.empty() || positions.empty()) return;
        const std::size_t step = (defects.size() + kMostDefects - 1) / kMostDefects;
        const auto projected = [&](Index v) { return camera_.project(drawn_.origin() + positions[v].cast<double>()); };
        for (std::size_t i = 0; i < defects.size(); i += step) {
            const DefectEdge& edge = defects[i];
            const Vec3d a = projected(edge.a), b = projected(edge.b);
            if (a.z() <= 0 || b.z() <= 0) continue;
            const int tile = camera_.middle_tile();
            content.defects.push_back(
                {QLineF(camera_.from_tile(a, tile), camera_.from_tile(b, tile)), edge.is_open, edge.is_opposed});
        }
    }

    /// One sentence in the corner: the most important one.
    void add_note() { content.note = note(); }
    QString note() const {
        const ShownModel* shown = drawn_.shown();
        const State& state = workbench_.state();
        if (drawn_.is_preparing()) return QStringLiteral("Preparing the picture…");
        if (!drawn_.problem().empty()) return QString::fromStdString(drawn_.problem());
        if (shown && settings_.level_by_distance)
            return QString("Level %1 of %2: %3 vertices")
                .arg(drawn_level_)
                .arg(shown->finest_level())
                .arg(with_commas(facts().vertices));
        const auto why_no_colors = settings_.coloring->why_not;
        if (const QString why = shown && why_no_colors ? why_no_colors(drawn_.seen()) : QString(); !why.isEmpty())
            return why;
        if (!state.source) return {};
        if (!(state.source->box.diagonal() > 0)) return "All vertices are in one place, so there is no shape to show.";
        if (state.source->mesh.face_count() == 0) return "This mesh has no faces: its vertices are shown as balls.";
        return {};
    }

    Workbench& workbench_;
    DrawnObjects& drawn_;
    const PictureCamera& camera_;
    const Pointer& pointer_;
    const ViewSettings& settings_;
    unsigned drawn_level_;
};

} // namespace

OverlayContent overlay_content(const PictureParts& parts, unsigned drawn_level, double hint_strength) {
    OverlayWriter writer(parts, drawn_level);
    const bool has_model = parts.workbench.state().model != nullptr;
    writer.content.hint = has_model ? "Drag the shape to pull it. Drag beside it to turn. Wheel to zoom."
                                    : "Open a mesh, or drop one here.";
    writer.content.hint_strength = has_model ? hint_strength : 1;
    writer.add_all();
    return std::move(writer.content);
}

} // namespace filigree::studio
