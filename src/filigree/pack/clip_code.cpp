#include "filigree/pack/clip_code.h"

#include "filigree/core/dense_solve.h"
#include "filigree/pack/symbols.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace filigree {

namespace {

// Contexts. Curves that matter less have smaller coefficients: so has each its own, and the last ones share.
constexpr unsigned kCurveContexts = 40, kKinds = 3, kCurveEntry = 2, kCoefficient = kCurveEntry + 2,
                   kClipContexts = kCoefficient + kCurveContexts * kKinds;
constexpr std::int32_t kCurveOne = 1 << 19; // entries of curves are shares of it: fine enough for whole positions
constexpr std::int32_t kLargestCoefficient = 1 << 25;

/// Positions are one kind of numbers, gradients' diagonals another, the rest of them a third.
unsigned kind_of(std::size_t number) { return number < 3 ? 0 : (number - 3) % 4 == 0 ? 1 : 2; }
unsigned coefficient_context(std::size_t curve, std::size_t number) {
    return kCoefficient + unsigned(std::min<std::size_t>(curve, kCurveContexts - 1)) * kKinds + kind_of(number);
}

void bits_of(SymbolWriter& out, float value) { out.bits(std::bit_cast<std::uint32_t>(value), 32); }

} // namespace

ClipOrder clip_order(std::span<const Index> face_offsets, std::span<const Index> corners, std::size_t vertices) {
    std::vector<std::vector<Index>> neighbours(vertices);
    for (std::size_t f = 0; f + 1 < face_offsets.size(); ++f)
        for (Index c = face_offsets[f]; c < face_offsets[f + 1]; ++c) {
            const Index a = corners[c], b = corners[c + 1 < face_offsets[f + 1] ? c + 1 : face_offsets[f]];
            neighbours[a].push_back(b);
            neighbours[b].push_back(a);
        }
    ClipOrder order;
    std::vector<bool> is_known(vertices);
    for (Index start = 0; start < vertices; ++start) {
        if (is_known[start]) continue;
        is_known[start] = true;
        std::size_t next = order.vertex.size();
        order.vertex.push_back(start);
        order.near.push_back(kNoIndex);
        for (; next < order.vertex.size(); ++next) {
            std::vector<Index>& around = neighbours[order.vertex[next]];
            std::ranges::sort(around);
            for (const Index v : around) {
                if (is_known[v]) continue;
                is_known[v] = true;
                order.near.push_back(order.vertex[next]);
                order.vertex.push_back(v);
            }
        }
    }
    return order;
}

std::string encode_clip(const ClipFrames& frames, std::span<const double> weights, double error,
                        const ClipOrder& order) {
    const auto count = Eigen::Index(frames.size()), numbers = Eigen::Index(frames[0].size());
    Eigen::MatrixXd values(numbers, count);
    for (Eigen::Index t = 0; t < count; ++t)
        for (Eigen::Index i = 0; i < numbers; ++i)
            values(i, t) = double(frames[std::size_t(t)][std::size_t(i)]) * weights[std::size_t(i) % weights.size()];
    const auto [eigenvalues, eigenvectors] = symmetric_eigen(Eigen::MatrixXd(values.transpose() * values));

    // Half of the error's square is for curves that are left out, half for rounding. Eigenvalues ascend.
    const double allowed = error * error * double(numbers) * double(count) / 2;
    Eigen::Index left_out = 0;
    for (double lost = 0; left_out < count; ++left_out) {
        lost += std::max(0.0, eigenvalues[left_out]);
        if (lost > allowed) break;
    }
    const auto curve_count = std::size_t(count - left_out);
    const double step =
        error * std::sqrt(6.0 * double(count) / double(std::max<std::size_t>(curve_count, 1))); // 12 / 2

    SymbolWriter out(kClipContexts);
    out.number(0, static_cast<std::uint32_t>(count));
    out.number(0, static_cast<std::uint32_t>(curve_count));
    bits_of(out, static_cast<float>(step));
    for (const double weight : weights) bits_of(out, static_cast<float>(1 / weight));
    // The coefficients fit the curves as they are read: rounded ones are not quite at right angles.
    Eigen::MatrixXd curves(count, Eigen::Index(curve_count));
    for (std::size_t c = 0; c < curve_count; ++c) {
        std::int32_t before = 0, slope = 0;
        for (Eigen::Index t = 0; t < count; ++t) {
            const auto entry = std::int32_t(std::lround(eigenvectors(t, count - 1 - Eigen::Index(c)) * kCurveOne));
            out.number_with_sign(kCurveEntry + (t > 0), entry - before - slope);
            slope = t > 0 ? entry - before : 0;
            before = entry;
            curves(t, Eigen::Index(c)) = double(entry) / kCurveOne;
        }
    }
    Eigen::MatrixXd coefficients = values * curves;
    if (curve_count > 0) {
        const Eigen::MatrixXd gram = curves.transpose() * curves;
        coefficients = solve_semidefinite(gram, coefficients.transpose()).transpose();
    }
    for (std::size_t c = 0; c < curve_count; ++c) {
        const auto steps = [&](std::size_t v, std::size_t k) {
            const double value = coefficients(Eigen::Index(v * weights.size() + k), Eigen::Index(c)) / step;
            return std::int32_t(
                std::lround(std::clamp(value, -double(kLargestCoefficient), double(kLargestCoefficient))));
        };
        for (std::size_t i = 0; i < order.vertex.size(); ++i)
            for (std::size_t k = 0; k < weights.size(); ++k) {
                const std::int32_t expected = order.near[i] != kNoIndex ? steps(order.near[i], k) : 0;
                out.number_with_sign(coefficient_context(c, k), steps(order.vertex[i], k) - expected);
            }
    }
    return out.finish();
}

std::optional<ClipFrames> decode_clip(std::string_view stream, std::size_t numbers, const ClipOrder& order,
                                      std::size_t most_frames) {
    SymbolReader in(stream, kClipContexts);
    const std::size_t count = in.number(0), curve_count = in.number(0), vertices = order.vertex.size();
    if (in.is_damaged() || count == 0 || count > std::min(most_frames, kClipFrames) || curve_count > count)
        return std::nullopt;
    const auto real = [&] { return std::bit_cast<float>(in.bits(32)); };
    const float step = real();
    std::vector<float> shares; // of each number, what one step is
    for (std::size_t k = 0; k < numbers; ++k) shares.push_back(real() * step);
    if (!std::ranges::all_of(shares, [](float share) { return std::isfinite(share * float(1 << 30)); }))
        return std::nullopt;
    std::vector<std::vector<float>> curves(curve_count, std::vector<float>(count));
    for (std::vector<float>& curve : curves) {
        std::int32_t before = 0, slope = 0;
        for (std::size_t t = 0; t < count; ++t) {
            const std::int64_t entry = std::int64_t{before} + slope + in.number_with_sign(kCurveEntry + (t > 0));
            if (std::abs(entry) > 2 * kCurveOne) return std::nullopt;
            slope = t > 0 ? std::int32_t(entry) - before : 0;
            before = std::int32_t(entry);
            curve[t] = float(before) / kCurveOne;
        }
    }
    ClipFrames frames(count, std::vector<float>(vertices * numbers, 0.0f));
    std::vector<std::int32_t> steps(vertices * numbers);
    for (std::size_t c = 0; c < curve_count; ++c) {
        for (std::size_t i = 0; i < vertices; ++i)
            for (std::size_t k = 0; k < numbers; ++k) {
                const std::int64_t expected = order.near[i] != kNoIndex ? steps[order.near[i] * numbers + k] : 0;
                const std::int64_t value = expected + in.number_with_sign(coefficient_context(c, k));
                if (std::abs(value) > kLargestCoefficient || in.is_damaged()) return std::nullopt;
                steps[order.vertex[i] * numbers + k] = std::int32_t(value);
            }
        for (std::size_t t = 0; t < count; ++t)
            for (std::size_t v = 0; v < vertices; ++v)
                for (std::size_t k = 0; k < numbers; ++k)
                    frames[t][v * numbers + k] += curves[c][t] * shares[k] * float(steps[v * numbers + k]);
    }
    return frames;
}

} // namespace filigree
