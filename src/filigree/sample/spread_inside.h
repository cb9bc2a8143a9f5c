// Points inside a mesh, on a lattice or in less regular places.
#pragma once

#include "filigree/sample/sample_inside.h"

namespace filigree {

/// How points are spread. jitter: each lattice point somewhere in its own cell. poisson: in random places, none closer
/// to another than 0.8 of the spacing. All of them inside; seeded by the context.
enum class Pattern { lattice, jitter, poisson };

/// Points inside, relative to the mesh's origin. Memory: a bit a lattice point; 24 bytes a point, for poisson about
/// 100. Cost: that of sample_inside; jitter asks about one to eight places a point, poisson about eight. Errors: as
/// InsideSampler.
Result<std::vector<Vec3d>> spread_inside(const Mesh& mesh, const Lattice& lattice, Pattern pattern,
                                         const InsideOptions& options, const RunContext& context,
                                         InsideReport* report = nullptr);

} // namespace filigree
