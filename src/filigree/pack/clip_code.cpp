#include "filigree/pack/clip_code.h"

#include "filigree/core/dense_solve.h"
#include "filigree/pack/symbols.h"
#include "runtime/rt_clip.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

namespace filigree {

namespace {

void bits_of(SymbolWriter& out, float value) { out.bits(std::bit_cast<std::uint32_t>(value), 32); }

} // namespace

ClipOrder clip_order(std::span<const Index> face_offsets, std::span<const Index> corners, std::size_t vertices) {
    ClipOrder order;
    order.vertex.resize(vertices);
    std::vector<Index> beside(vertices), starts(vertices + 1);
    std::vector<flg_key> keys(4 * corners.size());
    const flg_faces faces{corners.data(), face_offsets.data(), face_offsets.empty() ? 0 : face_offsets.size() - 1};
    flg_clip_order(&faces, static_cast<std::uint32_t>(corners.size()), static_cast<std::uint32_t>(vertices),
                   order.vertex.data(), beside.data(), keys.data(), starts.data());
    for (const Index v : order.vertex) order.near.push_back(beside[v]);
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

    SymbolWriter out(FLG_CLIP_CONTEXTS);
    out.number(0, static_cast<std::uint32_t>(count));
    out.number(0, static_cast<std::uint32_t>(curve_count));
    bits_of(out, static_cast<float>(step));
    for (const double weight : weights) bits_of(out, static_cast<float>(1 / weight));
    // The coefficients fit the curves as they are read: rounded ones are not quite at right angles.
    Eigen::MatrixXd curves(count, Eigen::Index(curve_count));
    for (std::size_t c = 0; c < curve_count; ++c) {
        std::int32_t before = 0, slope = 0;
        for (Eigen::Index t = 0; t < count; ++t) {
            const auto entry =
                std::int32_t(std::lround(eigenvectors(t, count - 1 - Eigen::Index(c)) * double(FLG_CURVE_ONE)));
            out.number_with_sign(FLG_CURVE_ENTRY + (t > 0), entry - before - slope);
            slope = t > 0 ? entry - before : 0;
            before = entry;
            curves(t, Eigen::Index(c)) = double(entry) / double(FLG_CURVE_ONE);
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
                std::lround(std::clamp(value, -double(FLG_LARGEST_COEFFICIENT), double(FLG_LARGEST_COEFFICIENT))));
        };
        for (std::size_t i = 0; i < order.vertex.size(); ++i)
            for (std::size_t k = 0; k < weights.size(); ++k) {
                const std::int32_t expected = order.near[i] != kNoIndex ? steps(order.near[i], k) : 0;
                out.number_with_sign(flg_coefficient_context(c, k), steps(order.vertex[i], k) - expected);
            }
    }
    return out.finish();
}

std::optional<ClipFrames> decode_clip(std::string_view stream, std::size_t numbers, const ClipOrder& order,
                                      std::size_t most_frames) {
    const std::uint32_t count = flg_clip_frames(stream.data(), stream.size());
    if (count == 0 || count > most_frames) return std::nullopt;
    const std::size_t vertices = order.vertex.size(), all = vertices * numbers;
    std::vector<Index> beside(vertices);
    for (std::size_t i = 0; i < vertices; ++i) beside[order.vertex[i]] = order.near[i];
    std::vector<float> block(count * all);
    std::vector<std::max_align_t> scratch(flg_clip_scratch_bytes(all) / sizeof(std::max_align_t) + 1);
    if (flg_read_clip(stream.data(), stream.size(), static_cast<std::uint32_t>(numbers), order.vertex.data(),
                      beside.data(), static_cast<std::uint32_t>(vertices), block.data(), scratch.data()) == 0)
        return std::nullopt;
    ClipFrames frames;
    for (std::size_t t = 0; t < count; ++t) frames.emplace_back(block.begin() + t * all, block.begin() + (t + 1) * all);
    return frames;
}

} // namespace filigree
