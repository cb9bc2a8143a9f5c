// Pulls the shape, or the body, by a point of its surface.
#include "drawn_objects.h"
#include "tools/tool.h"

#include <cmath>

namespace filigree::studio {

namespace {

constexpr int kDragFrom = 3; // pixels: below, it was a click

class PullTool : public Tool {
public:
    using Tool::Tool;

    bool press(const Hit& hit) override {
        held_ = hit.surface();
        pressed_ = at_ = hit.at();
        return held_.has_value();
    }

    void move(const Hit& hit) override {
        at_ = hit.at();
        const QPointF way = at_ - pressed_;
        if (!is_pulling_ && std::hypot(way.x(), way.y()) < kDragFrom) return;
        if (!std::exchange(is_pulling_, true)) workbench().begin_pull(held_->vertex, held_->at);
        // Tiles have one camera, so the way from the press is the same in each of them.
        const QPointF to = context_.camera.in_tile(pressed_) + way;
        const PictureCamera& camera = context_.camera;
        workbench().pull_to(point_in_plane(camera.camera(), held_->at, to.x(), to.y(), camera.tile_size()));
    }

    void release() override {
        if (std::exchange(is_pulling_, false)) workbench().end_pull();
        held_.reset();
    }

    void cancel() override {
        if (std::exchange(is_pulling_, false)) workbench().cancel_pull();
        held_.reset();
    }

    double radius() const override { return grip(); }
    Qt::CursorShape cursor(bool is_held) const override { return is_held ? Qt::ClosedHandCursor : Qt::OpenHandCursor; }

    /// The line from a body to the mouse that pulls it.
    void draw(OverlayContent& content, bool) const override {
        if (!is_pulling_ || workbench().mode() != Mode::body) return;
        if (const std::optional<Vec3d> place = context_.drawn.place_of_vertex(held_->vertex))
            content.pull = QLineF(context_.camera.place_of(*place), at_);
    }

private:
    std::optional<Picked> held_;
    QPointF pressed_, at_;
    bool is_pulling_ = false; ///< the mouse has moved far enough
};

} // namespace

const ToolEntry kPullTool = {"pull",
                             "&Pull",
                             "Drag the surface to pull it",
                             "P",
                             {{StrokeKind::curve, {1.5, 13, 6, 13, 6, 8.5, 8, 8.5, 10, 8.5, 10, 13, 14.5, 13}},
                              {StrokeKind::line, {8, 6.2, 8, 1.8}},
                              {StrokeKind::head, {8, 1.6, 90, 3.4}}},
                             {{"drag the surface", "pulls it"}},
                             make_tool<PullTool>};

} // namespace filigree::studio
