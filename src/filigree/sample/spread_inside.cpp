#include "filigree/sample.h"

#include "filigree/core/hash.h"
#include "filigree/core/parallel_for.h"
#include "filigree/core/random.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace filigree {

namespace {

constexpr int kTries = 8;                // places in a cell; then the lattice point stays where it is, which is inside
constexpr std::size_t kDarts = 8;        // for each lattice point inside
constexpr double kDartReach = 1.5;       // spacings: the side of the cube around the point that they fall into
constexpr double kApart = 0.8;           // spacings between points
constexpr double kDartsAtOnce = 1 << 21; // about; they take 60 bytes each
constexpr double kFirstPass = 1.0 / 8;   // of all darts; a later pass has as many as all before it
constexpr double kSmallestPart = 1.0 / 16;     // of all darts at once, so that passes stay few
constexpr std::size_t kAhead = 8;              // darts
constexpr std::size_t kBetweenLooks = 1 << 14; // darts from one look at `cancel` to the next

std::vector<Vec3d> lattice_points(const Lattice& lattice, const Occupancy& occupancy) {
    std::vector<Vec3d> points;
    points.reserve(occupancy.count());
    for_each_inside(occupancy,
                    [&](std::size_t i, std::size_t j, std::size_t k) { points.push_back(lattice.point(i, j, k)); });
    return points;
}

Result<std::vector<Vec3d>> jitter(std::vector<Vec3d> points, double spacing, const InsideTest& test,
                                  const RunContext& context) {
    parallel_for(context, points.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end && !context.is_cancelled(); ++p)
            for (int attempt = 0; attempt < kTries; ++attempt) {
                Vec3d moved = points[p];
                for (int axis = 0; axis < 3; ++axis)
                    moved[axis] += spacing * (random_unit(context.seed, 3 * (p * kTries + attempt) + axis) - 0.5);
                if (!test.contains(moved)) continue;
                points[p] = moved;
                break;
            }
    });
    if (context.is_cancelled()) return cancelled_error();
    return points;
}

/// Points that keep a distance from each other.
class SpacedPoints {
public:
    SpacedPoints(const Vec3d& corner, double distance, std::size_t expected)
        : corner_(corner), distance_(distance),
          mask_(std::bit_ceil(std::max<std::size_t>(2 * expected, kBlockCells)) / kBlockCells - 1),
          buckets_((mask_ + 1) * kBlockCells) {}

    /// Takes the point, which has room.
    void add(const Vec3d& point) {
        points_.push_back(point);
        Entry& first = buckets_[bucket(cell_of(point))];
        if (first.is_taken) {
            others_.push_back(first);
            first.other = static_cast<Index>(others_.size() - 1);
        }
        first.point = point;
        first.is_taken = true;
    }

    /// No point is too near. point: nowhere below the corner.
    bool has_room(const Vec3d& point) const {
        const Vec3d place = (point - corner_) / distance_;
        const Cell cell = place.cast<std::int64_t>();
        const Vec3d above = place - cell.cast<double>(), below = Vec3d::Ones() - above; // cells to the planes around
        for (const Step& step : kSteps) {
            double squared = 0;
            for (int axis = 0; axis < 3; ++axis) {
                if (step[axis] < 0) squared += above[axis] * above[axis];
                if (step[axis] > 0) squared += below[axis] * below[axis];
            }
            if (squared < 1 && has_near(cell + Cell(step[0], step[1], step[2]), point)) return false;
        }
        return true;
    }

    /// Darts fall anywhere: what a later one will look at is on its way while earlier ones are added.
    void fetch(const Vec3d& point) const { __builtin_prefetch(&buckets_[bucket(cell_of(point))]); }

    std::vector<Vec3d> take() { return std::move(points_); }

private:
    using Cell = Eigen::Matrix<std::int64_t, 3, 1>;
    using Step = std::array<int, 3>;
    struct Entry {
        Vec3d point = Vec3d::Zero();
        Index other = kNoIndex; ///< the next of its bucket
        bool is_taken = false;
    };
    /// To a cell itself and to its neighbours, the nearest first: what is too near is found soonest there.
    static constexpr std::array<Step, 27> kSteps = [] {
        std::array<Step, 27> steps;
        for (int n = 0; n < 27; ++n) steps[n] = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
        std::ranges::sort(steps, {}, [](const Step& s) {
            return std::array{s[0] * s[0] + s[1] * s[1] + s[2] * s[2], s[2], s[1], s[0]};
        });
        return steps;
    }();
    static constexpr std::size_t kBlockCells = 64; ///< 4^3, side by side in memory

    Cell cell_of(const Vec3d& point) const { return ((point - corner_) / distance_).cast<std::int64_t>(); }
    std::size_t bucket(const Cell& cell) const {
        const std::uint64_t block = hash_words(cell[0] >> 2, cell[1] >> 2, cell[2] >> 2) & mask_;
        return block * kBlockCells + std::size_t((cell[0] & 3) | (cell[1] & 3) << 2 | (cell[2] & 3) << 4);
    }
    /// Cells that share a bucket do not matter: what is too near is too near from any cell.
    bool has_near(const Cell& cell, const Vec3d& point) const {
        const auto is_near = [&](const Entry& e) { return (e.point - point).squaredNorm() < distance_ * distance_; };
        const Entry& first = buckets_[bucket(cell)];
        if (!first.is_taken) return false;
        if (is_near(first)) return true;
        for (Index other = first.other; other != kNoIndex; other = others_[other].other)
            if (is_near(others_[other])) return true;
        return false;
    }

    Vec3d corner_;
    double distance_;
    std::size_t mask_; ///< of blocks
    std::vector<Vec3d> points_;
    std::vector<Entry> buckets_; ///< of each bucket, its last point: neighbours in space lie side by side in memory
    std::vector<Entry> others_;  ///< those before it
};

/// Darts around lattice points inside, those whose order is from `low` to below `high`. Cells that merely touch the
/// surface get none: their neighbours' darts reach them.
struct Darts {
    std::vector<Vec3d> places;
    std::vector<double> orders; ///< 0 to 1: lower ones are thrown first
};

Darts make_darts(const Lattice& lattice, const Occupancy& occupancy, double low, double high, std::uint64_t seed) {
    Darts darts;
    std::uint64_t number = 0;
    for_each_inside(occupancy, [&](std::size_t i, std::size_t j, std::size_t k) {
        for (const std::uint64_t end = number + kDarts; number < end; ++number) {
            const double order = random_unit(seed + 1, number);
            if (!(low <= order && order < high)) continue;
            Vec3d place = lattice.point(i, j, k);
            for (int axis = 0; axis < 3; ++axis)
                place[axis] += lattice.spacing * (random_unit(seed, 4 * number + axis) - 0.5) * kDartReach;
            darts.places.push_back(place);
            darts.orders.push_back(order);
        }
    });
    return darts;
}

/// Drops darts that are too near to a point: they lie in the lattice's order, whose neighbours look at the same points,
/// and that takes far less than asking whether they are inside.
void keep_those_with_room(const SpacedPoints& points, Darts& darts, const RunContext& context) {
    std::vector<std::uint8_t> stays(darts.places.size());
    parallel_for(context, stays.size(), 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t d = begin; d < end; ++d) stays[d] = points.has_room(darts.places[d]);
    });
    std::size_t kept = 0;
    for (std::size_t d = 0; d < stays.size(); ++d) {
        if (!stays[d]) continue;
        darts.places[kept] = darts.places[d];
        darts.orders[kept++] = darts.orders[d];
    }
    darts.places.resize(kept);
    darts.orders.resize(kept);
}

/// Darts in random order, each kept when nothing kept is too near. They are made and thrown in passes, lower orders
/// first, so that few of them are in memory, and most of later passes have no room.
Result<std::vector<Vec3d>> throw_darts(const Lattice& lattice, const Occupancy& occupancy, const InsideTest& test,
                                       const RunContext& context) {
    const std::size_t lattice_points = occupancy.count();
    if (lattice_points == 0) return std::vector<Vec3d>{};
    const double most = std::max(kDartsAtOnce / double(kDarts * lattice_points), kSmallestPart);
    const Vec3d corner = lattice.point(0, 0, 0) - Vec3d::Constant(lattice.spacing);
    SpacedPoints points(corner, kApart * lattice.spacing, lattice_points);
    for (double low = 0, high = 0; low < 1; low = high) {
        context.report("throwing darts", low);
        high = std::min({std::max(2 * low, kFirstPass), low + most, 1.0});
        Darts darts = make_darts(lattice, occupancy, low, high, context.seed);
        if (low > 0) keep_those_with_room(points, darts, context);
        const Result<std::vector<std::uint8_t>> inside = test.contains(darts.places, context);
        if (!inside) return inside.error();
        std::vector<std::pair<double, std::size_t>> thrown;
        for (std::size_t d = 0; d < darts.places.size(); ++d)
            if ((*inside)[d]) thrown.emplace_back(darts.orders[d], d);
        std::ranges::sort(thrown);
        std::vector<Vec3d> places(thrown.size());
        for (std::size_t t = 0; t < thrown.size(); ++t) places[t] = darts.places[thrown[t].second];
        for (std::size_t t = 0; t < places.size(); ++t) {
            if (t % kBetweenLooks == 0 && context.is_cancelled()) return cancelled_error();
            if (t + kAhead < places.size()) points.fetch(places[t + kAhead]);
            if (points.has_room(places[t])) points.add(places[t]);
        }
    }
    if (context.is_cancelled()) return cancelled_error();
    return points.take();
}

} // namespace

Result<std::vector<Vec3d>> spread_inside(const Mesh& mesh, const Lattice& lattice, Pattern pattern,
                                         const InsideOptions& options, const RunContext& context,
                                         InsideReport* report) {
    const Result<Occupancy> occupancy = sample_inside(mesh, lattice, options, context, report);
    if (!occupancy) return occupancy.error();
    if (pattern == Pattern::lattice) return lattice_points(lattice, *occupancy);
    const Result<InsideTest> test = InsideTest::create(mesh, options, context);
    if (!test) return test.error();
    return pattern == Pattern::jitter ? jitter(lattice_points(lattice, *occupancy), lattice.spacing, *test, context)
                                      : throw_darts(lattice, *occupancy, *test, context);
}

} // namespace filigree
