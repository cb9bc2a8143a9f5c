// Scenes described in a TOML file: the structs of physics, with what a file names by words. scene_keys.h has the keys,
// each with the member that it fills.
#pragma once

#include "filigree/fracture.h"
#include "filigree/mesh.h"
#include "filigree/physics/simulation.h"
#include "filigree/types.h"

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace filigree {

/// A part of a body: what lies in a box or a ball at the start (world, m), or what is near vertices of its mesh. With
/// none of the three: all of it.
struct SceneRegion {
    std::optional<Box> box = {};
    std::optional<Ball> ball = {};
    std::vector<Index> vertices;
};

/// Many bodies for one [[body]].
struct SceneRepeat {
    std::array<unsigned, 3> count = {1, 1, 1}; ///< along x, y and z; along `step` where it is one number
    bool is_row = false;                       ///< it is
    Vec3d step = Vec3d::Zero();                ///< m
    double jitter = 0;                         ///< m, most along each axis, to either side
    double turn = 0;                           ///< radians at most, about any axis
    std::uint64_t seed = 1;                    ///< of both

    std::size_t bodies() const { return std::size_t{count[0]} * count[1] * count[2]; }
};

struct SceneBody {
    unsigned line = 0; ///< where it begins in the file, for messages
    std::string name;
    std::string group; ///< of repeated bodies: what each name begins with, before ".1" and so on; else ""
    std::string mesh;  ///< file, as found from here; or
    std::string shape;
    ShapeOptions shape_options;
    std::optional<double> size = {}; ///< of the shape (model units) or of the mesh (m), as in the options of each
    std::optional<std::size_t> driver = {}; ///< vertices; unset: as fine as the particles, see body_driver_options
    BodyOptions body;                       ///< with the scale, metres a model unit, or the size
    std::string material_name = "rubber";   ///< the named material that `material` began as
    Material material;
    std::optional<Vec3d> centre = {}; ///< m; unset: where the mesh's own coordinates say
    Vec3d aside = Vec3d::Zero();      ///< m: from there, of a repeated one
    Eigen::AngleAxisd rotation = Eigen::AngleAxisd::Identity();
    Vec3d velocity = Vec3d::Zero(), spin = Vec3d::Zero(); ///< m/s, rad/s
    std::optional<SceneRepeat> repeat = {};
    bool may_sleep = true;
    std::optional<Vec3f> color = {};
};

struct SceneObstacle {
    unsigned line = 0;
    std::string shape; ///< ground, ball, box or mesh
    HalfSpace ground;
    Ball ball;
    Cuboid box;
    std::string mesh; ///< file
    double scale = 1, spacing = 0;
    std::optional<Vec3d> centre = {};
    std::optional<Vec3d> pivot = {}; ///< unset: the middle of what moves
    Obstacle obstacle;               ///< without its shape, and the centre of its motion
    std::optional<Vec3f> color = {};
    bool visible = true;
};

/// How bodies touch: those called `first` each of those called `second`.
struct ScenePair {
    std::string first, second;
    PairContact contact;
};

struct SceneFracture {
    unsigned line = 0;
    std::string named; ///< the body, in the file; "": there is only one
    std::size_t body = 0;
    FracturePattern pattern; ///< without points
    std::vector<Vec3d> at;   ///< world, at the start
    FractureMaterial material = {.seed = 1};
    std::optional<double> energy = {}; ///< J/m^2; unset: by the strength
    bool keep_closed = false;          ///< also write inner faces of cracks that never opened
};

/// Pieces that let go of each other at a time.
struct SceneCrack {
    unsigned line = 0;
    std::string named;
    std::size_t body = 0;
    double time = 0; ///< s
    std::vector<Index> pieces;
    SceneRegion region;
};

struct ScenePin {
    unsigned line = 0;
    std::string named;
    std::size_t body = 0;
    SceneRegion region;
    RigidMotion motion;              ///< without its centre
    std::optional<Vec3d> pivot = {}; ///< unset: the middle of what moves
};

struct SceneForce {
    unsigned line = 0;
    std::string named;
    std::size_t body = 0;
    SceneRegion region;
    Keyed<Vec3d> newtons{{}, {}, Vec3d::Zero()};
};

struct SceneHand {
    unsigned line = 0;
    std::string named;
    std::size_t body = 0;
    std::optional<Vec3d> point = {}; ///< world, at the start; or
    std::optional<Index> vertex = {};
    Hand hand; ///< without the point
};

struct SceneBackground {
    std::optional<Vec3f> top = {}, bottom = {};
};

struct ScenePicture {
    View view = View::iso;
    UpAxis up = UpAxis::y;
    std::optional<Vec3d> eye = {}, target = {};
    double field_of_view = 30;
    std::array<unsigned, 2> size = {960, 720}; ///< width and height, pixels
    unsigned passes = 8;
    SceneBackground background;
    bool ground = true, obstacles = true, particles = false;
    std::size_t most_triangles = 300'000; ///< of a body as it is drawn
};

struct SceneFile {
    std::string path;
    std::string content; ///< all that the motion depends on but the meshes, spelled in one way
    std::size_t frames = 120;
    std::optional<double> duration = {}; ///< s: where the file has it, in place of `frames`, which follow from it
    StepOptions step;
    World world; ///< air, heat and how bodies touch; without what follows
    std::vector<SceneBody> bodies;
    std::vector<SceneObstacle> obstacles;
    std::vector<SceneFracture> fractures;
    std::vector<SceneCrack> cracks;
    std::vector<ScenePin> pins;
    std::vector<SceneForce> forces;
    std::vector<SceneHand> hands;
    ScenePicture picture;
};

/// A value that takes the place of what a scene's file says, or of what holds without it.
struct SceneValue {
    std::string table, key;
    std::size_t entry = 0; ///< of a list such as [[body]], from 1; 0: of all
    std::string value;     ///< as TOML spells it
};

/// Reads and checks a scene; meshes are not opened. A mesh's name is seen from the scene's folder. Errors, with file
/// and line: bad_file (not TOML, unknown keys with a suggestion, wrong types and ranges), not_found. values: in this
/// order; of those that are wrong no line is said.
Result<SceneFile> read_scene(const std::string& path, std::span<const SceneValue> values = {});

/// An error in a line of the scene: "scene.toml:12: what".
Error scene_error(const SceneFile& scene, unsigned line, ErrorCode code, const std::string& what);

} // namespace filigree
