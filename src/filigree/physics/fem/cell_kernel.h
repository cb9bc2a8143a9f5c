// The inner loops of the fem material: elastic forces of whole cells, sixteen (or
// eight, or four) cells at a time.
#pragma once

#include "filigree/physics/body.h"
#include "filigree/physics/body/elasticity.h"

#include <algorithm>

namespace filigree::cell_kernel {

/// The Walsh-Hadamard transform of a cell's corners, in place: X_m is the sum of all with the signs of m's bits.
template <class Vector>
void transform_corners(std::array<Vector, 8>& X) {
    for (unsigned bit = 1; bit < 8; bit *= 2)
        for (unsigned i = 0; i < 8; ++i)
            if (!(i & bit)) {
                const Vector low = X[i], high = X[i | bit];
                X[i] = low + high;
                X[i | bit] = high - low;
            }
}

/// Below this volume ratio a cell resists more: by (bulk + shear) kCrushStiffness r^2, r = kCrushFrom - J, so that its
/// stiffness grows steadily from none; below J = 0, where it is inverted, no more than there. Steps are short enough
/// for a cell that loses kCrushSoon more.
inline constexpr float kCrushFrom = 0.4f, kCrushStiffness = 100, kCrushSoon = 0.1f;
/// Cells that are hardly filled stand between the surface and whole ones, whose push they have to bear: they resist
/// crushing as if they were at least so full.
inline constexpr float kLeastCrushed = 0.5f;
/// Where a part of I beyond this is bending, a cell resists more as well: by shear kBentStiffness r^2, r up to
/// kBentMost. The corners of cells that are hardly filled would be thrown through the others.
inline constexpr float kBentFrom = 0.02f, kBentStiffness = 500, kBentMost = 0.5f;

/// Damping never looks further ahead than this, of a cell's sides: forces there have little to do with those here.
inline constexpr float kMostAhead = 0.2f;

/// Energy of a cell of occupied volume V, stable where it is inverted or collapsed [Smith 2018]:
///     V (shear/2 (I - 3) + bulk/2 (J - rest_ratio)^2 - shear/2 log((I + 1) / 4)) less its value at rest,
/// crush_energy and bent_energy. I is the mean of |F|^2 over the cell (an exact integral of the trilinear shape), J the
/// determinant of its mean F: one a cell, so that nothing locks. Small strains see Lame's parameters.
struct CellMaterial {
    float spacing = 0;         ///< m
    float density = 0;         ///< kg/m^3
    float shear = 0, bulk = 0; ///< Pa: 4/3 mu, lambda + 5/6 mu
    float rest_ratio = 0;      ///< J that the volume term alone would like
    float crush = 0;           ///< over bulk: kCrushStiffness, of bulk and shear together
};
CellMaterial cell_material(const Material& material, double spacing);

/// CellMaterial::crush of a cell that is filled by a fraction.
inline float crush_stiffness(const CellMaterial& m, float fraction) {
    return m.crush * (std::max(fraction, kLeastCrushed) / fraction);
}
/// Of a cell that is crushed, over V bulk.
inline double crush_energy(const CellMaterial& m, double J, float fraction) {
    const double most = double(kCrushFrom), r = std::clamp(most - J, 0.0, most);
    return double(crush_stiffness(m, fraction)) * (r * r * r / 3 + most * most * std::max(-J, 0.0));
}
/// Of a cell that is bent, by the part of I that is bending, over V shear.
inline double bent_energy(double I_bent) {
    const double over = std::max(I_bent - double(kBentFrom), 0.0), r = std::min(over, double(kBentMost));
    return double(kBentStiffness) * (r * r * r / 6 + r * r * (over - r) / 2);
}

/// Layers of cells whose forces one thread adds up by itself. Neighbours share one layer of corners, so slabs of equal
/// parity share none.
struct Slab {
    std::size_t first_run, last_run;     ///< [first, last)
    std::size_t first_layer, last_layer; ///< of corners, both included
};

/// Everything about a body that the loops want and that does not change.
struct Plan {
    const Cells* cells = nullptr;
    CellMaterial material;
    std::vector<float> fraction; ///< padded with zeros
    /// Of a body whose stiffness or density varies, padded with zeros; else empty: stiffness of each cell, and of it
    /// over density, as multiples of the material's.
    std::vector<float> stiffness, pace;
    /// Of a body whose rest shape is stretched, padded with zeros; else empty.
    struct Growth {
        /// Of each cell: the inverse of the stretch (xx, yy, zz, xy, xz, yz), what its bending is multiplied by, and
        /// the volume that its rest shape has, times its stiffness.
        static constexpr std::size_t kBent = 6, kShare = 7, kNumbers = 8;
        std::array<std::vector<float>, kNumbers> numbers;
        std::vector<float> pace; ///< stiffness over density, as what it was
    } growth;
    bool grows() const { return !growth.pace.empty(); }
    std::vector<std::size_t> layer_starts; ///< first corner of each layer; one more at the end
    std::vector<std::size_t> run_layers;   ///< of each run's lower corners
    std::vector<Slab> slabs;
};
Plan make_plan(const Body& body);

/// Where slabs add up forces: the even ones in one array, the odd ones in the other. kPadding floats lie between
/// layers.
struct Sums {
    std::array<Vectors, 2> of_parity;
};

/// Forces, N, overwritten. Same bytes for any thread count and any processor. Cost: 10 ns a cell, twice as much where
/// they are damped (null: they are not).
ElasticReport forces(const Plan& plan, const Vectors& positions, Vectors& forces, Sums& sums, const RunContext& context,
                     const InternalDamping* damping = nullptr);

/// Cells at a time that this processor has an implementation for, ascending; forces takes the fastest.
std::span<const int> lane_counts();
/// The same by one of them, so that tests can hold them against each other.
ElasticReport forces(const Plan& plan, const Vectors& positions, Vectors& forces, Sums& sums, int lanes,
                     const RunContext& context, const InternalDamping* damping = nullptr);

} // namespace filigree::cell_kernel
