#include "filigree/sample.h"
#include "filigree/sample/lattice_memory.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <string>

namespace filigree {

namespace {

constexpr int kSpacingBits = 25; // of the spacing; 2^-25 of it is the grid's step
/// A spacing has to be this many times the rounding of float at the largest coordinate: closer points would tell apart
/// what the mesh cannot.
constexpr double kResolution = 0x1p-22;
constexpr double kSmallestSpacing = 0x1p-149; // the smallest float

std::string number(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", x);
    return text;
}

std::string gigabytes(double bytes) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g GiB", bytes / double(1 << 30));
    return text;
}

std::string list(const Vec3d& v, const char* between) {
    return number(v[0]) + between + number(v[1]) + between + number(v[2]);
}

/// What is wrong with the request, or nothing.
std::optional<Error> check(const Box& box, const LatticeOptions& options) {
    const double h = options.spacing;
    if (!std::isfinite(h) || h <= 0)
        return Error{ErrorCode::usage, "The lattice's spacing is " + number(h) + "; give a number above 0."};
    if (options.origin && !options.origin->allFinite())
        return Error{ErrorCode::usage,
                     "The lattice's origin is (" + list(*options.origin, ", ") + "); give three finite numbers."};
    if (box.empty() || !box.min.allFinite() || !box.max.allFinite() || box.size().maxCoeff() <= 0)
        return Error{ErrorCode::usage, "The box for the lattice has no extent; give a mesh with a volume."};
    if (h > box.size().maxCoeff())
        return Error{ErrorCode::usage, "A lattice spacing of " + number(h) + " is larger than the box (" +
                                           list(box.size(), " x ") + "); give less than " +
                                           number(box.size().maxCoeff()) + "."};
    double largest = std::max(box.min.cwiseAbs().maxCoeff(), box.max.cwiseAbs().maxCoeff());
    if (options.origin) largest = std::max(largest, options.origin->cwiseAbs().maxCoeff());
    const double resolution = std::max(kResolution * largest, kSmallestSpacing);
    if (h < resolution)
        return Error{ErrorCode::unsuitable, "A lattice spacing of " + number(h) +
                                                " is below the resolution of the coordinates (they reach " +
                                                number(largest) + "); give at least " + number(1.0001 * resolution) +
                                                ", or move the mesh nearer to the origin."};
    return std::nullopt;
}

} // namespace

Result<Lattice> make_lattice(const Box& box, const LatticeOptions& options) {
    if (const auto error = check(box, options)) return *error;
    // Everything is a whole number of steps of the grid, below 2^50: all sums and products here are exact.
    const double step = std::ldexp(1.0, std::ilogb(options.spacing) - (kSpacingBits - 1));
    const double h = std::nearbyint(options.spacing / step) * step;

    Lattice lattice;
    lattice.spacing = h;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = box.min[axis], high = box.max[axis];
        const bool thin = high - low < h; // then one layer, in the middle
        const double wanted = options.origin ? (*options.origin)[axis]
                              : thin         ? low + 0.5 * (high - low)
                                             : low + 0.5 * h;
        const double origin = std::nearbyint(wanted / step) * step;
        double first = std::ceil((low - origin) / h), last = std::floor((high - origin) / h);
        if (origin + first * h < low) ++first; // the division rounds
        if (origin + (first - 1) * h >= low) --first;
        if (origin + last * h > high) --last;
        if (origin + (last + 1) * h <= high) ++last;
        if (!options.origin && thin) first = last = 0;
        if (first > last)
            return Error{ErrorCode::unsuitable, std::string("No lattice point falls into the box along ") +
                                                    "xyz"[axis] + " (" + number(low) + " to " + number(high) +
                                                    "); give a smaller spacing or another origin."};
        const double count = last - first + 1;
        if (count > double(kMostLowerBounds))
            return Error{ErrorCode::unsuitable,
                         "A lattice spacing of " + number(h) + " gives " + number(count) + " points along " +
                             "xyz"[axis] + "; the most are " + std::to_string(kMostLowerBounds) +
                             ", so give at least " +
                             number(1.0001 * box.size().maxCoeff() / double(kMostLowerBounds - 1)) + "."};
        auto& coordinates = lattice.coordinates[axis];
        coordinates.resize(std::size_t(count));
        for (std::size_t i = 0; i < coordinates.size(); ++i) coordinates[i] = origin + (first + double(i)) * h;
    }
    return lattice;
}

Status check_lattice_bytes(const Lattice& lattice, double bytes, std::size_t most_bytes) {
    if (bytes <= double(most_bytes)) return Success{};
    const auto [nx, ny, nz] = lattice.counts();
    return Error{ErrorCode::unsuitable, "A lattice of " + std::to_string(nx) + " x " + std::to_string(ny) + " x " +
                                            std::to_string(nz) + " points takes " + gigabytes(bytes) +
                                            " of memory, and " + gigabytes(double(most_bytes)) +
                                            " are allowed; take a larger spacing."};
}

Result<Occupancy> make_occupancy(const Lattice& lattice, double other_bytes, std::size_t most_bytes) {
    Occupancy occupancy;
    occupancy.counts = lattice.counts();
    const auto [nx, ny, nz] = occupancy.counts;
    occupancy.words_per_row = (nx + 63) / 64;
    const double words = double(occupancy.words_per_row) * double(ny) * double(nz);
    const double bytes = words * sizeof(std::uint64_t) + other_bytes;
    if (const Status fits = check_lattice_bytes(lattice, bytes, most_bytes); !fits) return fits.error();
    occupancy.bits.resize(occupancy.words_per_row * ny * nz);
    return occupancy;
}

std::size_t Occupancy::count() const {
    std::size_t result = 0;
    for (const std::uint64_t word : bits) result += std::size_t(std::popcount(word));
    return result;
}

LatticePoints points_inside(const Lattice& lattice, const Occupancy& occupancy) {
    const std::size_t count = occupancy.count();
    LatticePoints points;
    points.indices.reserve(count);
    points.positions.reserve(count);
    for_each_inside(occupancy, [&](std::size_t i, std::size_t j, std::size_t k) {
        points.indices.push_back({std::uint16_t(i), std::uint16_t(j), std::uint16_t(k)});
        points.positions.push_back(lattice.point(i, j, k).cast<float>());
    });
    return points;
}

} // namespace filigree
