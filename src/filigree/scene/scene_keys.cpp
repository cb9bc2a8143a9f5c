#include "filigree/scene/scene_keys.h"

#include "filigree/physics/material.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>

namespace filigree {

namespace {

constexpr double kAny = std::numeric_limits<double>::infinity();

using enum KeyType;

constexpr KeyRule plain(std::string_view table, std::string_view key, KeyType type, std::string_view unit,
                        std::string_view unset, std::string_view text, std::string_view only = "") {
    return {table, key, type, unit, unset, -kAny, kAny, false, "", only, text};
}
constexpr KeyRule from(double least, double most, std::string_view table, std::string_view key, KeyType type,
                       std::string_view unit, std::string_view unset, std::string_view text,
                       std::string_view only = "") {
    return {table, key, type, unit, unset, least, most, false, "", only, text};
}
constexpr KeyRule above(double least, double most, std::string_view table, std::string_view key, KeyType type,
                        std::string_view unit, std::string_view unset, std::string_view text,
                        std::string_view only = "") {
    return {table, key, type, unit, unset, least, most, true, "", only, text};
}
constexpr KeyRule one_of(std::string_view words, std::string_view table, std::string_view key, std::string_view unset,
                         std::string_view text) {
    return {table, key, word, "", unset, -kAny, kAny, false, words, "", text};
}

constexpr KeyRule kKeys[] = {
    from(1, 1e6, "simulation", "frames", whole, "", "120", "frames to compute; the start is one more in the output"),
    above(0, 1e6, "simulation", "duration", number, "s", "", "or how long to compute"),
    from(10, 1e4, "simulation", "frames_per_second", number, "1/s", "60", "of the output"),
    one_of("auto explicit", "simulation", "mode", "auto",
           "auto: bodies that are too stiff for most_substeps become rigid; explicit: they stay elastic"),
    from(1, 1e5, "simulation", "most_substeps", whole, "", "500", "a frame, that a body may need to stay elastic"),
    plain("simulation", "contacts_between_bodies", flag, "", "true", "whether bodies touch each other"),
    plain("simulation", "contacts_within_bodies", flag, "", "true", "whether a body touches itself"),
    plain("simulation", "automatic_rigid", flag, "", "true",
          "whether bodies of fewer than 8 cells, or that need more than most_substeps, become rigid"),

    plain("world", "gravity", vector, "m/s^2", "[0, -9.81, 0]", "acceleration of everything"),
    plain("world", "wind", keyed, "m/s", "[0, 0, 0]", "velocity of the air"),
    from(0, 1e4, "world", "air_density", number, "kg/m^3", "1.2 with wind, else 0", "how hard the air presses"),
    from(0, 100, "world", "body_friction", number, "", "0.3", "Coulomb's coefficient between bodies"),
    from(0, 1, "world", "body_restitution", number, "", "0.7", "between bodies, as that of obstacles"),

    above(0, 1e5, "world", "air_temperature", keyed_number, "K", "293", "around bodies of mpm"),
    from(0, 1e9, "world", "air_heat_transfer", number, "W/(m^2 K)", "0",
         "how well the air warms and cools them; still air 10"),
    above(0, 1e9, "world", "heat_pace", number, "", "1",
          "how many times quicker than in truth heat goes, in and around them"),

    plain("body", "name", text, "", "that of the mesh or shape",
          "of files, and for pins, forces and hands; letters, digits, - and _"),
    plain("body", "mesh", text, "", "", "file of a mesh or model (.fil), seen from the scene's folder; or"),
    one_of("wavy-cube wavy-sphere wavy-plane wavy-plate bar cylinder torus", "body", "shape", "",
           "a built-in shape, as `filigree make` has them; one of `mesh` and `shape` must be there"),
    from(1, 8192, "body", "resolution", whole, "", "64", "quads along a side", "shape"),
    from(0, 1e6, "body", "frequency", number, "", "5", "waves along a side", "shape"),
    from(0, 10, "body", "amplitude", number, "sides", "0.04", "height of the waves", "shape"),
    from(1e-30, 1e30, "body", "size", number, "m", "1 of a shape",
         "longest side of a mesh, in place of `scale`; of a shape its side or diameter, in model units"),
    from(1e-3, 1e6, "body", "length", number, "sides", "4", "of bars and cylinders", "shape"),
    from(1e-6, 1, "body", "thickness", number, "ring radii; sides", "0.3", "of a torus: radius of its tube; of a plate",
         "shape"),
    from(3, 1e8, "body", "driver", whole, "vertices", "by the spacing",
         "of the driver that the particles move, whose edges are else 0.8 spacings on average; a model has its own"),
    above(0, 1e9, "body", "scale", number, "m a model unit", "1", "how large the body is"),
    from(8, 1e8, "body", "particles", whole, "", "8000", "about so many"),
    above(0, 1e6, "body", "spacing", number, "m", "", "instead of `particles`: from one to the next"),
    plain("body", "material", text, "", "rubber", "one of the materials below; the keys from `model` on change it"),
    one_of("fem springs meshfree rigid mpm", "body", "model", "by the material",
           "finite elements, springs, or mesh-free; rigid does not deform; mpm melts, parts and joins"),
    from(1e-9, 1e6, "body", "density", number, "kg/m^3", "by the material", "mass by volume"),
    from(1e-9, 1e12, "body", "young_modulus", number, "Pa", "by the material", "stiffness"),
    from(0, 0.49, "body", "poisson_ratio", number, "", "by the material",
         "how much it thins when pulled; springs have 1/4"),
    from(0, 1e6, "body", "damping", number, "1/s", "by the material",
         "decay rate d: e^-d of the speed is left after a second"),
    from(0, 1e3, "body", "internal_damping", number, "s", "by the material",
         "stress by the rate of strain, as a multiple of stiffness"),
    from(0, 0.2, "body", "bending", number, "", "by the material", "springs: share of bending springs"),
    above(0, 1e12, "body", "yield_stress", number, "Pa", "by the material",
          "fem, mesh-free, mpm: above it the shape changes for good"),
    from(0, 1e6, "body", "creep_time", number, "s", "by the material", "fem, mesh-free: how slowly; 0 is at once"),
    above(0, 1e5, "body", "temperature", number, "K", "by the material", "mpm: at the start"),
    from(0, 1e5, "body", "melting_from", number, "K", "by the material", "mpm: stiff below"),
    from(0, 1e5, "body", "melting_to", number, "K", "by the material", "mpm: fluid above"),
    from(0, 1e9, "body", "viscosity", number, "Pa s", "by the material", "mpm: of the melt"),
    from(-1e6, 1e6, "body", "heating", number, "K/s", "by the material", "mpm: of the surface, from around"),
    from(0, 1e3, "body", "conductivity", number, "m^2/s", "by the material", "mpm: thermal diffusivity inside"),
    above(0, 1e6, "body", "specific_heat", number, "J/(kg K)", "by the material", "mpm: solid and fluid"),
    from(0, 1e9, "body", "latent_heat", number, "J/kg", "by the material",
         "mpm: that melting takes, and freezing gives back"),
    plain("body", "centre", vector, "m", "where its coordinates say", "of the body's box at the start"),
    plain("body", "rotate", rotation, "degrees", "", "about that centre: `{ axis = [0, 1, 0], degrees = 30 }`"),
    plain("body", "velocity", vector, "m/s", "[0, 0, 0]", "at the start"),
    plain("body", "spin", vector, "degrees/s", "[0, 0, 0]", "at the start, about its centre of mass: axis times speed"),
    plain("body", "repeat", repeat, "m, degrees", "",
          "many of it, `NAME.1` and so on: `{ count = [5, 8, 1], step = [0.3, 0.2, 0] }`, or one count in a row along "
          "step; `jitter` moves each by up to so far along each axis, `turn` turns it by up to so many degrees about "
          "any axis, both by `seed`"),
    plain("body", "may_sleep", flag, "", "true", "rigid: whether it costs nothing while it lies still on something"),
    plain("body", "color", color, "", "by its number", "in pictures, `\"#rrggbb\"`"),

    one_of("ground ball box mesh", "obstacle", "shape", "", "must be there"),
    plain("obstacle", "point", vector, "m", "[0, 0, 0]", "one on the surface", "ground"),
    plain("obstacle", "normal", vector, "", "[0, 1, 0]", "away from what is solid, of any length", "ground"),
    plain("obstacle", "centre", vector, "m", "[0, 0, 0]; a mesh: where its coordinates say",
          "of the ball, the box, or the mesh's box", "ball box mesh"),
    above(0, 1e6, "obstacle", "radius", number, "m", "1", "", "ball"),
    plain("obstacle", "size", vector, "m", "[1, 1, 1]", "along x, y and z, before it turns; above 0", "box"),
    plain("obstacle", "mesh", text, "", "", "file, seen from the scene's folder", "mesh"),
    above(0, 1e9, "obstacle", "scale", number, "m a model unit", "1", "", "mesh"),
    above(0, 1e6, "obstacle", "spacing", number, "m", "1/64 of the longest side",
          "of the grid that holds its distances", "mesh"),
    from(0, 100, "obstacle", "friction", number, "", "0.5", "Coulomb's coefficient"),
    from(0, 1, "obstacle", "restitution", number, "", "0.5",
         "of hard points: speed after the bounce over that before; a soft body bounces by its own elasticity, use "
         "`internal_damping` to deaden it"),
    above(0, 1, "obstacle", "stiffness", number, "", "1", "of the contact; less for ground softer than the bodies"),
    above(0, 1e5, "obstacle", "temperature", keyed_number, "K", "293", "of what bodies of mpm touch"),
    from(0, 1e9, "obstacle", "heat_transfer", number, "W/(m^2 K)", "0", "how well it warms and cools them; metal 1000"),
    plain("obstacle", "move", keyed, "m", "[0, 0, 0]", "from where it is"),
    plain("obstacle", "turn", keyed, "degrees", "[0, 0, 0]", "axis times angle, before it moves"),
    plain("obstacle", "pivot", vector, "m", "its centre", "what it turns about"),
    plain("obstacle", "color", color, "", "grey", "in pictures"),
    plain("obstacle", "visible", flag, "", "true", "in pictures"),

    plain("heat", "centre", vector, "m", "[0, 0, 0]", "of a ball whose matter is warmed, in bodies of mpm"),
    above(0, 1e6, "heat", "radius", number, "m", "0.1", "of the ball"),
    plain("heat", "move", keyed, "m", "[0, 0, 0]", "from where it is"),
    from(-1e12, 1e12, "heat", "power", keyed_number, "W", "0",
         "that the matter in it takes up, shared out by mass; below 0 it cools"),

    plain("pair", "first", text, "", "",
          "name of a body, of a repeated one, or of a material: all bodies of it; `*` stands for any letters; must be "
          "there"),
    plain("pair", "second", text, "", "", "the same of what it touches; of one body with itself, its name again"),
    from(0, 100, "pair", "friction", number, "", "the world's", "Coulomb's coefficient where these touch"),
    from(0, 1, "pair", "restitution", number, "", "the world's", "where these touch"),

    plain("fracture", "body", text, "", "the only one",
          "name of the body that breaks, or of a repeated one; it is of model fem"),
    from(2, 100'000, "fracture", "pieces", whole, "", "20", "that it may break into"),
    one_of(
        "even impact slabs radial grains", "fracture", "pattern", "even",
        "of about one size; small around a point; long ones, as of wood; rays and rings around a point, as of glass; "
        "small here and large there, as of stone"),
    from(1, 100, "fracture", "clump", whole, "", "1",
         "cells that a piece is made of: with more, pieces are knobbly and have hollows"),
    plain("fracture", "at", points, "m", "a corner; radial: the middle",
          "where the pattern impact or radial begins, at the start; radial takes one"),
    plain("fracture", "grain", vector, "", "the longest axis",
          "slabs: along which they are longer, on the mesh's axes"),
    from(1, 100, "fracture", "stretch", number, "", "6", "slabs: how many times longer"),
    from(0, 1, "fracture", "roughness", number, "", "0.5", "of cracks; 0 is planes"),
    from(0, 1e9, "fracture", "seed", whole, "", "1", "of the pattern and the scatter"),
    above(0, 1e12, "fracture", "strength", number, "Pa",
          "by the material, else 0.01 young_modulus; of what yields 3 yield_stress",
          "the stress at which a crack begins"),
    above(0, 1e6, "fracture", "plastic_opening", number, "m", "any",
          "of what yields: how far a layer a cell thick may stretch for good before it tears"),
    from(0, 1, "fracture", "scatter", number, "", "0", "of the strengths of cracks: their standard deviation, a share"),
    above(0, 1e12, "fracture", "energy", number, "J/m^2",
          "by the material, else strength^2 diagonal / (50 young_modulus)", "that a crack costs by its area"),
    plain("fracture", "keep_closed", flag, "", "false", "also write the inner faces of cracks that never opened"),

    plain("crack", "body", text, "", "the only one", "name of a body with a [[fracture]]"),
    from(0, 1e9, "crack", "time", number, "s", "0", "when pieces let go of each other, whatever pulls them"),
    plain("crack", "pieces", ids, "", "any", "of what holds these to others, by number; and"),
    plain("crack", "box", box, "m", "everywhere", "of what is in a box at the start; or"),
    plain("crack", "ball", ball, "m", "everywhere", "in a ball; or"),
    plain("crack", "vertices", ids, "", "everywhere", "near vertices of its mesh"),

    plain("pin", "body", text, "", "the only one", "name of the body whose particles are held, or of a repeated one"),
    plain("pin", "box", box, "m", "", "those in a box at the start: `{ min = [x, y, z], max = [x, y, z] }`; or"),
    plain("pin", "ball", ball, "m", "", "in a ball: `{ centre = [x, y, z], radius = r }`; or"),
    plain("pin", "vertices", ids, "", "", "near vertices of its mesh, counted from 0"),
    plain("pin", "move", keyed, "m", "[0, 0, 0]", "from where they were"),
    plain("pin", "turn", keyed, "degrees", "[0, 0, 0]", "axis times angle, before they move"),
    plain("pin", "pivot", vector, "m", "their middle", "what they turn about"),

    plain("force", "body", text, "", "the only one", "name of the body that is pushed, or of a repeated one"),
    plain("force", "box", box, "m", "the whole body", "on what is in a box at the start; or"),
    plain("force", "ball", ball, "m", "the whole body", "in a ball; or"),
    plain("force", "vertices", ids, "", "the whole body", "near vertices of its mesh"),
    plain("force", "newtons", keyed, "N", "[0, 0, 0]", "of all of it together"),

    plain("hand", "body", text, "", "the only one", "name of the body that is pulled"),
    plain("hand", "point", vector, "m", "", "the surface's nearest point to this one at the start; or"),
    from(0, 4294967294.0, "hand", "vertex", whole, "", "", "a vertex of its mesh"),
    plain("hand", "target", keyed, "m", "the point", "where the hand is"),
    from(0, 1e12, "hand", "stiffness", number, "N/m", "0: by the body's",
         "of the spring between them; at most a quarter of what the body's own would allow"),
    from(0, 1e9, "hand", "from", number, "s", "0", "when it takes hold"),
    from(0, 1e9, "hand", "until", number, "s", "to the end", "when it lets go"),

    one_of("front side top iso", "picture", "view", "iso", "where from"),
    one_of("x y z", "picture", "up", "y", "which axis is up"),
    plain("picture", "eye", vector, "m", "as near as all the motion fits", "where the camera is; with `target`"),
    plain("picture", "target", vector, "m", "", "what it looks at"),
    from(0, 150, "picture", "field_of_view", number, "degrees", "30", "vertical; 0 is parallel projection"),
    from(16, 8192, "picture", "size", pixels, "pixels", "[960, 720]", "width and height"),
    plain("picture", "background", text, "", "light grey",
          "`\"#rrggbb\"`, or two from top to bottom: `\"#rrggbb,#rrggbb\"`"),
    plain("picture", "ground", flag, "", "true", "whether a level ground, or the lowest point, catches the shadow"),
    plain("picture", "obstacles", flag, "", "true", "whether they are drawn"),
    plain("picture", "particles", flag, "", "false", "whether particles are drawn in place of the surface"),
    from(1, 1000, "picture", "passes", whole, "", "8", "light directions that are averaged"),
    from(1, 1e9, "picture", "most_triangles", whole, "", "300000",
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

std::string table_head(std::string_view table) {
    return fmt::format("\n### `{}`\n\n| key | type | unit | unset | range | |\n|---|---|---|---|---|---|\n",
                       shown_table(table));
}

std::string manual_row(const KeyRule& rule) {
    std::string text(rule.text);
    if (!rule.only.empty() && rule.table == "obstacle") {
        std::string shapes;
        for (const char c : rule.only) shapes += c == ' ' ? std::string(", ") : std::string(1, c);
        text = shapes + (text.empty() ? "" : ": " + text);
    }
    std::string range = range_text(rule);
    for (std::size_t at = 0; at < rule.words.size();) { // `a`, `b`
        const std::size_t end = std::min(rule.words.find(' ', at), rule.words.size());
        range += fmt::format("{}`{}`", range.empty() ? "" : ", ", rule.words.substr(at, end - at));
        at = end + 1;
    }
    return fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", rule.key, type_text(rule.type), rule.unit, rule.unset,
                       range, text);
}

std::string or_never(double value) { return std::isinf(value) ? "" : fmt::format("{}", value); }

} // namespace

std::span<const KeyRule> scene_keys() { return kKeys; }

const KeyRule* find_key(std::string_view table, std::string_view key) {
    for (const KeyRule& rule : kKeys)
        if (rule.table == table && rule.key == key) return &rule;
    return nullptr;
}

bool is_list(std::string_view table) { return table != "simulation" && table != "world" && table != "picture"; }

std::string shown_table(std::string_view table) {
    return is_list(table) ? fmt::format("[[{}]]", table) : fmt::format("[{}]", table);
}

std::string range_text(const KeyRule& rule) {
    const bool has_least = !std::isinf(rule.least), has_most = !std::isinf(rule.most);
    if (rule.above) {
        return has_most ? fmt::format("above {:g}, to {:g}", rule.least, rule.most)
                        : fmt::format("above {:g}", rule.least);
    }
    if (has_least)
        return has_most ? fmt::format("{:g} to {:g}", rule.least, rule.most) : fmt::format("{:g} and up", rule.least);
    return "";
}

std::string type_text(KeyType type) {
    switch (type) {
    case text:
        return "text";
    case word:
        return "word";
    case number:
        return "number";
    case whole:
        return "whole number";
    case flag:
        return "true or false";
    case vector:
        return "three numbers";
    case points:
        return "three numbers, or a list of such";
    case keyed:
        return "three numbers, or keys";
    case keyed_number:
        return "number, or keys";
    case color:
        return "colour";
    case box:
        return "box";
    case ball:
        return "ball";
    case ids:
        return "list of numbers from 0";
    case rotation:
        return "axis and degrees";
    case repeat:
        return "table";
    case pixels:
        return "two whole numbers";
    }
    return "";
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

std::string scene_manual() {
    std::string manual;
    std::string_view table;
    for (const KeyRule& rule : kKeys) {
        if (rule.table != table) manual += table_head(rule.table);
        table = rule.table;
        manual += manual_row(rule);
    }
    manual +=
        "\n### Materials\n\n| name | model | density | young_modulus | poisson_ratio | damping | internal_damping | "
        "yield_stress | creep_time | melting_from, melting_to | viscosity | strength, energy | |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    constexpr std::array<std::string_view, 5> kModels = {"fem", "springs", "meshfree", "rigid", "mpm"};
    for (const NamedMaterial& named : named_materials()) {
        const Material& m = named.material;
        manual +=
            fmt::format("| `{}` | {} | {} | {:.0e} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", named.name,
                        kModels[std::size_t(m.model)], m.density, m.young_modulus, m.poisson_ratio, m.damping,
                        m.internal_damping, or_never(m.yield_stress), m.is_plastic() ? or_never(m.creep_time) : "",
                        m.melts() ? fmt::format("{}, {}", m.melting_from, m.melting_to) : "",
                        m.melts() ? fmt::format("{}", m.viscosity) : "",
                        named.strength > 0 ? fmt::format("{:.0e}, {}", named.strength, named.energy) : "", named.text);
    }
    return manual.substr(1);
}

} // namespace filigree
