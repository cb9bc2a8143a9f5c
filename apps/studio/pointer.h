// The mouse over the picture: the left button is the tool's; what the tool leaves turns and moves the camera.
#pragma once

#include "tools/tool.h"

#include <QMouseEvent>

namespace filigree::studio {

class Pointer : public QObject {
    Q_OBJECT
public:
    Pointer(const ToolContext& context, QWidget& widget);

    void press(const QMouseEvent& event);
    void move(const QMouseEvent& event);
    void release();
    void wheel(const QWheelEvent& event);
    void double_click(const QMouseEvent& event);
    void leave();
    /// Puts back what is being dragged. False: nothing is.
    bool escape();
    void forget_hover(); ///< there is another picture under the mouse

    bool is_dragging() const { return held_ || camera_drag_; }
    /// What the mouse and its tools show over the picture.
    void draw(OverlayContent& content) const;

Q_SIGNALS:
    void changed();   ///< what is to be drawn over the picture
    void has_begun(); ///< a drag: hints are not needed any more

private:
    /// moved: pixels since the last move.
    using CameraDrag = void (*)(ViewState& view, const QPointF& moved, const PictureSize& size);

    std::array<Tool*, 2> hand() const { return {knobs_.get(), tool_.get()}; } ///< first who is asked first
    void take_up();
    void press_left(const QMouseEvent& event);
    CameraDrag middle_drag(Qt::KeyboardModifiers keys) const;
    void update_hover();
    void show_cursor();
    Qt::CursorShape cursor() const;
    ViewState& view() const { return context_.workbench.view(); }

    ToolContext context_;
    QWidget& widget_;
    std::unique_ptr<Tool> knobs_ = make_gizmo(context_);
    const ToolEntry* entry_ = nullptr; ///< of the tool in hand
    std::unique_ptr<Tool> tool_;       ///< the view's; during a drag, the one that it began with
    Tool* held_ = nullptr;             ///< that is dragged
    Tool* hot_ = nullptr;              ///< that would be
    CameraDrag camera_drag_ = nullptr;
    QPointF last_, hover_at_;
    std::optional<Picked> hover_; ///< where hot_ would take hold of the surface
    QTimer hover_timer_;
};

} // namespace filigree::studio
