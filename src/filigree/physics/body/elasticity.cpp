// Which material is whose; and what those without memory leave as it is.
#include "filigree/physics/body/elasticity.h"

#include "filigree/physics/body.h"
#include "filigree/physics/fem/plastic_cells.h"
#include "filigree/physics/rigid/rigid_body.h"

#include <algorithm>

namespace filigree {

ElasticReport Elasticity::damped_forces(const Vectors& positions, const InternalDamping& damping, Vectors& forces,
                                        const RunContext& context) {
    const ElasticReport& before = damping.before;
    const float stiff = before.squared_frequency > damping.stiffest ? damping.stiffest / before.squared_frequency : 1;
    const float seconds = std::max(damping.seconds * stiff, damping.crushed_at(before.least_volume_ratio));
    Vectors ahead = positions;
    for (const auto axis : kVectorAxes)
        for (std::size_t i = 0; i < ahead.size(); ++i) (ahead.*axis)[i] += seconds * (damping.velocities.*axis)[i];
    ElasticReport report = this->forces(ahead, forces, context);
    report.damping_rate = seconds * report.squared_frequency;
    return report;
}
void Elasticity::finish_substep(const Vectors&, float, const RunContext&) {}
void Elasticity::set_crush_share(float) {}
bool Elasticity::can_grow() const { return false; }
void Elasticity::set_rest_stretches(std::span<const RestStretch>, std::span<const RestStretch>) {}
void Elasticity::set_part_of_frame(float) {}
std::size_t Elasticity::flowed_out() const { return 0; }
std::span<const PlasticCell> Elasticity::plastic_cells() const { return {}; }
void Elasticity::take_over(std::span<const PlasticCell>, std::span<const Index>) {}
std::string Elasticity::state() const { return {}; }
bool Elasticity::restore_state(std::string_view bytes) { return bytes.empty(); }

std::unique_ptr<Elasticity> make_elasticity(const Body& body, const RunContext& context) {
    const MaterialModel model = body.material.model;
    if (model == MaterialModel::springs) return make_spring_elasticity(body, context);
    if (model == MaterialModel::meshfree) return make_meshfree_elasticity(body, context);
    if (model == MaterialModel::rigid) return make_rigid_elasticity(body);
    if (body.material.is_plastic()) return make_plastic_elasticity(body, context);
    return make_cell_elasticity(body, context);
}

} // namespace filigree
