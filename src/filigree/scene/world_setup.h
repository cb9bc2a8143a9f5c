// From a scene's words to bodies, a world and what is drawn of it.
#pragma once

#include "filigree/scene.h"
#include "filigree/scene/body_driver.h"
#include "filigree/scene/breaking.h"

#include <map>
#include <string>

namespace filigree {

/// An error in a line of the scene: "scene.toml:12: what".
Error scene_error(const SceneFile& scene, unsigned line, ErrorCode code, const std::string& what);

struct ReadyBody {
    std::string name;
    std::string group;            ///< of repeated bodies; else ""
    std::string mesh_path;        ///< "" for a built-in shape
    Model model;                  ///< its origin is zero: poses say where it is, from the scene's
    Vec3d origin = Vec3d::Zero(); ///< that its mesh had, model units
    double scale = 1;             ///< metres a model unit
    std::shared_ptr<const Body> body;
    BodyReport report;
    DriverEdges driver;
    std::shared_ptr<const FractureCells> cells; ///< of a body that breaks, in model units; else null
    CarriedByPieces pieces;                     ///< of such a body, whose model is in pieces too
    BrokenBodyReport broken;
    bool keeps_closed_cracks = false;   ///< in what is written
    std::shared_ptr<const Flesh> flesh; ///< of a body that follows a character; else null
    std::optional<SceneFollow> follow = {};
    std::size_t clip = 0; ///< of the flesh's skin
    Vec3f color = Vec3f::Zero();
    bool has_own_color = false; ///< of the mesh's own, if it has some

    std::vector<Vec3f> in_metres(std::vector<Vec3f> points) const; ///< from model units
};

/// An obstacle as it is drawn, before its motion.
struct ShownObstacle {
    Mesh mesh;
    RigidMotion motion;
    bool moves = false;
    bool is_ground = false; ///< a plane: `mesh` is empty, and drawn to fit the picture
    HalfSpace plane;
    Vec3f color = Vec3f::Zero();
};

struct ReadyScene {
    /// Of everything below and of all that moves; not zero only where the bodies are far from the world's, so that
    /// float keeps their digits.
    Vec3d origin = Vec3d::Zero();
    std::vector<ReadyBody> bodies;
    std::vector<Actor> actors;
    World world;
    std::vector<ShownObstacle> drawn;
    std::uint64_t hash = 0;            ///< of all that the motion depends on
    std::vector<std::string> warnings; ///< sentences: of the meshes' files, and of bodies that are hard to simulate
};

/// Takes the faces of cracks that did not open in any of the poses out of a body's mesh; nothing out of one that keeps
/// them, or does not break.
void leave_out_closed_cracks(ReadyBody& body, std::span<const Pose> poses);

using KnownMeshes = std::map<std::string, Mesh>;

/// Reads the scene's meshes, strips them and fills them with particles. Errors name the scene's line: those of the
/// readers, of strip, make_body and DistanceField; bad_file (a region without particles, a vertex that is not there).
/// known: meshes that were read already, by the names that the scene gives them.
Result<ReadyScene> set_up(const SceneFile& scene, const RunContext& context, KnownMeshes known = {});

} // namespace filigree
