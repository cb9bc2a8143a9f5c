#include "filigree/sample/sample_inside.h"

#include "filigree/core/parallel_for.h"
#include "filigree/core/random.h"
#include "filigree/mesh/triangulate.h"
#include "filigree/mesh/weld.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <unordered_map>

namespace filigree {

namespace {

double now_seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Closure closure_of(std::span<const Triangle> triangles, std::span<const Vec3f> positions) {
    struct Edge {
        Index low, high;
        int direction;
    };
    std::vector<Edge> edges;
    edges.reserve(3 * triangles.size());
    for (const Triangle& t : triangles)
        for (int k = 0; k < 3; ++k) {
            const Index a = t[k], b = t[(k + 1) % 3];
            edges.push_back(a < b ? Edge{a, b, 1} : Edge{b, a, -1});
        }
    std::sort(edges.begin(), edges.end(),
              [](const Edge& a, const Edge& b) { return a.low != b.low ? a.low < b.low : a.high < b.high; });
    Closure closure;
    for (std::size_t first = 0, last; first < edges.size(); first = last) {
        int net = 0;
        for (last = first;
             last < edges.size() && edges[last].low == edges[first].low && edges[last].high == edges[first].high;
             ++last)
            net += edges[last].direction;
        closure.unbalanced += net != 0;
        if ((last - first) % 2 == 0) continue;
        if (closure.open_edges++ == 0) closure.first_open = {positions[edges[first].low], positions[edges[first].high]};
    }
    return closure;
}

std::string place(const Vec3f& p, const Vec3d& origin) {
    const auto text = [](double x) {
        std::string digits = std::to_string(x); // six decimals; enough to find the place
        return digits;
    };
    return "(" + text(p.x() + origin.x()) + ", " + text(p.y() + origin.y()) + ", " + text(p.z() + origin.z()) + ")";
}

Error not_closed(const Closure& closure, const Vec3d& origin) {
    return {ErrorCode::unsuitable, "The mesh is open (" + std::to_string(closure.open_edges) +
                                       " open edges, the first from " + place(closure.first_open[0], origin) + " to " +
                                       place(closure.first_open[1], origin) +
                                       "), so crossings do not tell inside from outside; use the method winding."};
}

/// What to ask with, and what for.
Result<WeldedTriangles> prepare(const Mesh& mesh, InsideMethod& method) {
    WeldedTriangles welded = weld_triangles(mesh);
    if (welded.triangles.empty())
        return Error{ErrorCode::unsuitable, "The mesh has no faces with an area, so nothing is inside."};
    if (method == InsideMethod::automatic)
        method =
            welded.closure.is_closed() && welded.closure.is_oriented() ? InsideMethod::scan : InsideMethod::winding;
    if (method != InsideMethod::winding && !welded.closure.is_closed()) return not_closed(welded.closure, mesh.origin);
    return welded;
}

} // namespace

WeldedTriangles weld_triangles(const Mesh& mesh) {
    WeldedTriangles welded;
    const std::vector<Index> same = weld_map(mesh.positions);
    for (Triangle t : triangulate(mesh).triangles) {
        for (Index& v : t) v = same[v];
        if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) welded.triangles.push_back(t);
    }
    welded.closure = closure_of(welded.triangles, mesh.positions);
    return welded;
}

Result<Occupancy> sample_inside(const Mesh& mesh, const Lattice& lattice, const InsideOptions& options,
                                const RunContext& context, InsideReport* report) {
    const double start = now_seconds();
    InsideReport ignored;
    InsideReport& found = report ? *report : ignored;
    found = {};
    found.used = options.method;
    const Result<WeldedTriangles> welded = prepare(mesh, found.used);
    if (!welded) return welded.error();
    found.closure = welded->closure;
    const std::span<const Triangle> triangles = welded->triangles;
    found.setup_seconds = now_seconds() - start;

    Result<Occupancy> occupancy = Occupancy{};
    if (found.used == InsideMethod::scan) {
        occupancy = scan_inside({mesh.positions, triangles}, lattice, options.overlap, context, &found.scan,
                                options.most_bytes);
    } else if (found.used == InsideMethod::winding) {
        occupancy = winding_inside(mesh.positions, triangles, lattice, options.accuracy, context, &found.winding);
    } else {
        const Result<RayParity> rays =
            RayParity::create(mesh.positions, triangles, options.eye ? &*options.eye : nullptr, context);
        if (!rays) return rays.error();
        found.setup_seconds = now_seconds() - start;
        occupancy->counts = lattice.counts();
        occupancy->words_per_row = (lattice.counts()[0] + 63) / 64;
        const double bytes =
            8.0 * double(occupancy->words_per_row) * double(lattice.counts()[1]) * double(lattice.counts()[2]);
        if (bytes > double(options.most_bytes))
            return Error{ErrorCode::unsuitable, "The lattice needs " + std::to_string(std::llround(bytes / 1e6)) +
                                                    " MB for a bit a point; take a larger spacing."};
        occupancy->bits.assign(occupancy->words_per_row * lattice.counts()[1] * lattice.counts()[2], 0);
        std::vector<Vec3d> row(lattice.counts()[0] * lattice.counts()[1]);
        for (std::size_t k = 0; k < lattice.counts()[2]; ++k) {
            context.report("counting crossings", double(k) / double(lattice.counts()[2]));
            std::size_t at = 0;
            for (std::size_t j = 0; j < lattice.counts()[1]; ++j)
                for (std::size_t i = 0; i < lattice.counts()[0]; ++i) row[at++] = lattice.point(i, j, k);
            const Result<std::vector<std::uint8_t>> inside = rays->contains(row, context, &found.rays);
            if (!inside) return inside.error();
            at = 0;
            for (std::size_t j = 0; j < lattice.counts()[1]; ++j)
                for (std::size_t i = 0; i < lattice.counts()[0]; ++i)
                    if ((*inside)[at++])
                        occupancy->bits[(k * lattice.counts()[1] + j) * occupancy->words_per_row + (i >> 6)] |=
                            std::uint64_t{1} << (i & 63);
        }
    }
    found.seconds = now_seconds() - start - found.setup_seconds;
    return occupancy;
}

struct InsideTest::Content {
    InsideMethod used = InsideMethod::rays;
    std::optional<RayParity> rays;
    std::optional<WindingTree> winding;
};

InsideTest::InsideTest(std::unique_ptr<Content> content) : content_(std::move(content)) {}
InsideTest::InsideTest(InsideTest&&) noexcept = default;
InsideTest& InsideTest::operator=(InsideTest&&) noexcept = default;
InsideTest::~InsideTest() = default;

InsideMethod InsideTest::used() const { return content_->used; }

Result<InsideTest> InsideTest::create(const Mesh& mesh, const InsideOptions& options, const RunContext& context) {
    InsideMethod method = options.method;
    const Result<WeldedTriangles> welded = prepare(mesh, method);
    if (!welded) return welded.error();
    auto content = std::make_unique<Content>();
    content->used = method == InsideMethod::winding ? method : InsideMethod::rays;
    if (method == InsideMethod::winding) {
        content->winding.emplace(mesh.positions, welded->triangles, options.accuracy, context);
    } else {
        Result<RayParity> rays =
            RayParity::create(mesh.positions, welded->triangles, options.eye ? &*options.eye : nullptr, context);
        if (!rays) return rays.error();
        content->rays = std::move(rays).value();
    }
    return InsideTest(std::move(content));
}

bool InsideTest::contains(const Vec3d& point) const {
    return content_->rays ? content_->rays->contains(point) : content_->winding->winding(point) >= 0.5;
}

Result<std::vector<std::uint8_t>> InsideTest::contains(std::span<const Vec3d> points, const RunContext& context) const {
    if (content_->rays) return content_->rays->contains(points, context);
    const Result<std::vector<float>> windings = content_->winding->winding(points, context);
    if (!windings) return windings.error();
    std::vector<std::uint8_t> inside(points.size());
    for (std::size_t i = 0; i < inside.size(); ++i) inside[i] = (*windings)[i] >= 0.5f;
    return inside;
}

Result<double> spacing_for_count(const Mesh& mesh, std::size_t count, const InsideOptions& options,
                                 const RunContext& context) {
    const Box box = bounds(mesh.positions);
    const Vec3d size = box.size();
    double volume = (size.array() > 0).all() ? size.prod() : 0;
    if (count == 0 || !(volume > 0))
        return Error{ErrorCode::unsuitable, "The mesh has no volume, so no point is inside."};
    // A count tells the volume; the better the finer. Twice refined, the last at the wanted fineness.
    double spacing = std::cbrt(volume / 2e5);
    for (int round = 0; round < 4; ++round) {
        const Result<Lattice> lattice = make_lattice(box, {.spacing = spacing});
        if (!lattice) return lattice.error();
        const Result<Occupancy> occupancy = sample_inside(mesh, *lattice, options, context);
        if (!occupancy) return occupancy.error();
        const double inside = double(occupancy->count());
        if (inside == 0 && round == 3)
            return Error{ErrorCode::unsuitable, "No lattice point is inside, however fine; is the mesh a thin sheet?"};
        if (round > 0 && std::abs(inside / double(count) - 1) < 0.01) break;
        spacing = inside == 0 ? spacing / 2 : spacing * std::cbrt(inside / double(count));
    }
    return spacing;
}

Result<std::vector<Vec3d>> spread_inside(const Mesh& mesh, const Lattice& lattice, Pattern pattern,
                                         const InsideOptions& options, const RunContext& context,
                                         InsideReport* report) {
    const Result<Occupancy> occupancy = sample_inside(mesh, lattice, options, context, report);
    if (!occupancy) return occupancy.error();
    std::vector<Vec3d> points;
    for (const auto& [i, j, k] : points_inside(lattice, *occupancy).indices) points.push_back(lattice.point(i, j, k));
    if (pattern == Pattern::lattice) return points;

    const Result<InsideTest> test = InsideTest::create(mesh, options, context);
    if (!test) return test.error();
    const double h = lattice.spacing;
    if (pattern == Pattern::jitter) {
        constexpr int kTries = 8; // then the lattice point stays where it is, which is inside
        parallel_for(context, points.size(), 256, [&](std::size_t begin, std::size_t end) {
            for (std::size_t p = begin; p < end && !context.is_cancelled(); ++p)
                for (int attempt = 0; attempt < kTries; ++attempt) {
                    Vec3d moved = points[p];
                    for (int axis = 0; axis < 3; ++axis)
                        moved[axis] += h * (random_unit(context.seed, 3 * (p * kTries + attempt) + axis) - 0.5);
                    if (!test->contains(moved)) continue;
                    points[p] = moved;
                    break;
                }
        });
        if (context.is_cancelled()) return cancelled_error();
        return points;
    }

    // Darts in random order, eight for each cell of the lattice, each kept when nothing kept is too near.
    constexpr int kDarts = 8;
    struct Dart {
        double order;
        Vec3d place;
    };
    std::vector<Dart> darts;
    const auto counts = lattice.counts();
    std::vector<Vec3d> candidates;
    std::uint64_t number = 0;
    for (std::size_t k = 0; k < counts[2]; ++k)
        for (std::size_t j = 0; j < counts[1]; ++j)
            for (std::size_t i = 0; i < counts[0]; ++i) {
                // Only around points inside; cells that merely touch the surface add what their neighbours reach.
                if (!occupancy->contains(i, j, k)) continue;
                for (int d = 0; d < kDarts; ++d, ++number) {
                    Vec3d p = lattice.point(i, j, k);
                    for (int axis = 0; axis < 3; ++axis)
                        p[axis] += h * (random_unit(context.seed, 4 * number + axis) - 0.5) * 1.5;
                    candidates.push_back(p);
                }
            }
    const Result<std::vector<std::uint8_t>> inside = test->contains(candidates, context);
    if (!inside) return inside.error();
    for (std::size_t c = 0; c < candidates.size(); ++c)
        if ((*inside)[c]) darts.push_back({random_unit(context.seed + 1, c), candidates[c]});
    std::sort(darts.begin(), darts.end(), [](const Dart& a, const Dart& b) { return a.order < b.order; });

    const double least = 0.8 * h;
    const Vec3d corner(lattice.coordinates[0][0] - h, lattice.coordinates[1][0] - h, lattice.coordinates[2][0] - h);
    const auto cell_of = [&](const Vec3d& p) {
        std::array<std::int64_t, 3> cell;
        for (int axis = 0; axis < 3; ++axis) cell[axis] = static_cast<std::int64_t>((p[axis] - corner[axis]) / least);
        return cell;
    };
    const auto key = [](std::int64_t x, std::int64_t y, std::int64_t z) {
        return static_cast<std::uint64_t>(x) | static_cast<std::uint64_t>(y) << 21 |
               static_cast<std::uint64_t>(z) << 42;
    };
    std::unordered_map<std::uint64_t, std::vector<Index>> grid;
    points.clear();
    for (const Dart& dart : darts) {
        const auto [x, y, z] = cell_of(dart.place);
        bool is_free = true;
        for (std::int64_t n = 0; n < 27 && is_free; ++n) {
            const auto near = grid.find(key(x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1));
            if (near == grid.end()) continue;
            for (Index other : near->second)
                if ((points[other] - dart.place).squaredNorm() < least * least) is_free = false;
        }
        if (!is_free) continue;
        grid[key(x, y, z)].push_back(static_cast<Index>(points.size()));
        points.push_back(dart.place);
    }
    return points;
}

Result<std::vector<Vec3d>> frustum_points(const Frustum& frustum) {
    const double count = double(frustum.counts[0]) * double(frustum.counts[1]) * double(frustum.counts[2]);
    const Vec3d forward = frustum.target - frustum.eye;
    const Vec3d across = forward.cross(frustum.up);
    if (!(forward.norm() > 0) || !(across.norm() > 0) || !(0 < frustum.near && frustum.near < frustum.far) ||
        !(frustum.field_of_view_deg > 0 && frustum.field_of_view_deg < 170) || !(frustum.aspect > 0) || !(count >= 1))
        return Error{ErrorCode::usage,
                     "The frustum has no extent: eye and target have to differ, up must not point along "
                     "the view, and 0 < near < far."};
    if (count > double(1 << 28))
        return Error{ErrorCode::usage, "The frustum has more than 2^28 points; take fewer along its sides."};
    const Vec3d back = -forward.normalized(), right = across.normalized(), up = back.cross(right);
    const double half = std::tan(frustum.field_of_view_deg * std::numbers::pi / 360);
    const auto step = [](std::size_t i, std::size_t n) { return (2.0 * double(i) + 1) / double(n) - 1; };
    std::vector<Vec3d> points;
    points.reserve(static_cast<std::size_t>(count));
    for (std::size_t k = 0; k < frustum.counts[2]; ++k) {
        const double depth =
            frustum.near + (frustum.far - frustum.near) * (double(k) + 0.5) / double(frustum.counts[2]);
        for (std::size_t j = 0; j < frustum.counts[1]; ++j)
            for (std::size_t i = 0; i < frustum.counts[0]; ++i)
                points.push_back(
                    frustum.eye - depth * back +
                    depth * half *
                        (frustum.aspect * step(i, frustum.counts[0]) * right + step(j, frustum.counts[1]) * up));
    }
    return points;
}

} // namespace filigree
