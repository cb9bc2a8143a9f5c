#include "coloring.h"

#include "softness.h"
#include "tools/tool.h"

#include <algorithm>

namespace filigree::studio {

namespace {

/// Of distances, fractions of the mesh's diagonal.
VertexColors error_colors(std::vector<float> distances, double diagonal) {
    HeatMap map = heat_map(std::move(distances), diagonal);
    return {std::move(map.values), ColorMap::sequential, map.range};
}

/// Colours that are there already.
ColorWork at_once(VertexColors colors) {
    return {[colors = std::move(colors)](const RunContext&) -> Result<VertexColors> { return colors; }};
}

// Error

std::optional<ColorKey> error_key(const Seen& seen) {
    const std::optional<VertexDistance>& error = seen.workbench.error();
    if (seen.pose_number == 0 || seen.knows_full) return ColorKey{seen.model, 2 * seen.pose_number};
    if (!error || error->per_vertex.size() != seen.model->vertex_count()) return std::nullopt;
    return ColorKey{seen.model, 2 * seen.pose_number + 1}; // as measured
}

ColorWork error_work(const Seen& seen) {
    const double diagonal = bounds(seen.model->mesh.positions).diagonal();
    if (seen.pose_number == 0)
        return at_once({std::vector<float>(seen.model->vertex_count()), ColorMap::sequential, {0, 0.01f}});
    if (!seen.knows_full) return at_once(error_colors(seen.workbench.error()->per_vertex, diagonal));
    const std::span<const Vec3f> full = seen.workbench.full();
    const auto work =
        [diagonal, pose = seen.pose, model = seen.model, restore = seen.workbench.state().restore,
         full = std::vector(full.begin(), full.end())](const RunContext& context) mutable -> Result<VertexColors> {
        restore.level.reset();
        const Result<Restorer> restorer = Restorer::create(*model, restore, context);
        if (!restorer) return restorer.error();
        const Result<std::vector<Vec3f>> restored = restorer->positions(pose, context);
        if (!restored) return restored.error();
        std::vector<float> distances(full.size());
        for (std::size_t v = 0; v < full.size(); ++v) distances[v] = ((*restored)[v] - full[v]).norm();
        return error_colors(std::move(distances), diagonal);
    };
    return {work, true};
}

// Levels

std::optional<ColorKey> level_key(const Seen& seen) { return ColorKey{seen.model, 0}; }

ColorWork level_work(const Seen& seen) {
    const unsigned finest = seen.model->finest_level();
    return at_once({vertex_levels(*seen.model, finest), ColorMap::sequential, {0, float(std::max(1u, finest))}});
}

// Patches: drawn as another surface

QString why_no_patches(const Seen& seen) { return QString::fromStdString(seen.patches_problem); }

// Expected error: while things move, that of a pose just before

std::optional<ColorKey> expected_error_key(const Seen& seen) {
    const ExpectedError& expected = seen.workbench.expected_error();
    if (expected.colors().values.size() != seen.model->vertex_count()) return std::nullopt;
    return ColorKey{seen.model, expected.number()};
}

ColorWork expected_error_work(const Seen& seen) {
    const HeatMap& colors = seen.workbench.expected_error().colors();
    return at_once({colors.values, ColorMap::sequential, colors.range});
}

// Pieces

std::optional<ColorKey> piece_key(const Seen& seen) {
    const std::shared_ptr<const MadePieces>& pieces = seen.workbench.state().source->pieces;
    if (!pieces || pieces->breaking->carried.vertices.size() != seen.model->vertex_count()) return std::nullopt;
    return ColorKey{pieces, 0};
}

ColorWork piece_work(const Seen& seen) {
    std::vector<float> values;
    for (const Index piece : seen.workbench.state().source->pieces->breaking->carried.vertices)
        values.push_back(float(piece % kCategoryCount) + 0.5f);
    return at_once({std::move(values), ColorMap::categorical, {0, float(kCategoryCount)}});
}

// Heat: known of the latest moment of a body that melts

std::optional<ColorKey> heat_key(const Seen& seen) {
    const Moment* const moment = seen.workbench.playback().moment();
    const std::size_t count = seen.melt ? seen.melt->positions.size() : seen.model->vertex_count();
    if (!moment || moment->surface != seen.melt || moment->temperatures.size() != count) return std::nullopt;
    return ColorKey{seen.model, seen.moment_number};
}

ColorWork heat_work(const Seen& seen) {
    constexpr float kCelsius = 273.15f, kAround = 20; // K, K
    const Material& material = seen.workbench.playback().made()->body->material;
    VertexColors colors{.values = {}, .melt = seen.melt};
    for (const float kelvins : seen.workbench.playback().moment()->temperatures)
        colors.values.push_back(kelvins - kCelsius);
    colors.range = {float(std::min(material.temperature, material.melting_from)) - kCelsius - kAround,
                    float(material.melting_to) - kCelsius + kAround};
    return at_once(std::move(colors));
}

QString why_no_heat(const Seen& seen) {
    return heat_key(seen) ? QString()
                          : QStringLiteral("Heat is known of a body that melts while it moves: choose wax or ice in "
                                           "the Body panel.");
}

// Softness

std::optional<ColorKey> softness_key(const Seen& seen) {
    if (seen.workbench.state().source->mesh.vertex_count() != seen.model->vertex_count()) return std::nullopt;
    const auto softness = softness_of(seen.workbench.state());
    return softness ? ColorKey{softness, 0} : ColorKey{seen.model, 0};
}

ColorWork softness_work(const Seen& seen) {
    const auto softness = softness_of(seen.workbench.state());
    return at_once(
        {softness ? *softness : std::vector<float>(seen.model->vertex_count()), ColorMap::sequential, {0, 1}});
}

constexpr const char* kPerDiagonal = "% of the diagonal";

} // namespace

const Coloring kOwnColors = {"own", "&Own colours", "The mesh's own colours", "Shift+1", "Its own"};

const Coloring kErrorColors = {
    "error",   "E&rror as colours", "How far each vertex is from the full deformation",        "Shift+2",     "Error",
    error_key, error_work,          {"Distance from the full deformation", kPerDiagonal, 100}, {.full = true}};

const Coloring kLevelColors = {
    "levels",  "&Levels as colours", "The level at which each vertex is added",        "Shift+3", "Levels",
    level_key, level_work,           {"Level at which a vertex comes in", "", 1, true}};

const Coloring kPatchColors = {"patches",
                               "Patc&hes as colours",
                               "The patches of regular quads, each in a colour unlike its neighbours'",
                               "Shift+4",
                               "Patches",
                               nullptr,
                               nullptr,
                               {},
                               {.patches = true},
                               why_no_patches};

const Coloring kExpectedErrorColors = {"expected",
                                       "E&xpected error as colours",
                                       "Where the pose is more curved than the driver can follow",
                                       "Shift+5",
                                       "Expected error",
                                       expected_error_key,
                                       expected_error_work,
                                       {"Expected error", kPerDiagonal, 100},
                                       {.expected_error = true}};

const Coloring kPieceColors = {
    "pieces", "Pi&eces as colours", "Each piece of a mesh that breaks", "Shift+6", "Pieces", piece_key, piece_work};

const Coloring kHeatColors = {"heat",
                              "&Heat as colours",
                              "How warm a body that melts is",
                              "Shift+7",
                              "Heat",
                              heat_key,
                              heat_work,
                              {"Temperature", "°C", 1, true},
                              {.temperatures = true},
                              why_no_heat};

const Coloring kSoftnessColors = {
    "softness",    "So&ftness as colours", "Where softness is painted", "Shift+8", "Softness", softness_key,
    softness_work, {"Softness", ""}};

const std::vector<const Coloring*>& colorings() {
    static const std::vector<const Coloring*> all = [] {
        std::vector<const Coloring*> rows = {&kOwnColors,   &kErrorColors,         &kLevelColors,
                                             &kPatchColors, &kExpectedErrorColors, &kPieceColors};
        for (const ToolEntry* const tool : kTools)
            if (tool->colors) rows.push_back(tool->colors);
        return rows;
    }();
    return all;
}

} // namespace filigree::studio
