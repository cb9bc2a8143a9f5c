#include "filigree/scene/scene_keys.h"

#include <algorithm>
#include <vector>

namespace filigree {

namespace {

constexpr KeyValues kAnything = {};
constexpr KeyValues kFile = {.is_file = true};
constexpr KeyValues from(double least, double most) { return {.least = least, .most = most}; }
constexpr KeyValues above(double least, double most) { return {.least = least, .most = most, .above = true}; }
constexpr KeyValues one_of(std::string_view words) { return {.words = words}; }
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
                            "frames to compute; the start is one more in the output"),
    key<&SceneFile::duration>("simulation", "duration", "s", above(0, 1e6), "or how long to compute"),
    key<&StepOptions::frames_per_second>("simulation", "frames_per_second", "1/s", from(10, 1e4), "of the output"),
    key<&StepOptions::mode>(
        "simulation", "mode", "", one_of("auto explicit"),
        "auto: bodies that are too stiff for most_substeps become rigid; explicit: they stay elastic"),
    key<&StepOptions::most_substeps>("simulation", "most_substeps", "", from(1, 1e5),
                                     "substeps a frame; with mode auto, a body that needs more becomes rigid"),
    key<&StepOptions::contacts_between_bodies>("simulation", "contacts_between_bodies", "", kAnything,
                                               "whether bodies touch each other"),
    key<&StepOptions::contacts_within_bodies>("simulation", "contacts_within_bodies", "", kAnything,
                                              "whether a body touches itself"),
    key<&StepOptions::automatic_rigid>(
        "simulation", "automatic_rigid", "", kAnything,
        "whether bodies of fewer than 8 cells, or that need more than most_substeps, become rigid"),

    key<&World::gravity>("world", "gravity", "m/s^2", kAnything, "acceleration of everything"),
    key<&World::wind>("world", "wind", "m/s", kAnything, "velocity of the air"),
    key<&World::air_density>("world", "air_density", "kg/m^3", from(0, 1e4), "how hard the air presses",
                             "1.2 with wind, else 0"),
    key<&World::body_friction>("world", "body_friction", "", from(0, 100), "Coulomb's coefficient between bodies"),
    key<&World::body_restitution>("world", "body_restitution", "", from(0, 1), "between bodies, as that of obstacles"),
    key<&World::air_temperature>("world", "air_temperature", "K", above(0, 1e5), "around bodies of mpm"),
    key<&World::air_heat_transfer>("world", "air_heat_transfer", "W/(m^2 K)", from(0, 1e9),
                                   "how well the air warms and cools them; still air 10"),
    key<&World::heat_pace>("world", "heat_pace", "", above(0, 1e9),
                           "how many times quicker than in truth heat goes, in and around them"),

    key<&SceneBody::name>("body", "name", "", kAnything,
                          "of files, and for pins, forces and hands; letters, digits, - and _",
                          "that of the mesh or shape"),
    key<&SceneBody::mesh>("body", "mesh", "", kFile,
                          "file of a mesh or model (.fil), seen from the scene's folder; or"),
    key<&SceneBody::shape>("body", "shape", "",
                           one_of("wavy-cube wavy-sphere wavy-plane wavy-plate bar cylinder torus"),
                           "a built-in shape; one of `mesh` and `shape` must be there"),
    key<&ShapeOptions::resolution>("body", "resolution", "", from(1, 8192), "quads along a side", "", shapes("shape")),
    key<&ShapeOptions::frequency>("body", "frequency", "", from(0, 1e6), "waves along a side", "", shapes("shape")),
    key<&ShapeOptions::amplitude>("body", "amplitude", "sides", from(0, 10), "height of the waves", "",
                                  shapes("shape")),
    key<&SceneBody::size>(
        "body", "size", "m", from(1e-30, 1e30),
        "longest side of a mesh, in place of `scale`; of a shape its side or diameter, in model units", "1 of a shape"),
    key<&ShapeOptions::length>("body", "length", "sides", from(1e-3, 1e6), "of bars and cylinders", "",
                               shapes("shape")),
    key<&ShapeOptions::thickness>("body", "thickness", "ring radii; sides", from(1e-6, 1),
                                  "of a torus: radius of its tube; of a plate", "", shapes("shape")),
    key<&SceneBody::driver>("body", "driver", "vertices", from(3, 1e8),
                            "of the driver that the particles move, whose edges are else 0.8 spacings on average; a "
                            "model has its own",
                            "by the spacing"),
    key<&SceneBody::body, &BodyOptions::scale>("body", "scale", "m a model unit", above(0, 1e9),
                                               "how large the body is"),
    key<&SceneBody::body, &BodyOptions::cells, &CellOptions::count>("body", "particles", "", from(8, 1e8),
                                                                    "about so many"),
    key<&SceneBody::body, &BodyOptions::cells, &CellOptions::spacing>(
        "body", "spacing", "m", above(0, 1e6), "in place of `particles`: from one to the next", "by `particles`"),
    key<&SceneBody::material_name>("body", "material", "", kAnything,
                                   "one of the materials below; the keys from `model` on change it"),
    key<&Material::model>("body", "model", "", one_of("fem springs meshfree rigid mpm"),
                          "finite elements, springs, or mesh-free; rigid does not deform; mpm melts, parts and joins",
                          kByMaterial),
    key<&Material::density>("body", "density", "kg/m^3", from(1e-9, 1e6), "mass by volume", kByMaterial),
    key<&Material::young_modulus>("body", "young_modulus", "Pa", from(1e-9, 1e12), "stiffness", kByMaterial,
                                  models("fem springs meshfree mpm")),
    key<&Material::poisson_ratio>("body", "poisson_ratio", "", from(0, 0.49),
                                  "how much it thins when pulled; springs have 1/4", kByMaterial,
                                  models("fem meshfree mpm")),
    key<&Material::damping>("body", "damping", "1/s", from(0, 1e6),
                            "decay rate d: e^-d of the speed is left after a second", kByMaterial),
    key<&Material::internal_damping>("body", "internal_damping", "s", from(0, 1e3),
                                     "stress by the rate of strain, as a multiple of stiffness", kByMaterial,
                                     models("fem springs meshfree")),
    key<&Material::bending>("body", "bending", "", from(0, 0.2), "share of bending springs", kByMaterial,
                            models("springs")),
    key<&Material::yield_stress>("body", "yield_stress", "Pa", above(0, 1e12), "above it the shape changes for good",
                                 kByMaterial, models("fem meshfree mpm")),
    key<&Material::creep_time>("body", "creep_time", "s", from(0, 1e6),
                               "how slowly the shape changes above yield_stress; 0 is at once", kByMaterial,
                               models("fem meshfree")),
    key<&Material::temperature>("body", "temperature", "K", above(0, 1e5), "at the start", kByMaterial, models("mpm")),
    key<&Material::melting_from>("body", "melting_from", "K", from(0, 1e5), "stiff below", kByMaterial, models("mpm")),
    key<&Material::melting_to>("body", "melting_to", "K", from(0, 1e5), "fluid above", kByMaterial, models("mpm")),
    key<&Material::viscosity>("body", "viscosity", "Pa s", from(0, 1e9), "of the melt", kByMaterial, models("mpm")),
    key<&Material::heating>("body", "heating", "K/s", from(-1e6, 1e6), "of the surface, from around", kByMaterial,
                            models("mpm")),
    key<&Material::conductivity>("body", "conductivity", "m^2/s", from(0, 1e3), "thermal diffusivity inside",
                                 kByMaterial, models("mpm")),
    key<&Material::specific_heat>("body", "specific_heat", "J/(kg K)", above(0, 1e6), "solid and fluid", kByMaterial,
                                  models("mpm")),
    key<&Material::latent_heat>("body", "latent_heat", "J/kg", from(0, 1e9),
                                "that melting takes, and freezing gives back", kByMaterial, models("mpm")),
    key<&SceneBody::centre>("body", "centre", "m", kAnything, "of the body's box at the start",
                            "where its coordinates say"),
    key<&SceneBody::rotation>("body", "rotate", "degrees", kAnything,
                              "about that centre: `{ axis = [0, 1, 0], degrees = 30 }`"),
    key<&SceneBody::velocity>("body", "velocity", "m/s", kAnything, "at the start"),
    key<&SceneBody::spin>("body", "spin", "degrees/s", kAnything,
                          "at the start, about its centre of mass: axis times speed"),
    key<&SceneBody::repeat>(
        "body", "repeat", "m, degrees", kAnything,
        "many of it, `NAME.1` and so on: `{ count = [5, 8, 1], step = [0.3, 0.2, 0] }`, or one count in a row along "
        "step; `jitter` moves each by up to so far along each axis, `turn` turns it by up to so many degrees about "
        "any axis, both by `seed`"),
    key<&SceneBody::may_sleep>("body", "may_sleep", "", kAnything,
                               "rigid: whether it costs nothing while it lies still on something"),
    key<&SceneBody::color>("body", "color", "", kAnything, "in pictures, `\"#rrggbb\"`", "by its number"),

    key<&SceneObstacle::shape>("obstacle", "shape", "", one_of("ground ball box mesh"), "must be there"),
    key<&SceneObstacle::ground, &HalfSpace::point>("obstacle", "point", "m", kAnything, "one on the surface", "",
                                                   shapes("ground")),
    key<&SceneObstacle::ground, &HalfSpace::normal>("obstacle", "normal", "", kAnything,
                                                    "away from what is solid, of any length", "", shapes("ground")),
    key<&SceneObstacle::centre>("obstacle", "centre", "m", kAnything, "of the ball, the box, or the mesh's box",
                                "[0, 0, 0]; a mesh: where its coordinates say", shapes("ball box mesh")),
    key<&SceneObstacle::ball, &Ball::radius>("obstacle", "radius", "m", above(0, 1e6), "", "", shapes("ball")),
    key<&SceneObstacle::box, &Cuboid::size>("obstacle", "size", "m", kAnything,
                                            "along x, y and z, before it turns; above 0", "", shapes("box")),
    key<&SceneObstacle::mesh>("obstacle", "mesh", "", kFile, "file, seen from the scene's folder", "", shapes("mesh")),
    key<&SceneObstacle::scale>("obstacle", "scale", "m a model unit", above(0, 1e9), "", "", shapes("mesh")),
    key<&SceneObstacle::spacing>("obstacle", "spacing", "m", above(0, 1e6), "of the grid that holds its distances",
                                 "1/64 of the longest side", shapes("mesh")),
    key<&SceneObstacle::obstacle, &Obstacle::friction>("obstacle", "friction", "", from(0, 100),
                                                       "Coulomb's coefficient"),
    key<&SceneObstacle::obstacle, &Obstacle::restitution>(
        "obstacle", "restitution", "", from(0, 1),
        "of hard points: speed after the bounce over that before; a soft body bounces by its own elasticity, use "
        "`internal_damping` to deaden it"),
    key<&SceneObstacle::obstacle, &Obstacle::stiffness>("obstacle", "stiffness", "", above(0, 1),
                                                        "of the contact; less for ground softer than the bodies"),
    key<&SceneObstacle::obstacle, &Obstacle::temperature>("obstacle", "temperature", "K", above(0, 1e5),
                                                          "of what bodies of mpm touch"),
    key<&SceneObstacle::obstacle, &Obstacle::heat_transfer>("obstacle", "heat_transfer", "W/(m^2 K)", from(0, 1e9),
                                                            "how well it warms and cools them; metal 1000"),
    key<&SceneObstacle::obstacle, &Obstacle::motion, &RigidMotion::move>("obstacle", "move", "m", kAnything,
                                                                         "from where it is"),
    key<&SceneObstacle::obstacle, &Obstacle::motion, &RigidMotion::angle>("obstacle", "turn", "degrees", kAnything,
                                                                          "axis times angle, before it moves"),
    key<&SceneObstacle::pivot>("obstacle", "pivot", "m", kAnything, "what it turns about", "its centre"),
    key<&SceneObstacle::color>("obstacle", "color", "", kAnything, "in pictures", "grey"),
    key<&SceneObstacle::visible>("obstacle", "visible", "", kAnything, "in pictures"),

    key<&HeatSource::ball, &Ball::centre>("heat", "centre", "m", kAnything,
                                          "of a ball whose matter is warmed, in bodies of mpm"),
    key<&HeatSource::ball, &Ball::radius>("heat", "radius", "m", above(0, 1e6), "of the ball"),
    key<&HeatSource::move>("heat", "move", "m", kAnything, "from where it is"),
    key<&HeatSource::power>("heat", "power", "W", from(-1e12, 1e12),
                            "that the matter in it takes up, shared out by mass; below 0 it cools"),

    key<&ScenePair::first>("pair", "first", "", kAnything,
                           "name of a body, of a repeated one, or of a material: all bodies of it; `*` stands for any "
                           "letters; must be there"),
    key<&ScenePair::second>("pair", "second", "", kAnything,
                            "the same of what it touches; of one body with itself, its name again"),
    key<&ScenePair::contact, &PairContact::friction>("pair", "friction", "", from(0, 100),
                                                     "Coulomb's coefficient where these touch", "the world's"),
    key<&ScenePair::contact, &PairContact::restitution>("pair", "restitution", "", from(0, 1), "where these touch",
                                                        "the world's"),

    key<&SceneFracture::named>("fracture", "body", "", kAnything,
                               "name of the body that breaks, or of a repeated one; it is of model fem",
                               "the only one"),
    key<&SceneFracture::pattern, &FracturePattern::pieces>("fracture", "pieces", "", from(2, 100'000),
                                                           "that it may break into"),
    key<&SceneFracture::pattern, &FracturePattern::kind>(
        "fracture", "pattern", "", one_of("even impact slabs radial grains"),
        "of about one size; small around a point; long ones, as of wood; rays and rings around a point, as of glass; "
        "small here and large there, as of stone"),
    key<&SceneFracture::pattern, &FracturePattern::clump>(
        "fracture", "clump", "", from(1, FracturePattern::kMostClump),
        "cells that a piece is made of: with more, pieces are knobbly and have hollows"),
    key<&SceneFracture::at>("fracture", "at", "m", kAnything,
                            "where the pattern impact or radial begins, at the start; radial takes one",
                            "a corner; radial: the middle"),
    key<&SceneFracture::pattern, &FracturePattern::grain>("fracture", "grain", "", kAnything,
                                                          "slabs: along which they are longer, on the mesh's axes",
                                                          "the longest axis"),
    key<&SceneFracture::pattern, &FracturePattern::stretch>("fracture", "stretch", "", from(1, 100),
                                                            "slabs: how many times longer"),
    key<&SceneFracture::pattern, &FracturePattern::roughness>("fracture", "roughness", "", from(0, 1),
                                                              "of cracks; 0 is planes"),
    key<&SceneFracture::material, &FractureMaterial::seed>("fracture", "seed", "", from(0, 1e9),
                                                           "of the pattern and the scatter"),
    key<&SceneFracture::material, &FractureMaterial::strength>(
        "fracture", "strength", "Pa", above(0, 1e12), "the stress at which a crack begins",
        "by the material, else 0.01 young_modulus; of what yields 3 yield_stress"),
    key<&SceneFracture::material, &FractureMaterial::plastic_opening>(
        "fracture", "plastic_opening", "m", above(0, 1e6),
        "of what yields: how far a layer a cell thick may stretch for good before it tears", "any"),
    key<&SceneFracture::material, &FractureMaterial::scatter>(
        "fracture", "scatter", "", from(0, 1), "of the strengths of cracks: their standard deviation, a share"),
    key<&SceneFracture::energy>("fracture", "energy", "J/m^2", above(0, 1e12), "that a crack costs by its area",
                                "by the material, else strength^2 diagonal / (50 young_modulus)"),
    key<&SceneFracture::keep_closed>("fracture", "keep_closed", "", kAnything,
                                     "also write the inner faces of cracks that never opened"),

    key<&SceneCrack::named>("crack", "body", "", kAnything, "name of a body with a [[fracture]]", "the only one"),
    key<&SceneCrack::time>("crack", "time", "s", from(0, 1e9), "when pieces let go of each other, whatever pulls them"),
    key<&SceneCrack::pieces>("crack", "pieces", "", kAnything, "of what holds these to others, by number; and", "any"),
    key<&SceneCrack::region, &SceneRegion::box>("crack", "box", "m", kAnything, "of what is in a box at the start; or",
                                                "everywhere"),
    key<&SceneCrack::region, &SceneRegion::ball>("crack", "ball", "m", kAnything, "in a ball; or", "everywhere"),
    key<&SceneCrack::region, &SceneRegion::vertices>("crack", "vertices", "", kAnything, "near vertices of its mesh",
                                                     "everywhere"),

    key<&ScenePin::named>("pin", "body", "", kAnything,
                          "name of the body whose particles are held, or of a repeated one", "the only one"),
    key<&ScenePin::region, &SceneRegion::box>(
        "pin", "box", "m", kAnything, "those in a box at the start: `{ min = [x, y, z], max = [x, y, z] }`; or"),
    key<&ScenePin::region, &SceneRegion::ball>("pin", "ball", "m", kAnything,
                                               "in a ball: `{ centre = [x, y, z], radius = r }`; or"),
    key<&ScenePin::region, &SceneRegion::vertices>("pin", "vertices", "", kAnything,
                                                   "near vertices of its mesh, counted from 0"),
    key<&ScenePin::motion, &RigidMotion::move>("pin", "move", "m", kAnything, "from where they were"),
    key<&ScenePin::motion, &RigidMotion::angle>("pin", "turn", "degrees", kAnything,
                                                "axis times angle, before they move"),
    key<&ScenePin::pivot>("pin", "pivot", "m", kAnything, "what they turn about", "their middle"),

    key<&SceneForce::named>("force", "body", "", kAnything, "name of the body that is pushed, or of a repeated one",
                            "the only one"),
    key<&SceneForce::region, &SceneRegion::box>("force", "box", "m", kAnything, "on what is in a box at the start; or",
                                                "the whole body"),
    key<&SceneForce::region, &SceneRegion::ball>("force", "ball", "m", kAnything, "in a ball; or", "the whole body"),
    key<&SceneForce::region, &SceneRegion::vertices>("force", "vertices", "", kAnything, "near vertices of its mesh",
                                                     "the whole body"),
    key<&SceneForce::newtons>("force", "newtons", "N", kAnything, "of all of it together"),

    key<&SceneHand::named>("hand", "body", "", kAnything, "name of the body that is pulled", "the only one"),
    key<&SceneHand::point>("hand", "point", "m", kAnything, "the surface's nearest point to this one at the start; or"),
    key<&SceneHand::vertex>("hand", "vertex", "", from(0, double(kNoIndex) - 1), "a vertex of its mesh"),
    key<&SceneHand::hand, &Hand::target>("hand", "target", "m", kAnything, "where the hand is", "must be there"),
    key<&SceneHand::hand, &Hand::stiffness>(
        "hand", "stiffness", "N/m", from(0, 1e12),
        "of the spring between them; at most a quarter of what the body's own would allow", "0: by the body's"),
    key<&SceneHand::hand, &Hand::from>("hand", "from", "s", from(0, 1e9), "when it takes hold"),
    key<&SceneHand::hand, &Hand::until>("hand", "until", "s", from(0, 1e9), "when it lets go", "to the end"),

    key<&ScenePicture::view>("picture", "view", "", one_of("front side top iso"), "where from"),
    key<&ScenePicture::up>("picture", "up", "", one_of("x y z"), "which axis is up"),
    key<&ScenePicture::eye>("picture", "eye", "m", kAnything, "where the camera is; with `target`",
                            "as near as all the motion fits"),
    key<&ScenePicture::target>("picture", "target", "m", kAnything, "what it looks at"),
    key<&ScenePicture::field_of_view>("picture", "field_of_view", "degrees", from(0, 150),
                                      "vertical; 0 is parallel projection"),
    key<&ScenePicture::size>("picture", "size", "pixels", from(16, 8192), "width and height"),
    key<&ScenePicture::background>("picture", "background", "", kAnything,
                                   "`\"#rrggbb\"`, or two from top to bottom: `\"#rrggbb,#rrggbb\"`", "light grey"),
    key<&ScenePicture::ground>("picture", "ground", "", kAnything,
                               "whether a level ground, or the lowest point, catches the shadow"),
    key<&ScenePicture::obstacles>("picture", "obstacles", "", kAnything, "whether they are drawn"),
    key<&ScenePicture::particles>("picture", "particles", "", kAnything,
                                  "whether particles are drawn in place of the surface"),
    key<&ScenePicture::passes>("picture", "passes", "", from(1, 1000), "light directions that are averaged"),
    key<&ScenePicture::most_triangles>("picture", "most_triangles", "", from(1, 1e9),
                                       "of a body; a larger one is drawn at a coarser level"),
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
