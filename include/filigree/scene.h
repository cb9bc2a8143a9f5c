// Scenes in TOML files (docs/scenes.md): bodies, obstacles and what happens to them. Link filigree::scene.
//
//     const SceneFile scene = read_scene("bounce.toml").value();
//     const SceneMotion motion = simulate_scene(scene).value();
//     write_model(motion.bodies[0].model, motion.bodies[0].poses, "bounce.fil");
//
// A scene holds the structs of physics/world.h and physics/body.h, and the words of the file where it names things.
// Lengths are in metres, angles in radians; colours are sRGB, 0 to 1.
#pragma once

#include "filigree/context.h"
#include "filigree/flesh.h"
#include "filigree/fracture.h"
#include "filigree/mesh.h"
#include "filigree/physics/simulation.h"
#include "filigree/strip.h"
#include "filigree/types.h"

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace filigree {

// ---------------------------------------------------------------------------------------------------------------------
// What a scene file says

/// A part of a body: everything inside a box or a ball at the start (world, m), or everything near vertices of its
/// mesh. Without any of the three: the whole body.
struct SceneRegion {
    std::optional<Box> box = {};
    std::optional<Ball> ball = {};
    std::vector<Index> vertices;
};

/// Several bodies from one [[body]].
struct SceneRepeat {
    std::array<unsigned, 3> count = {1, 1, 1}; ///< along x, y and z; a row along `step` where the file has one number
    bool is_row = false;                       ///< the file has one number
    Vec3d step = Vec3d::Zero();                ///< m
    double jitter = 0;                         ///< m, largest random shift along each axis
    double turn = 0;                           ///< radians, largest random rotation, about a random axis
    std::uint64_t seed = 1;                    ///< of shifts and rotations

    std::size_t bodies() const { return std::size_t{count[0]} * count[1] * count[2]; }
};

struct SceneBody {
    unsigned line = 0; ///< in the file, for messages
    std::string name;
    std::string group; ///< of repeated bodies: the common part of their names; else ""
    std::string mesh;  ///< path of a mesh file; or
    std::string shape; ///< name of a built-in shape
    ShapeOptions shape_options;
    std::optional<double> size = {};        ///< of the shape (model units) or of the mesh (m, longest side)
    std::optional<std::size_t> driver = {}; ///< driver vertices; unset: as fine as the particles
    BodyOptions body;                       ///< with the scale (metres a model unit) or the size
    std::string material_name = "rubber";   ///< the preset that `material` began as
    Material material;
    std::optional<Vec3d> centre = {}; ///< m; unset: where the coordinates of the mesh say
    Vec3d aside = Vec3d::Zero();      ///< m: shift of a repeated body
    Eigen::AngleAxisd rotation = Eigen::AngleAxisd::Identity();
    Vec3d velocity = Vec3d::Zero(); ///< m/s
    Vec3d spin = Vec3d::Zero();     ///< rad/s
    std::optional<SceneRepeat> repeat = {};
    bool may_sleep = true;
    std::optional<Vec3f> color = {};
};

/// A quantity that varies within a body, by what its mesh carries.
struct SceneMap {
    unsigned line = 0;
    std::string named;
    std::size_t body = 0;
    FieldOf of = FieldOf::stiffness;
    std::string from;                       ///< "color.r", "scalar NAME", "group NAME", "material NAME", "object NAME"
    std::array<double, 2> values = {0, 1};  ///< numbers of the mesh that count as the ends of `range`
    std::array<double, 2> range = {0.1, 1}; ///< multiples of the material's value
};

struct SceneObstacle {
    unsigned line = 0;
    std::string shape; ///< ground, ball, box or mesh: says which of the next counts
    HalfSpace ground;
    Ball ball;
    Cuboid box;
    std::string mesh;   ///< path of a mesh file
    double scale = 1;   ///< of the mesh: metres a model unit
    double spacing = 0; ///< of the mesh's distance field, m; 0: chosen
    std::optional<Vec3d> centre = {};
    std::optional<Vec3d> pivot = {}; ///< m: what it turns about; unset: pivot_of
    Obstacle obstacle;               ///< the rest: motion, friction, heat
    std::optional<Vec3f> color = {};
    bool visible = true;
};

/// The contact of bodies called `first` with bodies called `second`.
struct ScenePair {
    std::string first, second;
    PairContact contact;
};

struct SceneFracture {
    unsigned line = 0;
    std::string named;    ///< the body's name in the file; "": there is one body only
    std::size_t body = 0; ///< its number
    FracturePattern pattern;
    std::vector<Vec3d> at; ///< m, world, at the start: points that are hit
    FractureMaterial material = {.seed = 1};
    std::optional<double> energy = {}; ///< J/m^2; unset: by the strength
    bool keep_closed = false;          ///< also write the inner faces of cracks that never opened
};

/// Pieces that separate at a given time.
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
    std::optional<Vec3d> pivot = {}; ///< m; unset: the middle of the region
};

struct SceneForce {
    unsigned line = 0;
    std::string named;
    std::size_t body = 0;
    SceneRegion region;
    Keyed<Vec3d> newtons{{}, {}, Vec3d::Zero()};
};

/// How joints of a [[follow]] hold, with all joints below them.
struct SceneFollowJoint {
    SoftJoints soft; ///< its pattern is `name`
};

/// Whether limbs of a [[follow]] touch each other.
struct SceneFollowContact {
    JointContact limbs;
};

/// A body that becomes the flesh of an animated character.
struct SceneFollow {
    unsigned line = 0;
    std::string named;
    std::size_t body = 0;
    std::string animation; ///< path; "": the body's own mesh
    std::string clip;      ///< "": the first that moves
    double speed = 1;
    double start = 0;        ///< s of the clip, at the start of the scene
    bool repeat = false;     ///< the clip begins again at its end
    bool is_sculpted = true; ///< FleshOptions::sculpted_gravity
    FleshOptions flesh;      ///< the springs; without what the body says
    std::string loose_from;  ///< as SceneMap::from; "": nothing
    std::array<double, 2> loose_values = {0, 1};
    std::vector<SceneFollowJoint> joints;
    std::vector<SceneFollowContact> contacts;
};

struct SceneHand {
    unsigned line = 0;
    std::string named;
    std::size_t body = 0;
    std::optional<Vec3d> point = {};  ///< m, world, at the start; or
    std::optional<Index> vertex = {}; ///< a vertex of the mesh
    Hand hand;                        ///< without its point
};

struct SceneBackground {
    std::optional<Vec3f> top = {}, bottom = {};
};

struct ScenePicture {
    View view = View::iso;
    UpAxis up = UpAxis::y;
    std::optional<Vec3d> eye = {}, target = {}; ///< m, world
    double field_of_view = 30;                  ///< degrees
    bool follow = true; ///< without an eye: the camera moves with the bodies where that shows them larger
    std::array<unsigned, 2> size = {960, 720}; ///< width and height, pixels
    unsigned passes = 8;
    SceneBackground background;
    bool ground = true, obstacles = true, particles = false; ///< what is drawn
    std::size_t most_triangles = 300'000;                    ///< of a body as it is drawn
};

struct SceneFile {
    std::string path;
    std::string content; ///< all that the motion depends on except the meshes, always spelled the same way
    std::size_t frames = 120;
    std::optional<double> duration = {}; ///< s, where the file says it in place of `frames`, which follow from it
    StepOptions step;
    World world; ///< air, heat, contact; without the lists that follow
    std::vector<SceneBody> bodies;
    std::vector<SceneMap> maps;
    std::vector<SceneObstacle> obstacles;
    std::vector<SceneFracture> fractures;
    std::vector<SceneCrack> cracks;
    std::vector<ScenePin> pins;
    std::vector<SceneForce> forces;
    std::vector<SceneHand> hands;
    std::vector<SceneFollow> follows;
    ScenePicture picture;
    std::vector<std::string> warnings; ///< sentences, with the line: words of older versions
};

/// A value that replaces one of the file, or a default.
struct SceneValue {
    std::string table, key;
    std::size_t entry = 0; ///< of a list such as [[body]], from 1; 0: of all its entries
    std::string value;     ///< as TOML spells it
};

/// Reads and checks a scene; meshes are not opened. Paths of meshes are relative to the folder of the scene. values: in
/// this order. Errors, with file and line (without a line for `values`): bad_file (not TOML; an unknown key, with a
/// suggestion; a wrong type or range), not_found.
Result<SceneFile> read_scene(const std::string& path, std::span<const SceneValue> values = {});
/// The same of a text that has no file yet. path: of the file that it would be, for its folder and for messages.
Result<SceneFile> parse_scene(std::string_view text, const std::string& path, std::span<const SceneValue> values = {});

// ---------------------------------------------------------------------------------------------------------------------
// Simulating a scene

/// A body of a scene, and how it moved.
struct MovedBody {
    std::string name;
    Model model;        ///< model units; its mesh has the origin zero
    PoseSequence poses; ///< in metres; the first is the start
    double scale = 1;   ///< metres a model unit
};

struct SceneMotion {
    Vec3d origin = Vec3d::Zero(); ///< m: added to all positions; zero unless the scene is far from the world's origin
    std::vector<MovedBody> bodies;
    std::vector<std::string> warnings; ///< sentences
    /// A sentence where the motion cannot be trusted: something was not finite, inverted cells, energy from nowhere.
    /// The warnings say how much, where, and what to change.
    std::optional<std::string> broke_down;
};

/// Sets a scene up and simulates all of its frames: meshes are read and stripped, bodies filled with particles. Errors,
/// with the line of the scene: those of read_mesh, strip, make_body and make_mesh_obstacle; bad_file (a region without
/// particles, a vertex that does not exist), out_of_memory, cancelled.
Result<SceneMotion> simulate_scene(const SceneFile& scene, const RunContext& context = RunContext());

} // namespace filigree
