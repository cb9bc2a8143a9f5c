// The knobs of the deformations in the picture, there while the tool Pull is in hand.
#pragma once

#include "tools/tool.h"

#include "filigree/present/warp_gizmo.h"

namespace filigree::studio {

class GizmoTool : public Tool {
public:
    using Tool::Tool;

    bool press(const Hit& hit) override;
    void move(const Hit& hit) override;
    void release() override;
    void cancel() override;
    bool hover(const Hit& hit) override;
    Qt::CursorShape cursor(bool is_held) const override;
    void draw(OverlayContent& content, bool is_hot) const override;

private:
    std::vector<GizmoShape> shapes() const; ///< none while they are not to be seen
    std::optional<GizmoPart> part_at(const QPointF& at) const;

    std::optional<GizmoDrag> drag_;
    std::optional<GizmoPart> part_;      ///< that was last under the mouse, or is dragged
    std::shared_ptr<const Model> model_; ///< there when the drag began
    int step_ = 0;                       ///< of the history then
};

} // namespace filigree::studio
