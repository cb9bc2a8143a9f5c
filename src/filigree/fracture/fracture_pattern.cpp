#include "filigree/fracture.h"

#include "filigree/core/dense_solve.h"
#include "filigree/core/math.h"
#include "filigree/core/random.h"
#include "filigree/fracture/cell_clumps.h"
#include "filigree/fracture/crack_warp.h"
#include "filigree/mesh.h"
#include "filigree/sample.h"
#include "filigree/sample/closure.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace filigree {

namespace {

constexpr std::size_t kPointsOfPiece = 100, kFewestPoints = 4'000, kMostPoints = 1'000'000;
constexpr double kMostUnbalanced = 0.25; ///< edges a triangle
constexpr int kLloydRounds = 3;
constexpr double kWavelength = 0.8;                          ///< of the coarsest bumps, beside a piece's size
constexpr double kGrainWavelength = 2.5, kGrainContrast = 2; ///< of grains' density e^(contrast noise), in cells' sizes
constexpr int kGrainRounds = 1;                              ///< of Lloyd's method: more would make them alike

/// Points of the matter that breaks, and how much of it there is.
struct Matter {
    std::vector<Vec3d> points;
    double piece_size = 0; ///< of one cell, across
    double spacing = 0;    ///< of the points, about
};

/// Points of the surface, by area.
std::vector<Vec3d> points_on_surface(const Mesh& mesh, std::span<const Triangle> triangles, std::size_t count,
                                     std::uint64_t seed, double& area) {
    std::vector<double> until; // sum of areas
    area = 0;
    const auto at = [&](const Triangle& t, std::size_t k) { return mesh.positions[t[k]].cast<double>().eval(); };
    for (const Triangle& t : triangles)
        until.push_back(area += 0.5 * (at(t, 1) - at(t, 0)).cross(at(t, 2) - at(t, 0)).norm());
    std::vector<Vec3d> points;
    for (std::size_t k = 0; k < count; ++k) {
        const double where = random_unit(seed, 3 * k) * area;
        const auto found = std::min(std::upper_bound(until.begin(), until.end(), where), until.end() - 1);
        const Triangle& t = triangles[static_cast<std::size_t>(found - until.begin())];
        double u = random_unit(seed, 3 * k + 1), v = random_unit(seed, 3 * k + 2);
        if (u + v > 1) {
            u = 1 - u;
            v = 1 - v;
        }
        points.push_back(at(t, 0) + u * (at(t, 1) - at(t, 0)) + v * (at(t, 2) - at(t, 0)));
    }
    return points;
}

Result<Matter> matter_of(const Mesh& mesh, Index pieces, const RunContext& context) {
    const std::size_t count = std::clamp(kPointsOfPiece * pieces, kFewestPoints, kMostPoints);
    Matter matter;
    const Result<WeldedTriangles> welded = weld_triangles(mesh, context);
    if (!welded) return welded.error();
    // Winding numbers of a tangle tell no inside, and looking for one takes minutes.
    const bool is_tangle = double(welded->closure.unbalanced) > kMostUnbalanced * double(welded->triangles.size());
    const Result<double> spacing =
        is_tangle ? Result<double>(Error{ErrorCode::unsuitable, ""}) : spacing_for_count(mesh, count, {}, context);
    if (spacing) {
        const Result<Lattice> lattice = make_lattice(bounds(mesh), {.spacing = *spacing});
        Result<std::vector<Vec3d>> inside = lattice ? spread_inside(mesh, *lattice, Pattern::jitter, {}, context)
                                                    : Result<std::vector<Vec3d>>(lattice.error());
        if (inside && inside->size() >= pieces) {
            matter.points = std::move(*inside);
            matter.piece_size = *spacing * math::cbrt(double(matter.points.size()) / pieces);
            matter.spacing = *spacing;
            return matter;
        }
    }
    if (context.is_cancelled()) return cancelled_error();
    const Result<Triangulation> surface = triangulate(mesh, context);
    if (!surface) return surface.error();
    double area = 0;
    matter.points = points_on_surface(mesh, surface->triangles, count, context.seed, area);
    matter.piece_size = std::sqrt(area / pieces);
    matter.spacing = 2 * std::sqrt(area / double(count)); // they are not evenly spread
    return matter;
}

/// Principal axes of points: columns, the longest last.
Mat3d principal_axes(std::span<const Vec3d> points) {
    Vec3d mean = Vec3d::Zero();
    for (const Vec3d& p : points) mean += p;
    mean /= double(points.size());
    Mat3d spread = Mat3d::Zero();
    for (const Vec3d& p : points) spread += (p - mean) * (p - mean).transpose();
    return symmetric_eigen(spread).vectors;
}

/// `count` of the points, those with large weights first and the rest by chance [Efraimidis 2006].
std::vector<Vec3d> draw(std::span<const Vec3d> points, std::span<const double> weights, Index count,
                        std::uint64_t seed) {
    std::vector<std::pair<double, Index>> keys(points.size());
    for (Index k = 0; k < points.size(); ++k)
        keys[k] = {math::log(1 - random_unit(seed, k)) / (weights.empty() ? 1 : weights[k]), k};
    const std::size_t drawn = std::min<std::size_t>(count, keys.size());
    std::partial_sort(keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(drawn), keys.end(), std::greater<>());
    std::vector<Vec3d> seeds;
    for (std::size_t k = 0; k < drawn; ++k) seeds.push_back(points[keys[k].second]);
    return seeds;
}

/// Moves each seed to the middle of its points, or, where that is another's or outside, to the point nearest to it.
Status even_out(const Matter& matter, const CrackWarpOptions& warp, int rounds, std::vector<Vec3d>& seeds,
                const RunContext& context) {
    for (int round = 0; round < rounds; ++round) {
        const Result<FractureCells> cells = FractureCells::create(seeds, {}, warp, context);
        if (!cells) return cells.error();
        std::vector<Index> cell(matter.points.size());
        std::vector<Vec3d> sum(seeds.size(), Vec3d::Zero());
        std::vector<std::size_t> count(seeds.size(), 0);
        Index near = kNoIndex;
        for (std::size_t k = 0; k < cell.size(); ++k) {
            cell[k] = near = cells->cell_at(matter.points[k], near);
            sum[near] += matter.points[k];
            ++count[near];
        }
        std::vector<double> least(seeds.size(), std::numeric_limits<double>::infinity());
        std::vector<Vec3d> next = seeds;
        for (std::size_t k = 0; k < cell.size(); ++k) {
            const double d = (matter.points[k] - sum[cell[k]] / double(count[cell[k]])).squaredNorm();
            if (d >= least[cell[k]]) continue;
            least[cell[k]] = d;
            next[cell[k]] = matter.points[k];
        }
        seeds = std::move(next);
    }
    return Success{};
}

/// Rings of seeds around a point, denser towards it, on rays that go on from ring to ring.
std::vector<Vec3d> rings(const Vec3d& centre, const Vec3d& x, const Vec3d& y, double reach, Index count,
                         std::uint64_t seed) {
    const Index rays = std::max<Index>(3, static_cast<Index>(std::lround(1.6 * std::sqrt(double(count)))));
    const Index circles = std::max<Index>(1, count / rays);
    std::vector<Vec3d> seeds;
    for (Index c = 0; c < circles; ++c)
        for (Index r = 0; r < rays; ++r) {
            const auto jitter = [&](std::uint64_t which) {
                return random_unit(seed, 2 * (c * rays + r) + which) - 0.5;
            };
            const double radius = reach * math::pow((c + 0.5 + 0.4 * jitter(0)) / circles, 1.6);
            const double angle = 2 * std::numbers::pi * (r + 0.35 * random_unit(seed + 1, r) + 0.25 * jitter(1)) / rays;
            seeds.push_back(centre + radius * (math::cos(angle) * x + math::sin(angle) * y));
        }
    return seeds;
}

Result<std::vector<Vec3d>> radial_seeds(const Matter& matter, const FracturePattern& pattern, Index wanted_cells,
                                        CrackWarpOptions warp, const RunContext& context) {
    const Mat3d axes = principal_axes(matter.points); // rays leave across the thinnest
    Vec3d mean = Vec3d::Zero();
    for (const Vec3d& p : matter.points) mean += p / double(matter.points.size());
    const Vec3d centre = pattern.at.empty() ? mean : pattern.at[0];
    double reach = 0;
    for (const Vec3d& p : matter.points) {
        const Vec3d off = p - centre;
        reach = std::max(reach, math::hypot(off.dot(axes.col(1)), off.dot(axes.col(2))));
    }
    std::vector<Vec3d> seeds;
    warp.roughness = 0;
    // Rings reach beyond the matter in places: as many seeds as it takes to have the pieces asked for.
    constexpr int kMostTries = 8;
    double wanted = wanted_cells;
    for (int attempt = 0; attempt < kMostTries; ++attempt) {
        seeds = rings(centre, axes.col(1), axes.col(2), reach, static_cast<Index>(wanted), context.seed);
        const Result<FractureCells> cells = FractureCells::create(seeds, {}, warp, context);
        if (!cells) return cells.error();
        std::vector<bool> holds(seeds.size(), false);
        Index near = kNoIndex;
        for (const Vec3d& p : matter.points) holds[near = cells->cell_at(p, near)] = true;
        const auto held = double(std::count(holds.begin(), holds.end(), true));
        if (held >= wanted_cells || wanted >= FractureCells::kMostSeeds) break;
        wanted = std::min<double>(FractureCells::kMostSeeds, std::max(wanted + 1, wanted * wanted_cells / held));
    }
    return seeds;
}

/// How many grains there are by volume, a point.
std::vector<double> grain_density(const Matter& matter, std::uint64_t seed) {
    std::vector<double> density;
    const double wavelength = kGrainWavelength * matter.piece_size;
    for (const Vec3d& p : matter.points)
        density.push_back(math::exp(kGrainContrast * value_noise(p / wavelength, seed, nullptr)[0]));
    return density;
}

} // namespace

Result<FractureCells> make_fracture_cells(const Mesh& mesh, const FracturePattern& pattern, const RunContext& context) {
    if (std::optional<Error> error = mesh_error(mesh)) return *error;
    if (mesh.face_count() == 0)
        return Error{ErrorCode::unsuitable, "The mesh has no faces: there is nothing to break."};
    if (pattern.pieces < 1 || pattern.pieces > FractureCells::kMostSeeds)
        return Error{ErrorCode::usage, "A fracture has 1 to 100,000 pieces."};
    if (pattern.clump < 1 || pattern.clump > FracturePattern::kMostClump)
        return Error{ErrorCode::usage, "A piece is made of 1 to 100 cells."};
    if (pattern.pieces > FractureCells::kMostSeeds / pattern.clump)
        return Error{ErrorCode::usage, "Pieces times cells a piece are more than 100,000; ask for fewer of either."};
    const Index count = pattern.pieces * pattern.clump; // of cells
    if (!(pattern.roughness >= 0 && pattern.roughness <= 1))
        return Error{ErrorCode::usage, "The roughness of cracks is 0 to 1."};
    if (!(pattern.stretch >= 1 && pattern.stretch <= 100))
        return Error{ErrorCode::usage, "Slabs are 1 to 100 times longer."};
    for (const Vec3d& p : pattern.at)
        if (!p.allFinite()) return Error{ErrorCode::usage, "A point that was hit is not a finite point."};

    context.report("choosing where it breaks", 0);
    const Result<Matter> matter = matter_of(mesh, count, context);
    if (!matter) return matter.error();
    CrackWarpOptions warp{.box = bounds(mesh),
                          .roughness = pattern.roughness,
                          .wavelength = kWavelength * matter->piece_size,
                          .seed = context.seed};
    if (pattern.kind == FracturePatternKind::slabs) {
        warp.stretch = pattern.stretch;
        warp.grain = pattern.grain ? pattern.grain->normalized() : Vec3d(principal_axes(matter->points).col(2));
        if (!warp.grain.allFinite() || warp.grain.isZero())
            return Error{ErrorCode::usage, "The grain of slabs has no direction."};
        // Across the grain pieces are thinner than they are on average.
        warp.wavelength /= math::cbrt(pattern.stretch);
    }

    std::vector<Vec3d> seeds;
    if (pattern.kind == FracturePatternKind::radial) {
        Result<std::vector<Vec3d>> radial = radial_seeds(*matter, pattern, count, warp, context);
        if (!radial) return radial.error();
        seeds = std::move(*radial);
    } else if (pattern.kind == FracturePatternKind::impact) {
        std::vector<Vec3d> hits = pattern.at;
        if (hits.empty())
            hits.push_back(*std::max_element(matter->points.begin(), matter->points.end(),
                                             [](const Vec3d& a, const Vec3d& b) { return a.sum() < b.sum(); }));
        std::vector<double> weights;
        const double near = 0.05 * warp.box.diagonal();
        for (const Vec3d& p : matter->points) {
            double weight = 0;
            for (const Vec3d& hit : hits) weight += math::pow((p - hit).squaredNorm() / (near * near) + 1, -2);
            weights.push_back(weight);
        }
        seeds = draw(matter->points, weights, count, context.seed);
    } else {
        const bool grains = pattern.kind == FracturePatternKind::grains;
        seeds = draw(matter->points, grains ? grain_density(*matter, context.seed) : std::vector<double>(), count,
                     context.seed);
        CrackWarpOptions plane = warp;
        plane.roughness = 0;
        if (const Status done = even_out(*matter, plane, grains ? kGrainRounds : kLloydRounds, seeds, context); !done)
            return done.error();
    }
    Result<FractureCells> cells = FractureCells::create(seeds, {}, warp, context);
    if (!cells || pattern.clump == 1) return cells;
    if (Status merged =
            cells->merge(cell_clumps(matter->points, matter->spacing, *cells, pattern.pieces, context.seed));
        !merged)
        return merged.error();
    return cells;
}

} // namespace filigree
