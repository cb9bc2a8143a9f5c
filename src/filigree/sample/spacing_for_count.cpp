#include "filigree/sample.h"

#include "filigree/core/math.h"
#include "filigree/core/text.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

namespace filigree {

namespace {

constexpr int kRounds = 4;
constexpr double kFirstPoints = 2e5;    // of the first lattice
constexpr double kCloseEnough = 0.01;   // of the count: no more rounds
constexpr double kMostAlong = 60'000;   // points along an axis; a lattice takes 65,534
constexpr double kSearchedPoints = 1e6; // of a lattice: what lies in so few of them is hardly there,
constexpr double kHardlyInside = 1e-5;  // in this share of them,
constexpr double kMostSlowPoints = 2e6; // and not worth a lattice of more points by rays or winding

/// About how many lattice points a box of these sides holds. A side shorter than the spacing gets one layer.
double points_at(const Vec3d& size, double spacing) { return (size / spacing).cwiseMax(1.0).prod(); }

/// The inverse: the spacing for so many points.
double spacing_at(const Vec3d& size, double points) {
    Vec3d sides = size;
    std::sort(sides.begin(), sides.end(), std::greater<>());
    if (const double spacing = math::cbrt(size.prod() / points); spacing <= sides[2]) return spacing;
    if (const double spacing = std::sqrt(sides[0] * sides[1] / points); spacing <= sides[1]) return spacing;
    return sides[0] / points;
}

Error hardly_inside(std::size_t inside, const Lattice& lattice) {
    return {ErrorCode::unsuitable, "Of " + with_commas(static_cast<std::uint64_t>(lattice.point_count())) +
                                       " lattice points, " + std::to_string(inside) +
                                       " are inside: the mesh is a thin sheet, or too open to have an inside. Close "
                                       "it, or give a spacing instead of a count."};
}

} // namespace

Result<double> spacing_for_count(const Mesh& mesh, std::size_t count, const InsideOptions& options,
                                 const RunContext& context) {
    if (std::optional<Error> error = mesh_error(mesh)) return *error;
    const Box box = bounds(mesh);
    const Vec3d size = box.size();
    if (count == 0 || !((size.array() > 0).all() && size.prod() > 0))
        return Error{ErrorCode::unsuitable, "The mesh has no volume, so no point is inside."};
    const Result<InsideSampler> sampler = InsideSampler::create(mesh, options, context);
    if (!sampler) return sampler.error();
    const bool is_fast = sampler->used() == InsideMethod::scan;
    const double largest = size.maxCoeff(), finest = largest / kMostAlong;

    // A count tells the volume, the better the finer the lattice; the last is as fine as wanted.
    double spacing = std::max(spacing_at(size, kFirstPoints), finest);
    for (int round = 0; round < kRounds; ++round) {
        const Result<Lattice> lattice = make_lattice(box, {.spacing = spacing});
        if (!lattice) return lattice.error();
        const Result<Occupancy> occupancy = sampler->inside(*lattice, context);
        if (!occupancy) return occupancy.error();
        const std::size_t found = occupancy->count();
        const double inside = double(found), points = lattice->point_count();
        if (round > 0 && std::abs(inside / double(count) - 1) < kCloseEnough) break;
        const bool is_hardly_inside = inside <= kHardlyInside * points;
        if (is_hardly_inside && (round == kRounds - 1 || (!is_fast && points > kSearchedPoints))) {
            const bool is_worth_it = inside > 0 && (is_fast || points / inside * double(count) <= kMostSlowPoints);
            if (!is_worth_it) return hardly_inside(found, *lattice);
        }
        if (inside == 0 || (is_hardly_inside && !is_fast && points <= kSearchedPoints))
            spacing /= 2;
        else if (const double next = spacing * math::cbrt(inside / double(count));
                 std::max(spacing, next) <= size.minCoeff())
            spacing = next;
        else
            spacing = spacing_at(size, points_at(size, spacing) * double(count) / inside);
        spacing = std::min(spacing, largest);
        if (spacing < finest)
            return Error{ErrorCode::unsuitable, with_commas(count) + " points inside take more than " +
                                                    with_commas(static_cast<std::uint64_t>(kMostAlong)) +
                                                    " along a side; ask for fewer."};
    }
    return spacing;
}

} // namespace filigree
