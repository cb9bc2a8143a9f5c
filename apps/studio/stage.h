// Everything the viewport draws, as objects in graphics memory that follow the workbench.
#pragma once

#include "drawing.h"
#include "shown_model.h"
#include "workbench.h"

#include <QPalette>

#include <functional>

namespace filigree::studio {

/// An edge that a closed, manifold mesh would not have. Vertices of the finest mesh.
struct DefectEdge {
    Index a = 0, b = 0;
    bool is_open = false; ///< else it has three faces or more
};
/// All of them, ascending. Cost O(corners log corners).
std::vector<DefectEdge> defect_edges(const Mesh& mesh);

class Stage : public QObject {
    Q_OBJECT
public:
    /// Runs its argument with OpenGL current, or not at all.
    using WithOpenGl = std::function<void(std::function<void()>)>;

    Stage(Workbench& workbench, WithOpenGl with_opengl);
    ~Stage() override;

    void start(RestoreOn where); ///< OpenGL is there
    void stop();                 ///< it goes away; called while it is still current
    bool is_started() const { return is_started_; }

    Background& background() { return background_; }
    /// Null: nothing to draw yet.
    ShownModel* shown() { return shown_.get(); }
    bool is_preparing() const { return next_ != nullptr; }  ///< what is drawn is not the document's any more
    const std::string& problem() const { return problem_; } ///< why the document cannot be drawn; "" when it can

    /// Where the driver of the model shown is, and a number that changes with it.
    const Pose& pose() const { return pose_; }
    std::uint64_t pose_stamp() const { return pose_stamp_; }

    /// The level meant when nothing is in a hurry.
    unsigned calm_level(double pixels_a_unit);
    /// Makes the levels that may be drawn soon.
    void ask_for_levels(unsigned calm, bool all);

    /// What a picture needs of levels: posed and coloured. Returns the milliseconds that posing took.
    double prepare(std::span<const unsigned> levels);
    /// One tile's objects. `from` melts into `level`; part: of `level`.
    enum class Content { driver, restored, full };
    Scene scene(Content content, unsigned level, std::optional<unsigned> from, double part, const QPalette& palette);
    bool has_full() const { return full_.has_value() || workbench_.pose() == nullptr; }

    /// Positions of a level as posed, relative to the origin; kept until the pose changes.
    std::span<const Vec3f> positions(unsigned level);
    Vec3d origin() const;
    /// The box of what is drawn, in the world; exact.
    Box box();
    std::optional<ClipPlane> clip();

    const VertexColors& colors() const { return colors_; }
    const std::vector<DefectEdge>& defects() const { return defects_; }
    bool shows_particles() const;
    bool shows_inside_points() const;

Q_SIGNALS:
    void changed(bool pose); ///< another picture is due; pose: because things move

private:
    void follow_document();
    void follow_pose();
    void follow_view();
    void follow_particles();
    void follow_surroundings();
    void follow_inside_points();
    void follow_full();
    void follow_colors();
    void follow_defects();
    void adopt();
    void drop_posed_extras();

    Workbench& workbench_;
    WithOpenGl with_opengl_;
    Background background_;
    bool is_started_ = false;
    RestoreOn where_ = RestoreOn::cpu;
    std::unique_ptr<ShownModel> shown_, next_;
    std::string problem_;
    Pose pose_;
    std::uint64_t pose_stamp_ = 0, last_stamp_ = 0;

    std::optional<Drawable> particles_, inside_, full_;
    std::shared_ptr<const MadeBody> particles_of_, surroundings_of_;
    std::vector<Drawable> obstacles_;
    VertexColors colors_;
    std::uint64_t color_stamp_ = 0;
    std::vector<DefectEdge> defects_;
    std::shared_ptr<const Model> defects_of_;
    bool inside_points_stale_ = false;               ///< other points have come than are drawn
    std::shared_ptr<const Source> inside_points_of_; ///< asked for of it, so many
    std::size_t inside_points_asked_ = 0;
    unsigned by_size_ = 0;  ///< the level chosen by size on screen
    ViewSettings settings_; ///< as last followed

    struct Positions {
        std::uint64_t stamp = 0;
        std::shared_ptr<const LevelShape> shape;
        std::vector<Vec3f> values;
    };
    std::vector<Positions> positions_; ///< of the levels asked for
};

} // namespace filigree::studio
