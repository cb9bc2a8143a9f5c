// Sums and products of doubles with what their rounding left out.
#pragma once

namespace filigree {

/// high + low, the exact result; high is the rounded one.
struct ExactPair {
    double high, low;
};

/// [Knuth 1969]
inline ExactPair exact_sum(double a, double b) {
    const double sum = a + b;
    const double b_part = sum - a, a_part = sum - b_part;
    return {sum, (a - a_part) + (b - b_part)};
}

/// Of |a| >= |b| or a == 0.
inline ExactPair exact_ordered_sum(double a, double b) {
    const double sum = a + b;
    return {sum, b - (sum - a)};
}

/// [Dekker 1971]; the standard library's fused multiply-add is not exact everywhere. Exact while the product and its
/// low part are neither above 1e290 nor below 1e-290.
inline ExactPair exact_product(double a, double b) {
    const auto upper_half = [](double x) {
        const double wide = 0x1.0000002p27 * x;
        return wide - (wide - x);
    };
    const double a_high = upper_half(a), a_low = a - a_high, b_high = upper_half(b), b_low = b - b_high;
    const double product = a * b;
    return {product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low};
}

/// The low part to its own precision.
inline ExactPair long_quotient(double a, double b) {
    const double quotient = a / b;
    const ExactPair product = exact_product(quotient, b);
    return {quotient, ((a - product.high) - product.low) / b};
}

} // namespace filigree
