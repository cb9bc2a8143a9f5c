#include "filigree/scene.h"

#include "filigree/core/math.h"
#include "filigree/core/random.h"
#include "filigree/file.h"
#include "filigree/io/model/model_file.h"
#include "filigree/io/system/file.h"
#include "filigree/mesh/mesh_map.h"
#include "filigree/physics/body/fields.h"
#include "filigree/physics/material.h"
#include "filigree/scene/scene_table.h"
#include "filigree/scene/world_setup.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

#include <fmt/format.h>
#include <toml++/toml.h>

namespace filigree {

namespace {

namespace fs = std::filesystem;

/// The k-th of a repeated body.
SceneBody repeated(const SceneBody& body, const SceneRepeat& repeat, std::size_t k) {
    const auto at = [&](std::uint64_t number) { return 2 * random_unit(repeat.seed, 8 * k + number) - 1; };
    SceneBody one = body;
    one.name = fmt::format("{}.{}", body.group, k + 1);
    const std::array<double, 3> place = {double(k % repeat.count[0]), double(k / repeat.count[0] % repeat.count[1]),
                                         double(k / repeat.count[0] / repeat.count[1])};
    for (int axis = 0; axis < 3; ++axis)
        one.aside[axis] = repeat.step[axis] * place[repeat.is_row ? 0 : axis] + repeat.jitter * at(unsigned(axis));
    const Vec3d about(at(3), at(4), at(5));
    if (repeat.turn > 0 && about.norm() > 0)
        one.rotation = math::angle_axis(math::quaternion({repeat.turn * at(6), about.normalized()}) *
                                        math::quaternion(body.rotation));
    return one;
}

/// A name that can be part of a file's name.
std::string plain_name(const std::string& text) {
    std::string name;
    for (const char c : text) name += std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' ? c : '_';
    return name.empty() ? "body" : name;
}

class SceneReader {
public:
    SceneReader(std::string_view bytes, const std::string& path) {
        scene_.path = path;
        if (const bool is_model = is_model_file(bytes); is_model || mesh_format(path_of(path)))
            throw BadResultAccess(
                {ErrorCode::bad_file,
                 fmt::format("{}: is a {}, not a scene; a scene is a TOML file that names {}, such as "
                             "[[body]] mesh = \"scan.ply\" (docs/scenes.md).",
                             path, is_model ? "model" : "mesh", is_model ? "a mesh" : "it")});
        try {
            root_ = toml::parse(bytes, path);
        } catch (const toml::parse_error& error) {
            std::string what(error.description());
            while (!what.empty() && what.back() == '.') what.pop_back();
            fail_at(path, std::max(1u, error.source().begin.line), what);
        }
    }

    void set(const SceneValue& value) {
        const auto wrong = [&](const std::string& what) {
            throw BadResultAccess(
                {ErrorCode::bad_file, fmt::format("{}: {}.{}: {}.", scene_.path, value.table, value.key, what)});
        };
        if (!find_key(value.table, value.key)) wrong("a scene has no such key (docs/scenes.md lists what there is)");
        const toml::table spelled = parsed(value, wrong);
        const auto put = [&](toml::table& table) { table.insert_or_assign(value.key, *spelled.get("value")); };
        if (!is_list(value.table)) {
            if (value.entry > 0)
                wrong(fmt::format("there is one {} alone, without a number", shown_table(value.table)));
            toml::node* const there = root_.get(value.table);
            toml::table empty;
            if (!there) put(*root_.insert_or_assign(value.table, std::move(empty)).first->second.as_table());
            if (there && there->is_table()) put(*there->as_table());
            return;
        }
        const toml::array* const entries = root_.get_as<toml::array>(value.table);
        const std::size_t count = entries ? entries->size() : 0;
        if (count == 0 || value.entry > count)
            wrong(fmt::format("the scene has {} {}", count == 0 ? "no" : std::to_string(count),
                              shown_table(value.table)));
        for (std::size_t k = 0; k < count; ++k)
            if (value.entry == 0 || value.entry == k + 1)
                if (toml::table* const table = root_.get_as<toml::array>(value.table)->get_as<toml::table>(k))
                    put(*table);
    }

    SceneFile read() {
        check_tables();
        single("simulation", [&](const SceneTable& in) { read_simulation(in); });
        single("world", [&](const SceneTable& in) { read_world(in); });
        single("picture", [&](const SceneTable& in) { read_picture(in); });
        each("body", [&](const SceneTable& in) { read_body(in); });
        if (scene_.bodies.empty())
            throw BadResultAccess({ErrorCode::bad_file, scene_.path + ": there is no [[body]], and a scene needs one "
                                                                      "(docs/scenes.md)."});
        each("obstacle", [&](const SceneTable& in) { read_obstacle(in); });
        each("fracture", [&](const SceneTable& in) { read_fractures(in); });
        each("crack", [&](const SceneTable& in) { read_crack(in); });
        each("map", [&](const SceneTable& in) { read_maps(in); });
        each("pin", [&](const SceneTable& in) { read_pins(in); });
        each("force", [&](const SceneTable& in) { read_forces(in); });
        each("heat", [&](const SceneTable& in) { in.read(&scene_.world.heat_sources.emplace_back()); });
        each("pair", [&](const SceneTable& in) { read_pair(in); });
        each("hand", [&](const SceneTable& in) { read_hand(in); });
        each("follow", [&](const SceneTable& in) { read_follow(in); });
        scene_.content = spelled();
        return std::move(scene_);
    }

private:
    /// { value = ... }
    template <class Wrong>
    static toml::table parsed(const SceneValue& value, const Wrong& wrong) {
        try {
            toml::table table = toml::parse("value = " + value.value);
            if (table.size() == 1 && table.contains("value")) return table;
        } catch (const toml::parse_error&) {
        }
        wrong("'" + value.value + "' is no value that TOML knows");
        return {};
    }

    void check_tables() const {
        std::vector<std::string_view> tables;
        for (const SceneKey& key : scene_keys())
            if (tables.empty() || tables.back() != key.table) tables.push_back(key.table);
        for (const auto& [key, value] : root_) {
            if (std::find(tables.begin(), tables.end(), key.str()) == tables.end()) {
                const std::string alike = most_alike(key.str(), tables);
                fail_at(scene_.path, key.source().begin.line,
                        fmt::format("unknown table '{}'{}", key.str(),
                                    alike.empty() ? " (docs/scenes.md)"
                                                  : fmt::format("; did you mean {}?", shown_table(alike))));
            }
            const bool is_right = is_list(key.str()) ? value.is_array_of_tables() : value.is_table();
            if (!is_right)
                fail_at(scene_.path, key.source().begin.line,
                        fmt::format("'{}' must be written as a table {}", key.str(), shown_table(key.str())));
        }
    }
    template <class Read>
    void single(std::string_view name, const Read& read) const {
        if (const toml::node* node = root_.get(name)) read(SceneTable(scene_.path, name, *node->as_table()));
    }
    template <class Read>
    void each(std::string_view name, const Read& read) const {
        const toml::node* node = root_.get(name);
        if (!node) return;
        for (const toml::node& entry : *node->as_array()) read(SceneTable(scene_.path, name, *entry.as_table()));
    }

    void read_simulation(const SceneTable& in) {
        in.refuse_both("frames", "duration");
        in.read(&scene_);
        in.read(&scene_.step);
        scene_.warnings = in.former_words();
        if (!scene_.duration) return;
        const double frames = std::round(*scene_.duration * scene_.step.frames_per_second);
        const double most = find_key("simulation", "frames")->values.most;
        if (frames > most)
            in.fail("duration", fmt::format("the duration takes {:.0f} frames at {} a second, and {:.0f} are the "
                                            "most; shorten it or lower frames_per_second",
                                            frames, scene_.step.frames_per_second, most));
        scene_.frames = static_cast<std::size_t>(std::max(frames, 1.0));
    }

    void read_world(const SceneTable& in) {
        constexpr double kAir = 1.2; // kg/m^3, at 20 degrees Celsius
        if (in.has("wind")) scene_.world.air_density = kAir;
        in.read(&scene_.world);
    }

    void read_body(const SceneTable& in) {
        SceneBody body;
        body.line = in.line();
        if (in.has("mesh") == in.has("shape")) in.fail("[[body]] takes one of mesh and shape");
        in.refuse_other_shapes(in.has("shape") ? "shape" : "mesh");
        if (in.has("mesh")) in.refuse_both("size", "scale");
        in.refuse_both("particles", "spacing");
        in.read(&body);
        in.read(&body.shape_options);
        body.material = begun_material(in, body.material_name);
        in.read(&body.material);
        check_material_of(in, body.material);
        if (in.has("shape"))
            body.shape_options.size = body.size.value_or(body.shape_options.size);
        else
            body.body.size = body.size;
        body.name = name_of(in, body);
        if (!body.repeat) return scene_.bodies.push_back(std::move(body));
        body.group = body.name;
        for (std::size_t k = 0; k < body.repeat->bodies(); ++k)
            scene_.bodies.push_back(repeated(body, *body.repeat, k));
    }

    std::string name_of(const SceneTable& in, const SceneBody& body) const {
        const auto is_taken = [&](const std::string& name) {
            return std::any_of(scene_.bodies.begin(), scene_.bodies.end(),
                               [&](const SceneBody& other) { return other.name == name || other.group == name; });
        };
        if (const std::string& name = body.name; !name.empty()) {
            if (name != plain_name(name)) in.fail("name", "a body's name is made of letters, digits, - and _");
            if (is_taken(name)) in.fail("name", "two bodies are called '" + name + "'");
            return name;
        }
        const std::string base = plain_name(body.mesh.empty() ? body.shape : path_of(body.mesh).stem().string());
        std::string name = base;
        for (int number = 2; is_taken(name); ++number) name = fmt::format("{}{}", base, number);
        return name;
    }

    static const NamedMaterial& material_called(std::string_view name) {
        return *std::ranges::find(named_materials(), name, &NamedMaterial::name);
    }

    /// A named material, with the model that the file gives it.
    static Material begun_material(const SceneTable& in, const std::string& name) {
        std::vector<std::string_view> names;
        for (const NamedMaterial& named : named_materials()) names.push_back(named.name);
        if (std::ranges::find(names, name) == names.end()) {
            const std::string alike = most_alike(name, names);
            in.fail("material", fmt::format("there is no material '{}'{}; there are {}", name,
                                            alike.empty() ? "" : " ('" + alike + "'?)", fmt::join(names, ", ")));
        }
        Material material = material_called(name).material;
        in.read("model", &material);
        const MaterialModel model = material.model;
        in.refuse_other_models(model);
        // As another model, a material that yields or melts does not.
        if (model != MaterialModel::mpm) material.melting_from = material.melting_to = Material::kNever;
        if (model == MaterialModel::springs || model == MaterialModel::rigid) material.yield_stress = Material::kNever;
        return material;
    }

    static void check_material_of(const SceneTable& in, const Material& material) {
        if (const std::string wrong = check_material(material); !wrong.empty()) in.fail(wrong);
    }

    void read_obstacle(const SceneTable& in) {
        SceneObstacle from;
        from.line = in.line();
        if (!in.has("shape")) in.fail("[[obstacle]] needs a shape: ground, ball, box or mesh");
        in.read(&from);
        in.refuse_other_shapes(from.shape);
        if (!(from.ground.normal.norm() > 0)) in.fail("normal", "the normal has no length");
        from.ground.normal.normalize();
        from.ball.centre = from.box.centre = from.centre.value_or(Vec3d::Zero());
        if (!(from.box.size.minCoeff() > 0)) in.fail("size", "the sides of a box must be above 0");
        if (from.shape == "mesh" && from.mesh.empty()) in.fail("an obstacle of shape mesh needs a mesh");
        scene_.obstacles.push_back(std::move(from));
    }

    /// The bodies that a pin, force or fracture names: one, or all of a repeated one.
    std::vector<std::size_t> bodies_of(const SceneTable& in, const std::string& name) const {
        std::vector<std::size_t> found;
        const bool is_one_group = name.empty() && !scene_.bodies.front().group.empty() &&
                                  scene_.bodies.front().group == scene_.bodies.back().group;
        for (std::size_t b = 0; b < scene_.bodies.size(); ++b)
            if (is_one_group || (!name.empty() && scene_.bodies[b].group == name)) found.push_back(b);
        return found.empty() ? std::vector<std::size_t>{body_of(in, name)} : found;
    }
    /// The body that a hand or crack names; "": the only one.
    std::size_t body_of(const SceneTable& in, const std::string& name) const {
        if (name.empty()) {
            if (scene_.bodies.size() > 1) in.fail("there are several bodies; say which with body = \"name\"");
            return 0;
        }
        std::vector<std::string_view> names;
        for (const SceneBody& body : scene_.bodies)
            if (body.group.empty() || names.empty() || names.back() != body.group)
                names.push_back(body.group.empty() ? body.name : body.group);
        for (std::size_t b = 0; b < scene_.bodies.size(); ++b)
            if (scene_.bodies[b].name == name) return b;
        if (std::ranges::count(scene_.bodies, name, &SceneBody::group) > 0)
            in.fail("body", fmt::format("'{0}' is repeated; name one of them, such as '{0}.1'", name));
        in.fail("body", fmt::format("there is no body '{}'; there are {}", name, fmt::join(names, ", ")));
    }

    /// Numbers of the bodies of this name or pattern, of a repeated one, or of this material.
    std::vector<std::size_t> bodies_called(const SceneTable& in, std::string_view key, const std::string& name) const {
        if (name.empty()) in.fail("[[pair]] needs first and second: names of bodies or materials");
        std::vector<std::size_t> found;
        for (std::size_t b = 0; b < scene_.bodies.size(); ++b)
            if (fits_pattern(scene_.bodies[b].name, name) || scene_.bodies[b].group == name) found.push_back(b);
        if (!found.empty()) return found;
        for (std::size_t b = 0; b < scene_.bodies.size(); ++b)
            if (scene_.bodies[b].material_name == name) found.push_back(b);
        if (found.empty()) in.fail(key, "no body is called '" + name + "', nor made of it");
        return found;
    }

    void read_pair(const SceneTable& in) {
        ScenePair pair;
        pair.contact = {scene_.world.body_friction, scene_.world.body_restitution};
        in.read(&pair);
        scene_.world.group_pairs.push_back(
            {bodies_called(in, "first", pair.first), bodies_called(in, "second", pair.second), pair.contact});
    }

    void read_pins(const SceneTable& in) {
        in.refuse_two_regions();
        ScenePin pin;
        pin.line = in.line();
        in.read(&pin);
        for (const std::size_t body : bodies_of(in, pin.named)) {
            if (scene_.bodies[body].material.model == MaterialModel::rigid)
                in.fail("a rigid body has no part that could be held; make it an [[obstacle]]");
            pin.body = body;
            scene_.pins.push_back(pin);
        }
    }

    void read_forces(const SceneTable& in) {
        in.refuse_two_regions();
        SceneForce force;
        force.line = in.line();
        in.read(&force);
        for (const std::size_t body : bodies_of(in, force.named)) {
            force.body = body;
            scene_.forces.push_back(force);
        }
    }

    void read_fractures(const SceneTable& in) {
        SceneFracture fracture;
        fracture.line = in.line();
        in.read(&fracture);
        if (fracture.pattern.kind == FracturePatternKind::radial && fracture.at.size() > 1)
            in.fail("at", "the pattern radial begins at one point");
        if (fracture.pattern.grain && !(fracture.pattern.grain->norm() > 0))
            in.fail("grain", "the grain has no direction");
        for (const std::size_t body : bodies_of(in, fracture.named))
            scene_.fractures.push_back(of_body(in, fracture, body));
    }
    /// What the file says of a fracture, and the rest by the body's material.
    SceneFracture of_body(const SceneTable& in, SceneFracture fracture, std::size_t number) const {
        const SceneBody& body = scene_.bodies[number];
        const Material& material = body.material;
        fracture.body = number;
        if (material.model != MaterialModel::fem)
            in.fail("only bodies of model = \"fem\" break, and '" + body.name +
                    "' is of another; give its [[body]] a material that breaks (brittle-stone, glass, plaster), or "
                    "add model = \"fem\" and young_modulus = 2e7 (stiffer takes longer; with fem, clay dents and "
                    "tears as well)");
        if (std::ranges::count(scene_.fractures, number, &SceneFracture::body) > 0)
            in.fail("a body has one [[fracture]] at most");
        if (in.has("plastic_opening") && !material.is_plastic())
            in.fail("plastic_opening", "'plastic_opening' in [[fracture]] is for a body with a yield_stress");
        const NamedMaterial& named = material_called(body.material_name);
        if (!in.has("strength")) {
            fracture.material.strength =
                material.is_plastic() ? 3 * material.yield_stress : 0.01 * material.young_modulus;
            if (named.strength > 0) // it breaks at the same strain where another stiffness is given
                fracture.material.strength = named.strength * material.young_modulus / named.material.young_modulus;
        }
        if (!fracture.energy && named.energy > 0) fracture.energy = named.energy;
        return fracture;
    }

    void read_crack(const SceneTable& in) {
        in.refuse_two_regions();
        SceneCrack crack;
        crack.line = in.line();
        in.read(&crack);
        crack.body = body_of(in, crack.named);
        if (std::ranges::count(scene_.fractures, crack.body, &SceneFracture::body) == 0)
            in.fail("this body has no [[fracture]]");
        scene_.cracks.push_back(std::move(crack));
    }

    void read_maps(const SceneTable& in) {
        SceneMap map;
        map.line = in.line();
        if (!in.has("of")) in.fail("[[map]] needs `of`: what varies");
        if (!in.has("from")) in.fail("[[map]] needs `from`: the mesh's numbers, such as \"color.r\"");
        in.read(&map);
        if (const std::string wrong = check_mesh_map(map.from); !wrong.empty()) in.fail("from", wrong);
        if (map.values[0] == map.values[1]) in.fail("values", "the two values of 'values' are the same");
        for (const std::size_t number : bodies_of(in, map.named)) {
            const SceneBody& body = scene_.bodies[number];
            if (!body.group.empty() && body.group != map.named && !map.named.empty())
                in.fail("body", fmt::format("bodies of one [[body]] are alike; name '{}'", body.group));
            check_map(in, map.of, number);
            map.body = number;
            scene_.maps.push_back(map);
        }
    }
    void check_map(const SceneTable& in, FieldOf of, std::size_t number) const {
        const Material& material = scene_.bodies[number].material;
        if (material.model != MaterialModel::fem && material.model != MaterialModel::rigid)
            in.fail(fmt::format("a [[map]] is for bodies of the models fem and rigid, and '{}' is of another",
                                scene_.bodies[number].name));
        if (of == FieldOf::yield_stress && !material.is_plastic())
            in.fail("of", "a map of yield_stress is for a body with a yield_stress");
        if (of == FieldOf::strength && std::ranges::count(scene_.fractures, number, &SceneFracture::body) == 0)
            in.fail("of", "a map of strength is for a body with a [[fracture]]");
        for (const SceneMap& other : scene_.maps)
            if (other.body == number && other.of == of)
                in.fail("of", fmt::format("a body has one [[map]] of {} at most", filigree::name_of(of)));
    }

    void read_hand(const SceneTable& in) {
        SceneHand hand;
        hand.line = in.line();
        in.read(&hand);
        hand.body = hand.hand.body = body_of(in, hand.named);
        if (in.has("point") == in.has("vertex")) in.fail("[[hand]] takes one of point and vertex");
        if (!in.has("target")) in.fail("[[hand]] needs a target: where it pulls to");
        if (!(hand.hand.from < hand.hand.until)) in.fail("until", "a hand lets go after it takes hold");
        scene_.hands.push_back(std::move(hand));
    }

    void read_follow(const SceneTable& in) {
        SceneFollow follow;
        follow.line = in.line();
        in.read(&follow);
        if (const std::string wrong = follow.loose_from.empty() ? "" : check_mesh_map(follow.loose_from);
            !wrong.empty())
            in.fail("loose_from", wrong);
        if (follow.loose_values[0] == follow.loose_values[1])
            in.fail("loose_values", "the two values of 'loose_values' are the same");
        in.each("joint", [&](const SceneTable& joint) {
            SceneFollowJoint one;
            joint.read(&one);
            if (one.soft.pattern.empty()) joint.fail("[[follow.joint]] needs `name`: a joint, or a pattern");
            const bool holds_otherwise =
                one.soft.core || one.soft.frequency || one.soft.surface_frequency || one.soft.damping;
            if (!joint.has("strength") && holds_otherwise) one.soft.strength = 1;
            follow.joints.push_back(std::move(one));
        });
        in.each("contact", [&](const SceneTable& contact) {
            SceneFollowContact one;
            contact.read(&one);
            if (one.limbs.first.empty() || one.limbs.second.empty())
                contact.fail("[[follow.contact]] needs first and second: joints, or patterns");
            follow.contacts.push_back(std::move(one));
        });
        for (const std::size_t number : bodies_of(in, follow.named)) {
            const SceneBody& body = scene_.bodies[number];
            if (!body.group.empty() && body.group != follow.named && !follow.named.empty())
                in.fail("body", fmt::format("bodies of one [[body]] are alike; name '{}'", body.group));
            if (body.material.model != MaterialModel::fem)
                in.fail(fmt::format("a [[follow]] is for bodies of the model fem, and '{}' is of another", body.name));
            if (std::ranges::count(scene_.fractures, number, &SceneFracture::body) > 0)
                in.fail(fmt::format("'{}' has a [[fracture]], and bodies that break do not follow", body.name));
            if (std::ranges::count(scene_.follows, number, &SceneFollow::body) > 0)
                in.fail("a body has one [[follow]] at most");
            if (body.mesh.empty() && follow.animation.empty())
                in.fail(fmt::format("'{}' is a built-in shape; [[follow]] needs `animation`: the file that moves it",
                                    body.name));
            follow.body = number;
            scene_.follows.push_back(follow);
        }
    }

    void read_picture(const SceneTable& in) {
        in.read(&scene_.picture);
        const ScenePicture& picture = scene_.picture;
        if (picture.eye.has_value() != picture.target.has_value()) in.fail("eye and target of the camera go together");
        if (picture.eye && *picture.eye == *picture.target) in.fail("eye", "eye and target are the same point");
    }

    /// The scene without its comments, its pictures and its length, always in one order.
    std::string spelled() const {
        toml::table kept = root_;
        kept.erase("picture");
        if (toml::table* simulation = kept["simulation"].as_table()) {
            simulation->erase("frames");
            simulation->erase("duration");
        }
        std::ostringstream text;
        text << toml::toml_formatter(kept) << "\nparticles drawn: " << scene_.picture.particles;
        return text.str();
    }

    toml::table root_;
    SceneFile scene_;
};

} // namespace

Error scene_error(const SceneFile& scene, unsigned line, ErrorCode code, const std::string& what) {
    return error_at(scene.path, line, code, what);
}

Result<SceneFile> read_scene(const std::string& path, std::span<const SceneValue> values) {
    const Result<std::string> bytes = read_file(path_of(path));
    if (!bytes) return bytes.error();
    return parse_scene(*bytes, path, values);
}

Result<SceneFile> parse_scene(std::string_view text, const std::string& path, std::span<const SceneValue> values) {
    try {
        SceneReader reader(text, path);
        for (const SceneValue& value : values) reader.set(value);
        return reader.read();
    } catch (const BadResultAccess& failure) {
        return failure.error();
    }
}

} // namespace filigree
