// The bodies of a scene that melt, as one surface that parts and joins.
#pragma once

#include "filigree/melting/composite_surface.h"
#include "filigree/mesh/surfels.h"
#include "filigree/restore.h"
#include "filigree/scene/body_look.h"
#include "filigree/scene/matter_at_points.h"
#include "filigree/scene/recording.h"
#include "filigree/scene/world_setup.h"

namespace filigree {

/// One surface of all bodies of mpm: where they melt they flow together.
class MeltingSurface {
public:
    /// Bodies whose mesh is open or not manifold are left out: their meshes keep their topology. `warnings` names them.
    /// ready has to outlive the surface. Cost: welding, and O(vertices). Errors: cancelled.
    static Result<MeltingSurface> create(const ReadyScene& ready, const RunContext& context);
    /// looks: one a body of the scene. Kept parts keep their materials and UVs, and melt has the colours of what it
    /// was.
    static Result<MeltingSurface> create(const ReadyScene& ready, std::span<const BodyLook> looks,
                                         const RunContext& context);

    /// Whether the scene has such bodies. Without them there is no frame to ask for.
    bool is_empty() const { return bodies_.empty(); }
    bool has_body(std::size_t body) const;
    /// The bodies' names, with + between.
    const std::string& name() const { return name_; }
    /// Of all bodies, as the surfaces' materials have them; empty: none has any.
    const std::vector<MeshMaterial>& materials() const { return materials_; }

    /// Metres, in the scene's frame; in the colours of the bodies or their meshes. The start is the bodies' own meshes,
    /// to the byte. Frames are made in order from the start on, as what died in one stays dead. Cost
    /// O(mesh + particles). Errors: cancelled.
    Result<CompositeSurface> frame(const Recording& recording, std::size_t frame, const RunContext& context);

    /// The surfels of a frame that frame() has made: those of the mesh are carried from the start; where it fades or is
    /// replaced they are made of the surface. Errors: as frame's.
    Result<Surfels> surfels(const CompositeSurface& surface, const Recording& recording, std::size_t frame,
                            const RunContext& context) const;

    /// Velocity of each vertex of a frame that frame() has made, m/s: that of its nearest particles, up to the next
    /// frame. Errors: cancelled.
    Result<std::vector<Vec3f>> velocities(const CompositeSurface& surface, const Recording& recording,
                                          std::size_t frame, double frames_per_second, const RunContext& context) const;

    std::vector<std::string> warnings;

private:
    struct BodyPart {
        std::size_t body;
        Restorer restorer;
        std::vector<Vec3f> start;  ///< m
        Surfels surfels;           ///< at rest, model units; but colours and rest_radius, m
        MatterAtPoints matter;     ///< at its vertices
        std::vector<Vec4f> colors; ///< of its vertices, by its look; none: the mesh's own, or the body's
        Index first_material = 0;
        bool has_look = false;
    };

    Status add(std::size_t body, const BodyLook* look, const RunContext& context);
    void append(const Mesh& part_mesh, const BodyPart& part, const RunContext& context, Mesh& whole) const;
    static float renewal_at(const BodyPart& part, std::size_t vertex, const MatterParticles& matter);

    const ReadyScene* ready_ = nullptr;
    std::vector<BodyPart> bodies_;
    std::string name_;
    std::vector<Vec4f> particle_colors_;
    std::vector<MeshMaterial> materials_;
    bool has_uvs_ = false;
    std::optional<CompositeMesher> mesher_;
    std::vector<std::uint8_t> dead_; ///< vertices, so far
};

} // namespace filigree
