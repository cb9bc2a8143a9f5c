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
#include "filigree/core/parallel_for.h"
#include "filigree/core/parallel_sum.h"
#include "filigree/physics/body/elasticity.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/springs/spring_kernel.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace filigree {

using namespace spring_kernel;

namespace {

// A cell pressed flat along an axis and through itself is held on the wrong side by its springs with up to 0.4 E per
// unit of J, just below 0; there this pushes out by 0.45 E. Random and collapsed starts came back with 1.5 and with 3,
// and no longer with 12, where the tetrahedra of corners wedge each other fast.
constexpr float kVolumeFrom = 0.3f, kVolumeStiffness = 1.5f;
// That alone does not stop what hits hard. So a cell as a whole resists as well, by its mean gradient's volume ratio J:
// below kCrushFrom by kCrushStiffness E V r^2, r = kCrushFrom - J, where it is inverted no more than where it is flat.
// Steps are short enough for a cell that loses kCrushSoon more. Cells that are hardly filled resist as whole ones: they
// stand between the surface and those, whose push they have to bear.
constexpr float kCrushFrom = 0.4f, kCrushStiffness = 50, kCrushSoon = 0.1f;
constexpr float kPressedFrom = 0.5f;                ///< volume ratio at a corner below which a cell is looked at
constexpr float kLargestSpring = 1e15f;             // m: positions beyond are not fit for explicit steps
constexpr std::size_t kSpringElasticityGrain = 256; // particles
constexpr std::size_t kRunGrain = 2;

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

/// A cell's mean edges, and how its volume depends on them.
struct MeanVolume {
    std::array<Vec3f, 3> edges, cofactors; ///< m; m^2
    float ratio;                           ///< J
    MeanVolume(const std::array<Vec3f, 8>& p, float inverse_cube) {
        for (std::size_t a = 0; a < 3; ++a) {
            const std::size_t bit = std::size_t{1} << a;
            edges[a].setZero();
            for (std::size_t c = 0; c < 8; ++c)
                if (!(c & bit)) edges[a] += 0.25f * (p[c | bit] - p[c]);
        }
        for (std::size_t a = 0; a < 3; ++a) cofactors[a] = edges[(a + 1) % 3].cross(edges[(a + 2) % 3]);
        ratio = inverse_cube * edges[0].dot(cofactors[0]);
    }
    /// dJ/dx of a corner.
    Vec3f gradient(std::size_t corner, float inverse_cube) const {
        Vec3f sum = Vec3f::Zero();
        for (std::size_t a = 0; a < 3; ++a) sum += ((corner >> a & 1) ? 0.25f : -0.25f) * cofactors[a];
        return inverse_cube * sum;
    }
};

float cell_crush(float ratio) { return std::clamp(kCrushFrom - ratio, 0.0f, kCrushFrom); }

/// How far the cells are pressed.
struct CellVolumes {
    std::vector<float> least;            // volume ratio of a cell's corners, one a cell
    std::vector<VolumeJob::Found> found; // one a run of cells
    bool any_pressed = false;
};

class SpringElasticity final : public Elasticity {
public:
    explicit SpringElasticity(const Body& body)
        : body_(body), stars_(make_stars(body)), runs_(make_runs(stars_)), steps_(make_steps(body.spacing())) {
        const std::size_t n = body.particle_count();
        const double h = body.spacing();
        inverse_cube_ = float(1 / (h * h * h));
        crush_stiffness_ = float(double(kCrushStiffness) * body.material.young_modulus * h * h * h);
        volume_stiffness_ = float(double(kVolumeStiffness) * body.material.young_modulus * h * h * h / 8);
        inverse_mass_.assign(n + Vectors::kPadding, 0);
        for (std::size_t i = 0; i < n; ++i) inverse_mass_[i] = 1 / body.mass[i];
        std::array<Index, 8> none;
        none.fill(kNoIndex);
        cells_at_.assign(n, none);
        for (std::size_t c = 0; c < body.cells.cells.size(); ++c)
            for (std::size_t corner = 0; corner < 8; ++corner)
                cells_at_[body.cells.cell_corners[c][corner]][corner] = Index(c);
        bounds_.resize(runs_.runs.size());
        volumes_ = volumes_of_cells();
    }

    ElasticReport forces(const Vectors& positions, Vectors& forces, const RunContext& context) override {
        const ForceJob job{runs_.runs.data(),    runs_.slots.data(), runs_.stiffness.data(), steps_.data(),
                           inverse_mass_.data(), positions.x.data(), positions.y.data(),     positions.z.data(),
                           forces.x.data(),      forces.y.data(),    forces.z.data(),        bounds_.data()};
        parallel_for(context, runs_.runs.size(), kRunGrain,
                     [&](std::size_t begin, std::size_t end) { kernels_.spring_forces(job, begin, end); });
        ElasticReport report = find_pressed_cells(positions, volumes_, context);
        for (const float bound : bounds_) report.squared_frequency = std::max(report.squared_frequency, bound);
        if (volumes_.any_pressed) report.squared_frequency += add_volume_forces(positions, forces, context);
        if (!(report.most_stretch < kLargestSpring)) report.squared_frequency = std::numeric_limits<float>::infinity();
        return report;
    }

    double energy(const Vectors& positions, const RunContext& context) const override {
        CellVolumes volumes = volumes_of_cells();
        find_pressed_cells(positions, volumes, context);
        return parallel_sum(context, body_.particle_count(), kSpringElasticityGrain,
                            [&](std::size_t i) { return star_energy(positions, volumes, i); });
    }

    void gradients(const Vectors& positions, std::span<Mat3f> gradients, const RunContext& context) const override {
        corner_gradients(body_.cells, positions, gradients, context);
    }

private:
    CellVolumes volumes_of_cells() const {
        return {std::vector<float>(body_.cells.cells.size()), std::vector<VolumeJob::Found>(body_.cells.runs.size())};
    }

    /// Least volume ratios of all cells into `volumes`. The report is without the squared frequency.
    ElasticReport find_pressed_cells(const Vectors& positions, CellVolumes& volumes, const RunContext& context) const {
        const std::vector<Cells::Run>& runs = body_.cells.runs;
        const VolumeJob job{runs.data(),   positions.x.data(),   positions.y.data(),  positions.z.data(),
                            inverse_cube_, volumes.least.data(), volumes.found.data()};
        parallel_for(context, runs.size(), kRunGrain,
                     [&](std::size_t begin, std::size_t end) { kernels_.cell_volumes(job, begin, end); });
        VolumeJob::Found all = {1, std::numeric_limits<float>::infinity(), 0};
        for (const VolumeJob::Found& found : volumes.found) {
            all.least_corner = std::min(all.least_corner, found.least_corner);
            all.least = found.least >= all.least ? all.least : found.least;
            all.most_squared = found.most_squared <= all.most_squared ? all.most_squared : found.most_squared;
        }
        volumes.any_pressed = all.least_corner < kPressedFrom;
        ElasticReport report;
        report.least_volume_ratio = all.least;
        report.most_stretch = std::sqrt(all.most_squared / 3) / (4 * float(body_.spacing()));
        return report;
    }

    /// Calls visit(volume, axis, stiffness) for the pressed corners' tetrahedra that particle i is a vertex of: the end
    /// of edge `axis`, or 3 for the corner itself. Looks into cells that find_pressed_cells found below `most`.
    template <class Visit>
    void for_pressed_corners(const Vectors& positions, const CellVolumes& volumes, Index i, float most,
                             const Visit& visit) const {
        for (std::size_t here = 0; here < 8; ++here) {
            const Index c = cells_at_[i][here];
            if (c == kNoIndex || !(volumes.least[c] < most)) continue;
            std::array<Vec3f, 8> p;
            for (std::size_t k = 0; k < 8; ++k) p[k] = positions[body_.cells.cell_corners[c][k]];
            for (std::size_t axis = 0; axis < 4; ++axis) {
                const std::size_t corner = axis == 3 ? here : here ^ (std::size_t{1} << axis);
                const CornerVolume volume = corner_volume(p, corner, inverse_cube_);
                if (volume.ratio < kVolumeFrom) visit(volume, axis, volume_stiffness_ * body_.cells.fraction[c]);
            }
        }
    }

    /// Calls visit(volume, corner, stiffness) for the crushed cells around particle i, which is that corner of theirs.
    template <class Visit>
    void for_crushed_cells(const Vectors& positions, const CellVolumes& volumes, Index i, const Visit& visit) const {
        for (std::size_t here = 0; here < 8; ++here) {
            const Index c = cells_at_[i][here];
            if (c == kNoIndex || !(volumes.least[c] < kPressedFrom)) continue;
            std::array<Vec3f, 8> p;
            for (std::size_t k = 0; k < 8; ++k) p[k] = positions[body_.cells.cell_corners[c][k]];
            const MeanVolume volume(p, inverse_cube_);
            if (volume.ratio < kCrushFrom + kCrushSoon) visit(volume, here, crush_stiffness_);
        }
    }

    /// Adds the forces of crushed cells on particle i; returns what they add to the bound, times its mass.
    float add_crush_forces(const Vectors& positions, Vectors& forces, Index i) const {
        float bound = 0;
        for_crushed_cells(positions, volumes_, i, [&](const MeanVolume& volume, std::size_t corner, float stiffness) {
            const Vec3f g = volume.gradient(corner, inverse_cube_);
            const float crush = cell_crush(volume.ratio), push = crush * crush;
            forces.add(i, (stiffness * push) * g);
            // As of corners below. A corner is in three mean edges, by a quarter: of J's second derivative the blocks
            // of one corner with all eight add up to 3 |e| / h^3.
            float sum = 0, longest = 0;
            for (std::size_t c = 0; c < 8; ++c) sum += volume.gradient(c, inverse_cube_).norm();
            for (const Vec3f& edge : volume.edges) longest = std::max(longest, edge.norm());
            bound += stiffness *
                     (2 * cell_crush(volume.ratio - kCrushSoon) * g.norm() * sum + 3 * push * longest * inverse_cube_);
        });
        return bound;
    }

    /// Returns what the pressed cells add to the bound on the squared frequency.
    float add_volume_forces(const Vectors& positions, Vectors& forces, const RunContext& context) const {
        const std::size_t n = body_.particle_count();
        std::vector<float> bounds((n + kSpringElasticityGrain - 1) / kSpringElasticityGrain);
        parallel_for(context, n, kSpringElasticityGrain, [&](std::size_t begin, std::size_t end) {
            float most = 0;
            for (std::size_t i = begin; i < end; ++i) {
                float bound = add_crush_forces(positions, forces, Index(i));
                for_pressed_corners(positions, volumes_, Index(i), kVolumeFrom,
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
            bounds[begin / kSpringElasticityGrain] = most;
        });
        float most = 0;
        for (const float bound : bounds) most = std::max(most, bound);
        return most;
    }

    /// Half of its springs' energy, and that of the cells' corners that it is.
    double star_energy(const Vectors& positions, const CellVolumes& volumes, std::size_t i) const {
        double sum = 0;
        for (std::size_t s = 0; s < kStencil; ++s) {
            const Index j = stars_[i].other[s];
            if (j == kNoIndex) continue;
            const double excess =
                (positions[j].cast<double>() - positions[i].cast<double>()).norm() - double(steps_[s].rest);
            sum += 0.25 * double(stars_[i].stiffness[s]) * excess * excess;
        }
        for_pressed_corners(positions, volumes, Index(i), kVolumeFrom,
                            [&](const CornerVolume& volume, std::size_t axis, float stiffness) {
                                const double below = double(volume.ratio - kVolumeFrom);
                                if (axis == 3) sum += 0.5 * double(stiffness) * below * below;
                            });
        for_crushed_cells(
            positions, volumes, Index(i), [&](const MeanVolume& volume, std::size_t corner, float stiffness) {
                if (corner != 0) return;
                const double most = double(kCrushFrom), r = double(cell_crush(volume.ratio));
                sum += double(stiffness) * (r * r * r / 3 + most * most * std::max(-double(volume.ratio), 0.0));
            });
        return sum;
    }

    const Body& body_;
    std::vector<Star> stars_;
    Runs runs_;
    std::array<Step, kStencil> steps_;
    std::vector<float> inverse_mass_;            // padded
    std::vector<std::array<Index, 8>> cells_at_; // cells around each particle, by which of their corners it is
    float inverse_cube_, volume_stiffness_;      // 1 / h^3; kVolumeStiffness E h^3 / 8
    float crush_stiffness_;                      // kCrushStiffness E h^3
    Kernels kernels_ = widest_kernels();

    // Scratch.
    std::vector<float> bounds_; // of the squared frequency, one a run of particles
    CellVolumes volumes_;
};

} // namespace

std::unique_ptr<Elasticity> make_spring_elasticity(const Body& body, const RunContext&) {
    return std::make_unique<SpringElasticity>(body);
}

} // namespace filigree
