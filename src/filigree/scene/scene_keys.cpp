#include "filigree/scene/scene_keys.h"

#include <algorithm>
#include <vector>

namespace filigree {

namespace {

constexpr KeyValues kAnything = {};
constexpr KeyValues kFile = {.is_file = true};
constexpr KeyValues from(double least, double most) { return {.least = least, .most = most}; }
constexpr KeyValues above(double least, double most) { return {.least = least, .most = most, .above = true}; }
constexpr KeyValues one_of(std::string_view words, std::string_view former = "") {
    return {.words = words, .former = former};
}
constexpr KeyUse shapes(std::string_view words) { return {.shapes = words}; }
constexpr KeyUse models(std::string_view words) { return {.models = words}; }

template <class Owner, class T>
Owner owner_of(T Owner::*);

/// Down from the owner by one member after the other.
template <auto First, auto... Rest>
KeyPlace place_in(SceneOwner owner) {
    return &((std::get<decltype(owner_of(First))*>(owner)->*First).*....*Rest);
}
/// A struct that no file has filled.
template <auto First, auto...>
SceneOwner fresh_owner() {
    static decltype(owner_of(First)) fresh;
    return &fresh;
}
template <auto... Members>
constexpr SceneKey key(std::string_view table, std::string_view name, std::string_view unit, KeyValues values,
                       std::string_view text, std::string_view unset = "", KeyUse use = {}) {
    return {table, name, &place_in<Members...>, &fresh_owner<Members...>, unit, values, text, unset, use};
}

constexpr std::string_view kByMaterial = "by the material";

const SceneKey kKeys[] = {
    key<&SceneFile::frames>("simulation", "frames", "", from(1, 1e6),
                            "number of frames; the output also has the start, so one frame more"),
    key<&SceneFile::duration>("simulation", "duration", "s", above(0, 1e6),
                              "in place of `frames`: length of the simulation"),
    key<&StepOptions::frames_per_second>("simulation", "frames_per_second", "1/s", from(10, 1e4),
                                         "frame rate of the output"),
    key<&StepOptions::mode>(
        "simulation", "mode", "", one_of("auto explicit", "descent"),
        "auto: a body that needs more than `most_substeps` becomes rigid; explicit: it stays elastic"),
    key<&StepOptions::most_substeps>(
        "simulation", "most_substeps", "", from(1, 1e5),
        "largest number of substeps in a frame; with mode auto, a body that needs more becomes rigid"),
    key<&StepOptions::contacts_between_bodies>("simulation", "contacts_between_bodies", "", kAnything,
                                               "whether bodies touch each other"),
    key<&StepOptions::contacts_within_bodies>("simulation", "contacts_within_bodies", "", kAnything,
                                              "whether a body touches itself"),
    key<&StepOptions::automatic_rigid>(
        "simulation", "automatic_rigid", "", kAnything,
        "whether a body with fewer than 8 cells, or one that needs more than `most_substeps`, becomes rigid"),

    key<&World::gravity>("world", "gravity", "m/s^2", kAnything, "acceleration of all bodies"),
    key<&World::wind>("world", "wind", "m/s", kAnything, "velocity of the air"),
    key<&World::air_density>("world", "air_density", "kg/m^3", from(0, 1e4),
                             "density of the air; the force of wind and drag grows with it", "1.2 with wind, else 0"),
    key<&World::body_friction>("world", "body_friction", "", from(0, 100), "Coulomb's coefficient between bodies"),
    key<&World::body_restitution>("world", "body_restitution", "", from(0, 1),
                                  "restitution between bodies, as `restitution` of an obstacle"),
    key<&World::air_temperature>("world", "air_temperature", "K", above(0, 1e5),
                                 "temperature of the air around `mpm` bodies"),
    key<&World::air_heat_transfer>("world", "air_heat_transfer", "W/(m^2 K)", from(0, 1e9),
                                   "heat transfer coefficient between air and `mpm` bodies; 10 for still air"),
    key<&World::heat_pace>("world", "heat_pace", "", above(0, 1e9),
                           "factor by which heat flows faster than in reality, in and around `mpm` bodies"),

    key<&SceneBody::name>("body", "name", "", kAnything,
                          "name in file names, and for pins, forces and hands; letters, digits, - and _",
                          "name of the mesh or shape"),
    key<&SceneBody::mesh>("body", "mesh", "", kFile,
                          "file of a mesh or model (.fil), relative to the scene's folder. Either this or `shape`"),
    key<&SceneBody::shape>("body", "shape", "",
                           one_of("wavy-cube wavy-sphere wavy-plane wavy-plate bar cylinder torus"),
                           "built-in shape. Either this or `mesh`"),
    key<&ShapeOptions::resolution>("body", "resolution", "", from(1, 8192), "quads along a side", "", shapes("shape")),
    key<&ShapeOptions::frequency>("body", "frequency", "", from(0, 1e6), "waves along a side", "", shapes("shape")),
    key<&ShapeOptions::amplitude>("body", "amplitude", "sides", from(0, 10), "height of the waves", "",
                                  shapes("shape")),
    key<&SceneBody::size>(
        "body", "size", "m", from(1e-30, 1e30),
        "mesh: length of the longest side, in place of `scale`; shape: side or diameter, in model units", "shape: 1"),
    key<&ShapeOptions::length>("body", "length", "sides", from(1e-3, 1e6), "length of a bar or cylinder", "",
                               shapes("shape")),
    key<&ShapeOptions::thickness>("body", "thickness", "ring radii; sides", from(1e-6, 1),
                                  "torus: radius of the tube; plate: thickness", "", shapes("shape")),
    key<&SceneBody::driver>(
        "body", "driver", "vertices", from(3, 1e8),
        "vertices of the driver; by default its edges are 0.8 spacings long on average. A model has its own driver",
        "by the spacing"),
    key<&SceneBody::body, &BodyOptions::scale>("body", "scale", "m per model unit", above(0, 1e9),
                                               "metres of one model unit"),
    key<&SceneBody::body, &BodyOptions::cells, &CellOptions::count>("body", "particles", "", from(8, 1e8),
                                                                    "approximate number of particles"),
    key<&SceneBody::body, &BodyOptions::cells, &CellOptions::spacing>(
        "body", "spacing", "m", above(0, 1e6), "in place of `particles`: distance from one particle to the next",
        "by `particles`"),
    key<&SceneBody::body, &BodyOptions::separate>("body", "separate", "", kAnything,
                                                  "whether parts that are nearer to each other than two particles, "
                                                  "such as fingers, move apart; gaps from a quarter "
                                                  "of a spacing on count, and such a body does not break",
                                                  "", models("fem")),
    key<&SceneBody::material_name>("body", "material", "", kAnything,
                                   "one of the materials below; the keys from `model` on override its values"),
    key<&Material::model>("body", "model", "", one_of("fem springs meshfree rigid mpm"),
                          "fem: finite elements; springs: a lattice of springs; meshfree: moving least squares; rigid: "
                          "does not deform; mpm: melts, separates and joins",
                          kByMaterial),
    key<&Material::density>("body", "density", "kg/m^3", from(1e-9, 1e6), "mass per volume", kByMaterial),
    key<&Material::young_modulus>("body", "young_modulus", "Pa", from(1e-9, 1e12), "stiffness", kByMaterial,
                                  models("fem springs meshfree mpm")),
    key<&Material::poisson_ratio>("body", "poisson_ratio", "", from(0, 0.49),
                                  "how much the body gets thinner when it is pulled; springs have 1/4", kByMaterial,
                                  models("fem meshfree mpm")),
    key<&Material::damping>("body", "damping", "1/s", from(0, 1e6),
                            "decay rate d of all motion: after one second e^-d of the speed is left", kByMaterial),
    key<&Material::internal_damping>("body", "internal_damping", "s", from(0, 1e3),
                                     "viscous stress per strain rate, as a multiple of the stiffness", kByMaterial,
                                     models("fem springs meshfree")),
    key<&Material::bending>("body", "bending", "", from(0, 0.2),
                            "stiffness of bending springs, as a share of an axis spring's", kByMaterial,
                            models("springs")),
    key<&Material::yield_stress>("body", "yield_stress", "Pa", above(0, 1e12),
                                 "stress above which the shape changes permanently", kByMaterial,
                                 models("fem meshfree mpm")),
    key<&Material::creep_time>("body", "creep_time", "s", from(0, 1e6),
                               "time constant of the change above `yield_stress`; 0: at once", kByMaterial,
                               models("fem meshfree")),
    key<&Material::temperature>("body", "temperature", "K", above(0, 1e5), "temperature at the start", kByMaterial,
                                models("mpm")),
    key<&Material::melting_from>("body", "melting_from", "K", from(0, 1e5), "solid below this temperature", kByMaterial,
                                 models("mpm")),
    key<&Material::melting_to>("body", "melting_to", "K", from(0, 1e5), "fluid above this temperature", kByMaterial,
                               models("mpm")),
    key<&Material::viscosity>("body", "viscosity", "Pa s", from(0, 1e9), "viscosity of the melt", kByMaterial,
                              models("mpm")),
    key<&Material::heating>("body", "heating", "K/s", from(-1e6, 1e6), "heating rate of the surface from outside",
                            kByMaterial, models("mpm")),
    key<&Material::conductivity>("body", "conductivity", "m^2/s", from(0, 1e3), "thermal diffusivity inside",
                                 kByMaterial, models("mpm")),
    key<&Material::specific_heat>("body", "specific_heat", "J/(kg K)", above(0, 1e6), "specific heat, solid and fluid",
                                  kByMaterial, models("mpm")),
    key<&Material::latent_heat>("body", "latent_heat", "J/kg", from(0, 1e9),
                                "heat that melting takes and freezing gives back", kByMaterial, models("mpm")),
    key<&SceneBody::centre>("body", "centre", "m", kAnything, "centre of the body's box at the start",
                            "as in the file"),
    key<&SceneBody::rotation>("body", "rotate", "degrees", kAnything,
                              "rotation about `centre` at the start: `{ axis = [0, 1, 0], degrees = 30 }`"),
    key<&SceneBody::velocity>("body", "velocity", "m/s", kAnything, "velocity at the start"),
    key<&SceneBody::spin>("body", "spin", "degrees/s", kAnything,
                          "angular velocity at the start, about the centre of mass: axis times speed"),
    key<&SceneBody::repeat>("body", "repeat", "m, degrees", kAnything,
                            "makes copies `NAME.1` and so on: `{ count = [5, 8, 1], step = [0.3, 0.2, 0] }`, or one "
                            "`count` for a row along `step`. `jitter`: largest random shift along each axis; `turn`: "
                            "largest random rotation, degrees; `seed` changes both"),
    key<&SceneBody::may_sleep>("body", "may_sleep", "", kAnything,
                               "rigid: whether the body sleeps (costs nothing) while it lies still on something"),
    key<&SceneBody::color>("body", "color", "", kAnything, "colour in pictures, `\"#rrggbb\"`",
                           "by the number of the body"),

    key<&SceneMap::named>("map", "body", "", kAnything,
                          "name of the body, or of a repeated body, in which something varies; its model has to be fem "
                          "or rigid",
                          "the only body"),
    key<&SceneMap::of>("map", "of", "", one_of("stiffness density damping yield_stress strength"),
                       "what varies: young_modulus, density, damping or yield_stress of the [[body]], or strength of "
                       "its [[fracture]]; each once a body",
                       "required"),
    key<&SceneMap::from>(
        "map", "from", "", kAnything,
        "numbers of the mesh's vertices: `\"color.r\"` (or g, b, a: 0 to 1), `\"scalar NAME\"`, or `\"group NAME\"`, "
        "`\"object NAME\"`, `\"material NAME\"` (1 there, 0 elsewhere), or with [[follow]] `\"joint NAME\"` (how much "
        "the "
        "joint and those below it carry); `*` stands for any letters",
        "required"),
    key<&SceneMap::values>("map", "values", "", kAnything,
                           "two numbers of the mesh that get the ends of `range`; numbers beyond them get the same"),
    key<&SceneMap::range>("map", "range", "", from(1e-3, 1e3),
                          "two multiples of the body's own value; straight in between"),

    key<&SceneObstacle::shape>("obstacle", "shape", "", one_of("ground ball box mesh"),
                               "shape of the obstacle; required"),
    key<&SceneObstacle::ground, &HalfSpace::point>("obstacle", "point", "m", kAnything, "a point of the surface", "",
                                                   shapes("ground")),
    key<&SceneObstacle::ground, &HalfSpace::normal>("obstacle", "normal", "", kAnything,
                                                    "normal of the surface, away from the solid side; of any length",
                                                    "", shapes("ground")),
    key<&SceneObstacle::centre>("obstacle", "centre", "m", kAnything, "centre of the ball, the box, or the mesh's box",
                                "[0, 0, 0]; mesh: as in the file", shapes("ball box mesh")),
    key<&SceneObstacle::ball, &Ball::radius>("obstacle", "radius", "m", above(0, 1e6), "radius", "", shapes("ball")),
    key<&SceneObstacle::box, &Cuboid::size>("obstacle", "size", "m", kAnything,
                                            "lengths along x, y and z, before the turn; above 0", "", shapes("box")),
    key<&SceneObstacle::mesh>("obstacle", "mesh", "", kFile, "file, relative to the scene's folder", "",
                              shapes("mesh")),
    key<&SceneObstacle::scale>("obstacle", "scale", "m per model unit", above(0, 1e9), "metres of one model unit", "",
                               shapes("mesh")),
    key<&SceneObstacle::spacing>("obstacle", "spacing", "m", above(0, 1e6), "spacing of the distance grid",
                                 "1/64 of the longest side", shapes("mesh")),
    key<&SceneObstacle::obstacle, &Obstacle::friction>("obstacle", "friction", "", from(0, 100),
                                                       "Coulomb's coefficient"),
    key<&SceneObstacle::obstacle, &Obstacle::restitution>(
        "obstacle", "restitution", "", from(0, 1),
        "ratio of the speeds after and before a bounce. It acts on rigid points; a soft body's bounce comes from its "
        "elasticity (lower it with `internal_damping`)"),
    key<&SceneObstacle::obstacle, &Obstacle::stiffness>(
        "obstacle", "stiffness", "", above(0, 1),
        "stiffness of the contact, relative; less than 1 for ground that is softer than the bodies"),
    key<&SceneObstacle::obstacle, &Obstacle::temperature>("obstacle", "temperature", "K", above(0, 1e5),
                                                          "temperature of the surface, for `mpm` bodies that touch it"),
    key<&SceneObstacle::obstacle, &Obstacle::heat_transfer>(
        "obstacle", "heat_transfer", "W/(m^2 K)", from(0, 1e9),
        "heat transfer coefficient to `mpm` bodies; 1000 for metal"),
    key<&SceneObstacle::obstacle, &Obstacle::motion, &RigidMotion::move>("obstacle", "move", "m", kAnything,
                                                                         "displacement from the start"),
    key<&SceneObstacle::obstacle, &Obstacle::motion, &RigidMotion::angle>(
        "obstacle", "turn", "degrees", kAnything, "rotation: axis times angle, applied before `move`"),
    key<&SceneObstacle::pivot>("obstacle", "pivot", "m", kAnything, "centre of `turn`", "its centre"),
    key<&SceneObstacle::color>("obstacle", "color", "", kAnything, "colour in pictures", "grey"),
    key<&SceneObstacle::visible>("obstacle", "visible", "", kAnything, "whether it is drawn in pictures"),

    key<&HeatSource::ball, &Ball::centre>("heat", "centre", "m", kAnything,
                                          "centre of a ball; matter of `mpm` bodies inside is warmed"),
    key<&HeatSource::ball, &Ball::radius>("heat", "radius", "m", above(0, 1e6), "radius of the ball"),
    key<&HeatSource::move>("heat", "move", "m", kAnything, "displacement from the start"),
    key<&HeatSource::power>("heat", "power", "W", from(-1e12, 1e12),
                            "power that the matter inside takes up, distributed by mass; below 0 it cools"),

    key<&ScenePair::first>(
        "pair", "first", "", kAnything,
        "name of a body, a repeated body, or a material (all its bodies). `*` stands for any letters. Required"),
    key<&ScenePair::second>("pair", "second", "", kAnything,
                            "the other body, named alike; for contact within one body, the same name. Required"),
    key<&ScenePair::contact, &PairContact::friction>("pair", "friction", "", from(0, 100),
                                                     "Coulomb's coefficient between the two", "the world's"),
    key<&ScenePair::contact, &PairContact::restitution>("pair", "restitution", "", from(0, 1),
                                                        "restitution between the two", "the world's"),

    key<&SceneFracture::named>("fracture", "body", "", kAnything,
                               "name of the body that breaks, or of a repeated body; its model has to be fem",
                               "the only body"),
    key<&SceneFracture::pattern, &FracturePattern::pieces>("fracture", "pieces", "", from(2, 100'000),
                                                           "number of pieces"),
    key<&SceneFracture::pattern, &FracturePattern::kind>(
        "fracture", "pattern", "", one_of("even impact slabs radial grains"),
        "even: pieces of about one size; impact: small pieces around a point; slabs: long pieces, like wood; radial: "
        "rays and rings around a point, like glass; grains: small and large pieces, like stone"),
    key<&SceneFracture::pattern, &FracturePattern::clump>(
        "fracture", "clump", "", from(1, FracturePattern::kMostClump),
        "number of cells in a piece: more cells make knobbly pieces with hollows"),
    key<&SceneFracture::at>(
        "fracture", "at", "m", kAnything,
        "impact, radial: points around which the pattern lies, at the start; radial takes one point",
        "a corner; radial: the middle"),
    key<&SceneFracture::pattern, &FracturePattern::grain>(
        "fracture", "grain", "", kAnything, "slabs: direction of the long sides, in the mesh's own coordinates",
        "the longest axis"),
    key<&SceneFracture::pattern, &FracturePattern::stretch>("fracture", "stretch", "", from(1, 100),
                                                            "slabs: ratio of length to width"),
    key<&SceneFracture::pattern, &FracturePattern::roughness>("fracture", "roughness", "", from(0, 1),
                                                              "roughness of the cracks; 0: planes"),
    key<&SceneFracture::material, &FractureMaterial::seed>("fracture", "seed", "", from(0, 1e9),
                                                           "random seed of pattern and scatter"),
    key<&SceneFracture::material, &FractureMaterial::strength>(
        "fracture", "strength", "Pa", above(0, 1e12), "stress at which a crack begins",
        "by the material, else 0.01 young_modulus (with a yield_stress: 3 yield_stress)"),
    key<&SceneFracture::material, &FractureMaterial::plastic_opening>(
        "fracture", "plastic_opening", "m", above(0, 1e6),
        "bodies with a `yield_stress`: permanent stretch of a layer one cell thick at which it tears", "no limit"),
    key<&SceneFracture::material, &FractureMaterial::scatter>(
        "fracture", "scatter", "", from(0, 1),
        "standard deviation of the strengths of cracks, as a share of `strength`"),
    key<&SceneFracture::energy>("fracture", "energy", "J/m^2", above(0, 1e12), "energy that a crack costs per area",
                                "by the material, else strength^2 diagonal / (50 young_modulus)"),
    key<&SceneFracture::keep_closed>("fracture", "keep_closed", "", kAnything,
                                     "whether inner faces of cracks that never opened are written"),

    key<&SceneCrack::named>("crack", "body", "", kAnything, "name of a body with a [[fracture]]", "the only body"),
    key<&SceneCrack::time>("crack", "time", "s", from(0, 1e9), "time at which pieces come apart, whatever the stress"),
    key<&SceneCrack::pieces>("crack", "pieces", "", kAnything, "only the cracks around these pieces, by number", "any"),
    key<&SceneCrack::region, &SceneRegion::box>(
        "crack", "box", "m", kAnything, "only the cracks in a box at the start (one of `box`, `ball`, `vertices`)",
        "everywhere"),
    key<&SceneCrack::region, &SceneRegion::ball>("crack", "ball", "m", kAnything, "only the cracks in a ball",
                                                 "everywhere"),
    key<&SceneCrack::region, &SceneRegion::vertices>("crack", "vertices", "", kAnything,
                                                     "only the cracks near these vertices of the mesh", "everywhere"),

    key<&ScenePin::named>("pin", "body", "", kAnything,
                          "name of the body whose particles are held, or of a repeated body", "the only body"),
    key<&ScenePin::region, &SceneRegion::box>(
        "pin", "box", "m", kAnything,
        "particles in a box at the start: `{ min = [x, y, z], max = [x, y, z] }` (one of `box`, `ball`, `vertices`)"),
    key<&ScenePin::region, &SceneRegion::ball>("pin", "ball", "m", kAnything,
                                               "particles in a ball: `{ centre = [x, y, z], radius = r }`"),
    key<&ScenePin::region, &SceneRegion::vertices>("pin", "vertices", "", kAnything,
                                                   "particles near these vertices of the mesh, counted from 0"),
    key<&ScenePin::motion, &RigidMotion::move>("pin", "move", "m", kAnything, "displacement from the start"),
    key<&ScenePin::motion, &RigidMotion::angle>("pin", "turn", "degrees", kAnything,
                                                "rotation: axis times angle, applied before `move`"),
    key<&ScenePin::pivot>("pin", "pivot", "m", kAnything, "centre of `turn`", "their middle"),

    key<&SceneForce::named>("force", "body", "", kAnything, "name of the body that is pushed, or of a repeated body",
                            "the only body"),
    key<&SceneForce::region, &SceneRegion::box>(
        "force", "box", "m", kAnything, "only particles in a box at the start (one of `box`, `ball`, `vertices`)",
        "the whole body"),
    key<&SceneForce::region, &SceneRegion::ball>("force", "ball", "m", kAnything, "only particles in a ball",
                                                 "the whole body"),
    key<&SceneForce::region, &SceneRegion::vertices>(
        "force", "vertices", "", kAnything, "only particles near these vertices of the mesh", "the whole body"),
    key<&SceneForce::newtons>("force", "newtons", "N", kAnything, "total force"),

    key<&SceneHand::named>("hand", "body", "", kAnything, "name of the body that is pulled", "the only body"),
    key<&SceneHand::point>(
        "hand", "point", "m", kAnything,
        "pulls the point of the surface nearest to this point at the start. Either this or `vertex`"),
    key<&SceneHand::vertex>("hand", "vertex", "", from(0, double(kNoIndex) - 1),
                            "pulls this vertex of the mesh. Either this or `point`"),
    key<&SceneHand::hand, &Hand::target>("hand", "target", "m", kAnything, "position of the hand", "required"),
    key<&SceneHand::hand, &Hand::stiffness>(
        "hand", "stiffness", "N/m", from(0, 1e12),
        "stiffness of the spring; reduced if its frequency would be more than half of the body's highest",
        "0: an eighth of the limit"),
    key<&SceneHand::hand, &Hand::from>("hand", "from", "s", from(0, 1e9), "time at which it takes hold"),
    key<&SceneHand::hand, &Hand::until>("hand", "until", "s", from(0, 1e9), "time at which it lets go", "to the end"),

    key<&SceneFollow::named>(
        "follow", "body", "", kAnything,
        "name of the body that becomes the flesh of an animated character; its model has to be fem", "the only body"),
    key<&SceneFollow::animation>("follow", "animation", "", kFile,
                                 "glTF with a skin or morph targets, .pc2, .mdd, .usda or a model with poses (.fil), "
                                 "whose vertices are those of "
                                 "the body's mesh, relative to the scene's folder",
                                 "the body's mesh"),
    key<&SceneFollow::clip>("follow", "clip", "", kAnything, "name of its clip", "the first that moves"),
    key<&SceneFollow::speed>("follow", "speed", "", above(0, 1e3), "how fast the clip plays"),
    key<&SceneFollow::start>("follow", "start", "s", from(0, 1e6), "time of the clip at the start of the scene"),
    key<&SceneFollow::repeat>("follow", "repeat", "", kAnything,
                              "whether the clip begins again at its end; else its last pose stays"),
    key<&SceneFollow::flesh, &FleshOptions::core>(
        "follow", "core", "", from(0, 1), "how far from the bones to the skin all is held: 0 nothing, 1 everything"),
    key<&SceneFollow::flesh, &FleshOptions::frequency>("follow", "frequency", "Hz", from(0, 1e6),
                                                       "of the springs at the edge of the core"),
    key<&SceneFollow::flesh, &FleshOptions::surface_frequency>("follow", "surface_frequency", "Hz", from(0, 1e6),
                                                               "of the springs at the skin"),
    key<&SceneFollow::flesh, &FleshOptions::damping>("follow", "damping", "1/s", from(0, 1e6),
                                                     "of motion beside the animation"),
    key<&SceneFollow::flesh, &FleshOptions::leash>(
        "follow", "leash", "m", above(0, 1e6), "further from the animation matter is pulled back hard", "two spacings"),
    key<&SceneFollow::flesh, &FleshOptions::most_acceleration>(
        "follow", "most_acceleration", "m/s^2", above(0, 1e9),
        "matter feels no more of the animation's acceleration; the rest moves it along"),
    key<&SceneFollow::is_sculpted>("follow", "sculpted_gravity", "", kAnything,
                                   "whether the bind pose has its shape under gravity, and does not sag"),
    key<&SceneFollow::loose_from>(
        "follow", "loose_from", "", kAnything,
        "numbers of the mesh's vertices that say how loose the matter is, as `from` of [[map]]", "nothing"),
    key<&SceneFollow::loose_values>("follow", "loose_values", "", kAnything,
                                    "two numbers of the mesh: where matter holds as the joints say, and where it holds "
                                    "with `loose_strength`"),
    key<&SceneFollow::flesh, &FleshOptions::loose_strength>("follow", "loose_strength", "", from(0, 1),
                                                            "factor of the springs' stiffness where matter is loose"),

    key<&SceneFollowJoint::soft, &SoftJoints::pattern>(
        "follow.joint", "name", "", kAnything,
        "name of a joint, with all joints below it; `*` stands for any letters. The first that fits counts. Required"),
    key<&SceneFollowJoint::soft, &SoftJoints::strength>(
        "follow.joint", "strength", "", from(0, 1),
        "factor of the springs' stiffness; below 0.75 nothing is held, and below 0.1 there is no leash",
        "0.02, or 1 "
        "with other keys"),
    key<&SceneFollowJoint::soft, &SoftJoints::core>("follow.joint", "core", "", from(0, 1), "as of [[follow]]",
                                                    "that of [[follow]]"),
    key<&SceneFollowJoint::soft, &SoftJoints::frequency>("follow.joint", "frequency", "Hz", from(0, 1e6),
                                                         "as of [[follow]]", "that of [[follow]]"),
    key<&SceneFollowJoint::soft, &SoftJoints::surface_frequency>(
        "follow.joint", "surface_frequency", "Hz", from(0, 1e6), "as of [[follow]]", "that of [[follow]]"),
    key<&SceneFollowJoint::soft, &SoftJoints::damping>("follow.joint", "damping", "1/s", from(0, 1e6),
                                                       "as of [[follow]]", "that of [[follow]]"),

    key<&SceneFollowContact::limbs, &JointContact::first>(
        "follow.contact", "first", "", kAnything,
        "name of a joint, with all joints below it; `*` stands for any letters. Required"),
    key<&SceneFollowContact::limbs, &JointContact::second>("follow.contact", "second", "", kAnything,
                                                           "the other, named alike. Required"),
    key<&SceneFollowContact::limbs, &JointContact::touch>(
        "follow.contact", "touch", "", kAnything,
        "whether what they carry touches; the last entry that fits two joints counts, and without one they touch"),

    key<&ScenePicture::view>("picture", "view", "", one_of("front side top iso"), "view direction"),
    key<&ScenePicture::up>("picture", "up", "", one_of("x y z"), "up axis"),
    key<&ScenePicture::eye>("picture", "eye", "m", kAnything, "position of the camera; needs `target`",
                            "as close as the whole motion fits"),
    key<&ScenePicture::target>("picture", "target", "m", kAnything, "point that the camera looks at"),
    key<&ScenePicture::field_of_view>("picture", "field_of_view", "degrees", from(0, 150),
                                      "vertical field of view; 0: parallel projection"),
    key<&ScenePicture::follow>(
        "picture", "follow", "", kAnything,
        "whether the camera moves with the bodies where that shows them at least a third larger; "
        "a camera with `eye` stands still"),
    key<&ScenePicture::size>("picture", "size", "pixels", from(16, 8192), "width and height"),
    key<&ScenePicture::background>("picture", "background", "", kAnything,
                                   "`\"#rrggbb\"`, or a gradient from top to bottom: `\"#rrggbb,#rrggbb\"`",
                                   "light grey"),
    key<&ScenePicture::ground>("picture", "ground", "", kAnything,
                               "whether shadows are drawn, on a level ground obstacle or at the lowest point"),
    key<&ScenePicture::obstacles>("picture", "obstacles", "", kAnything, "whether obstacles are drawn"),
    key<&ScenePicture::particles>("picture", "particles", "", kAnything,
                                  "whether particles are drawn, not the surface"),
    key<&ScenePicture::passes>("picture", "passes", "", from(1, 1000), "number of light directions that are averaged"),
    key<&ScenePicture::most_triangles>("picture", "most_triangles", "", from(1, 1e9),
                                       "largest number of triangles of a body; above it a coarser level is drawn"),
};

std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t changed = diagonal + (a[i - 1] != b[j - 1]);
            diagonal = row[j];
            row[j] = std::min({row[j] + 1, row[j - 1] + 1, changed});
        }
    }
    return row.back();
}

} // namespace

std::span<const SceneKey> scene_keys() { return kKeys; }

const SceneKey* find_key(std::string_view table, std::string_view name) {
    for (const SceneKey& key : kKeys)
        if (key.table == table && key.name == name) return &key;
    return nullptr;
}

double& number_in(Material& material, const SceneKey& key) { return *std::get<double*>(key.place(&material)); }

std::vector<const SceneKey*> material_numbers() {
    std::vector<const SceneKey*> numbers;
    Material material;
    for (const SceneKey& key : kKeys)
        if (key.is_in(&material) && std::holds_alternative<double*>(key.place(&material))) numbers.push_back(&key);
    return numbers;
}

bool is_list(std::string_view table) { return table != "simulation" && table != "world" && table != "picture"; }

std::string shown_table(std::string_view table) {
    return std::string(is_list(table) ? "[[" : "[").append(table).append(is_list(table) ? "]]" : "]");
}

bool has_word(std::string_view words, std::string_view word) {
    bool found = false;
    each_word(words, [&](std::string_view each) { found = found || each == word; });
    return found;
}

std::string former_word_sentence(const SceneKey& key, std::string_view word) {
    if (word.empty() || word != key.values.former) return "";
    const std::string_view words = key.values.words;
    return fmt::format("{} '{}' is a word of older versions; '{}' takes its place", key.name, word,
                       words.substr(0, words.find(' ')));
}

std::string most_alike(std::string_view word, std::span<const std::string_view> words) {
    std::string_view best;
    std::size_t least = std::string_view::npos;
    for (const std::string_view known : words) {
        if (word.size() >= 3 && known.starts_with(word)) return std::string(known);
        const std::size_t distance = edit_distance(word, known);
        const bool begins_alike = !word.empty() && !known.empty() && word[0] == known[0];
        if (distance > std::max<std::size_t>(2, word.size() / (begins_alike ? 2 : 3)) || distance >= least) continue;
        least = distance;
        best = known;
    }
    return std::string(best);
}

} // namespace filigree
