// Quad meshes with subdivision connectivity: a base, whose faces and places are coded as any mesh's, and levels, whose
// faces take no bits and whose vertices are expected on cubics through those that are known, as in four-point
// subdivision [Dyn, Levin and Gregory 1987]. What is left of a place is its wavelet coefficient in the interpolating
// transform [Donoho 1992]; predicted from places as they are read, so that errors do not add up over levels.
#pragma once

#include "filigree/coding/geometry_code.h"
#include "filigree/context.h"
#include "filigree/mesh.h"

#include <optional>

namespace filigree {

/// Contexts of a SymbolWriter that the places of such a mesh take, from 0 on: its base's and its levels'.
inline constexpr unsigned kRegularContexts = kGeometryContexts + 108;

/// Faces and places in the order of their code.
struct CodedShape {
    std::vector<Index> face_offsets = {0}, corners;
    std::vector<FinePlace> places;
};

struct EncodedRegular {
    CodedShape read;                               ///< as it will be read
    std::vector<Index> vertex, face, first_corner; ///< which each was; the corner of the face that is first now
};

/// Writes faces to `faces_out` (kFaceContexts) and the places of all vertices to `places_out`. None: the mesh has no
/// subdivision connectivity, or it is cancelled; both writers are spoilt then. Cost O(V + F).
std::optional<EncodedRegular> encode_regular(const Mesh& mesh, std::span<const FinePlace> places, GeometrySteps steps,
                                             SymbolWriter& faces_out, SymbolWriter& places_out,
                                             const RunContext& context);

/// None: damaged, or it has not so many vertices and corners, or more vertices than its bytes can hold.
std::optional<CodedShape> decode_regular(SymbolReader& faces_in, SymbolReader& places_in, GeometrySteps steps,
                                         std::size_t vertices, std::size_t corners);

} // namespace filigree
