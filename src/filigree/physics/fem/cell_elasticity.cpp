// The fem material: what cell_kernel computes, behind the interface of all materials; the energy in double.
#include "filigree/core/math.h"
#include "filigree/core/parallel_sum.h"
#include "filigree/physics/body.h"
#include "filigree/physics/body/fields.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/fem/cell_kernel.h"
#include "filigree/physics/fem/cell_lanes.h"

#include <bit>
#include <cmath>
#include <optional>
#include <tuple>

namespace filigree {

namespace {

using Growth = cell_kernel::Plan::Growth;

/// What Plan::Growth says of one cell.
using GrownCell = std::array<float, Growth::kNumbers>;

/// The energy of one cell, J, from its corners in doubles. grown: null, or of a rest shape that is stretched; its share
/// is the caller's.
double cell_energy(const cell_kernel::CellMaterial& m, const std::array<Vec3d, 8>& corners, float filled,
                   const GrownCell* grown) {
    std::array<Vec3d, 8> X = corners;
    const double fraction = double(filled);
    cell_kernel::transform_corners(X);
    if (grown) {
        const auto back = [&](std::size_t k) { return double((*grown)[k]); };
        const Vec3d x = X[1], y = X[2], z = X[4];
        X[1] = back(0) * x + back(3) * y + back(4) * z;
        X[2] = back(3) * x + back(1) * y + back(5) * z;
        X[4] = back(4) * x + back(5) * y + back(2) * z;
        for (const int n : {3, 5, 6, 7}) X[n] *= back(Growth::kBent);
    }
    const double h = m.spacing, size = 4 * h;
    const double I_bent =
        ((X[3].squaredNorm() + X[5].squaredNorm() + X[6].squaredNorm()) * (2.0 / 3.0) + X[7].squaredNorm() / 3.0) /
        (size * size);
    const double I = (X[1].squaredNorm() + X[2].squaredNorm() + X[4].squaredNorm()) / (size * size) + I_bent;
    const double J = X[1].dot(X[2].cross(X[4])) / (size * size * size);
    const double shear = m.shear, bulk = m.bulk, g = m.rest_ratio;
    // (J - g)^2 - (1 - g)^2 and log(I + 1) - log(4) as products: a body near rest has an energy, not rounding.
    return fraction * h * h * h *
           (shear * (0.5 * ((I - 3) - math::log1p((I - 3) / 4)) + cell_kernel::bent_energy(I_bent)) +
            bulk * (0.5 * (J - 1) * (J + 1 - 2 * g) + cell_kernel::crush_energy(m, J, filled)));
}

/// Of a cell whose corners have these rest stretches: their mean counts.
GrownCell grown_cell(std::span<const RestStretch> stretches, const std::array<Index, 8>& corners, float stiffness) {
    RestStretch mean = {};
    for (const Index corner : corners)
        for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += 0.125f * stretches[corner][k];
    Mat3d stretch;
    stretch << double(mean[0]), double(mean[3]), double(mean[4]), double(mean[3]), double(mean[1]), double(mean[5]),
        double(mean[4]), double(mean[5]), double(mean[2]);
    const Mat3d back = stretch.inverse();
    const double volume = stretch.determinant();
    return {float(back(0, 0)),
            float(back(1, 1)),
            float(back(2, 2)),
            float(back(0, 1)),
            float(back(0, 2)),
            float(back(1, 2)),
            float(1 / math::cbrt(volume)),
            float(volume) * stiffness};
}
constexpr GrownCell kAsAtRest = {1, 1, 1, 0, 0, 0, 1, 1};

/// A bound on what it multiplies the stiffness of a cell by.
float growth_of_stiffness(const GrownCell& cell) {
    const auto row = [](float a, float b, float c) { return std::abs(a) + std::abs(b) + std::abs(c); };
    const float most = std::max({row(cell[0], cell[3], cell[4]), row(cell[3], cell[1], cell[5]),
                                 row(cell[4], cell[5], cell[2])}); // no eigenvalue is above it
    return most * most;
}

/// A lattice without copies of corners, for the loops of cell_kernel: cells beside each other that do not hang together
/// lie in different layers of it, one above the other. Its corners follow the body's, several one of these.
class StackedCells {
public:
    explicit StackedCells(const Body& body) : scratch_(0) {
        const Cells& cells = body.cells;
        std::vector<unsigned> level(cells.cells.size(), 0);
        int most = 0;
        for (const auto& at : cells.cells) most = std::max(most, int(at[2]));
        std::vector<std::pair<Cells::LatticeIndex, Index>> stacked;
        for (Index c = 0; c < level.size(); ++c) {
            level[c] = free_level(cells, c, level);
            Cells::LatticeIndex at = cells.cells[c];
            at[2] = std::uint16_t(unsigned(at[2]) + level[c] * unsigned(most + 3));
            stacked.emplace_back(at, c);
        }
        const auto order = [](const auto& entry) { return std::tie(entry.first[2], entry.first[1], entry.first[0]); };
        std::ranges::sort(stacked, {}, order);
        std::vector<Cells::LatticeIndex> indices;
        std::vector<Index> own; // cells of the body
        for (const auto& [at, cell] : stacked) {
            indices.push_back(at);
            own.push_back(cell);
        }
        own_ = own;
        body_.material = body.material;
        body_.cells = lattice_cells(std::move(indices), cells.spacing, cells.origin);
        body_.fields = part_of(body.fields, own);
        std::vector<Index> corner_of(body_.cells.corners.size());
        for (Index c = 0; c < own.size(); ++c) {
            body_.cells.fraction[c] = cells.fraction[own[c]];
            for (int n = 0; n < 8; ++n) corner_of[body_.cells.cell_corners[c][n]] = cells.cell_corners[own[c]][n];
        }
        corners_ = corner_of.size();
        scratch_ = Vectors(corners_);
        for (Index c = 0; c < corners_; ++c) {
            const bool goes_on = c > 0 && corner_of[c] == corner_of[c - 1] + 1;
            if (!goes_on) stretches_.push_back({c, corner_of[c], 0});
            ++stretches_.back().count;
        }
    }

    const Body& body() const { return body_; }
    Index own(Index cell) const { return own_[cell]; } ///< the body's number of a cell
    Vectors& forces() { return scratch_; }
    /// The corners of this lattice where the body's are.
    const Vectors& gathered(const Vectors& from, Vectors& to) const {
        if (to.size() != corners_) to = Vectors(corners_);
        for (const auto& axis : kVectorAxes)
            for (const Stretch& s : stretches_)
                std::copy_n((from.*axis).data() + s.own, s.count, (to.*axis).data() + s.first);
        return to;
    }
    const Vectors& positions(const Vectors& from) { return gathered(from, positions_); }
    const Vectors& velocities(const Vectors& from) { return gathered(from, velocities_); }
    void scatter(Vectors& to) const {
        const std::size_t count = to.size();
        for (const auto& axis : kVectorAxes) {
            float* const sums = (to.*axis).data();
            const float* const parts = (scratch_.*axis).data();
            std::fill_n(sums, count, 0.0f);
            for (const Stretch& s : stretches_)
                for (Index k = 0; k < s.count; ++k) sums[s.own + k] += parts[s.first + k];
        }
    }

private:
    /// The lowest level in which all cells around that are there have the same corners where they meet the cell.
    static unsigned free_level(const Cells& cells, Index cell, std::span<const unsigned> level) {
        const auto& at = cells.cells[cell];
        std::uint32_t taken = 0;
        for (int n = 0; n < 27; ++n) {
            const std::array<int, 3> step = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
            const Index other = cells.find_cell(at[0] + step[0], at[1] + step[1], at[2] + step[2]);
            if (other == kNoIndex || other >= cell) continue; // later
            for (int corner = 0; corner < 8; ++corner) {
                int same = 0; // the other's number of this lattice point
                bool meets = true;
                for (int axis = 0; axis < 3; ++axis) {
                    const int bit = (corner >> axis & 1) - step[axis];
                    meets = meets && (bit == 0 || bit == 1);
                    same |= (bit & 1) << axis;
                }
                if (meets && cells.cell_corners[cell][corner] != cells.cell_corners[other][same])
                    taken |= 1u << level[other];
            }
        }
        return unsigned(std::countr_one(taken));
    }

    Body body_; ///< its cells and what they are made of
    struct Stretch {
        Index first, own, count; ///< corners from `first` on are the body's from `own` on
    };
    std::vector<Stretch> stretches_;
    std::vector<Index> own_;
    std::size_t corners_ = 0;
    Vectors scratch_, positions_, velocities_;
};

class CellElasticity final : public Elasticity {
public:
    explicit CellElasticity(const Body& body) : body_(body) {
        if (body.cells.is_parted()) stacked_.emplace(body);
        plan_ = cell_kernel::make_plan(stacked_ ? stacked_->body() : body);
    }

    ElasticReport forces(const Vectors& positions, Vectors& forces, const RunContext& context) override {
        if (stacked_) return stacked_forces(positions, nullptr, forces, context);
        return cell_kernel::forces(plan_, positions, forces, sums_, context);
    }

    ElasticReport damped_forces(const Vectors& positions, const InternalDamping& damping, Vectors& forces,
                                const RunContext& context) override {
        if (stacked_) return stacked_forces(positions, &damping, forces, context);
        return cell_kernel::forces(plan_, positions, forces, sums_, context, &damping);
    }

    double energy(const Vectors& positions, const RunContext& context) const override {
        const Cells& cells = body_.cells;
        const std::vector<float>& stiffness = body_.fields.stiffness;
        return parallel_sum(context, cells.cells.size(), 1024, [&](std::size_t cell) {
            std::array<Vec3d, 8> corners;
            for (int c = 0; c < 8; ++c) corners[c] = positions[cells.cell_corners[cell][c]].cast<double>();
            if (plan_.grows()) {
                const GrownCell grown = grown_at(cell, part_);
                return double(grown[Growth::kShare]) *
                       cell_energy(plan_.material, corners, cells.fraction[cell], &grown);
            }
            const double energy = cell_energy(plan_.material, corners, cells.fraction[cell], nullptr);
            return stiffness.empty() ? energy : energy * double(stiffness[cell]);
        });
    }

    void gradients(const Vectors& positions, std::span<Mat3f> gradients, const RunContext& context) const override {
        corner_gradients(body_.cells, positions, gradients, context);
    }

    void set_crush_share(float share) override {
        plan_.material.crush = share * cell_kernel::cell_material(body_.material, body_.spacing()).crush;
    }

    bool can_grow() const override { return true; }

    void set_rest_stretches(std::span<const RestStretch> from, std::span<const RestStretch> to) override {
        Growth& growth = plan_.growth;
        if (from.empty() && to.empty()) {
            growth = {};
            from_.clear();
            to_.clear();
            return;
        }
        const std::size_t count = body_.cells.cells.size();
        const auto ends_of = [&](std::span<const RestStretch> stretches) {
            std::vector<GrownCell> ends(count, kAsAtRest);
            for (std::size_t c = 0; c < count; ++c) {
                const float stiffness = body_.fields.stiffness.empty() ? 1 : body_.fields.stiffness[c];
                ends[c][Growth::kShare] = stiffness;
                if (!stretches.empty()) ends[c] = grown_cell(stretches, body_.cells.cell_corners[c], stiffness);
            }
            return ends;
        };
        from_ = ends_of(from);
        to_ = ends_of(to);
        for (std::vector<float>& numbers : growth.numbers) numbers.assign(count + cell_kernel::kPadding, 0);
        growth.pace.assign(count + cell_kernel::kPadding, 0);
        for (Index place = 0; place < count; ++place) { // the most of the frame
            const Index c = own(place);
            const float density = body_.fields.density.empty() ? 1 : body_.fields.density[c];
            growth.pace[place] = std::max(from_[c][Growth::kShare], to_[c][Growth::kShare]) / density *
                                 std::max(growth_of_stiffness(from_[c]), growth_of_stiffness(to_[c]));
        }
        set_part_of_frame(0);
    }

    void set_part_of_frame(float part) override {
        if (!plan_.grows()) return;
        part_ = part;
        for (Index place = 0; place < from_.size(); ++place) {
            const GrownCell now = grown_at(own(place), part);
            for (std::size_t k = 0; k < now.size(); ++k) plan_.growth.numbers[k][place] = now[k];
        }
    }

private:
    Index own(Index place) const { return stacked_ ? stacked_->own(place) : place; }
    GrownCell grown_at(std::size_t cell, float part) const {
        GrownCell now = from_[cell];
        for (std::size_t k = 0; k < now.size(); ++k) now[k] += part * (to_[cell][k] - now[k]);
        return now;
    }

    ElasticReport stacked_forces(const Vectors& positions, const InternalDamping* damping, Vectors& forces,
                                 const RunContext& context) {
        InternalDamping inside;
        if (damping) {
            inside = *damping;
            inside.velocities = stacked_->velocities(damping->velocities);
        }
        const ElasticReport report = cell_kernel::forces(plan_, stacked_->positions(positions), stacked_->forces(),
                                                         sums_, context, damping ? &inside : nullptr);
        stacked_->scatter(forces);
        return report;
    }

    const Body& body_;
    std::optional<StackedCells> stacked_; ///< of a body whose corners have copies
    cell_kernel::Plan plan_;
    cell_kernel::Sums sums_;
    std::vector<GrownCell> from_, to_; ///< of the body's cells, at the ends of a frame; empty: as at rest
    float part_ = 0;
};

} // namespace

std::unique_ptr<Elasticity> make_cell_elasticity(const Body& body, const RunContext&) {
    return std::make_unique<CellElasticity>(body);
}

} // namespace filigree
