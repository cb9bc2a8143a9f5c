#include "filigree/physics/material.h"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(Material, DefaultsAreSoundForEveryModel) {
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::springs, MaterialModel::meshfree}) {
        Material material;
        material.model = model;
        EXPECT_EQ(check_material(material), "");
    }
}

TEST(Material, WaveSpeedIsThatOfLamesParameters) {
    Material material;
    material.young_modulus = 2e5;
    material.density = 800;
    material.poisson_ratio = 0;
    EXPECT_DOUBLE_EQ(pressure_wave_speed(material), std::sqrt(2e5 / 800));
    material.poisson_ratio = 0.25; // lambda = mu = 0.4 E
    EXPECT_DOUBLE_EQ(pressure_wave_speed(material), std::sqrt(1.2 * 2e5 / 800));
    material.poisson_ratio = 0.4;
    material.model = MaterialModel::springs; // always 1/4
    EXPECT_DOUBLE_EQ(pressure_wave_speed(material), std::sqrt(1.2 * 2e5 / 800));
}

TEST(Material, SaysWhatIsWrong) {
    const double nan = std::nan(""), infinite = Material::kNever;
    struct Case {
        std::function<void(Material&)> spoil;
        std::string word;
    };
    const std::vector<Case> cases = {
        {[](Material& m) { m.density = 0; }, "density"},
        {[=](Material& m) { m.density = nan; }, "density"},
        {[](Material& m) { m.young_modulus = -1; }, "Young"},
        {[=](Material& m) { m.young_modulus = infinite; }, "Young"},
        {[](Material& m) { m.young_modulus = 1e-46; }, "1e-9 to 1e12 Pa"}, // 0 as a float
        {[](Material& m) { m.poisson_ratio = 0.5; }, "Poisson"},
        {[=](Material& m) { m.poisson_ratio = nan; }, "Poisson"},
        {[](Material& m) { m.damping = -0.1; }, "damping"},
        {[](Material& m) { m.internal_damping = -0.1; }, "internal damping"},
        {[](Material& m) { m.bending = 0.3; }, "bending"},
        {[](Material& m) { m.yield_stress = 0; }, "yield"},
        {[](Material& m) { m.creep_time = -1; }, "creep"},
        {[](Material& m) { m.temperature = 0; }, "temperature"},
        {[](Material& m) { m.melting_from = 400, m.melting_to = 300; }, "temperature"},
        {[](Material& m) { m.viscosity = 0; }, "viscosity"},
        {[=](Material& m) { m.heating = nan; }, "heating"},
        {[](Material& m) { m.conductivity = -1; }, "conductivity"},
        {[](Material& m) { m.model = MaterialModel::springs, m.yield_stress = 1e3; }, "fem"},
        {[](Material& m) { m.model = MaterialModel::fem, m.melting_from = m.melting_to = 300; }, "mpm"},
        {[](Material& m) { m.model = MaterialModel::springs, m.melting_from = m.melting_to = 300; }, "mpm"},
        {[](Material& m) { m.melting_from = m.melting_to = 300; }, "Only the model mpm melts"}};
    for (std::size_t c = 0; c < cases.size(); ++c) {
        Material material;
        material.model = MaterialModel::meshfree;
        cases[c].spoil(material);
        EXPECT_NE(check_material(material).find(cases[c].word), std::string::npos)
            << c << ": " << check_material(material);
    }
}

} // namespace
} // namespace filigree
