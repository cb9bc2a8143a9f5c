// One surface of a body that melts: its own mesh where matter is old, the surface of its particles where it is new.
#pragma once

#include "filigree/melting/particle_field.h"
#include "filigree/mesh/surface.h"

namespace filigree {

struct CompositeSurface {
    Mesh mesh;                        ///< closed, manifold and oriented; m
    std::vector<Index> origin;        ///< of each vertex: which of the restored mesh's it is, kNoIndex: a new one
    std::size_t kept_triangles = 0;   ///< of the restored mesh, untouched
    std::size_t seam_triangles = 0;   ///< pieces of its triangles
    std::size_t matter_triangles = 0; ///< of the particles' surface
};

/// Makes the surfaces of a film. Where matter is renewed the mesh fades to the particles' surface and is then replaced
/// by it; in between it is cut along a grid's faces, in which both are stitched [Wojtan et al. 2009].
class CompositeMesher {
public:
    /// mesh: at rest. Cost O(corners log corners). Errors: usage (check_mesh refuses the mesh), unsuitable (welded, it
    /// is open, not manifold or not oriented: says so), cancelled.
    static Result<CompositeMesher> create(const Mesh& mesh, const RunContext& context);
    /// Of another body, which may flow together with this one: make takes its mesh behind those before it.
    void append(const CompositeMesher& other);

    /// restored: the mesh as it is now, in the world; its attributes are kept where it is, new vertices have normals,
    /// and colours where particle_colors (RGBA; one a particle, or none) says them. renewal: a vertex, 0 old .. 1 new.
    /// Nothing renewed: the mesh itself, to the byte. Vertices that live come first, in their order. The same bytes for
    /// any number of threads. dead: of each vertex whether it died in an earlier frame, none at first; those that die
    /// now are added, so that nothing comes back. Cost O(mesh + field). Errors: usage (lengths that differ, numbers
    /// that are not finite; check_mesh refuses the restored mesh), cancelled.
    Result<CompositeSurface> make(const Mesh& restored, std::span<const float> renewal,
                                  const MatterParticles& particles, std::span<const Vec4f> particle_colors,
                                  const ParticleField& field, std::vector<std::uint8_t>& dead,
                                  const RunContext& context) const;

    static constexpr float kFadeBegin = 0.2f, kFadeEnd = 0.6f; ///< renewal between which the mesh fades

private:
    CompositeMesher(Surface surface, std::size_t faces) : surface_(std::move(surface)), face_count_(faces) {}

    Surface surface_;
    std::size_t face_count_;
};

} // namespace filigree
