// A model as the viewport has it: some of its levels in graphics memory, prepared one after the other in the
// background.
#pragma once

#include "document.h"
#include "jobs.h"

#include "filigree/present/level_shape.h"
#include "filigree/render.h"

namespace filigree::studio {

/// Numbers of vertices to be shown as colours.
struct VertexColors {
    std::vector<float> values; ///< one a vertex
    ColorMap map = ColorMap::sequential;
    ValueRange range = {};
    std::shared_ptr<const Mesh> melt = {}; ///< whose vertices they are; null: the model's, at its finest level
};

/// One level in graphics memory. Lives and dies with the OpenGL context current.
struct ShownLevel {
    std::shared_ptr<const LevelShape> shape;
    Drawable drawable;
    bool is_points = false;   ///< the mesh has no faces: its vertices as balls
    std::uint64_t pose = 0;   ///< which pose it has; 0: at rest
    std::uint64_t colors = 0; ///< which colours it has; 0: its own
};

/// The levels of one model with one law. Main thread only.
class ShownModel {
public:
    ShownModel(const State& state, RestoreOn where);

    bool is_of(const State& state) const;
    const Model& model() const { return *model_; }
    std::shared_ptr<const Model> shared_model() const { return model_; }
    RestoreOn where() const { return where_; }
    unsigned finest_level() const { return model_->finest_level(); }
    const std::vector<LevelFacts>& facts() const { return facts_; }
    const Pose& rest_pose() const { return rest_pose_; }

    /// Prepares a level unless it was asked for before. `upload` runs its argument with OpenGL at hand; `ready` is
    /// called when the level is there, or with the error that says why there will be none.
    void ask(unsigned level, bool is_urgent, Jobs& background, std::function<void(std::function<void()>)> upload,
             std::function<void(const std::optional<Error>&)> ready);
    /// Measures the deviations of all levels in the background, once.
    void measure(Jobs& background, std::function<void()> ready);

    /// Null: not ready, or there is none.
    ShownLevel* level(unsigned number) { return number < levels_.size() ? levels_[number].get() : nullptr; }
    /// The finest ready level up to `wanted`, which may be of a model to come with more levels than this one; else
    /// the coarsest beyond; none: nothing is ready.
    std::optional<unsigned> nearest_ready(unsigned wanted) const;

    /// Poses and colours a level that is ready; with OpenGL. `stamp` tells poses (colours) apart.
    bool set_pose(ShownLevel& level, const Pose& pose, std::uint64_t stamp, const RunContext& context);
    void set_colors(ShownLevel& level, const VertexColors& colors, std::uint64_t stamp);

    /// After Jobs::drop_all(): levels that were asked for and did not come can be asked for again.
    void forget_unready();

private:
    std::shared_ptr<const Model> model_;
    std::shared_ptr<const Source> source_;
    RestoreOptions restore_;
    RestoreOn where_;
    Pose rest_pose_;
    std::vector<std::unique_ptr<ShownLevel>> levels_;
    std::vector<char> asked_;
    std::vector<LevelFacts> facts_;
    bool is_measured_ = false;
    std::shared_ptr<int> life_ = std::make_shared<int>(); ///< deliveries come only while it lives
};

} // namespace filigree::studio
