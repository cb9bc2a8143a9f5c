// A mesh as a body above the ground, with an obstacle under it if wanted: a scene that needs no file.
#pragma once

#include "filigree/physics/world.h"
#include "filigree/scene/body_driver.h"
#include "filigree/scene/breaking.h"
#include "filigree/scene/melting_model.h"

#include <memory>
#include <span>
#include <vector>

namespace filigree {

enum class ObstacleChoice { none, ball, step, slope };

/// How a body is made of a mesh, and the world it is put in. SI units.
struct DropOptions {
    Material material;
    std::size_t particles = 2000; ///< about; the spacing follows
    double size = 1;              ///< m, the longest side of the mesh's box
    double drop = 0.5;            ///< m above the ground or the obstacle at the start
    double strength = 0.01; ///< of a body that breaks: the share of Young's modulus at which cracks begin, above 0
    double air_temperature = 293; ///< K, above 0; of a body of mpm that melts
    /// s, above 0; of such a body: heat goes so much quicker than in truth that air 60 K warmer than the melt has about
    /// melted all of it by then.
    double melting_time = 15;
    bool gravity = true, ground = true;
    ObstacleChoice obstacle = ObstacleChoice::none;
    double friction = 0.5, restitution = 0.9;
    bool operator==(const DropOptions&) const = default;
};

/// What stands around a body, to be drawn: meshes in model units, relative to the model's origin.
struct Surroundings {
    std::vector<Mesh> obstacles;
    bool has_ground = false;
    double ground_level = 0; ///< model units along `up`, relative to the model's origin
};

/// Along what a model breaks. Shared, and never changes.
struct BreakingModel {
    std::shared_ptr<const Mesh> whole; ///< that the model in pieces was cut from
    std::shared_ptr<const FractureCells> cells;
    CarriedByPieces carried;
};

/// A body that is ready to move. Shared, and never changes.
struct DroppedBody {
    std::shared_ptr<const Model> model;
    std::shared_ptr<const Body> body;
    std::shared_ptr<const BreakingModel> breaking; ///< null: it does not break
    std::shared_ptr<const Fracture> fracture;      ///< null: it does not break
    std::shared_ptr<const MeltingModel> melting;   ///< null: it does not melt, or its mesh is open
    BodyReport report;                             ///< its warning also says what is wrong with the drop
    std::optional<CoarseDriver> coarse_driver;     ///< where the model's driver is one
    double scale = 1;                              ///< metres a model unit
    double longest = 0;                            ///< side of the mesh's box, model units
    World world;                                   ///< metres, relative to the model's origin times the scale
    Surroundings surroundings;
};

/// The body starts where the mesh is, and the ground is put below it, so that nothing jumps when it is made. breaking:
/// of a model in pieces; null: it does not break. look: of the model's mesh, for its melt; may be empty. pinned:
/// vertices of the model's driver; the particles near them are held fast where they are. up: along an axis. Errors:
/// unsuitable (a mesh without extent), and as of make_body and break_body. Cost: theirs.
Result<std::shared_ptr<const DroppedBody>> make_dropped_body(std::shared_ptr<const Model> model,
                                                             std::shared_ptr<const BreakingModel> breaking,
                                                             const BodyLook& look, const DropOptions& options,
                                                             std::span<const Index> pinned, const Vec3d& up,
                                                             const RunContext& context);

/// What such a body falls onto, and its gravity. box: of the mesh, model units. scale: metres a model unit.
World world_of_drop(const DropOptions& options, const Box& box, double scale, const Vec3d& up);

/// Whether heat does anything to it: it is of mpm and melts.
bool can_melt(const DroppedBody& dropped);
/// W/(m^2 K): between a dropped body and the air.
inline constexpr double kAirHeatTransfer = 20;

/// Something held to the surface of a body that melts.
struct Torch {
    double size = 0.15;         ///< how far it reaches, of the mesh's longest side, above 0; four spacings at least
    double seconds = 1.0 / 3.0; ///< above 0: what is near it melts in about that time
    bool cools = false;         ///< it freezes instead
};
/// Held to a dropped body, at a place in model units relative to the model's origin.
HeatSource torch_at(const DroppedBody& dropped, const Vec3d& place, const Torch& torch);
/// How far it reaches, model units.
double torch_radius(const DroppedBody& dropped, const Torch& torch);

/// Where the body starts, what it falls on and what stands around it, in the world. up: an axis.
Box room_of(const DroppedBody& dropped, const Vec3d& up);

} // namespace filigree
