// Meshes of several parts: what lies on a surface, and what lies beside a detailed one.
#pragma once

#include "filigree/mesh.h"

#include <cmath>
#include <numbers>

namespace filigree_test {

using namespace filigree;

/// Adds a part's vertices and faces, each at scale * p + shift.
inline void add_part(Mesh& mesh, const Mesh& part, float scale = 1, const Vec3f& shift = Vec3f::Zero()) {
    const auto first = static_cast<Index>(mesh.vertex_count());
    for (const Vec3f& p : part.positions) mesh.positions.push_back(scale * p + shift);
    for (std::size_t f = 0; f < part.face_count(); ++f) {
        std::vector<Index> face(part.face(f).begin(), part.face(f).end());
        for (Index& v : face) v += first;
        mesh.add_face(face);
    }
}

/// An open tube along z, 2 long, with or without waves across it.
inline Mesh make_tube(Index around, Index along, float waves, const Vec3f& shift) {
    Mesh tube;
    for (Index j = 0; j <= along; ++j)
        for (Index i = 0; i < around; ++i) {
            const float turn = float(2 * std::numbers::pi * i) / float(around), z = 2 * float(j) / float(along);
            const float radius = 0.1f + waves * std::sin(10 * turn) * std::sin(30 * z);
            tube.positions.push_back(shift + Vec3f(radius * std::cos(turn), radius * std::sin(turn), z));
        }
    for (Index j = 0; j < along; ++j)
        for (Index i = 0; i < around; ++i) {
            const Index a = j * around + i, b = j * around + (i + 1) % around;
            tube.add_face(std::array<Index, 4>{a, b, b + around, a + around});
        }
    return tube;
}

/// A smooth tube beside a wavy one: all the quadric error is in the second.
inline Mesh make_two_tubes(Index around, Index along) {
    Mesh mesh = make_tube(around, along, 0, Vec3f::Zero());
    add_part(mesh, make_tube(around, along, 0.01f, Vec3f(0.5f, 0, 0)));
    return mesh;
}

} // namespace filigree_test
