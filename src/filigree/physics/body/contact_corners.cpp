#include "filigree/physics/body/contact_corners.h"

#include "filigree/core/parallel_for.h"

#include <numeric>

namespace filigree {

namespace {

constexpr std::size_t kContactCornersGrain = 512;

} // namespace

ContactCorners::ContactCorners(const Embedding& carried, std::size_t particles)
    : carried_(&carried), positions_(carried.size()), velocities_(carried.size()), forces_(carried.size()),
      offsets_(particles + 1, 0), corners_(carried.particles.size()), weights_(carried.particles.size()) {
    for (const Index particle : carried.particles) ++offsets_[particle + 1];
    std::partial_sum(offsets_.begin(), offsets_.end(), offsets_.begin());
    std::vector<Index> next(offsets_.begin(), offsets_.end() - 1);
    for (Index corner = 0; corner < carried.size(); ++corner)
        for (Index k = carried.offsets[corner]; k < carried.offsets[corner + 1]; ++k) {
            const Index at = next[carried.particles[k]]++;
            corners_[at] = corner;
            weights_[at] = carried.weights[k];
        }
}

/// Numbers as long as the particles are some, also where sums are not.
void ContactCorners::place(const Vectors& positions, const Vectors& velocities, const RunContext& context) {
    parallel_for(context, carried_->size(), kContactCornersGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t corner = begin; corner < end; ++corner) {
            Vec3f place = Vec3f::Zero(), velocity = Vec3f::Zero();
            for (Index k = carried_->offsets[corner]; k < carried_->offsets[corner + 1]; ++k) {
                place += carried_->weights[k] * positions[carried_->particles[k]];
                velocity += carried_->weights[k] * velocities[carried_->particles[k]];
            }
            const Index first = carried_->particles[carried_->offsets[corner]];
            positions_.set(corner, place.allFinite() ? place : positions[first]);
            velocities_.set(corner, velocity.allFinite() ? velocity : velocities[first]);
        }
    });
}

void ContactCorners::follow(Index particle, const Vec3f& way, const Vec3f& velocity) {
    for (Index k = offsets_[particle]; k < offsets_[particle + 1]; ++k) {
        positions_.add(corners_[k], weights_[k] * way);
        velocities_.add(corners_[k], weights_[k] * velocity);
    }
}

void ContactCorners::give_forces(Vectors& to, const RunContext& context) {
    parallel_for(context, to.size(), kContactCornersGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Vec3f sum = Vec3f::Zero();
            for (Index k = offsets_[i]; k < offsets_[i + 1]; ++k) sum += weights_[k] * forces_[corners_[k]];
            to.add(i, sum);
        }
    });
    forces_ = Vectors(forces_.size());
}

} // namespace filigree
