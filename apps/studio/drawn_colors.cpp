// Numbers of the mesh's vertices as colours: levels, errors measured, errors expected.
#include "drawn_objects.h"

#include <algorithm>

namespace filigree::studio {

namespace {

VertexColors error_colors(std::vector<float> distances, double diagonal) {
    HeatMap map = heat_map(std::move(distances), diagonal);
    return {std::move(map.values), ColorMap::sequential, map.range};
}

} // namespace

void DrawnObjects::put_colors(Coloring coloring, VertexColors colors) {
    colors_ = std::move(colors);
    colors_are_ = coloring;
    color_stamp_ = ++last_stamp_;
    Q_EMIT changed(false);
}

void DrawnObjects::drop_colors() {
    if (color_stamp_ != 0) put_colors(Coloring::own, {});
    color_stamp_ = 0;
}

void DrawnObjects::follow_colors() {
    if (!shown_) return;
    if (settings_.coloring != Coloring::heat && std::exchange(melt_is_colored_, false)) {
        with_opengl_([this] {
            if (melt_) (void)melt_->set_scalars({});
        });
        colors_ = {};
        color_stamp_ = 0;
    }
    switch (settings_.coloring) {
    case Coloring::own:
    case Coloring::patches: // as another surface
        return drop_colors();
    case Coloring::levels:
        if (colors_are_ == Coloring::levels && color_stamp_ != 0) return;
        return put_colors(
            Coloring::levels,
            {shown_->arrival(), ColorMap::sequential, {0, static_cast<float>(std::max(1u, shown_->finest_level()))}});
    case Coloring::error:
        return follow_error();
    case Coloring::expected_error:
        return follow_expected_error();
    case Coloring::pieces:
        return follow_pieces();
    case Coloring::heat:
        return follow_heat();
    }
}

/// Known of the latest moment of a body that melts.
void DrawnObjects::follow_heat() {
    constexpr float kCelsius = 273.15f, kAround = 20; // K, K
    const auto made = workbench_.playback().made();
    const Moment* const moment = workbench_.playback().moment();
    const std::size_t count = melt_of_ ? melt_of_->positions.size() : shown_->model().vertex_count();
    if (!made || !moment || moment->surface != melt_of_ || moment->temperatures.size() != count) {
        if (!melt_of_) drop_colors();
        return;
    }
    const Material& material = made->body->material;
    VertexColors colors;
    for (const float kelvins : moment->temperatures) colors.values.push_back(kelvins - kCelsius);
    colors.range = {float(std::min(material.temperature, material.melting_from)) - kCelsius - kAround,
                    float(material.melting_to) - kCelsius + kAround};
    if (melt_) {
        melt_is_colored_ = false;
        for (const Index v : melt_copies_) colors.values.push_back(colors.values[v]);
        with_opengl_([&] {
            melt_is_colored_ = bool(melt_->set_scalars({colors.values, ColorMap::sequential, colors.range}));
        });
        colors_ = std::move(colors); // for the legend
        colors_are_ = Coloring::heat;
        return Q_EMIT changed(false);
    }
    put_colors(Coloring::heat, std::move(colors));
}

/// While things move, the colours stay those of a pose just before.
void DrawnObjects::follow_expected_error() {
    const ExpectedError& expected = workbench_.expected_error();
    if (expected.colors().values.size() != shown_->model().vertex_count()) return drop_colors();
    if (colors_are_ == Coloring::expected_error && color_stamp_ != 0 && expected_number_ == expected.number()) return;
    expected_number_ = expected.number();
    put_colors(Coloring::expected_error, {expected.colors().values, ColorMap::sequential, expected.colors().range});
}

void DrawnObjects::follow_pieces() {
    const MadePieces* const pieces = workbench_.state().source->pieces.get();
    if (!pieces) return drop_colors();
    const std::vector<Index>& piece_of_vertex = pieces->breaking->carried.vertices;
    if (piece_of_vertex.size() != shown_->model().vertex_count()) return drop_colors(); // not shown yet
    if (colors_are_ == Coloring::pieces && color_stamp_ != 0) return;
    std::vector<float> values;
    for (const Index piece : piece_of_vertex) values.push_back(float(piece % kCategoryCount) + 0.5f);
    put_colors(Coloring::pieces, {std::move(values), ColorMap::categorical, {0, float(kCategoryCount)}});
}

void DrawnObjects::follow_error() {
    const std::size_t count = shown_->model().vertex_count();
    const double diagonal = bounds(shown_->model().mesh.positions).diagonal();
    const std::optional<VertexDistance>& error = workbench_.error();
    if (pose_stamp_ == 0)
        return put_colors(Coloring::error, {std::vector<float>(count), ColorMap::sequential, {0, 0.01f}});
    if (!has_full_vertices()) {
        if (!error || error->per_vertex.size() != count) return drop_colors();
        return put_colors(Coloring::error, error_colors(error->per_vertex, diagonal));
    }
    if (colors_are_ != Coloring::error) drop_colors();
    background_.start<VertexColors>(
        "The picture", "error colors",
        [diagonal, pose = pose_, model = shown_->shared_model(), restore = workbench_.state().restore,
         full = std::vector(workbench_.full().begin(), workbench_.full().end())](
            const RunContext& context) mutable -> Result<VertexColors> {
            restore.level.reset();
            const Result<Restorer> restorer = Restorer::create(*model, restore, context);
            if (!restorer) return restorer.error();
            const Result<std::vector<Vec3f>> restored = restorer->positions(pose, context);
            if (!restored) return restored.error();
            std::vector<float> distances(full.size());
            for (std::size_t v = 0; v < full.size(); ++v) distances[v] = ((*restored)[v] - full[v]).norm();
            return error_colors(std::move(distances), diagonal);
        },
        [this, stamp = pose_stamp_, model = shown_->shared_model()](VertexColors colors) {
            if (shown_ && shown_->shared_model() == model && stamp == pose_stamp_ &&
                settings_.coloring == Coloring::error)
                put_colors(Coloring::error, std::move(colors));
        },
        {.failed = [](const Error&) {}}); // the mesh is grey then: the error is not known
}

} // namespace filigree::studio
