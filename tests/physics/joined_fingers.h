// Two fingers on a hand, nearer to each other than cells.
#pragma once

#include "filigree/mesh.h"

namespace filigree::joined_fingers {

/// A box with inner faces left out nowhere: parts that overlap are one.
inline void add_box(Mesh& mesh, const Vec3d& low, const Vec3d& high) {
    const Mesh box = make_box((low + high) / 2, high - low);
    const Index first = Index(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), box.positions.begin(), box.positions.end());
    for (std::size_t f = 0; f < box.face_count(); ++f) {
        std::vector<Index> corners;
        for (Index c = box.face_offsets[f]; c < box.face_offsets[f + 1]; ++c) corners.push_back(first + box.corners[c]);
        mesh.add_face(corners);
    }
}

/// Two fingers of 2 x 0.2 x 0.2 m on one hand.
inline Mesh fork(double gap) {
    Mesh mesh;
    add_box(mesh, {0, 0, 0}, {2, 0.2, 0.2});
    add_box(mesh, {0, 0.2 + gap, 0}, {2, 0.4 + gap, 0.2});
    add_box(mesh, {-0.3, 0, 0}, {0.05, 0.4 + gap, 0.2});
    return mesh;
}

} // namespace filigree::joined_fingers
