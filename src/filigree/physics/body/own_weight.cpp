#include "filigree/physics/body/own_weight.h"

#include "filigree/core/math.h"
#include "filigree/core/text.h"

#include <cmath>
#include <cstdio>

namespace filigree {

namespace {

constexpr double kGoodStrain = 0.1; ///< with what is proposed

std::string rounded(const char* format, double x) {
    char text[32];
    std::snprintf(text, sizeof text, format, x);
    return text;
}

/// Rounded down to one digit.
double one_digit(double x) {
    const double unit = math::power_of_ten(int(std::floor(math::log10(x))));
    return std::floor(x / unit * (1 + 1e-9)) * unit;
}

std::string mass_text(double kilograms) {
    if (kilograms >= 1e5) return with_commas(std::uint64_t(std::lround(kilograms / 1000))) + " t";
    if (kilograms >= 1000) return rounded("%.2g t", kilograms / 1000);
    return kilograms >= 1 ? rounded("%.3g kg", kilograms) : rounded("%.3g g", 1000 * kilograms);
}

/// m along a direction of the body at rest.
double extent(const Body& body, const Vec3d& along) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    const auto add = [&](const Vec3f& point) {
        const double at = along.dot(point.cast<double>());
        low = std::min(low, at);
        high = std::max(high, at);
    };
    for (const Vec3f& point : body.surface.points.rest) add(point);
    if (body.surface.points.size() == 0)
        for (std::size_t i = 0; i < body.rest.size(); ++i) add(body.rest[i]);
    return high > low ? high - low : 0;
}

/// Matter that is meant to flow from the start.
bool is_fluid(const Material& material) { return material.melts() && material.temperature > material.melting_from; }

} // namespace

OwnWeight own_weight(const Body& body, const Mat3d& turn, const Vec3d& gravity) {
    OwnWeight weight;
    for (const float part : body.mass) weight.mass += double(part);
    if (!(gravity.norm() > 0)) return weight;
    weight.height = extent(body, turn.transpose() * gravity.normalized());
    const Material& of = body.material;
    weight.young_modulus = of.young_modulus;
    if (of.model == MaterialModel::rigid || is_fluid(of)) return weight;
    weight.strain = of.density * gravity.norm() * weight.height / of.young_modulus;
    if (weight.strain > kMostOwnStrain) weight.smaller = kGoodStrain / weight.strain;
    return weight;
}

double OwnWeight::size_that_does(double size) const { return one_digit(smaller * size); }

std::string OwnWeight::sentence(const std::string& material) const {
    if (!is_too_much()) return "";
    return "is " + rounded("%.2g", height) + " m high and weighs " + mass_text(mass) + "; " + material +
           " of that size cannot carry itself";
}

} // namespace filigree
