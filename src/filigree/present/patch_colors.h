// A colour for every patch of regular quads, other than those of its neighbours.
#pragma once

#include "filigree/mesh.h"

namespace filigree {

/// One of category_colors() a patch: the one that differs most from those its neighbours have by then.
std::vector<Index> choose_patch_colors(const RegularPatches& patches);

/// A label a face, its patch's colour; the labels' names are empty. most_levels, errors: as of find_regular_patches.
Result<FaceLabels> patch_labels(const Mesh& mesh, unsigned most_levels, const RunContext& context);

} // namespace filigree
