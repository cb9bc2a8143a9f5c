// Springs on the lattice of cells: along its axes, across the faces of cells, and from each particle to the second one
// along each axis, which resist bending.
//
// Every axis and face spring has stiffness 0.4 E h where four (axis) or two (face) whole cells share it; each cell
// gives its part times its fraction. So a body of any shape has Young's modulus E and, by construction (central forces,
// Cauchy), Poisson's ratio 1/4. A bending spring of stiffness b takes 2 b from both axis springs it spans: the energy
// of uniform strain is as without it.
//
// A lattice of springs has inverted states of equilibrium: a mirrored cell has the right lengths. So each of a cell's
// corners has a tetrahedron with the three corners beside it, and where its volume ratio J falls below kVolumeFrom it
// resists by kVolumeStiffness E V/2 (J - kVolumeFrom)^2, V an eighth of the cell. In ordinary motion that term is zero,
// and the material is springs alone. (One J a cell is not enough: single particles stay pushed through.)
//
// Each particle sums up the forces of its own springs, so that every spring is computed twice and nothing is scattered.
// Particles side by side along x share a stencil, and lanes are particles: the same sums in any vector width.
#include "filigree/physics/elasticity.h"

#include "filigree/core/lanes.h"
#include "filigree/core/parallel_for.h"
#include "filigree/physics/body.h"
#include "filigree/physics/vertex_block.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace filigree {
namespace {

constexpr double kSpringStiffness = 0.4; // of E h: gives Young's modulus E with axis and face springs alike
// A cell pressed flat along an axis and through itself is held on the wrong side by its springs with up to 0.4 E per
// unit of J, just below 0; there this pushes out by 0.45 E. Random and collapsed starts came back with 1.5 and with 3,
// and no longer with 12, where the tetrahedra of corners wedge each other fast.
constexpr float kVolumeFrom = 0.3f, kVolumeStiffness = 1.5f;
constexpr float kVolumeNear =
    0.6f; // a sweep looks at cells below this at its start: one sweep will not take others there
constexpr float kLeastLength = 1e-6f; // of the rest length: a shorter spring has its direction at rest
// Growing out of a collapse by leaps leaves particles on the wrong side of each other.
constexpr float kCollapsed = 0.5f;     // squared lengths over those at rest
constexpr float kCollapsedStep = 0.1f; // spacings a sweep
constexpr float kLargest = 1e15f;      // m: positions beyond are not fit for explicit steps
constexpr std::size_t kGrain = 256;    // particles
constexpr std::size_t kRunGrain = 2;
constexpr std::size_t kLongestRun = 256; // particles, so that threads have something to share
constexpr std::size_t kMostLanes = 16;

/// Where a particle's neighbours are, in lattice steps; the opposite of one is its number ^ 1.
constexpr std::size_t kAxis = 6, kFace = 12, kStencil = 2 * kAxis + kFace, kBending = kAxis + kFace;
constexpr std::array<std::array<int, 3>, kStencil> kSteps = {{
    {1, 0, 0},  {-1, 0, 0}, {0, 1, 0}, {0, -1, 0},  {0, 0, 1},  {0, 0, -1}, {1, 1, 0}, {-1, -1, 0},
    {1, -1, 0}, {-1, 1, 0}, {1, 0, 1}, {-1, 0, -1}, {1, 0, -1}, {-1, 0, 1}, {0, 1, 1}, {0, -1, -1},
    {0, 1, -1}, {0, -1, 1}, {2, 0, 0}, {-2, 0, 0},  {0, 2, 0},  {0, -2, 0}, {0, 0, 2}, {0, 0, -2},
}};

/// Number of the step from one corner of a cell to another; kStencil for a diagonal of the body of the cell.
std::size_t stencil_number(std::size_t from, std::size_t to) {
    std::array<int, 3> step{};
    for (std::size_t a = 0; a < 3; ++a) step[a] = int(to >> a & 1) - int(from >> a & 1);
    return std::size_t(std::find(kSteps.begin(), kSteps.end(), step) - kSteps.begin());
}

/// The springs at one particle, one a step of the stencil; kNoIndex where there is none.
struct Star {
    std::array<Index, kStencil> other;
    std::array<float, kStencil> stiffness;
};

std::vector<Star> make_stars(const Body& body) {
    const Cells& cells = body.cells;
    Star none;
    none.other.fill(kNoIndex);
    none.stiffness.fill(0);
    std::vector<Star> stars(body.particle_count(), none);

    const double whole = kSpringStiffness * body.material.young_modulus * cells.spacing;
    for (std::size_t c = 0; c < cells.cells.size(); ++c)
        for (std::size_t a = 0; a < 8; ++a)
            for (std::size_t b = 0; b < 8; ++b) {
                const std::size_t s = stencil_number(a, b);
                if (a == b || s >= kStencil) continue;
                Star& star = stars[cells.cell_corners[c][a]];
                star.other[s] = cells.cell_corners[c][b];
                star.stiffness[s] += float(whole * (s < kAxis ? 0.25 : 0.5) * double(cells.fraction[c]));
            }

    const float bending = float(body.material.bending);
    if (!(bending > 0)) return stars;
    const std::vector<Star> unbent = stars;
    for (std::size_t i = 0; i < stars.size(); ++i)
        for (std::size_t s = 0; s < kAxis; ++s) {
            const Index middle = unbent[i].other[s];
            if (middle == kNoIndex || unbent[middle].other[s] == kNoIndex) continue;
            const float first = unbent[i].stiffness[s], second = unbent[middle].stiffness[s];
            const float k = bending * std::min(first, second);
            stars[i].other[kBending + s] = unbent[middle].other[s];
            stars[i].stiffness[kBending + s] = k;
            stars[i].stiffness[s] -= 2 * k;          // the spring to the middle, seen from here
            stars[middle].stiffness[s ^ 1] -= 2 * k; // and seen from the middle
        }
    return stars;
}

/// Particles side by side along x, whose neighbours are side by side as well.
struct Run {
    Index first, count;
    Index first_slot, slot_count;
};
/// One step of the stencil for all particles of a run: particle first + t has neighbour first + offset + t.
struct Slot {
    std::int32_t offset;
    Index stiffness; ///< where the run's stiffnesses begin; 0 where a particle has no such neighbour
    Index step;
};

struct Runs {
    std::vector<Run> runs;
    std::vector<Slot> slots;
    std::vector<float> stiffness;
};

Runs make_runs(const std::vector<Star>& stars) {
    constexpr std::int64_t kOpen = std::numeric_limits<std::int64_t>::max();
    Runs result;
    const std::size_t n = stars.size();
    for (std::size_t first = 0; first < n;) {
        std::array<std::int64_t, kStencil> offset;
        offset.fill(kOpen);
        std::size_t end = first;
        for (; end < n && end - first < kLongestRun; ++end) {
            std::array<std::int64_t, kStencil> next = offset;
            bool fits = true;
            for (std::size_t s = 0; s < kStencil; ++s) {
                if (stars[end].other[s] == kNoIndex) continue;
                const std::int64_t here = std::int64_t(stars[end].other[s]) - std::int64_t(end);
                fits = fits && (next[s] == kOpen || next[s] == here);
                next[s] = here;
                // Particles without this neighbour read there all the same, so it has to be in the arrays.
                fits = fits && std::int64_t(first) + here >= 0;
            }
            for (std::size_t s = 0; s < kStencil; ++s)
                fits = fits && (next[s] == kOpen || std::int64_t(end) + next[s] < std::int64_t(n));
            if (!fits) break;
            offset = next;
        }
        const std::size_t count = end - first;
        Run run{Index(first), Index(count), Index(result.slots.size()), 0};
        const std::size_t padded = (count + kMostLanes - 1) / kMostLanes * kMostLanes;
        for (std::size_t s = 0; s < kStencil; ++s) {
            if (offset[s] == kOpen) continue;
            result.slots.push_back({std::int32_t(offset[s]), Index(result.stiffness.size()), Index(s)});
            ++run.slot_count;
            for (std::size_t t = 0; t < padded; ++t)
                result.stiffness.push_back(t < count ? stars[first + t].stiffness[s] : 0);
        }
        result.runs.push_back(run);
        first = end;
    }
    return result;
}

/// Rest length and direction of each step of the stencil.
struct Step {
    float rest, least_squared; // m, m^2
    Vec3f least;               // at least length, along the direction at rest
};

std::array<Step, kStencil> make_steps(double spacing) {
    std::array<Step, kStencil> steps;
    for (std::size_t s = 0; s < kStencil; ++s) {
        const Vec3d d = Vec3d(kSteps[s][0], kSteps[s][1], kSteps[s][2]) * spacing;
        const float least = kLeastLength * float(d.norm());
        steps[s] = {float(d.norm()), least * least, (d.normalized() * double(least)).cast<float>()};
    }
    return steps;
}

// --- Lanes ---------------------------------------------------------------------------------------------------------

/// 1 / sqrt(x) for x > 0 to float precision: a first guess from the exponent and three Newton steps.
template <int N>
FILIGREE_INLINE typename LaneTypes<N>::Float inverse_sqrt(typename LaneTypes<N>::Float x) {
    using Float = typename LaneTypes<N>::Float;
    using Int = typename LaneTypes<N>::Int;
    Float y = (Float)(0x5f3759df - ((Int)x >> 1));
    for (int step = 0; step < 3; ++step) y = y * (1.5f - 0.5f * x * y * y);
    return y;
}

struct Job {
    const Run* runs;
    const Slot* slots;
    const float* stiffness;
    const Step* steps;
    const float* inverse_mass;
    const float *x, *y, *z;
    float *fx, *fy, *fz;
    float* rate; // one a run
};

template <int N>
FILIGREE_INLINE void spring_forces(const Job& job, std::size_t begin, std::size_t end) {
    using Float = typename LaneTypes<N>::Float;
    using Loose = typename LaneTypes<N>::Loose;
    const auto load = [](const float* p) -> Float { return *reinterpret_cast<const Loose*>(p); };
    const Float zero = {};
    for (std::size_t r = begin; r < end; ++r) {
        const Run& run = job.runs[r];
        float run_rate = 0;
        for (std::size_t t = 0; t < run.count; t += N) {
            const std::size_t i = run.first + t;
            const Float x = load(job.x + i), y = load(job.y + i), z = load(job.z + i);
            Float fx = zero, fy = zero, fz = zero;
            Float xx = zero, yy = zero, zz = zero, xy = zero, xz = zero, yz = zero; // sum of blocks
            Float largest = zero;
            for (std::size_t s = run.first_slot; s < run.first_slot + run.slot_count; ++s) {
                const Slot& slot = job.slots[s];
                const Step& step = job.steps[slot.step];
                const std::int64_t j = std::int64_t(i) + slot.offset;
                Float dx = load(job.x + j) - x, dy = load(job.y + j) - y, dz = load(job.z + j) - z;
                Float squared = dx * dx + dy * dy + dz * dz;
                const auto is_short = squared < step.least_squared;
                dx = is_short ? zero + step.least.x() : dx;
                dy = is_short ? zero + step.least.y() : dy;
                dz = is_short ? zero + step.least.z() : dz;
                squared = is_short ? zero + step.least_squared : squared;
                const Float k = load(job.stiffness + slot.stiffness + t);
                const Float inverse = inverse_sqrt<N>(squared);
                const Float across = 1 - step.rest * inverse; // 1 - L / l: of k, the stiffness across the spring
                const Float tension = k * across;
                fx += tension * dx;
                fy += tension * dy;
                fz += tension * dz;
                // k [n n^T + a (I - n n^T)] with a = max(0, 1 - L / l), as (k (1 - a) / l^2) d d^T + k a I
                const Float a = across > zero ? across : zero;
                const Float isotropic = k * a, along = (k - isotropic) * (inverse * inverse);
                const Float ax = along * dx, ay = along * dy, az = along * dz;
                xx += ax * dx + isotropic;
                yy += ay * dy + isotropic;
                zz += az * dz + isotropic;
                xy += ax * dy;
                xz += ax * dz;
                yz += ay * dz;
                // Zero stiffness may stand for a particle that is none; NaN stays
                const Float size = k > zero ? squared : zero;
                largest = size <= largest ? largest : size;
            }
            // Of eigenvalues with mean m and variance v the largest is at most m + sqrt(2 v).
            const Float mean = (xx + yy + zz) * (1 / 3.f);
            const Float dxx = xx - mean, dyy = yy - mean, dzz = zz - mean;
            const Float spread = dxx * dxx + dyy * dyy + dzz * dzz + 2 * (xy * xy + xz * xz + yz * yz);
            const Float twice_variance = spread * (2 / 3.f) + 1e-30f;
            const Float rate =
                2 * (mean + twice_variance * inverse_sqrt<N>(twice_variance)) * load(job.inverse_mass + i);
            const std::size_t lanes = std::min<std::size_t>(N, run.count - t);
            for (std::size_t l = 0; l < lanes; ++l) {
                job.fx[i + l] = fx[l];
                job.fy[i + l] = fy[l];
                job.fz[i + l] = fz[l];
                const bool fit = largest[l] < kLargest * kLargest;
                run_rate = std::max(run_rate, fit ? rate[l] : std::numeric_limits<float>::infinity());
            }
        }
        job.rate[r] = run_rate;
    }
}

struct CellJob {
    const Cells::Run* runs;
    const float *x, *y, *z;
    float inverse_cube; // 1 / h^3
    float* least;       // one a cell: of the eight corners' volume ratios
    struct Found {
        float least_corner, least, most_squared; // volume ratios at corners and centres; |4h F|^2
    };
    Found* found; // one a run
};

template <class Float>
struct LaneVector {
    Float x, y, z;
    FILIGREE_INLINE LaneVector operator-(const LaneVector& b) const { return {x - b.x, y - b.y, z - b.z}; }
    FILIGREE_INLINE LaneVector operator+(const LaneVector& b) const { return {x + b.x, y + b.y, z + b.z}; }
};
template <class Float>
FILIGREE_INLINE Float determinant(const LaneVector<Float>& a, const LaneVector<Float>& b, const LaneVector<Float>& c) {
    return (a.y * b.z - a.z * b.y) * c.x + (a.z * b.x - a.x * b.z) * c.y + (a.x * b.y - a.y * b.x) * c.z;
}

template <int N>
FILIGREE_INLINE void cell_volumes(const CellJob& job, std::size_t begin, std::size_t end) {
    using Float = typename LaneTypes<N>::Float;
    using Loose = typename LaneTypes<N>::Loose;
    using Vector = LaneVector<Float>;
    const auto load = [](const float* p) -> Float { return *reinterpret_cast<const Loose*>(p); };
    for (std::size_t r = begin; r < end; ++r) {
        const Cells::Run& run = job.runs[r];
        CellJob::Found found = {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(), 0};
        for (std::size_t t = 0; t < run.count; t += N) {
            Vector p[8];
            for (std::size_t c = 0; c < 8; ++c) {
                const std::size_t i = run.rows[c >> 1] + t + (c & 1);
                p[c] = {load(job.x + i), load(job.y + i), load(job.z + i)};
            }
            const Vector x[4] = {p[1] - p[0], p[3] - p[2], p[5] - p[4], p[7] - p[6]}; // edges, by the other two bits
            const Vector y[4] = {p[2] - p[0], p[3] - p[1], p[6] - p[4], p[7] - p[5]};
            const Vector z[4] = {p[4] - p[0], p[5] - p[1], p[6] - p[2], p[7] - p[3]};
            Float least = determinant(x[0], y[0], z[0]);
            for (std::size_t c = 1; c < 8; ++c) {
                const Float J = determinant(x[c >> 1], y[(c & 1) | (c >> 1 & 2)], z[c & 3]);
                least = J >= least ? least : J;
            }
            least *= job.inverse_cube;
            const Vector mean_x = x[0] + x[1] + (x[2] + x[3]), mean_y = y[0] + y[1] + (y[2] + y[3]),
                         mean_z = z[0] + z[1] + (z[2] + z[3]);
            const Float centre = determinant(mean_x, mean_y, mean_z) * (job.inverse_cube * (1 / 64.f));
            const Float squared = mean_x.x * mean_x.x + mean_x.y * mean_x.y + mean_x.z * mean_x.z +
                                  mean_y.x * mean_y.x + mean_y.y * mean_y.y + mean_y.z * mean_y.z +
                                  mean_z.x * mean_z.x + mean_z.y * mean_z.y + mean_z.z * mean_z.z;
            const std::size_t lanes = std::min<std::size_t>(N, run.count - t);
            for (std::size_t l = 0; l < lanes; ++l) {
                job.least[run.first_cell + t + l] = least[l];
                found.least_corner = least[l] >= found.least_corner ? found.least_corner : least[l]; // NaN stays
                found.least = centre[l] >= found.least ? found.least : centre[l];
                found.most_squared = squared[l] <= found.most_squared ? found.most_squared : squared[l];
            }
        }
        job.found[r] = found;
    }
}

struct Kernels {
    void (*spring_forces)(const Job&, std::size_t, std::size_t);
    void (*cell_volumes)(const CellJob&, std::size_t, std::size_t);
};
#define FILIGREE_KERNELS(NAME, N, TARGET)                                                                              \
    TARGET void spring_forces_##NAME(const Job& job, std::size_t begin, std::size_t end) {                             \
        spring_forces<N>(job, begin, end);                                                                             \
    }                                                                                                                  \
    TARGET void cell_volumes_##NAME(const CellJob& job, std::size_t begin, std::size_t end) {                          \
        cell_volumes<N>(job, begin, end);                                                                              \
    }
FILIGREE_KERNELS(plain, 4, )
#if defined(__x86_64__)
FILIGREE_KERNELS(avx2, 8, __attribute__((target("avx2"))))
FILIGREE_KERNELS(avx512, 16, __attribute__((target("avx512f,avx512vl,avx512dq,avx512bw"))))
#endif
#undef FILIGREE_KERNELS

Kernels widest_kernels() {
#if defined(__x86_64__)
    if (vector_width_count() == 3) return {spring_forces_avx512, cell_volumes_avx512};
    if (vector_width_count() == 2) return {spring_forces_avx2, cell_volumes_avx2};
#endif
    return {spring_forces_plain, cell_volumes_plain};
}

// --- Cells that are pressed flat or turned inside out ---------------------------------------------------------------

/// The tetrahedron of a cell's corner and the three corners beside it.
struct CornerVolume {
    std::array<Vec3f, 3> edges;
    float ratio; ///< J: its volume over that at rest
    float sign;  ///< of the edges' determinant at rest
};

CornerVolume corner_volume(const std::array<Vec3f, 8>& p, std::size_t corner, float inverse_cube) {
    CornerVolume v;
    for (std::size_t a = 0; a < 3; ++a) v.edges[a] = p[corner ^ (std::size_t{1} << a)] - p[corner];
    v.sign = std::popcount(corner) % 2 == 0 ? 1.f : -1.f;
    v.ratio = v.sign * inverse_cube * v.edges[0].cross(v.edges[1]).dot(v.edges[2]);
    return v;
}

/// dJ/dx of the end of edge `axis`, or of the corner itself (axis 3).
Vec3f volume_gradient(const CornerVolume& v, std::size_t axis, float inverse_cube) {
    const auto& e = v.edges;
    if (axis == 3) return (e[0].cross(e[1]) + e[1].cross(e[2]) + e[2].cross(e[0])) * (-v.sign * inverse_cube);
    return e[(axis + 1) % 3].cross(e[(axis + 2) % 3]) * (v.sign * inverse_cube);
}

// --------------------------------------------------------------------------------------------------------------------

class SpringElasticity final : public Elasticity {
public:
    explicit SpringElasticity(const Body& body)
        : body_(body), stars_(make_stars(body)), runs_(make_runs(stars_)), steps_(make_steps(body.spacing())) {
        const std::size_t n = body.particle_count();
        const double h = body.spacing();
        inverse_cube_ = float(1 / (h * h * h));
        volume_stiffness_ = float(double(kVolumeStiffness) * body.material.young_modulus * h * h * h / 8);
        inverse_mass_.assign(n + Vectors::kPadding, 0);
        for (std::size_t i = 0; i < n; ++i) inverse_mass_[i] = 1 / body.mass[i];
        std::array<Index, 8> none;
        none.fill(kNoIndex);
        cells_at_.assign(n, none);
        for (std::size_t c = 0; c < body.cells.cells.size(); ++c)
            for (std::size_t corner = 0; corner < 8; ++corner)
                cells_at_[body.cells.cell_corners[c][corner]][corner] = Index(c);
        // Bending springs reach two steps far, so particles three apart are independent.
        colors_.resize(27);
        for (std::size_t i = 0; i < n; ++i) {
            const Cells::LatticeIndex& at = body.cells.corners[i];
            colors_[std::size_t(at[0] % 3 + 3 * (at[1] % 3) + 9 * (at[2] % 3))].push_back(Index(i));
        }
        std::erase_if(colors_, [](const std::vector<Index>& color) { return color.empty(); });
        run_rate_.resize(runs_.runs.size());
        least_volume_.resize(body.cells.cells.size());
        found_.resize(body.cells.runs.size());
    }

    ElasticReport forces(const Vectors& positions, Vectors& forces, const RunContext& context) override {
        const Job job{runs_.runs.data(),    runs_.slots.data(), runs_.stiffness.data(), steps_.data(),
                      inverse_mass_.data(), positions.x.data(), positions.y.data(),     positions.z.data(),
                      forces.x.data(),      forces.y.data(),    forces.z.data(),        run_rate_.data()};
        parallel_for(context, runs_.runs.size(), kRunGrain,
                     [&](std::size_t begin, std::size_t end) { kernels_.spring_forces(job, begin, end); });
        ElasticReport report = find_pressed_cells(positions, context);
        for (const float rate : run_rate_) report.rate = std::max(report.rate, rate);
        if (any_pressed_) report.rate += add_volume_forces(positions, forces, context);
        if (!(report.most_stretch < kLargest)) report.rate = std::numeric_limits<float>::infinity();
        return report;
    }

    void sweep(Vectors& positions, const Descent& descent, const RunContext& context) override {
        find_pressed_cells(positions, context);
        for (const std::vector<Index>& color : colors_)
            parallel_for(context, color.size(), kGrain / 4, [&](std::size_t begin, std::size_t end) {
                for (std::size_t k = begin; k < end; ++k) move_particle(positions, descent, color[k]);
            });
    }

    double energy(const Vectors& positions, const RunContext& context) override {
        find_pressed_cells(positions, context);
        const std::size_t n = body_.particle_count();
        std::vector<double> pieces((n + kGrain - 1) / kGrain);
        parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
            double sum = 0;
            for (std::size_t i = begin; i < end; ++i) sum += star_energy(positions, i);
            pieces[begin / kGrain] = sum;
        });
        double sum = 0;
        for (const double piece : pieces) sum += piece;
        return sum;
    }

    const Vectors& reference() const override { return body_.rest; }
    void gradients(const Vectors& positions, std::span<Mat3f> gradients, const RunContext& context) override {
        corner_gradients(body_.cells, positions, gradients, context);
    }

private:
    ElasticReport find_pressed_cells(const Vectors& positions, const RunContext& context) {
        const std::vector<Cells::Run>& runs = body_.cells.runs;
        const CellJob job{runs.data(),   positions.x.data(),   positions.y.data(), positions.z.data(),
                          inverse_cube_, least_volume_.data(), found_.data()};
        parallel_for(context, runs.size(), kRunGrain,
                     [&](std::size_t begin, std::size_t end) { kernels_.cell_volumes(job, begin, end); });
        CellJob::Found all = {1, std::numeric_limits<float>::infinity(), 0};
        for (const CellJob::Found& found : found_) {
            all.least_corner = std::min(all.least_corner, found.least_corner);
            all.least = found.least >= all.least ? all.least : found.least;
            all.most_squared = found.most_squared <= all.most_squared ? all.most_squared : found.most_squared;
        }
        any_pressed_ = all.least_corner < kVolumeFrom;
        ElasticReport report;
        report.least_volume_ratio = all.least;
        report.most_stretch = std::sqrt(all.most_squared / 3) / (4 * float(body_.spacing()));
        return report;
    }

    /// Calls visit(volume, axis, stiffness) for the pressed corners' tetrahedra that particle i is a vertex of: the end
    /// of edge `axis`, or 3 for the corner itself. Looks into cells that find_pressed_cells found below `most`.
    template <class Visit>
    void for_pressed_corners(const Vectors& positions, Index i, float most, const Visit& visit) const {
        for (std::size_t here = 0; here < 8; ++here) {
            const Index c = cells_at_[i][here];
            if (c == kNoIndex || !(least_volume_[c] < most)) continue;
            std::array<Vec3f, 8> p;
            for (std::size_t k = 0; k < 8; ++k) p[k] = positions[body_.cells.cell_corners[c][k]];
            for (std::size_t axis = 0; axis < 4; ++axis) {
                const std::size_t corner = axis == 3 ? here : here ^ (std::size_t{1} << axis);
                const CornerVolume volume = corner_volume(p, corner, inverse_cube_);
                if (volume.ratio < kVolumeFrom) visit(volume, axis, volume_stiffness_ * body_.cells.fraction[c]);
            }
        }
    }

    /// Returns what the pressed cells add to the bound of the rate.
    float add_volume_forces(const Vectors& positions, Vectors& forces, const RunContext& context) const {
        const std::size_t n = body_.particle_count();
        std::vector<float> rates((n + kGrain - 1) / kGrain);
        parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
            float most = 0;
            for (std::size_t i = begin; i < end; ++i) {
                float bound = 0;
                for_pressed_corners(positions, Index(i), kVolumeFrom,
                                    [&](const CornerVolume& volume, std::size_t axis, float stiffness) {
                                        const Vec3f g = volume_gradient(volume, axis, inverse_cube_);
                                        const float below = volume.ratio - kVolumeFrom;
                                        forces.add(i, g * (-stiffness * below));
                                        // g g^T is at most the blocks |g_i| sum |g_j|. J's own second derivative is at
                                        // most 2 |e| / h^3 in each edge; an edge's square is at most twice the sum of
                                        // its ends'.
                                        float sum = 0, longest = 0;
                                        for (std::size_t a = 0; a < 4; ++a)
                                            sum += volume_gradient(volume, a, inverse_cube_).norm();
                                        for (const Vec3f& edge : volume.edges) longest = std::max(longest, edge.norm());
                                        bound += stiffness * (g.norm() * sum -
                                                              below * longest * inverse_cube_ * (axis == 3 ? 12 : 4));
                                    });
                most = std::max(most, bound * inverse_mass_[i]);
            }
            rates[begin / kGrain] = most;
        });
        float most = 0;
        for (const float rate : rates) most = std::max(most, rate);
        return most;
    }

    void move_particle(Vectors& positions, const Descent& descent, Index i) const {
        if (descent.fixed[i]) return;
        const Vec3f x = positions[i];
        const float inertia = descent.inertia[i];
        Vec3f force = inertia * (descent.target[i] - x);
        Symmetric3 block;
        block.add_scaled_identity(inertia);
        const Star& star = stars_[i];
        float lengths = 0, rests = 0; // squared
        for (std::size_t s = 0; s < kStencil; ++s) {
            if (star.other[s] == kNoIndex) continue;
            Vec3f d = positions[star.other[s]] - x;
            float squared = d.squaredNorm();
            if (squared < steps_[s].least_squared) {
                d = steps_[s].least;
                squared = steps_[s].least_squared;
            }
            lengths += squared;
            rests += steps_[s].rest * steps_[s].rest;
            const float k = star.stiffness[s], across = 1 - steps_[s].rest / std::sqrt(squared);
            force += k * across * d;
            const float a = std::max(0.f, across);
            block.add_scaled_identity(k * a);
            block.add_outer(d, k * (1 - a) / squared);
        }
        for_pressed_corners(positions, i, kVolumeNear,
                            [&](const CornerVolume& volume, std::size_t axis, float stiffness) {
                                const Vec3f g = volume_gradient(volume, axis, inverse_cube_);
                                force -= stiffness * (volume.ratio - kVolumeFrom) * g;
                                block.add_outer(g, stiffness);
                            });
        if (descent.touched[i] && descent.external) descent.external->add(i, positions, force, block);
        Vec3f step = block.solve(force);
        const float most = kCollapsedStep * float(body_.spacing()), length = step.norm();
        if (length > most && lengths < kCollapsed * rests) step *= most / length;
        positions.add(i, step);
    }

    /// Half of its springs' energy, and that of the cells' corners that it is.
    double star_energy(const Vectors& positions, std::size_t i) const {
        double sum = 0;
        for (std::size_t s = 0; s < kStencil; ++s) {
            const Index j = stars_[i].other[s];
            if (j == kNoIndex) continue;
            const double excess =
                (positions[j].cast<double>() - positions[i].cast<double>()).norm() - double(steps_[s].rest);
            sum += 0.25 * double(stars_[i].stiffness[s]) * excess * excess;
        }
        for_pressed_corners(positions, Index(i), kVolumeFrom,
                            [&](const CornerVolume& volume, std::size_t axis, float stiffness) {
                                const double below = double(volume.ratio - kVolumeFrom);
                                if (axis == 3) sum += 0.5 * double(stiffness) * below * below;
                            });
        return sum;
    }

    const Body& body_;
    std::vector<Star> stars_;
    Runs runs_;
    std::array<Step, kStencil> steps_;
    std::vector<float> inverse_mass_;            // padded
    std::vector<std::array<Index, 8>> cells_at_; // cells around each particle, by which of their corners it is
    std::vector<std::vector<Index>> colors_;
    float inverse_cube_, volume_stiffness_; // 1 / h^3; kVolumeStiffness E h^3 / 8
    Kernels kernels_ = widest_kernels();
    std::vector<float> run_rate_, least_volume_; // of corners, one a cell
    std::vector<CellJob::Found> found_;
    bool any_pressed_ = false;
};

} // namespace

std::unique_ptr<Elasticity> make_spring_elasticity(const Body& body, const RunContext&) {
    return std::make_unique<SpringElasticity>(body);
}

} // namespace filigree
