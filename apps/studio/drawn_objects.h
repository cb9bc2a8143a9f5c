// Everything the viewport draws, as objects in graphics memory that follow the workbench.
#pragma once

#include "drawing.h"
#include "jobs.h"
#include "shown_model.h"
#include "workbench.h"

#include "filigree/mesh/defect_edges.h"
#include "filigree/present/patch_surface.h"

#include <QElapsedTimer>
#include <QPalette>

#include <functional>

namespace filigree::studio {

/// What a tile of the picture is of: the whole picture, or one of the three of the split view.
enum class TileShows { driver, restored, full };

inline double milliseconds(const QElapsedTimer& timer) { return 1e-6 * static_cast<double>(timer.nsecsElapsed()); }

class DrawnObjects : public QObject {
    Q_OBJECT
public:
    /// Runs its argument with OpenGL current, or not at all.
    using WithOpenGl = std::function<void(std::function<void()>)>;

    DrawnObjects(Workbench& workbench, WithOpenGl with_opengl);
    ~DrawnObjects() override;

    void start(RestoreOn where); ///< OpenGL is there
    void stop();                 ///< it goes away; called while it is still current
    bool is_started() const { return is_started_; }

    Jobs& background() { return background_; }
    /// Null: nothing to draw yet.
    ShownModel* shown() { return shown_.get(); }
    bool is_preparing() const { return next_ != nullptr; }  ///< what is drawn is not the document's any more
    const std::string& problem() const { return problem_; } ///< why the document cannot be drawn; "" when it can

    /// Where the driver of the model shown is.
    const Pose& pose() const { return pose_; }

    /// The level meant when nothing is in a hurry.
    unsigned calm_level(double pixels_a_unit);
    /// Makes the levels that may be drawn soon.
    void ask_for_levels(unsigned calm, bool all);

    /// What a picture needs of levels: posed and coloured. Returns the milliseconds that posing took.
    double prepare(std::span<const unsigned> levels);
    /// One tile's objects. `from` melts into `level`; part: of `level`.
    Scene scene(TileShows shows, unsigned level, std::optional<unsigned> from, double part, const QPalette& palette);
    /// Why the full deformation of the pose shown is not there (yet), for its tile; "" when it is.
    std::string full_problem() const;
    std::string patches_problem() const; ///< why patches are wanted and not seen; "" when they are

    /// Positions of a level as posed, relative to the origin; kept until the pose changes.
    std::span<const Vec3f> positions(unsigned level);
    /// Where a vertex of the finest mesh is in the picture, in the world; none: the level drawn does not have it.
    std::optional<Vec3d> place_of_vertex(Index vertex);
    Vec3d origin() const;
    /// The box of what is drawn, in the world; exact.
    Box box();
    std::optional<ClipPlane> clip();

    const VertexColors& colors() const { return colors_; }
    /// What is shown in place of the restored mesh, because it melts; null: nothing.
    const std::shared_ptr<const Mesh>& melt() const { return melt_of_; }
    /// Where a ray in the world meets it.
    std::optional<Picked> pick_melt(const Camera::Ray& ray);
    /// Its faces as triangles; cut once for a surface, when they are first asked for.
    std::span<const Triangle> melt_triangles();
    const std::vector<DefectEdge>& defects() const { return defects_; }
    bool shows_particles() const;

Q_SIGNALS:
    void changed(bool pose); ///< another picture is due; pose: because things move

private:
    void follow_document();
    void follow_pose();
    void follow_view();
    void follow_particles();
    void follow_surroundings();
    void follow_inside_points();
    void pose_net();
    bool has_full_vertices() const;
    void follow_full();
    void follow_melt();
    void set_melt(std::shared_ptr<const Mesh> surface);
    void follow_patches();
    PatchSurface* patches_at(unsigned level); ///< what is drawn in its place; null: itself
    void follow_colors();
    void put_colors(Coloring coloring, VertexColors colors);
    void drop_colors();
    void follow_error();
    void follow_pieces();
    void follow_expected_error();
    void follow_heat();
    void follow_defects();
    void ask_for(unsigned level, bool is_urgent);
    void adopt();
    Appearance surface_look(bool is_dark);
    void add_level(Scene& scene, unsigned level, const Appearance& look, float coverage = 1);
    void add_restored(Scene& scene, unsigned level, std::optional<unsigned> from, double part, const Appearance& look);
    void add_surroundings(Scene& scene) const;
    void drop_posed_extras();

    Workbench& workbench_;
    WithOpenGl with_opengl_;
    Jobs background_{"A coarser level needs less."};
    bool is_started_ = false;
    RestoreOn where_ = RestoreOn::cpu;
    std::unique_ptr<ShownModel> shown_, next_;
    std::string problem_;
    Pose pose_;
    std::uint64_t pose_stamp_ = 0, last_stamp_ = 0;

    std::optional<Drawable> particles_, inside_, full_, melt_;
    std::shared_ptr<const Mesh> melt_of_;
    std::optional<std::vector<Triangle>> melt_triangles_; ///< of melt_of_
    std::vector<Index> melt_copies_;                      ///< vertices that are drawn twice
    bool melt_is_colored_ = false;                        ///< by heat
    std::shared_ptr<const DroppedBody> particles_of_, surroundings_of_;
    std::uint64_t full_asked_ = 0; ///< which pose the full deformation is of, or will be; 0: none
    std::string full_error_;       ///< why it cannot be drawn
    std::vector<Drawable> obstacles_;
    std::optional<PatchSurface> patches_;
    std::shared_ptr<const Model> patches_of_; ///< asked for of it
    std::string patches_problem_;
    VertexColors colors_;
    std::uint64_t color_stamp_ = 0;
    Coloring colors_are_ = Coloring::own;
    std::uint64_t expected_number_ = 0; ///< of the expected error that the colours are
    std::vector<DefectEdge> defects_;
    std::shared_ptr<const Model> defects_of_;
    bool inside_points_stale_ = false;               ///< other points have come than are drawn
    std::shared_ptr<const Source> inside_points_of_; ///< asked for of it, so many
    std::size_t inside_points_asked_ = 0;
    std::uint64_t inside_pose_ = 0; ///< which pose the points inside have
    // The driver's edges over the mesh: drawn nearer to the eye than they are.
    std::uint64_t net_stamp_ = 0, net_pose_ = 0;
    Vec3d net_eye_ = Vec3d::Zero();
    double net_offset_ = 0;
    unsigned by_size_ = 0; ///< the level chosen by size on screen
    unsigned drawn_level_ = 0;
    ViewSettings settings_; ///< as last followed

    struct Positions {
        std::uint64_t stamp = 0;
        std::shared_ptr<const LevelShape> shape;
        std::vector<Vec3f> values;
    };
    std::vector<Positions> positions_; ///< of the levels asked for
};

} // namespace filigree::studio
