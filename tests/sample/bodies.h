// Meshes and lattices that the tests of `sample` share.
#pragma once

#include "filigree/sample.h"
#include "threads.h"

namespace filigree {

inline Lattice lattice_over(const Mesh& mesh, double spacing) {
    return make_lattice(bounds(mesh.positions), {.spacing = spacing}).value();
}

inline Mesh without_faces(Mesh mesh, std::size_t kept) {
    mesh.corners.resize(mesh.face_offsets[kept]);
    mesh.face_offsets.resize(kept + 1);
    return mesh;
}

inline InsideOptions by(InsideMethod method) {
    InsideOptions options;
    options.method = method;
    return options;
}

} // namespace filigree
