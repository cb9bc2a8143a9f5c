// From a scene's words to bodies, a world and what is drawn of it.
#pragma once

#include "scene_file.h"

namespace filigree::cli {

struct SetUpBody {
    std::string name;
    std::string mesh_path; ///< "" for a built-in shape
    Model model;           ///< its origin is zero: poses say where it is, from the scene's
    double scale = 1;      ///< metres a model unit
    std::shared_ptr<const Body> body;
    BodyReport report;
    Vec3f color = Vec3f::Zero();
    bool has_own_color = false; ///< of the mesh's own, if it has some
};

/// An obstacle as it is drawn, before its motion.
struct SetUpObstacle {
    Mesh mesh;
    RigidMotion motion;
    bool moves = false;
    bool is_ground = false; ///< a plane: `mesh` is empty, and drawn to fit the picture
    HalfSpace plane;
    Vec3f color = Vec3f::Zero();
};

struct SetUpScene {
    /// Of everything below and of all that moves; not zero only where the bodies are far from the world's, so that
    /// float keeps their digits.
    Vec3d origin = Vec3d::Zero();
    std::vector<SetUpBody> bodies;
    std::vector<Actor> actors;
    World world;
    std::vector<SetUpObstacle> drawn;
    std::uint64_t hash = 0; ///< of all that the motion depends on
};

/// Reads meshes, strips them, fills them with particles. Errors name the scene's line; warnings go to the session.
SetUpScene set_up(const SceneFile& scene, Session& session);

} // namespace filigree::cli
