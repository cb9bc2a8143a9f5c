#include "filigree/pose.h"

#include "filigree/hierarchy/blend_code.h"
#include "filigree/hierarchy/pose_mesh.h"
#include "filigree/mesh.h"
#include "filigree/mesh/weld.h"
#include "filigree/restore.h"

#include <algorithm>
#include <array>
#include <utility>

namespace filigree {

namespace {

/// A pull's vertices and those it holds, in the order that the solver is told their places.
struct PullTargets {
    HandleSolver solver;
    std::vector<Vec3f> starts; ///< of the pulled ones, then of those held
    std::size_t pulled;

    static Result<PullTargets> create(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                      const PullRegion& region, const RunContext& context) {
        std::vector<Index> vertices = region.grip;
        vertices.insert(vertices.end(), region.held.begin(), region.held.end());
        Result<HandleSolver> solver = HandleSolver::create(positions, triangles, vertices, context);
        if (!solver) return solver.error();
        std::vector<Vec3f> starts;
        for (const Index v : vertices) starts.push_back(positions[v]);
        return PullTargets{std::move(*solver), std::move(starts), region.grip.size()};
    }
    Result<HandleResult> solve(const Vec3f& way, const HandleOptions& options, const RunContext& context) {
        std::vector<Vec3f> places = starts;
        for (std::size_t i = 0; i < pulled; ++i) places[i] += way;
        return solver.solve(places, options, context);
    }
};

/// One vertex of the finest mesh, restored from pose after pose.
class GrabbedVertex {
public:
    GrabbedVertex(const Model& model, Index vertex, const Pose* start)
        : restorer_(model.detail, model.mesh.positions, model.driver().vertices,
                    std::array{BlendRestorer::Item{vertex, 0}}, {}, RunContext(1)),
          start_(start ? place(*start) : model.mesh.positions[vertex]) {}
    /// From where it started.
    Vec3f way(const Pose& pose) const { return place(pose) - start_; }

private:
    Vec3f place(const Pose& pose) const {
        Vec3f place;
        restorer_.restore(pose.positions, pose.gradients, std::span(&place, 1), {}, true, RunContext());
        return place;
    }
    BlendRestorer restorer_;
    Vec3f start_;
};

/// The driver vertices that carry a vertex of the finest mesh, ascending.
std::vector<Index> carriers(const Model& model, Index vertex) {
    const BlendDetail& detail = model.detail;
    const auto record = std::find(detail.order.begin(), detail.order.end(), vertex) - detail.order.begin();
    const auto next = std::upper_bound(detail.cell_offsets.begin(), detail.cell_offsets.end(), record);
    const auto cell = static_cast<std::size_t>(next - detail.cell_offsets.begin() - 1);
    if (cell >= detail.cells.size()) return {};
    std::vector<Index> result(detail.cells[cell].begin(), detail.cells[cell].end());
    std::sort(result.begin(), result.end());
    return result;
}

bool contains(std::span<const Index> ascending, Index v) {
    return std::binary_search(ascending.begin(), ascending.end(), v);
}

/// A pull of the driver as one of the vertices that stand for each place of the mesh.
PullRegion region_of_mesh(const Model& model, const Pull& pull, std::span<const Index> representative) {
    enum class Fate : char { by_distance, held, taken };
    const std::vector<Vec3f>& rest = model.mesh.positions;
    std::vector<Fate> fates(rest.size(), Fate::by_distance);
    const auto set = [&](std::span<const Index> driver_vertices, Fate fate) {
        for (const Index v : driver_vertices) fates[representative[model.driver().vertices[v]]] = fate;
    };
    set(pull.region.held, Fate::held);
    set(pull.region.grip, Fate::taken);
    PullRegion region;
    for (Index v = 0; v < rest.size(); ++v) {
        if (representative[v] != v) continue;
        const double distance = (rest[v] - pull.centre).norm();
        if (fates[v] == Fate::taken || (fates[v] != Fate::held && distance <= pull.grip))
            region.grip.push_back(v);
        else if (fates[v] == Fate::held || distance > pull.reach)
            region.held.push_back(v);
    }
    return region;
}

} // namespace

PullRegion pull_region(const Model& model, std::span<const Index> pinned, const Vec3f& rest_point, double grip,
                       double reach, std::optional<Index> vertex) {
    const std::vector<Index> carried_by = vertex ? carriers(model, *vertex) : std::vector<Index>();
    const std::vector<Vec3f> rest = driver_positions(model);
    PullRegion region;
    Index nearest = kNoIndex;
    for (Index v = 0; v < rest.size(); ++v) {
        if (contains(pinned, v)) continue;
        const float distance = (rest[v] - rest_point).norm();
        if (nearest == kNoIndex || distance < (rest[nearest] - rest_point).norm()) nearest = v;
        if (distance <= grip || contains(carried_by, v)) region.grip.push_back(v);
    }
    if (region.grip.empty() && nearest != kNoIndex) region.grip.push_back(nearest);
    for (Index v = 0; v < rest.size(); ++v)
        if (contains(pinned, v) || ((rest[v] - rest_point).norm() > reach && !contains(region.grip, v)))
            region.held.push_back(v);
    return region;
}

Result<std::vector<Vec3f>> pull_every_vertex(const Model& model, std::span<const Pull> pulls,
                                             const RunContext& context) {
    std::vector<Vec3f> positions = model.mesh.positions;
    if (pulls.empty()) {
        positions.resize(model.vertex_count());
        return positions;
    }
    const std::vector<Index> representative = weld_map(positions);
    Result<Triangulation> triangulation = triangulate(model.mesh, context);
    if (!triangulation) return triangulation.error();
    std::vector<Triangle>& triangles = triangulation->triangles;
    for (Triangle& triangle : triangles)
        for (Index& vertex : triangle) vertex = representative[vertex];
    for (std::size_t k = 0; k < pulls.size(); ++k) {
        context.report("pulling every vertex", double(k) / double(pulls.size()));
        if (context.is_cancelled()) return cancelled_error();
        const PullRegion region = region_of_mesh(model, pulls[k], representative);
        Result<PullTargets> targets = PullTargets::create(positions, triangles, region, context);
        if (!targets) return targets.error();
        Result<HandleResult> result = targets->solve(pulls[k].move, {}, context);
        if (!result) return result.error();
        positions = std::move(result->pose.positions);
    }
    for (Index v = 0; v < positions.size(); ++v) positions[v] = positions[representative[v]];
    positions.resize(model.vertex_count());
    return positions;
}

void follow_start(Pose& pose, const Pose* start) {
    if (!start || start->gradients.empty()) return;
    for (std::size_t v = 0; v < pose.gradients.size(); ++v) pose.gradients[v] *= start->gradients[v];
}

struct PullSolver::Solver {
    static constexpr unsigned kRounds = 8;         // a step: a picture while the mouse moves
    static constexpr unsigned kMostRounds = 400;   // on one way
    static constexpr double kOffPointer = 3e-4;    // of the diagonal: the grabbed vertex is where it should be
    static constexpr float kMostCorrection = 0.5f; // of the way: pins may hold what carries it

    PullTargets targets;
    const Pose* start;
    std::optional<GrabbedVertex> grabbed;
    double off_pointer; ///< model units
    Vec3f way = Vec3f::Zero(), correction = Vec3f::Zero(), applied = Vec3f::Zero();
    unsigned rounds = 0;
    double last_move = 1, distance = 0; ///< of the vertex that was grabbed from where it should be

    /// Learns from what came of it by how much more the grip has to move.
    void correct(const Pose& pose) {
        const Vec3f rest = way - grabbed->way(pose);
        distance = double(rest.norm());
        correction += rest;
        const float most = kMostCorrection * way.norm();
        if (correction.norm() > most) correction *= most / correction.norm();
    }
};

PullSolver::PullSolver(std::unique_ptr<Solver> solver) : solver_(std::move(solver)) {}
PullSolver::PullSolver(PullSolver&&) noexcept = default;
PullSolver& PullSolver::operator=(PullSolver&&) noexcept = default;
PullSolver::~PullSolver() = default;

Result<PullSolver> PullSolver::create(const Model& model, const Pose* start, const PullRegion& region,
                                      std::optional<Index> grabbed, const RunContext& context) {
    const Mesh driver = driver_mesh(model); // triangulating looks at the positions at rest
    const Result<Triangulation> triangulation = triangulate(driver, context);
    if (!triangulation) return triangulation.error();
    Result<PullTargets> targets =
        PullTargets::create(start ? start->positions : driver.positions, triangulation->triangles, region, context);
    if (!targets) return targets.error();
    const double off_pointer = Solver::kOffPointer * bounds(model.mesh.positions).diagonal();
    auto solver = std::make_unique<Solver>(Solver{std::move(*targets), start, {}, off_pointer});
    const bool is_known = !start || !start->gradients.empty();
    if (grabbed && is_known) solver->grabbed.emplace(model, *grabbed, start);
    return PullSolver(std::move(solver));
}

Result<Pose> PullSolver::step(const Vec3f& way, double tolerance, const RunContext& context) {
    Solver& s = *solver_;
    if (way != std::exchange(s.way, way)) s.rounds = 0;
    s.applied = way + s.correction;
    Result<HandleResult> result =
        s.targets.solve(s.applied, {.iterations = Solver::kRounds, .tolerance = tolerance}, context);
    if (!result) return result.error();
    s.rounds += std::max(1u, result->iterations);
    s.last_move = result->last_move;
    follow_start(result->pose, s.start);
    if (s.grabbed) s.correct(result->pose);
    return std::move(result->pose);
}

const Vec3f& PullSolver::applied() const { return solver_->applied; }

bool PullSolver::has_arrived(double tolerance) const {
    const Solver& s = *solver_;
    return (s.last_move <= tolerance && s.distance <= s.off_pointer) || s.rounds >= Solver::kMostRounds;
}

} // namespace filigree
