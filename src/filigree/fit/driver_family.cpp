#include "filigree/fit/driver_family.h"

#include "filigree/levels/simplify.h"

#include <numeric>

namespace filigree {

namespace {

constexpr std::size_t kSample = 65'536, kPiece = 40'000;
constexpr std::size_t kLeastOfPart = 48; // two open tubes of 30 vertices each were bound to each other's sides
/// What a squared length costs beside a squared distance: where the frames say what matters, a hundredth of the usual.
constexpr double kMotionLength = 2e-4;
constexpr double kLevelFactor = 4; // vertices of a level as a multiple of the next coarser one's

} // namespace

std::string_view name_of(DriverChoice choice) { return choice == DriverChoice::rest ? "rest" : "motion"; }

Result<DriverFamily> DriverFamily::create(const Mesh& mesh, const WorkingMesh& work, const RunContext& context) {
    DriverFamily family(mesh, work);
    std::span<const Triangle> now = work.surface.triangles;
    std::size_t count = work.surface.place_count;
    const auto simplify_to = [&](std::size_t target) {
        Simplified less = simplify(work.positions, now, {.target_vertices = target}, context);
        family.bulk_.push_back({std::move(less.triangles), less.vertex_count});
        now = family.bulk_.back().triangles;
        count = family.bulk_.back().vertices;
    };
    context.report("simplifying", 0);
    if (mesh.vertex_count() > kSample) {
        while (double(count) > kLevelFactor * double(kSample)) simplify_to(std::size_t(double(count) / kLevelFactor));
        if (count > kSample) simplify_to(kSample);
        if (context.is_cancelled()) return cancelled_error();
        if (Status made = family.make_sample({now.begin(), now.end()}, context); !made) return made.error();
    } else {
        family.sample_vertices_.resize(mesh.vertex_count());
        std::iota(family.sample_vertices_.begin(), family.sample_vertices_.end(), Index{0});
    }
    context.report("simplifying", 0.5);
    if (count > kPiece + kPiece / 4) simplify_to(kPiece);
    if (context.is_cancelled()) return cancelled_error();
    std::vector<Index> in_sample(mesh.vertex_count(), kNoIndex);
    for (Index i = 0; i < family.sample_vertices_.size(); ++i) in_sample[family.sample_vertices_[i]] = i;
    for (const Triangle& t : now) family.piece_.push_back({in_sample[t[0]], in_sample[t[1]], in_sample[t[2]]});
    family.piece_count_ = make_level(family.piece_, family.sample_vertices_.size()).vertices.size();
    return family;
}

/// triangles: over the mesh's vertices.
Status DriverFamily::make_sample(std::vector<Triangle> triangles, const RunContext& context) {
    const Level level = make_level(triangles, mesh_.vertex_count());
    sample_vertices_ = level.vertices;
    for (const Index v : level.vertices) sample_.positions.push_back(mesh_.positions[v]);
    sample_.origin = mesh_.origin;
    sample_.face_offsets = level.face_offsets;
    sample_.corners = level.corners;
    std::vector<Index> own(sample_vertices_.size());
    std::iota(own.begin(), own.end(), Index{0});
    Result<WorkingMesh> work = make_working_mesh(sample_, std::move(own), context);
    if (!work) return work.error();
    sample_work_ = std::move(*work);
    return Success{};
}

Status DriverFamily::order(DriverChoice choice, std::span<const std::vector<Vec3f>> shapes, const RunContext& context) {
    EdgeCollapseOptions options;
    options.least_of_part = kLeastOfPart;
    if (choice == DriverChoice::motion) {
        options.other_shapes = shapes;
        options.length_weight = kMotionLength;
    }
    orders_[std::size_t(choice)] = order_collapses(sample_work().positions, piece_, options, context);
    if (context.is_cancelled()) return cancelled_error();
    return Success{};
}

std::vector<Triangle> DriverFamily::in_mesh(std::vector<Triangle> of_sample) const {
    for (Triangle& t : of_sample)
        for (Index& v : t) v = sample_vertices_[v];
    return of_sample;
}

Level DriverFamily::sample_driver(DriverChoice choice, std::size_t vertices) const {
    return make_level(orders_[std::size_t(choice)]->at(vertices).triangles, sample_vertices_.size());
}

std::vector<Level> DriverFamily::levels(DriverChoice choice, std::size_t vertices) const {
    const CollapseOrder& order = *orders_[std::size_t(choice)];
    std::vector<Level> levels;
    const auto add = [&](const std::vector<Triangle>& triangles) {
        levels.push_back(make_level(triangles, mesh_.vertex_count()));
    };
    add(in_mesh(order.at(vertices).triangles));
    for (double count = double(vertices) * kLevelFactor; 2 * count < double(piece_count_); count *= kLevelFactor)
        add(in_mesh(order.at(std::size_t(count)).triangles));
    for (auto bulk = bulk_.rbegin(); bulk != bulk_.rend(); ++bulk)
        if (bulk->vertices >= 2 * levels.back().vertices.size() && 2 * bulk->vertices <= mesh_.vertex_count())
            add(bulk->triangles);
    return levels;
}

} // namespace filigree
