// Bodies that several tests put into worlds, and where they are.
#pragma once

#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/simulation.h"

namespace filigree {

/// Of whole cells, about the origin.
inline std::shared_ptr<const Body> block(std::size_t nx, std::size_t ny, std::size_t nz, double spacing,
                                         const Material& material) {
    const Vec3d half = 0.5 * spacing * Vec3d(double(nx), double(ny), double(nz));
    return std::make_shared<Body>(make_body(box_cells(nx, ny, nz, spacing, -half), material));
}

/// Two arms, one spacing apart, on a foot.
inline Cells fork() {
    std::vector<Cells::LatticeIndex> cells;
    for (std::uint16_t k = 0; k < 3; ++k)
        for (std::uint16_t j = 0; j < 14; ++j)
            for (std::uint16_t i = 0; i < 7; ++i)
                if (j < 3 || i < 3 || i > 3) cells.push_back({i, j, k});
    return lattice_cells(std::move(cells), 0.1, Vec3d(-0.35, 0, -0.15));
}

/// 1,000 kg/m^3, 1e6 Pa, without damping.
inline Material undamped(double poisson_ratio) {
    Material material;
    material.density = 1000;
    material.young_modulus = 1e6;
    material.poisson_ratio = poisson_ratio;
    material.damping = 0;
    return material;
}

inline Vec3d centre_of_mass(const Simulation& simulation, std::size_t body = 0) {
    Vec3d sum = Vec3d::Zero();
    double mass = 0;
    for (std::size_t i = 0; i < simulation.body(body).particle_count(); ++i) {
        const double m = double(simulation.body(body).mass[i]);
        sum += m * simulation.positions(body)[i].cast<double>();
        mass += m;
    }
    return sum / mass;
}

} // namespace filigree
