// Which material is whose; and what those without memory leave as it is.
#include "filigree/physics/body/elasticity.h"

#include "filigree/physics/body.h"
#include "filigree/physics/fem/plastic_cells.h"
#include "filigree/physics/rigid/rigid_body.h"

namespace filigree {

void Elasticity::finish_substep(const Vectors&, float, const RunContext&) {}
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
