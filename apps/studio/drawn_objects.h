// Everything the viewport draws, as objects in graphics memory that follow the workbench.
#pragma once

#include "coloring.h"
#include "drawing.h"
#include "shown.h"
#include "shown_model.h"

#include "filigree/mesh/defect_edges.h"
#include "filigree/present/patch_surface.h"

#include <QElapsedTimer>
#include <QPalette>

namespace filigree::studio {

/// What a tile of the picture is of: the whole picture, or one of the three of the split view.
enum class TileShows { driver, restored, full };

inline double milliseconds(const QElapsedTimer& timer) { return 1e-6 * static_cast<double>(timer.nsecsElapsed()); }

class DrawnObjects : public QObject {
    Q_OBJECT
public:
    DrawnObjects(Workbench& workbench, Workshop::WithOpenGl with_opengl);
    ~DrawnObjects() override;

    void start(RestoreOn where); ///< OpenGL is there
    void stop();                 ///< it goes away; called while it is still current
    bool is_started() const { return things_ != nullptr; }

    Jobs& background() { return shop_.background; }
    /// Null: nothing to draw yet.
    ShownModel* shown() const;
    bool is_preparing() const;                              ///< what is drawn is not the document's any more
    const std::string& problem() const { return problem_; } ///< why the document cannot be drawn; "" when it can

    /// Where the driver of the model shown is.
    const Pose& pose() const { return pose_; }

    /// The level meant when nothing is in a hurry.
    unsigned calm_level(double pixels_a_unit);
    /// Makes the levels that may be drawn soon.
    void ask_for_levels(unsigned calm, bool all);

    /// What a picture needs of levels, the one that is drawn first: posed and coloured. Returns the milliseconds that
    /// posing took.
    double prepare(std::span<const unsigned> levels);
    /// One tile's objects. `from` melts into `level`; part: of `level`.
    Scene scene(TileShows shows, unsigned level, std::optional<unsigned> from, double part, const QPalette& palette);
    /// Why the full deformation of the pose shown is not there (yet), for its tile; "" when it is.
    std::string full_problem() const;

    /// Positions of a level as posed, relative to the origin; kept until the pose changes.
    std::span<const Vec3f> positions(unsigned level);
    /// Where a vertex of the finest mesh is in the picture, in the world; none: the level drawn does not have it.
    std::optional<Vec3d> place_of_vertex(Index vertex);
    Vec3d origin() const;
    /// The box of what is drawn, in the world; exact.
    Box box();
    std::optional<ClipPlane> clip();

    /// What there is to be coloured. While something is shown.
    Seen seen() const;
    const VertexColors& colors() const; ///< no values: there are none
    /// What is shown in place of the restored mesh, because it melts; null: nothing.
    std::shared_ptr<const Mesh> melt() const;
    /// Where a ray in the world meets it.
    std::optional<Picked> pick_melt(const Camera::Ray& ray);
    /// Its faces as triangles; cut once for a surface, when they are first asked for.
    std::span<const Triangle> melt_triangles();
    std::span<const DefectEdge> defects() const;

Q_SIGNALS:
    void changed(bool pose); ///< another picture is due; pose: because things move

private:
    struct Things; ///< what there is while OpenGL is

    void follow_document();
    void follow_pose();
    void follow();
    void follow_and_draw();
    void adopt();
    bool show_particles();
    bool show_obstacles();
    bool show_inside_points();
    bool show_melt();
    bool show_full();
    bool show_patches();
    bool show_defects();
    bool show_colors();
    void color_melt();
    void pose_inside_points();
    void pose_net();
    bool has_full_vertices() const;
    std::string patches_problem() const;
    PatchSurface* patches_at(unsigned level); ///< what is drawn in its place; null: itself
    void ask_for(unsigned level, bool is_urgent);
    Appearance surface_look(bool is_dark);
    void add_level(Scene& scene, unsigned level, const Appearance& look, float coverage = 1);
    void add_restored(Scene& scene, unsigned level, std::optional<unsigned> from, double part, const Appearance& look);
    void add_surroundings(Scene& scene) const;

    Workbench& workbench_;
    Workshop shop_;
    std::unique_ptr<Things> things_; ///< null: there is no OpenGL
    std::string problem_;
    ViewSettings settings_; ///< as last followed
    Pose pose_;
    std::uint64_t pose_stamp_ = 0;    ///< another one with each pose; 0: at rest
    std::uint64_t model_stamp_ = 0;   ///< with each ShownModel
    std::uint64_t moment_stamp_ = 0;  ///< with each moment of the body
    std::uint64_t samples_stamp_ = 0; ///< with each set of points inside
    unsigned by_size_ = 0;            ///< the level chosen by size on screen
    unsigned drawn_level_ = 0;
};

} // namespace filigree::studio
