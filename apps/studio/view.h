// How the window looks at the document: camera, style, what else is shown. Not part of what is saved or undone.
#pragma once

#include "filigree/render.h"
#include "filigree/scene/dropped_body.h"

#include <QObject>

#include <cstddef>

namespace filigree::studio {

enum class SurfaceStyle { shaded, edges, wireframe };

struct Coloring;
extern const Coloring kOwnColors;
struct ToolEntry;
extern const ToolEntry kPullTool;

struct ViewSettings {
    SurfaceStyle style = SurfaceStyle::shaded;
    const Coloring* coloring = &kOwnColors; ///< one of colorings()
    const ToolEntry* tool = &kPullTool;     ///< one of kTools
    bool split = false;                     ///< driver | restored | full deformation
    bool driver = false;                    ///< the driver's edges over the mesh
    bool defects = false;                   ///< open and non-manifold edges marked
    bool particles = false;                 ///< the body's, instead of its surface
    bool inside_points = false;             ///< points inside the mesh at rest
    std::size_t inside_count = 3000;
    double apart = 0; ///< of the pieces of a mesh that breaks: how far each is moved, times its way from the middle
    bool clip = false;
    int clip_axis = 2;              ///< 0 x, 1 y, 2 z
    double clip_at = 0.5;           ///< fraction of the box
    bool level_by_distance = false; ///< the level follows the size on screen
    bool keep_up = true;            ///< a coarser level while things move, where drawing is slow
    bool ground = true;
    UpAxis up = UpAxis::y;
    bool original = false;            ///< the animation that a driver was fitted to, in place of the restored mesh
    bool follow = false;              ///< the camera goes along with what moves
    bool blender_mouse = false;       ///< the middle button turns the view; the window remembers it
    bool gizmos = false;              ///< handles of the warps in the view; on while the Deform panel is shown
    double grip = 0.06, reach = 0.45; ///< of a pull, fractions of the mesh's diagonal
    double torch_size = Torch().size, torch_seconds = Torch().seconds;

    bool operator==(const ViewSettings&) const = default;
};

class ViewState : public QObject {
    Q_OBJECT
public:
    explicit ViewState(QObject* parent = nullptr) : QObject(parent) {}

    const ViewSettings& settings() const { return settings_; }
    void set(const ViewSettings& settings);
    /// The settings as `edit(settings)` leaves them.
    template <class Edit>
    void edit(Edit&& edit) {
        ViewSettings next = settings_;
        std::forward<Edit>(edit)(next);
        set(next);
    }

    Torch torch(bool cools) const { return {settings_.torch_size, settings_.torch_seconds, cools}; }

    const Camera& camera() const { return camera_; }
    void set_camera(const Camera& camera);

    /// Zoom relative to the camera that shows all: 1 shows all, 2 twice as large.
    double zoom() const;
    void set_zoom(double zoom);
    /// The camera looks at this box from a direction (unit, from the object to the viewer) and shows all of it; zoom
    /// is 1 then.
    void fit(const Box& box, const Vec3d& direction, double aspect);
    /// Orbits by angles (degrees; azimuth about `up`, elevation held within 89), pans by fractions of the picture's
    /// height.
    void orbit(double azimuth, double elevation);
    void pan(double right, double up);

    static constexpr double kLeastZoom = 0.02, kMostZoom = 200;

Q_SIGNALS:
    void changed(); ///< settings
    void camera_changed();

private:
    ViewSettings settings_;
    Camera camera_;
    double fitted_distance_ = 1; ///< of the camera that shows all
};

} // namespace filigree::studio
