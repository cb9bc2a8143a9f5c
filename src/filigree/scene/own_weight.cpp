#include "filigree/scene/own_weight.h"

#include "filigree/core/text.h"

#include <cmath>

#include <fmt/format.h>

namespace filigree {

namespace {

constexpr double kMostStrain = 0.25; ///< at the foot
constexpr double kGoodStrain = 0.1;  ///< with what is proposed

/// Rounded down to one digit.
double one_digit(double x) {
    const double unit = std::pow(10, std::floor(std::log10(x)));
    return std::floor(x / unit * (1 + 1e-9)) * unit;
}

std::string mass_text(double kilograms) {
    if (kilograms >= 1e5) return with_commas(std::uint64_t(std::lround(kilograms / 1000))) + " t";
    if (kilograms >= 1000) return fmt::format("{:.2g} t", kilograms / 1000);
    return kilograms >= 1 ? fmt::format("{:.3g} kg", kilograms) : fmt::format("{:.3g} g", 1000 * kilograms);
}

} // namespace

std::string weight_warning(const Body& body, const Box& box, const Mat3d& turn, const Vec3d& gravity,
                           const std::string& material) {
    const Material& of = body.material;
    if (of.model == MaterialModel::rigid || !(gravity.norm() > 0)) return "";
    const Vec3d up = turn.transpose() * -gravity.normalized();
    const double height = body.scale * up.cwiseAbs().dot(box.size());
    const double strain = of.density * gravity.norm() * height / of.young_modulus;
    if (!(strain > kMostStrain)) return "";
    double mass = 0;
    for (const float part : body.mass) mass += double(part);
    const double smaller = kGoodStrain / strain;
    return fmt::format("is {:.2g} m high and weighs {}; {} of that size cannot carry itself: scale = {:.1g}, or "
                       "young_modulus = {:.0e}?",
                       height, mass_text(mass), material, one_digit(smaller * body.scale), of.young_modulus / smaller);
}

} // namespace filigree
