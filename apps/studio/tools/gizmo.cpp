// The knobs of the deformations in the picture, there while the tool Pull is in hand.
#include "tools/tool.h"

#include "words.h"

#include "filigree/present/warp_gizmo.h"

#include <algorithm>

namespace filigree::studio {

namespace {

constexpr double kKnobRadius = 9;  // pixels around a gizmo's knob that take hold of it
constexpr double kKnobMargin = 16; // pixels between an arrow's knob and the picture's border

/// "Bend 35°".
QString gizmo_label(WarpKind part, const Warps& warps) {
    const WarpInfo& info = warp_infos()[static_cast<std::size_t>(part)];
    const double amount = warps.*info.amount;
    return title_of(std::string(info.name)) + (info.is_factor ? QString::fromUtf8(" × %1").arg(amount, 0, 'f', 2)
                                                              : QString::fromUtf8(" %1°").arg(amount, 0, 'f', 0));
}

class GizmoTool : public Tool {
public:
    using Tool::Tool;

    bool press(const Hit& hit) override {
        part_ = part_at(hit.at());
        if (!part_) return false;
        const State& state = workbench().state();
        const QPointF at = context_.camera.in_tile(hit.at());
        drag_.emplace(*part_, state.warps, state.source->box, context_.camera.camera(), at.x(), at.y(),
                      context_.camera.tile_size());
        model_ = state.model;
        step_ = workbench().document().undo_stack().index();
        return true;
    }

    void move(const Hit& hit) override {
        const QPointF at = context_.camera.in_tile(hit.at());
        workbench().set_warps(drag_->moved_to(at.x(), at.y()), "gizmo");
    }

    void release() override {
        workbench().document().end_merge();
        drag_.reset();
        model_ = nullptr;
    }

    void cancel() override {
        const bool has_same_model = model_ == workbench().state().model;
        release();
        QUndoStack& history = workbench().document().undo_stack();
        if (has_same_model && history.index() > step_) history.undo();
    }

    bool hover(const Hit& hit) override {
        part_ = part_at(hit.at());
        return part_.has_value();
    }

    Qt::CursorShape cursor(bool is_held) const override {
        return is_held ? Qt::ClosedHandCursor : Qt::PointingHandCursor;
    }

    void draw(OverlayContent& content, bool is_hot) const override {
        for (const GizmoShape& shape : shapes()) {
            OverlayContent::Knob knob;
            knob.part = shape.part;
            for (const Vec3d& point : shape.line) knob.line << context_.camera.place_of(point);
            knob.at = context_.camera.place_of(shape.knob);
            knob.has_tip = shape.has_tip;
            knob.is_hot = is_hot && part_ == shape.part;
            if (knob.is_hot) knob.label = gizmo_label(shape.part, workbench().state().warps);
            content.knobs.push_back(std::move(knob));
        }
    }

private:
    /// None while they are not to be seen.
    std::vector<GizmoShape> shapes() const {
        const State& state = workbench().state();
        const bool are_shown = settings().gizmos && settings().tool == &kPullTool && !settings().split &&
                               workbench().mode() == Mode::deform && !workbench().is_pulling() && state.model;
        if (!are_shown) return {};
        const Camera& camera = context_.camera.camera();
        std::vector<GizmoShape> shapes = gizmo_shapes(state.warps, state.source->box, camera.eye - camera.target);
        const PictureSize size = context_.camera.tile_size();
        const auto is_inside = [&](const Vec3d& place) {
            const Vec3d at = context_.camera.project(place);
            return at.z() > 0 && std::min({at.x(), at.y(), size.width - at.x(), size.height - at.y()}) >= kKnobMargin;
        };
        // An arrow that leaves the picture is shorter, so that its knob can be reached.
        for (GizmoShape& shape : shapes) {
            if (!shape.has_tip || !is_inside(shape.line.front())) continue;
            const Vec3d from = shape.line.front(), way = shape.knob - from;
            for (double part = 0.9; part > 0.05 && !is_inside(shape.knob); part -= 0.1)
                shape.knob = shape.line.back() = from + part * way;
        }
        return shapes;
    }

    std::optional<WarpKind> part_at(const QPointF& point) const {
        const QPointF at = context_.camera.in_tile(point);
        return gizmo_at(shapes(), context_.camera.camera(), at.x(), at.y(), context_.camera.tile_size(), kKnobRadius);
    }

    std::optional<GizmoDrag> drag_;
    std::optional<WarpKind> part_;       ///< that was last under the mouse, or is dragged
    std::shared_ptr<const Model> model_; ///< there when the drag began
    int step_ = 0;                       ///< of the history then
};

} // namespace

std::unique_ptr<Tool> make_gizmo(const ToolContext& context) { return std::make_unique<GizmoTool>(context); }

} // namespace filigree::studio
