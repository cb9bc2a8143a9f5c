// What materials without memory leave as it is.
#include "filigree/physics/elasticity.h"

namespace filigree {

void Elasticity::finish_substep(const Vectors&, float, const RunContext&) {}
bool Elasticity::wants_renewal() const { return false; }
void Elasticity::renew(const Vectors&, const RunContext&) {}
std::string Elasticity::state() const { return {}; }
bool Elasticity::restore_state(std::string_view bytes) { return bytes.empty(); }

} // namespace filigree
