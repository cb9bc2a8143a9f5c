// A particle of the material point method, and how its matter answers. Private to the layer.
// Based on:
// [Hu 2018] A moving least squares material point method with displacement discontinuity and two-way rigid body
//           coupling
// [Simo 1988] the isochoric return map, with the elastic left Cauchy-Green tensor in place of gradients
#pragma once

#include "filigree/core/lanes.h"
#include "filigree/physics/material.h"
#include "filigree/types.h"

#include <cstdint>
#include <span>

namespace filigree::mpm {

using Float4 = Lanes<4>::Float;

/// Two cache lines.
struct alignas(16) Particle {
    float x[3], mass;      ///< m, kg
    float v[3], volume;    ///< m/s; m^3 at rest
    float c[3][4];         ///< columns of the velocity's gradient, 1/s; fourth: J, plastic strain, enthalpy (J/kg)
    float b[6];            ///< elastic left Cauchy-Green tensor of determinant 1: xx, yy, zz, xy, xz, yz
    float renewal;         ///< 0: as it was at the start, 1: new matter; never falls
    float melted;          ///< 1: has been fluid, and has grown together with whatever it met
    float warming[3];      ///< gradient of the temperature, K/m
    float enthalpy_beside; ///< J/kg that the enthalpy has no digits for: heat that comes slowly adds up here

    bool is_sound() const; ///< all that it carries is finite, and its volume ratio is one that deform leaves
    float volume_ratio() const { return c[0][3]; }
    float& volume_ratio() { return c[0][3]; }
    float plastic_strain() const { return c[1][3]; }
    float& plastic_strain() { return c[1][3]; }
    float enthalpy() const { return c[2][3]; }
    float& enthalpy() { return c[2][3]; }
    /// A sum whose rounding is carried on [Kahan 1965]: a float's last digit is 0.06 J/kg, more than a substep brings.
    void add_heat(float joules_a_kilogram) {
        const float wanted = joules_a_kilogram + enthalpy_beside, before = enthalpy();
        enthalpy() = before + wanted;
        enthalpy_beside = wanted - (enthalpy() - before);
        if (!(enthalpy() >= 0)) enthalpy() = enthalpy_beside = 0;
    }
};
static_assert(sizeof(Particle) == 128);

/// A material as the particles' loop wants it.
class Matter {
public:
    /// heat_pace: as World has it.
    Matter(const Material& material, double heat_pace);

    /// K, of so much enthalpy, J/kg (0 at 0 K).
    float temperature(float enthalpy) const;
    float enthalpy(float temperature) const;
    float liquid(float enthalpy) const; ///< 0 solid .. 1 fluid

    float density() const { return density_; }
    float damping() const { return damping_; }
    float heating() const { return heating_; }
    float specific_heat() const { return specific_heat_; }
    float heat_conductivity() const { return diffusivity_ * density_ * specific_heat_; } ///< W/(m K)
    bool has_heat() const { return has_heat_; }

    /// s, the longest step that is stable on a grid of this spacing, m; without what moves.
    float longest_step(float grid_spacing) const;
    float longest_elastic_step(float grid_spacing) const; ///< s: of its waves alone
    /// Viscosity is limited to what steps a quarter as long as elasticity's can carry, on this grid.
    void limit_viscosity(float grid_spacing);

    /// Volume times Kirchhoff stress (J/m^3 m^3) of the particle: xx, yy, zz, xy, xz, yz.
    void stress(const Particle& particle, float stress[6]) const;
    /// What particles of these numbers remember after a step dt in which c was the velocity's gradient. width: what the
    /// processor has, or less, for tests; every width gives the same bytes.
    void deform(std::span<const std::uint32_t> numbers, Particle* particles, float dt,
                VectorWidth width = widest_vectors()) const;
    double energy(const Particle& particle) const; ///< J, elastic

private:
    template <int N>
    void deform_lanes(std::span<const std::uint32_t> numbers, Particle* particles, float dt) const;
    void deform_wide(std::span<const std::uint32_t> numbers, Particle* particles, float dt) const;

    float density_, bulk_, shear_, yield_, viscosity_, damping_;
    float melting_from_, melting_to_, specific_heat_, latent_heat_, diffusivity_, heating_;
    bool melts_, has_heat_;
};

} // namespace filigree::mpm
