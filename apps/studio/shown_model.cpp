#include "shown_model.h"

#include <algorithm>

namespace filigree::studio {

ShownModel::ShownModel(const State& state, RestoreOn where)
    : model_(state.model), source_(state.source), restore_(state.restore), where_(where) {
    rest_pose_.positions = driver_positions(*model_);
    levels_.resize(model_->finest_level() + 1);
    asked_.resize(levels_.size());
    for (unsigned level = 0; level < levels_.size(); ++level) facts_.push_back(level_facts(*model_, level));
}

bool ShownModel::is_of(const State& state) const { return state.model == model_; }

void ShownModel::ask(unsigned level, bool is_urgent, Jobs& background,
                     std::function<void(std::function<void()>)> upload,
                     std::function<void(const std::optional<Error>&)> ready) {
    if (std::exchange(asked_[level], 1)) return;
    // The model before is drawn until this one is there, and may ask for a level of the same number meanwhile.
    const std::string topic =
        "level " + std::to_string(level) + " of " + std::to_string(reinterpret_cast<std::uintptr_t>(this));
    struct Prepared {
        std::shared_ptr<const LevelShape> shape;
        std::optional<DrawData> data; ///< unset: the mesh has no faces
    };
    background.start<Prepared>(
        "The picture", topic,
        [level, model = model_, source = source_, restore = restore_,
         where = where_](const RunContext& context) mutable -> Result<Prepared> {
            Result<std::shared_ptr<const LevelShape>> shape = LevelShape::make(model, restore, level, context);
            if (!shape) return shape.error();
            Prepared prepared{std::move(*shape), {}};
            if (prepared.shape->triangles().empty()) return prepared;
            restore.level = level;
            Result<DrawData> data =
                DrawData::model(*model, restore, {.materials = source->materials.materials}, where, context);
            if (!data) return data.error();
            prepared.data.emplace(std::move(*data));
            return prepared;
        },
        [this, life = std::weak_ptr(life_), upload = std::move(upload), ready, level](Prepared prepared) {
            if (life.expired()) return;
            std::optional<Error> error;
            upload([&] {
                const bool is_points = !prepared.data;
                Result<Drawable> drawable = is_points
                                                ? Drawable::points(prepared.shape->positions(rest_pose_, RunContext()),
                                                                   model_->mesh.origin, {}, RunContext())
                                                : Drawable::upload(std::move(*prepared.data));
                if (drawable)
                    levels_[level].reset(new ShownLevel{prepared.shape, std::move(drawable).value(), is_points});
                else
                    error = drawable.error();
            });
            ready(error);
        },
        {is_urgent, [life = std::weak_ptr(life_), ready](const Error& error) {
             if (!life.expired()) ready(error);
         }});
}

void ShownModel::measure(Jobs& background, std::function<void()> ready) {
    if (std::exchange(is_measured_, true)) return;
    using Deviations = std::vector<std::optional<double>>;
    background.start<Deviations>(
        "The picture", "deviations",
        [model = model_](const RunContext& context) { return level_deviations(*model, context); },
        [this, life = std::weak_ptr(life_), ready = std::move(ready)](const Deviations& deviations) {
            if (life.expired()) return;
            for (std::size_t level = 0; level < deviations.size(); ++level) facts_[level].deviation = deviations[level];
            ready();
        });
}

std::optional<unsigned> ShownModel::nearest_ready(unsigned wanted) const {
    wanted = std::min(wanted, finest_level());
    for (unsigned level = wanted + 1; level-- > 0;)
        if (levels_[level]) return level;
    for (unsigned level = wanted + 1; level < levels_.size(); ++level)
        if (levels_[level]) return level;
    return std::nullopt;
}

bool ShownModel::set_pose(ShownLevel& level, const Pose& pose, std::uint64_t stamp, const RunContext& context) {
    if (level.pose == stamp) return true;
    if (level.is_points) {
        const std::vector<Vec3f> positions = level.shape->positions(pose, context);
        if (!level.drawable.set_positions(positions)) return false;
    } else if (!level.drawable.set_pose(pose, context)) {
        return false;
    }
    level.pose = stamp;
    return true;
}

void ShownModel::set_colors(ShownLevel& level, const VertexColors& colors, std::uint64_t stamp) {
    if (level.colors == stamp || level.is_points) return;
    level.colors = stamp;
    if (colors.values.size() != model_->vertex_count()) return (void)level.drawable.set_scalars({});
    std::vector<float> values(level.shape->vertex_count());
    for (Index v = 0; v < values.size(); ++v)
        if (const Index finest = level.shape->finest_vertex(v); finest < colors.values.size()) // a cage's are not
            values[v] = colors.values[finest];
    (void)level.drawable.set_scalars({values, colors.map, colors.range});
}

void ShownModel::forget_unready() {
    for (std::size_t level = 0; level < levels_.size(); ++level) asked_[level] = levels_[level] != nullptr;
    is_measured_ =
        std::all_of(facts_.begin(), facts_.end(), [](const LevelFacts& f) { return f.deviation.has_value(); });
}

} // namespace filigree::studio
