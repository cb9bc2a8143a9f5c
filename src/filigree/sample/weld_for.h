// The method that decides about a mesh, and the mesh ready for it.
#pragma once

#include "filigree/sample/closure.h"

namespace filigree {

/// Welds, chooses the method where it is automatic, and refuses what that method cannot do.
/// Errors: unsuitable (no faces; scan or rays of an open mesh: the sentence names an open edge), cancelled.
Result<WeldedTriangles> weld_for(InsideMethod& method, const Mesh& mesh, const RunContext& context);

} // namespace filigree
