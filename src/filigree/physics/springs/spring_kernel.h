// Springs on the lattice of cells: which there are, in the order their loops want, and those loops. Private to the
// layer.
#pragma once

#include "filigree/physics/body.h"

namespace filigree::spring_kernel {

/// Where a particle's neighbours are, in lattice steps: along axes, across faces, then the second ones along axes. The
/// opposite of a step is its number ^ 1.
constexpr std::size_t kAxis = 6, kFace = 12, kStencil = 2 * kAxis + kFace;

/// The springs at one particle, one a step of the stencil; kNoIndex where there is none.
struct Star {
    std::array<Index, kStencil> other;
    std::array<float, kStencil> stiffness;
};
std::vector<Star> make_stars(const Body& body);

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
Runs make_runs(const std::vector<Star>& stars);

/// Rest length and direction of each step of the stencil.
struct Step {
    float rest, least_squared; // m, m^2
    Vec3f least;               // at least length, along the direction at rest
};
std::array<Step, kStencil> make_steps(double spacing);

/// Spring forces of runs [begin, end).
struct ForceJob {
    const Run* runs;
    const Slot* slots;
    const float* stiffness;
    const Step* steps;
    const float* inverse_mass;
    const float *x, *y, *z;
    float *fx, *fy, *fz;
    float* squared_frequency; // one a run: bound on the largest eigenvalue of M^-1 K, 1/s^2
};

/// Volume ratios of the cells in runs [begin, end).
struct VolumeJob {
    const Cells::Run* runs;
    const float *x, *y, *z;
    float inverse_cube; // 1 / h^3
    float* least;       // one a cell: of the eight corners' volume ratios
    struct Found {
        float least_corner, least, most_squared; // volume ratios at corners and centres; |4h F|^2
    };
    Found* found; // one a run
};

/// Both loops in one vector width. The same bytes in any.
struct Kernels {
    void (*spring_forces)(const ForceJob&, std::size_t begin, std::size_t end);
    void (*cell_volumes)(const VolumeJob&, std::size_t begin, std::size_t end);
};
Kernels widest_kernels();

} // namespace filigree::spring_kernel
