// The mouse over the picture: turns and moves the camera, pulls, pins, and drags the knobs of the deformations.
#pragma once

#include "picture_camera.h"
#include "pins.h"

#include "filigree/present/level_shape.h"
#include "filigree/present/warp_gizmo.h"

#include <QMouseEvent>

namespace filigree::studio {

class Pointer : public QObject {
    Q_OBJECT
public:
    /// pick: what is under a point of the widget.
    using Pick = std::function<std::optional<Picked>(const QPointF&)>;
    Pointer(Workbench& workbench, DrawnObjects& drawn, PictureCamera& camera, QWidget& widget, Pick pick);

    void press(const QMouseEvent& event);
    void move(const QMouseEvent& event);
    void release();
    void wheel(const QWheelEvent& event);
    void double_click(const QMouseEvent& event);
    void leave();
    /// Puts back what is being dragged. False: nothing is.
    bool escape();
    void forget_hover(); ///< there is another picture under the mouse

    bool is_dragging() const { return drag_ != Drag::none; }
    /// Where a pull or pin would take hold; none: nowhere.
    const std::optional<Picked>& hover() const { return hover_; }
    const QPointF& hover_at() const { return hover_at_; }
    const std::optional<GizmoPart>& hot_part() const { return hot_part_; } ///< the knob under the mouse, or dragged
    /// What of the surface is held by a pull, and where the mouse has it; none: no pull.
    const Picked* pulled() const { return drag_ == Drag::pull && held_ ? &*held_ : nullptr; }
    const QPointF& place() const { return last_; }
    /// Pinned vertices of the driver, with those that are being painted.
    std::vector<Index> shown_pins() const;
    std::vector<GizmoShape> gizmos() const; ///< none while they are not to be seen

    Box rest_box() const; ///< of the mesh at rest, in the world
    double grip() const;  ///< radius of a pull or pin, model units

Q_SIGNALS:
    void changed();   ///< what is to be drawn over the picture
    void has_begun(); ///< a drag: hints are not needed any more

private:
    enum class Drag { none, pending_pull, pull, orbit, pan, paint, gizmo, torch };

    void press_left(const QMouseEvent& event);
    void drop();
    void end_drag(Drag was);
    void paint_pins(const QPointF& point);
    void hold_torch(const QPointF& point);
    void update_hover();
    void show_cursor();
    Qt::CursorShape cursor() const;
    const ViewSettings& settings() const { return workbench_.view().settings(); }

    Workbench& workbench_;
    DrawnObjects& drawn_;
    PictureCamera& camera_;
    QWidget& widget_;
    Pick pick_;
    Drag drag_ = Drag::none;
    int pressed_step_ = 0; ///< of the history when the drag began
    QPointF pressed_, last_, hover_at_;
    std::optional<Picked> held_, hover_;
    std::optional<GizmoDrag> gizmo_;
    std::optional<GizmoPart> hot_part_;
    VertexSet painted_{0};
    bool unpins_ = false; ///< what is painted
    bool cools_ = false;  ///< the torch
    QTimer hover_timer_;
};

} // namespace filigree::studio
