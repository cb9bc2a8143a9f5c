// Surface and temperatures of one model that melts, moment by moment, in model units.
#pragma once

#include "filigree/melting/composite_surface.h"
#include "filigree/physics/body.h"
#include "filigree/restore.h"
#include "filigree/scene/body_look.h"
#include "filigree/scene/matter_at_points.h"

#include <memory>
#include <optional>

namespace filigree {

/// Never changes once made. What a moment is made of is in model units, relative to the model's origin.
class MeltingModel {
public:
    /// body: of the model, `scale` metres a model unit. look: of its mesh; empty: the mesh has its own colours, or
    /// none. Errors: unsuitable (the mesh is not closed), those of Restorer::create, cancelled. Cost: welding, and
    /// O(vertices + particles).
    static Result<MeltingModel> create(std::shared_ptr<const Model> model, const Body& body, double scale,
                                       const BodyLook& look, const RunContext& context);

    /// The surface of a moment. None while no matter is renewed: the restored mesh is the surface then. dead: vertices
    /// that have gone so far (see CompositeMesher::make). Cost O(mesh + particles). Errors: as make's.
    Result<std::optional<Mesh>> surface(const Pose& pose, const MatterParticles& matter,
                                        std::vector<std::uint8_t>& dead, const RunContext& context) const;
    /// K, one a vertex of the model's mesh.
    std::vector<float> temperatures(const MatterParticles& matter) const;

private:
    MeltingModel(std::shared_ptr<const Model> model, Restorer restorer, CompositeMesher mesher)
        : model_(std::move(model)), restorer_(std::move(restorer)), mesher_(std::move(mesher)) {}

    std::shared_ptr<const Model> model_;
    Restorer restorer_;
    CompositeMesher mesher_;
    MatterAtPoints at_vertices_;
    std::vector<Vec4f> vertex_colors_; ///< by its look; none: the mesh's own
    std::vector<Vec4f> particle_colors_;
};

/// In other units: metres times `scale`.
MatterParticles scaled(MatterParticles matter, double scale);

} // namespace filigree
