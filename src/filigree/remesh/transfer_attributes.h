// UVs, colours, normals, labels and further numbers, carried from a mesh to another that lies on it.
#pragma once

#include "filigree/remesh.h"

#include "filigree/context.h"
#include "filigree/mesh.h"

#include <vector>

namespace filigree {

/// Gives `to` the attributes of `from`. points: for each vertex of `to` where it lies on `from`.
/// Colours and scalars are interpolated; labels and smoothing groups are those of the face under each face's centre.
/// UVs and normals belong to corners: where `from` has a seam, each face of `to` takes the side that most of it lies
/// on, and its vertices beyond the seam are continued from that side, so that no face stretches across the texture.
/// Values agree across an edge of `from` when they are the same at its ends, whether corners share a value, a vertex or
/// only a position. There is one value a vertex where `to` needs no seam.
/// Normals are renormalised, and left out where `from` has none. Material files and materials are copied.
/// Vertices whose point is none (kNoIndex) take that of the nearest vertex of their faces that has one; in a component
/// without any, colours and scalars are 0, and there are no UVs, normals and labels.
/// Cost O(V + F log F), and a short search per face near a seam. Errors: usage (check_mesh refuses one of the meshes;
/// not one point a vertex of `to`, or one whose corners `from` does not have), cancelled.
Status transfer_attributes(const Mesh& from, std::span<const CornerPoint> points, Mesh& to, const RunContext& context);

} // namespace filigree
