#include "viewport_overlay.h"

#include "words.h"

#include <algorithm>

namespace filigree::studio {

namespace {

constexpr std::size_t kMostDefects = 5'000; // edges drawn

/// "Bend 35°".
QString gizmo_label(GizmoPart part, const Warps& warps) {
    const auto factor = [](double value) { return QString::fromUtf8("× %1").arg(value, 0, 'f', 2); };
    const auto degrees = [](double value) { return QString::fromUtf8("%1°").arg(value, 0, 'f', 0); };
    switch (part) {
    case GizmoPart::stretch:
        return "Stretch " + factor(warps.stretch);
    case GizmoPart::squeeze:
        return "Squeeze " + factor(warps.squeeze);
    case GizmoPart::bend:
        return "Bend " + degrees(warps.bend);
    case GizmoPart::twist:
        return "Twist " + degrees(warps.twist);
    default:
        return "Taper " + factor(warps.taper);
    }
}

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
            add_hold();
            add_knobs();
            if (settings_.defects) add_defects();
        }
        add_note();
        if (drawn_.shown()) content.warning = workbench_.expected_error().warning();
    }

private:
    const LevelFacts& facts() const {
        return drawn_.shown()->facts()[std::min(drawn_level_, drawn_.shown()->finest_level())];
    }
    QPointF place(const Vec3f& relative) const { return camera_.place_of(drawn_.origin() + relative.cast<double>()); }

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
        const VertexColors& colors = drawn_.colors();
        if (colors.values.empty() || settings_.coloring == Coloring::pieces) return;
        const bool is_levels = settings_.coloring == Coloring::levels;
        if (settings_.coloring == Coloring::heat) {
            content.legend = OverlayContent::Legend{"Temperature", "°C", colors.map, colors.range, 1.0, true};
            return;
        }
        const char* const title = is_levels ? "Level at which a vertex comes in"
                                  : settings_.coloring == Coloring::expected_error
                                      ? "Expected error"
                                      : "Distance from the full deformation";
        content.legend = OverlayContent::Legend{
            title, is_levels ? "" : "% of the diagonal", colors.map, colors.range, is_levels ? 1.0 : 100.0, is_levels};
    }

    void add_pins() {
        if (workbench_.mode() != Mode::deform) return;
        const std::vector<Vec3f>& driver = drawn_.pose().positions;
        for (const Index vertex : pointer_.shown_pins())
            if (vertex < driver.size()) content.pins.push_back(place(driver[vertex]));
    }

    /// The circle that a pull would take hold of, and the line from a body to the mouse that pulls it.
    void add_hold() {
        const PictureSize size = camera_.tile_size();
        if (pointer_.hover() && !pointer_.is_dragging()) {
            content.hover = pointer_.hover_at();
            content.hover_radius =
                std::clamp(pointer_.grip() * pixels_a_unit(camera_.camera(), pointer_.hover()->at, size), 5.0,
                           0.4 * std::min(size.width, size.height));
        }
        const Picked* pulled = pointer_.pulled();
        const std::optional<unsigned> level = drawn_.shown()->nearest_ready(drawn_level_);
        if (!pulled || workbench_.mode() != Mode::body || !level) return;
        const std::span<const Vec3f> positions = drawn_.positions(*level);
        const std::optional<Index> vertex = drawn_.shown()->level(*level)->shape->vertex_of(pulled->vertex);
        if (vertex && *vertex < positions.size()) content.pull = QLineF(place(positions[*vertex]), pointer_.place());
    }

    void add_knobs() {
        for (const GizmoShape& shape : pointer_.gizmos()) {
            OverlayContent::Knob knob;
            knob.part = shape.part;
            for (const Vec3d& point : shape.line) knob.line << camera_.place_of(point);
            knob.at = camera_.place_of(shape.knob);
            knob.has_tip = shape.has_tip;
            knob.is_hot = pointer_.hot_part() == shape.part;
            if (knob.is_hot) knob.label = gizmo_label(shape.part, workbench_.state().warps);
            content.knobs.push_back(std::move(knob));
        }
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
        const std::vector<DefectEdge>& defects = drawn_.defects();
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
        if (shown && settings_.coloring == Coloring::patches && !drawn_.patches_problem().empty())
            return QString::fromStdString(drawn_.patches_problem());
        if (shown && settings_.coloring == Coloring::heat && drawn_.colors().values.empty())
            return "Heat is known of a body that melts while it moves: choose wax or ice in the Body panel.";
        if (!state.source) return {};
        if (!(pointer_.rest_box().diagonal() > 0))
            return "All vertices are in one place, so there is no shape to show.";
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
