#include "filigree/hierarchy/sampled_restorer.h"

#include "filigree/core/random.h"
#include "filigree/hierarchy/blend_code.h"

#include <cmath>

namespace filigree {

std::vector<BlendRestorer::Item> SampledRestorer::sample(std::size_t all, std::size_t most) {
    const std::size_t some = std::min(all, most);
    std::vector<BlendRestorer::Item> items;
    for (std::size_t k = 0; k < some; ++k) {
        const double place = some < all ? double(k) + random_unit(1, k) : double(k);
        items.push_back({static_cast<Index>(place * double(all) / double(some)), static_cast<Index>(k)});
    }
    return items;
}

SampledRestorer::SampledRestorer(const Model& model, std::size_t most, const RunContext& context)
    : items_(sample(model.vertex_count(), most)),
      restorer_(model.detail, model.mesh.positions, model.driver().vertices, items_, {}, context) {
    for (const BlendRestorer::Item& item : items_) rest_.push_back(model.mesh.positions[item.vertex]);
}

double SampledRestorer::rms_distance(std::span<const Vec3f> driver, std::span<const Mat3f> gradients,
                                     std::span<const Vec3f> truth, const RunContext& context) const {
    if (truth.empty()) return 0;
    std::vector<Vec3f> restored(rest_.size());
    restorer_.restore(driver, gradients, restored, {}, true, context);
    double squared = 0;
    for (std::size_t k = 0; k < truth.size(); ++k)
        squared += (restored[k].cast<double>() - truth[k].cast<double>()).squaredNorm();
    return std::sqrt(squared / double(truth.size()));
}

} // namespace filigree
