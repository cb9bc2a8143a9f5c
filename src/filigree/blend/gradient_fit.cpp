#include "filigree/blend/gradient_fit.h"

#include "filigree/core/parallel_for.h"

#ifndef FLG_WITH_FIT_TERMS
#define FLG_WITH_FIT_TERMS
#endif
#include "runtime/rt_fit.h"

#include <algorithm>
#include <new>

namespace filigree {

void GradientFit::Free::operator()(flg_fit* fit) const { flg_fit_free(fit); }

GradientFit::GradientFit(const Mesh& driver, const RunContext& context) {
    const std::size_t count = driver.vertex_count();
    if (count == 0) return;
    const flg_faces faces{driver.corners.data(), driver.face_offsets.data(), driver.face_count()};
    const flg_allocator heap = flg_default_allocator();
    fit_.reset(
        flg_fit_begin(driver.positions.front().data(), static_cast<Index>(count), &faces, flg_kernel_of(0), &heap));
    if (!fit_) throw std::bad_alloc();
    const std::size_t grain = std::max<std::size_t>(256, count / 64); // each piece marks all vertices once
    parallel_for(context, count, grain, [&](std::size_t begin, std::size_t end) {
        std::vector<std::max_align_t> scratch(
            flg_fit_scratch_bytes(static_cast<Index>(count)) / sizeof(std::max_align_t) + 1);
        flg_fit_solve(fit_.get(), static_cast<Index>(begin), static_cast<Index>(end), scratch.data());
    });
    flg_fit_end(fit_.get());
}

std::vector<Mat3f> GradientFit::fit(std::span<const Vec3f> positions, const RunContext& context) const {
    std::vector<Mat3f> gradients(positions.size());
    if (!fit_) return gradients;
    parallel_for(context, gradients.size(), 256, [&](std::size_t begin, std::size_t end) {
        flg_fit_gradients(fit_.get(), positions.front().data(), static_cast<Index>(begin), static_cast<Index>(end),
                          gradients.front().data());
    });
    return gradients;
}

GradientFit::Terms GradientFit::terms(Index vertex) const {
    flg_fit_terms found;
    flg_fit_terms_of(fit_.get(), vertex, &found);
    Terms terms;
    for (std::uint32_t j = 0; j < found.count; ++j) {
        terms.vertices.push_back(found.vertices[j]);
        terms.weights.push_back({found.weights[j][0], found.weights[j][1], found.weights[j][2]});
    }
    terms.constant = Eigen::Map<const Mat3f>(found.constant);
    terms.line = Eigen::Map<const Vec3f>(found.line);
    terms.normal = Eigen::Map<const Vec3f>(found.normal);
    terms.beside_line = found.beside_line;
    terms.off_plane = found.off_plane;
    return terms;
}

} // namespace filigree
