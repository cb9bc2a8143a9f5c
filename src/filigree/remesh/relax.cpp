#include "filigree/remesh/relax.h"

#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/remesh/quad_quality.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace filigree {

namespace {

constexpr std::size_t kRelaxGrain = 512;
constexpr double kGoodEnough = 0.5;     // scaled Jacobian: a move that leaves quads above this is always welcome
constexpr double kOverRelaxation = 1.5; // of the way to the mean: half the sweeps do
constexpr double kStill = 2e-3;         // of the mean edge length at a vertex: shorter moves are not worth their price
constexpr int kShapeRounds = 6;         // for quads that are poor; the rest for those about to turn over
constexpr int kOnRounds = 24, kOffRounds = 96; // of untangling; nearly all end after a few
constexpr int kTutteRings = 4, kTutteSweeps = 30, kTutteSearches = 6;
constexpr int kReleaseRings = 2;         // around a quad that stays inverted: tips there may move
constexpr std::size_t kMostEvened = 200; // quads whose neighbourhoods are, for each size; more are not worth the time
constexpr std::array<double, 4> kReaches = {0.5, 0.2, 1.0, 0.07}; // mean edge lengths at the vertex
constexpr double kInverted = 1e-9;                                // scaled Jacobian of quads that are not above zero
constexpr double kHopeless = 0.002;  // of all quads inverted at the start: another base will do better, and sooner
constexpr double kOffSurface = 0.02; // scaled Jacobian that points leave the surface for, when nothing else helps

/// As a file will have it: what is judged is what is written. Through memory, as GCC 12 vectorises a cast to float and
/// back into nothing at all.
double rounded(double x) {
    volatile float stored = static_cast<float>(x);
    return stored;
}
Vec3d rounded(const Vec3d& p) { return {rounded(p.x()), rounded(p.y()), rounded(p.z())}; }

/// The scaled Jacobian at each corner of a quad, as in quad_quality.h.
std::array<double, 4> corner_jacobians(const std::array<Vec3d, 4>& p) {
    const Vec3d normal = (p[2] - p[0]).cross(p[3] - p[1]);
    const double size = normal.norm();
    std::array<Vec3d, 4> edges;
    std::array<double, 4> lengths, jacobians;
    for (int k = 0; k < 4; ++k) {
        edges[k] = p[(k + 1) % 4] - p[k];
        lengths[k] = edges[k].norm();
    }
    for (int k = 0; k < 4; ++k) {
        const double scale = size * lengths[k] * lengths[(k + 3) % 4];
        jacobians[k] = scale > 0 ? edges[(k + 3) % 4].cross(edges[k]).dot(normal) / scale : -1;
    }
    return jacobians;
}

/// Which quads each vertex has, and groups of vertices that share none.
struct Neighbourhoods {
    std::vector<std::array<Index, 4>> quads;
    IndexLists around; ///< the quads at each vertex
    std::vector<std::vector<Index>> groups;

    explicit Neighbourhoods(const PatchGrid& grid) : quads(grid.quads()) {
        around = make_lists<Index>(grid.positions.size(), [&](const auto& add) {
            for (Index q = 0; q < quads.size(); ++q)
                for (const Index v : quads[q]) add(v, q);
        });
        color();
    }

    void color() {
        std::vector<std::uint8_t> colors(around.size(), 255);
        for (Index v = 0; v < around.size(); ++v) {
            std::array<bool, 256> used = {};
            for (const Index q : around[v])
                for (const Index w : quads[q]) used[colors[w]] = true;
            std::uint8_t color = 0;
            while (used[color]) ++color;
            colors[v] = color;
            if (groups.size() <= color) groups.resize(color + 1u);
            groups[color].push_back(v);
        }
    }
};

/// One vertex and its quads, with the vertex tried elsewhere.
class Mover {
public:
    Mover(PatchGrid& grid, const SurfaceWalk& walk, const Neighbourhoods& near)
        : grid_(grid), walk_(walk), near_(near) {}

    void relax_vertex(Index v) {
        if (stays(v)) return;
        const Vec3d here = grid_.positions[v];
        double edge = 0;
        const Vec3d target = mean_target(v, edge);
        if ((target - here).squaredNorm() < kStill * kStill * edge * edge) return;
        for (const double share : {kOverRelaxation, 0.7}) {
            const SurfaceWalk::Place place = move(v, here + share * (target - here));
            if ((place.position - here).squaredNorm() < kStill * kStill * edge * edge) return;
            const double after = worst(v, place.position);
            if ((after < kGoodEnough && after < worst(v, here)) || is_turned(v, place.position)) continue;
            accept(v, place);
            return;
        }
    }

    /// From here on tips move as far as they may from where they are now.
    void loosen_tips() { anchors_ = grid_.positions; }

    /// Tries places around the vertex for better quads. Returns whether it moved.
    bool search(Index v, double reach, bool off_surface, int round) {
        if (stays(v)) return false;
        const Vec3d here = grid_.positions[v];
        double edge = 0;
        const Vec3d target = mean_target(v, edge);
        double best = badness(v, here);
        const bool was_good = worst(v, here) > 0; // then no quad may be folded over to look better
        SurfaceWalk::Place found;
        bool moved = false;
        const auto attempt = [&](const Vec3d& towards) {
            SurfaceWalk::Place place =
                off_surface ? SurfaceWalk::Place{grid_.source[v], rounded(towards)} : move(v, towards);
            if (off_surface) place.point = walk_.walk(grid_.source[v], towards).point;
            const double value = badness(v, place.position);
            if (value >= best - 1e-9 || !is_on_leash(v, place.position) || (was_good && is_turned(v, place.position)))
                return;
            best = value;
            found = place;
            moved = true;
        };
        const Vec3d normal = quad_normal(v);
        const Vec3d x = normal.unitOrthogonal(), y = normal.cross(x);
        attempt(target);
        attempt(here + 0.5 * (target - here));
        constexpr int kDirections = 12;
        for (const double step : {reach, 0.5 * reach, 0.2 * reach})
            for (int i = 0; i < kDirections; ++i) {
                const double angle = 2 * std::numbers::pi * (i + 0.382 * round) / kDirections;
                attempt(here + step * edge * (math::cos(angle) * x + math::sin(angle) * y));
            }
        if (off_surface)
            for (const double step : {reach, 0.5 * reach, 0.2 * reach})
                for (const double sign : {-1.0, 1.0}) {
                    attempt(here + sign * step * edge * normal);
                    const double angle = 2.4 * round; // the golden angle: every round looks elsewhere
                    attempt(here +
                            sign * step * edge * (normal + math::cos(angle) * x + math::sin(angle) * y).normalized());
                }
        if (moved) accept(v, found);
        return moved;
    }

    /// Puts the vertex between its neighbours, whatever that does to its quads.
    void centre(Index v) {
        if (grid_.kinds[v] != VertexKind::inside || grid_.held[v] > 0) return;
        Vec3d sum = Vec3d::Zero();
        for (const Index q : near_.around[v]) {
            const auto& quad = near_.quads[q];
            const int k = quad[0] == v ? 0 : quad[1] == v ? 1 : quad[2] == v ? 2 : 3;
            sum += 0.5 * (grid_.positions[quad[(k + 1) % 4]] + grid_.positions[quad[(k + 3) % 4]]);
        }
        accept(v, move(v, sum / double(near_.around[v].size())));
    }

    double worst(Index v, const Vec3d& place) const {
        double least = 1;
        for (const Index q : near_.around[v])
            for (const double jacobian : corner_jacobians(corners(near_.quads[q], v, place)))
                least = std::min(least, jacobian);
        return least;
    }

    /// What the quads at the vertex lack, the worst by far the most. A sum, so that the whole mesh's can only fall, and
    /// so that a quad with several things wrong can be mended one at a time.
    double badness(Index v, const Vec3d& place) const {
        double sum = 0;
        for (const Index q : near_.around[v]) {
            for (const double jacobian : corner_jacobians(corners(near_.quads[q], v, place))) {
                const double lack = std::max(0.0, kGoodEnough - jacobian);
                sum += lack * lack * lack * lack;
            }
        }
        return sum;
    }

private:
    bool stays(Index v) const {
        return grid_.kinds[v] == VertexKind::corner || (grid_.held[v] > 0 && anchors_.empty());
    }

    /// Whether the vertex is at no tip, or near enough to its own.
    bool is_on_leash(Index v, const Vec3d& place) const {
        return !(grid_.held[v] > 0) || (place - anchors_[v]).norm() <= grid_.held[v];
    }

    /// The quad's corners, with v put at `place`.
    std::array<Vec3d, 4> corners(const std::array<Index, 4>& quad, Index v, const Vec3d& place) const {
        std::array<Vec3d, 4> points;
        for (int k = 0; k < 4; ++k) points[k] = quad[k] == v ? place : grid_.positions[quad[k]];
        return points;
    }

    SurfaceWalk::Place move(Index v, const Vec3d& target) const {
        SurfaceWalk::Place place = grid_.kinds[v] == VertexKind::curve ? walk_.slide(grid_.source[v], target)
                                                                       : walk_.walk(grid_.source[v], target);
        place.position = rounded(place.position);
        return place;
    }

    void accept(Index v, const SurfaceWalk::Place& place) {
        grid_.positions[v] = place.position;
        grid_.source[v] = place.point;
    }

    /// Where the neighbours would have it; on a curve, between the two along it.
    Vec3d mean_target(Index v, double& edge) const {
        const Vec3d& here = grid_.positions[v];
        if (grid_.kinds[v] == VertexKind::curve && grid_.along[v][1] != kNoIndex) {
            const Vec3d &a = grid_.positions[grid_.along[v][0]], &b = grid_.positions[grid_.along[v][1]];
            edge = 0.5 * ((a - here).norm() + (b - here).norm());
            return 0.5 * (a + b);
        }
        Vec3d sum = Vec3d::Zero();
        double areas = 0;
        edge = 0;
        const std::span<const Index> around = near_.around[v];
        for (const Index q : around) {
            const auto& quad = near_.quads[q];
            const int k = quad[0] == v ? 0 : quad[1] == v ? 1 : quad[2] == v ? 2 : 3;
            const Vec3d &next = grid_.positions[quad[(k + 1) % 4]], &across = grid_.positions[quad[(k + 2) % 4]],
                        &before = grid_.positions[quad[(k + 3) % 4]];
            const double area = (across - here).cross(before - next).norm();
            sum += area * 0.5 * (next + before);
            areas += area;
            edge += (next - here).norm();
        }
        edge /= double(around.size());
        return areas > 0 ? Vec3d(sum / areas) : here;
    }

    Vec3d quad_normal(Index v) const {
        Vec3d sum = Vec3d::Zero();
        for (const Index q : near_.around[v]) sum += normal_of(near_.quads[q], kNoIndex, Vec3d::Zero());
        const double length = sum.norm();
        return length > 0 ? Vec3d(sum / length) : Vec3d::UnitZ();
    }

    Vec3d normal_of(const std::array<Index, 4>& quad, Index v, const Vec3d& place) const {
        const auto at = [&](int k) -> const Vec3d& { return quad[k] == v ? place : grid_.positions[quad[k]]; };
        return (at(2) - at(0)).cross(at(3) - at(1));
    }

    /// Whether one of the quads would face the other way.
    bool is_turned(Index v, const Vec3d& place) const {
        for (const Index q : near_.around[v])
            if (normal_of(near_.quads[q], v, place).dot(normal_of(near_.quads[q], kNoIndex, place)) < 0) return true;
        return false;
    }

    PatchGrid& grid_;
    const SurfaceWalk& walk_;
    const Neighbourhoods& near_;
    std::vector<Vec3d> anchors_; ///< of every vertex once tips are loose
};

/// Mends quads that are poor or turned over, in three ways, each for what the one before has left.
class Untangler {
public:
    Untangler(PatchGrid& grid, const SurfaceWalk& walk, const RunContext& context)
        : grid_(grid), near_(grid), mover_(grid, walk, near_), context_(context) {}

    std::vector<Index> quads_below(double limit) const {
        std::vector<std::uint8_t> is_bad(near_.quads.size(), 0);
        parallel_for(context_, near_.quads.size(), kRelaxGrain, [&](std::size_t begin, std::size_t end) {
            if (context_.is_cancelled()) return;
            for (std::size_t q = begin; q < end; ++q) is_bad[q] = jacobian(static_cast<Index>(q)) < limit;
        });
        std::vector<Index> bad;
        for (Index q = 0; q < is_bad.size(); ++q)
            if (is_bad[q]) bad.push_back(q);
        return bad;
    }

    /// Single vertices, over the surface.
    void search_on_surface(double least) {
        for (int round = 0; round < kOnRounds && !context_.is_cancelled(); ++round) {
            context_.report("untangling", double(round) / kOnRounds);
            const std::vector<Index> bad = quads_below(round < kShapeRounds ? least : 0.5 * least);
            if (bad.empty()) break;
            bool moved = false;
            const std::vector<Index> vertices = vertices_near(bad, round % 4 == 3 ? 2 : round % 2);
            for (const Index v : vertices) {
                if (context_.is_cancelled()) return;
                moved |= mover_.search(v, round % 3 == 0 ? 0.6 : 0.25, false, round);
            }
            if (!moved && round % 4 == 3) break;
        }
    }

    /// What single moves cannot undo: whole neighbourhoods evened out, as in a Tutte embedding, where that helps.
    void even_out_neighbourhoods() {
        for (int rings = 1; rings <= kTutteRings; ++rings) {
            const std::vector<Index> bad = quads_below(kOffSurface);
            for (const Index q : std::span(bad).first(std::min(bad.size(), kMostEvened))) {
                if (context_.is_cancelled()) return;
                even_out(vertices_near({q}, rings));
            }
        }
    }

    void loosen_tips() { mover_.loosen_tips(); }

    /// Lets go of the tips near quads that are turned over. Returns whether there were any.
    bool release_tips() {
        bool released = false;
        for (const Index v : vertices_near(quads_below(kInverted), kReleaseRings))
            released |= std::exchange(grid_.held[v], 0.0f) > 0;
        return released;
    }

    /// Single vertices, off the surface where nothing else helps. Returns how many moved.
    std::size_t search_off_surface() {
        std::vector<std::uint8_t> off(grid_.positions.size(), 0);
        for (int round = 0; round < kOffRounds && !context_.is_cancelled(); ++round) {
            const std::vector<Index> bad = quads_below(kOffSurface);
            if (bad.empty()) break;
            for (const Index v : vertices_near(bad, round / 12))
                if (!context_.is_cancelled() && mover_.search(v, kReaches[round % 4], true, round)) off[v] = 1;
        }
        return static_cast<std::size_t>(std::count(off.begin(), off.end(), 1));
    }

private:
    double jacobian(Index q) const {
        const auto& [a, b, c, d] = near_.quads[q];
        return scaled_jacobian(grid_.positions[a], grid_.positions[b], grid_.positions[c], grid_.positions[d]);
    }

    /// The vertices of the quads, and of `rings` rings of quads around them, ascending.
    std::vector<Index> vertices_near(const std::vector<Index>& bad, int rings) const {
        std::vector<Index> vertices;
        for (const Index q : bad) vertices.insert(vertices.end(), near_.quads[q].begin(), near_.quads[q].end());
        const auto sort_once_each = [&] {
            std::sort(vertices.begin(), vertices.end());
            vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
        };
        sort_once_each();
        for (int ring = 0; ring < rings; ++ring) {
            for (std::size_t i = 0, end = vertices.size(); i < end; ++i)
                for (const Index q : near_.around[vertices[i]])
                    vertices.insert(vertices.end(), near_.quads[q].begin(), near_.quads[q].end());
            sort_once_each();
        }
        return vertices;
    }

    double badness(std::span<const Index> vertices) const {
        double sum = 0;
        for (const Index v : vertices) sum += mover_.badness(v, grid_.positions[v]);
        return sum;
    }

    /// Puts everything back where it does not help.
    void even_out(const std::vector<Index>& vertices) {
        std::vector<SurfaceWalk::Place> before;
        for (const Index v : vertices) before.push_back({grid_.source[v], grid_.positions[v]});
        const double bad_before = badness(vertices);
        for (int sweep = 0; sweep < kTutteSweeps; ++sweep)
            for (const Index v : vertices) mover_.centre(v);
        for (int round = 0; round < kTutteSearches; ++round)
            for (const Index v : vertices) mover_.search(v, 0.25, false, round);
        if (badness(vertices) < bad_before) return;
        for (std::size_t i = 0; i < vertices.size(); ++i) {
            grid_.source[vertices[i]] = before[i].point;
            grid_.positions[vertices[i]] = before[i].position;
        }
    }

    PatchGrid& grid_;
    const Neighbourhoods near_;
    Mover mover_;
    const RunContext& context_;
};

} // namespace

bool is_hopeless(const PatchGrid& grid) {
    const std::vector<std::array<Index, 4>> quads = grid.quads();
    const auto inverted = std::ranges::count_if(quads, [&](const std::array<Index, 4>& quad) {
        const auto& [a, b, c, d] = quad;
        return scaled_jacobian(grid.positions[a], grid.positions[b], grid.positions[c], grid.positions[d]) < kInverted;
    });
    return double(inverted) > kHopeless * double(quads.size()) + 8;
}

void relax(PatchGrid& grid, const SurfaceWalk& walk, unsigned sweeps, const RunContext& context) {
    const Neighbourhoods near(grid);
    for (Vec3d& p : grid.positions) p = rounded(p);
    for (unsigned sweep = 0; sweep < sweeps && !context.is_cancelled(); ++sweep) {
        context.report("relaxing", double(sweep) / sweeps);
        for (const std::vector<Index>& group : near.groups)
            parallel_for(context, group.size(), kRelaxGrain, [&](std::size_t begin, std::size_t end) {
                if (context.is_cancelled()) return;
                Mover mover(grid, walk, near);
                for (std::size_t i = begin; i < end; ++i) mover.relax_vertex(group[i]);
            });
    }
}

Untangled untangle(PatchGrid& grid, const SurfaceWalk& walk, double least, const RunContext& context) {
    Untangler untangler(grid, walk, context);
    Untangled result;
    result.inverted = untangler.quads_below(kInverted).size();
    if (is_hopeless(grid)) return result;
    const auto mend_on_surface = [&] {
        untangler.search_on_surface(least);
        untangler.even_out_neighbourhoods();
    };
    mend_on_surface();
    if (std::ranges::any_of(grid.held, [](float leash) { return leash > 0; })) {
        untangler.loosen_tips();
        mend_on_surface();
        result.off_surface = untangler.search_off_surface();
        if (untangler.release_tips()) mend_on_surface();
    }
    result.off_surface += untangler.search_off_surface();
    result.inverted = untangler.quads_below(kInverted).size();
    return result;
}

} // namespace filigree
