#include "filigree/physics/meshfree/meshfree_plastic.h"

#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/physics/fem/plasticity.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace filigree::meshfree {

namespace {

constexpr std::size_t kMeshfreePlasticGrain = 256;

void yield_particle(Mat3f& inverse, const Mat3f& gradient, const FlowLaw& law) {
    const Mat3f elastic = gradient * inverse;
    if (!(elastic.determinant() > kLeastYielding)) return;
    Mat3f R;
    if (!filigree::flow(elastic, law, R)) return;
    Mat3f after = inverse * R;
    after /= math::cbrt(after.determinant());
    if (!after.allFinite() || (flowed(after) > kMostFlowed && flowed(after) > flowed(inverse))) return;
    inverse = after;
}

} // namespace

PlasticParticles::PlasticParticles(const Body& body) : body_(body) {
    if (body.material.is_plastic()) inverse_.assign(body.particle_count(), Mat3f::Identity());
}

void PlasticParticles::yield(const MlsNeighbours& neighbours, const Float4* position, float dt,
                             const RunContext& context) {
    const FlowLaw law = yield_law(body_.material, dt);
    parallel_for(context, inverse_.size(), kMeshfreePlasticGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            yield_particle(inverse_[i], to_matrix(gather_gradient(neighbours, position, i)), law);
    });
}

std::size_t PlasticParticles::flowed_out() const {
    return std::size_t(std::ranges::count_if(inverse_, has_flowed_out));
}

bool PlasticParticles::remember(std::vector<Mat3f> inverse) {
    const auto is_sound = [](const Mat3f& D) { return D.allFinite() && std::abs(D.determinant() - 1) < 0.1f; };
    if (inverse.size() != inverse_.size() || !std::ranges::all_of(inverse, is_sound)) return false;
    inverse_ = std::move(inverse);
    return true;
}

} // namespace filigree::meshfree
