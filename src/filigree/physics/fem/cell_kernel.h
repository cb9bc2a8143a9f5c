// The inner loops of the fem material: elastic forces of whole cells, sixteen (or
// eight, or four) cells at a time.
#pragma once

#include "filigree/physics/body.h"
#include "filigree/physics/body/elasticity.h"

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

/// Energy of a cell of occupied volume V, stable where it is inverted or collapsed [Smith 2018]:
///     V (shear/2 (I - 3) + bulk/2 (J - rest_ratio)^2 - shear/2 log((I + 1) / 4)) less its value at rest.
/// I is the mean of |F|^2 over the cell (an exact integral of the trilinear shape), J the determinant of its mean F:
/// one a cell, so that nothing locks. Small strains see Lame's parameters.
struct CellMaterial {
    float spacing = 0;         ///< m
    float density = 0;         ///< kg/m^3
    float shear = 0, bulk = 0; ///< Pa: 4/3 mu, lambda + 5/6 mu
    float rest_ratio = 0;      ///< J that the volume term alone would like
};
CellMaterial cell_material(const Material& material, double spacing);

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
    std::vector<float> fraction;           ///< padded with zeros
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

/// Forces, N, overwritten. Same bytes for any thread count and any processor. Cost: 10 ns a cell.
ElasticReport forces(const Plan& plan, const Vectors& positions, Vectors& forces, Sums& sums,
                     const RunContext& context);

/// Cells at a time that this processor has an implementation for, ascending; forces takes the fastest.
std::span<const int> lane_counts();
/// The same by one of them, so that tests can hold them against each other.
ElasticReport forces(const Plan& plan, const Vectors& positions, Vectors& forces, Sums& sums, int lanes,
                     const RunContext& context);

} // namespace filigree::cell_kernel
