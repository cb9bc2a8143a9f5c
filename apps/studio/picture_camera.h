// Where the picture is looked at from: follows what is opened and the body, flies to where it is told, and knows the
// tiles of the split view.
#pragma once

#include "filigree/render/camera_navigation.h"
#include "workbench.h"

#include <QElapsedTimer>
#include <QPointF>
#include <QTimer>
#include <QWidget>

namespace filigree::studio {

class DrawnObjects;

/// The camera of one widget's picture. Places are in device-independent pixels of the widget or of one of its tiles,
/// which all have the same camera.
class PictureCamera : public QObject {
    Q_OBJECT
public:
    PictureCamera(Workbench& workbench, DrawnObjects& drawn, const QWidget& widget);

    const Camera& camera() const { return workbench_.view().camera(); }
    int tile_count() const { return workbench_.view().settings().split ? 3 : 1; }
    int middle_tile() const { return tile_count() / 2; } ///< of the restored mesh
    PictureSize tile_size() const;
    QPointF in_tile(const QPointF& point) const; ///< of the tile that it is in
    QPointF from_tile(const Vec3d& place, int tile) const;
    Vec3d project(const Vec3d& world) const; ///< in a tile; z: above 0 in front of the camera
    QPointF place_of(const Vec3d& world) const { return from_tile(project(world), middle_tile()); }
    /// Of some of the positions, which are relative to an origin.
    std::vector<QPointF> places_of(std::span<const Index> some, std::span<const Vec3f> positions,
                                   const Vec3d& origin) const;

    void show_all_from(const Vec3d& direction);
    void show_all(); ///< from where it is
    void look_at(const Vec3d& point);
    void follow_opened();
    void follow_size();

    bool is_flying() const { return fly_to_.has_value(); }
    void stop_flight();
    void land(); ///< at once where it flies to
    /// Whether it flies, or is at once where it is told.
    void set_animated(bool animated) { is_animated_ = animated; }

private:
    void follow_view();
    void follow_body();
    void follow_motion();
    Camera camera_of_frame(std::size_t frame);
    void fit(const Vec3d& direction, bool may_fly);
    void show(const Box& box, const Vec3d& direction);
    void fly_from(const Camera& from);
    void fly_on();
    Box body_room() const;
    Box opened_box() const;
    bool is_seen(const Box& box) const;

    Workbench& workbench_;
    DrawnObjects& drawn_;
    const QWidget& widget_;
    bool is_animated_;
    std::optional<Camera> fly_from_, fly_to_;
    QElapsedTimer flight_;
    QTimer timer_;
    // When all was shown last:
    bool was_fitted_ = false;
    Camera fitted_;
    Box fitted_box_;
    std::string fitted_name_;

    // Along with what moves:
    std::optional<Camera> followed_; ///< as it was set last; none: it does not go along
    std::size_t followed_frame_ = 0; ///< while a body moved
    double zoom_ = 1;                ///< of the user, over what all is seen from
    Vec3d aside_ = Vec3d::Zero();    ///< that the user moved the view
    std::vector<Camera> track_;      ///< of the whole recording
    std::shared_ptr<const Recording> track_of_;
    Vec3d track_direction_ = Vec3d::Zero();

    bool was_split_ = false;
    std::shared_ptr<const DroppedBody> framed_body_; ///< that the view was widened for
};

} // namespace filigree::studio
