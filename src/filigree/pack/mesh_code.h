// Whole meshes in few bits: faces, places, attributes, each in a stream of its own. docs/packing.md says what it rests
// on.
#pragma once

#include "filigree/pack.h"

#include "filigree/context.h"
#include "filigree/mesh.h"
#include "filigree/pack/coded_levels.h"
#include "filigree/result.h"

#include <string>

namespace filigree {

/// A mesh as streams. Names of objects, groups, materials and scalars, and embedded pictures are not in them: they are
/// the mesh's own still, in `rest`, which has no vertices and no faces.
struct PackedMesh {
    std::uint64_t vertices = 0, faces = 0, corners = 0;
    std::array<double, 3> low{}; ///< the box's corner, relative to the origin
    double step = 0;             ///< between places along an axis
    PackOptions options = {};
    std::string connectivity = {}, places = {}, attributes = {}, order = {};
    PackedLevels levels = {}; ///< with options.levels: the map and its places; the other streams have the rest
    Mesh rest = {};
};

/// What was where before, and how far it is off.
struct PackedMeshReport {
    std::vector<Index> vertex;   ///< of each coded vertex: which one it was
    double rms = 0, largest = 0; ///< of the places, model units; of the vertices that faces meet, if any
    /// Vertices that no face meets, so far from the others (four boxes or more) that they come back nearer.
    std::size_t out_of_reach = 0;
};

/// Errors: usage (bits; check_mesh refuses the mesh), unsuitable (nothing to code), cancelled. Cost O(size log size),
/// about 0.6 processor seconds a million vertices.
Result<PackedMesh> pack_mesh(const Mesh& mesh, const PackOptions& options, PackedMeshReport* report,
                             const RunContext& context);

/// The mesh; without keep_order its vertices and faces are in the order of the code. Every machine and number of
/// threads gives the same. Errors: bad_file (damaged), cancelled. Cost O(size), about 0.4 processor seconds a million
/// vertices.
Result<Mesh> unpack_mesh(const PackedMesh& coded, const RunContext& context);

} // namespace filigree
