#include "filigree/scene/scene_file.h"

#include "filigree/core/random.h"
#include "filigree/io/file.h"
#include "filigree/io/mesh_file.h"
#include "filigree/io/model_file.h"
#include "filigree/physics/material.h"
#include "filigree/scene/scene_keys.h"
#include "filigree/scene/scene_table.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <sstream>

#include <fmt/format.h>
#include <toml++/toml.h>

namespace filigree {

namespace {

namespace fs = std::filesystem;

/// Whether a name is what a pattern says, in which * stands for any letters.
bool fits(std::string_view name, std::string_view pattern) {
    const std::size_t star = pattern.find('*');
    if (star == std::string_view::npos) return name == pattern;
    if (!name.starts_with(pattern.substr(0, star))) return false;
    for (std::size_t from = star; from <= name.size(); ++from)
        if (fits(name.substr(from), pattern.substr(star + 1))) return true;
    return false;
}

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
        one.rotation = Eigen::AngleAxisd(repeat.turn * at(6), about.normalized()) * body.rotation;
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
    explicit SceneReader(const std::string& path) {
        scene_.path = path;
        const std::string bytes = read_file(path).value();
        if (const bool is_model = is_model_file(bytes); is_model || mesh_format(path))
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
        if (const toml::table* table = single("simulation")) read_simulation({scene_.path, "simulation", *table});
        if (const toml::table* table = single("world")) read_world({scene_.path, "world", *table});
        if (const toml::table* table = single("picture")) read_picture({scene_.path, "picture", *table});
        each("body", [&](const SceneTable& section) { read_body(section); });
        if (scene_.bodies.empty())
            throw BadResultAccess({ErrorCode::bad_file, scene_.path + ": there is no [[body]], and a scene needs one "
                                                                      "(docs/scenes.md)."});
        each("obstacle", [&](const SceneTable& section) { read_obstacle(section); });
        each("fracture", [&](const SceneTable& section) { read_fracture(section); });
        each("crack", [&](const SceneTable& section) { read_crack(section); });
        each("pin", [&](const SceneTable& section) {
            for (const std::size_t body : bodies_of(section)) {
                scene_.pins.push_back({section.line(), body, section.region(), section.motion()});
                if (scene_.bodies[body].material.model == MaterialModel::rigid)
                    section.fail(section.line(),
                                 "a rigid body has no part that could be held; make it an [[obstacle]]");
            }
        });
        each("force", [&](const SceneTable& section) {
            for (const std::size_t body : bodies_of(section))
                scene_.forces.push_back({section.line(), body, section.region(), section.keyed("newtons")});
        });
        each("heat", [&](const SceneTable& section) {
            HeatSource source{{.radius = 0.1}, section.keyed("move"), section.keyed_number("power", 0)};
            section.set("centre", source.ball.centre);
            section.set("radius", source.ball.radius);
            scene_.heat_sources.push_back(std::move(source));
        });
        each("pair", [&](const SceneTable& section) { read_pair(section); });
        each("hand", [&](const SceneTable& section) { read_hand(section); });
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
        for (const KeyRule& rule : scene_keys())
            if (tables.empty() || tables.back() != rule.table) tables.push_back(rule.table);
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
    const toml::table* single(std::string_view name) const {
        const toml::node* node = root_.get(name);
        return node ? node->as_table() : nullptr;
    }
    template <class Read>
    void each(std::string_view name, const Read& read) const {
        const toml::node* node = root_.get(name);
        if (!node) return;
        for (const toml::node& entry : *node->as_array()) read(SceneTable(scene_.path, name, *entry.as_table()));
    }

    void read_simulation(const SceneTable& in) {
        if (in.has("frames") && in.has("duration")) in.fail("duration", "give one of frames and duration");
        StepOptions& step = scene_.step;
        in.set("frames_per_second", step.frames_per_second);
        in.set_whole("frames", scene_.frames);
        if (in.has("duration")) {
            const double frames = std::round(in.number("duration", 0) * step.frames_per_second);
            const double most = find_key("simulation", "frames")->most;
            if (frames > most)
                in.fail("duration", fmt::format("the duration takes {:.0f} frames at {} a second, and {:.0f} are the "
                                                "most; shorten it or lower frames_per_second",
                                                frames, step.frames_per_second, most));
            scene_.frames = static_cast<std::size_t>(std::max(frames, 1.0));
        }
        step.mode = static_cast<StepMode>(in.word("mode", 0));
        in.set_whole("most_substeps", step.most_substeps);
        step.contacts_between_bodies = in.flag("contacts_between_bodies", true);
        step.contacts_within_bodies = in.flag("contacts_within_bodies", true);
        step.automatic_rigid = in.flag("automatic_rigid", true);
    }

    void read_world(const SceneTable& in) {
        in.set("gravity", scene_.gravity);
        scene_.wind = in.keyed("wind");
        constexpr double kAir = 1.2; // kg/m^3, at 20 degrees Celsius
        scene_.air_density = in.number("air_density", in.has("wind") ? kAir : 0);
        in.set("body_friction", scene_.body_friction);
        in.set("body_restitution", scene_.body_restitution);
        scene_.air_temperature = in.keyed_number("air_temperature", scene_.air_temperature.constant);
        in.set("air_heat_transfer", scene_.air_heat_transfer);
        in.set("heat_pace", scene_.heat_pace);
    }

    void read_body(const SceneTable& in) {
        SceneBody body;
        body.line = in.line();
        body.shape = in.text("shape");
        if (in.has("mesh") == in.has("shape")) in.fail(in.line(), "[[body]] takes one of mesh and shape");
        in.word("shape", 0);
        in.refuse_others(in.has("shape") ? "shape" : "mesh");
        if (in.has("mesh")) body.mesh = in.file("mesh");
        in.set_whole("resolution", body.shape_options.resolution);
        in.set("frequency", body.shape_options.frequency);
        in.set("amplitude", body.shape_options.amplitude);
        if (in.has("shape"))
            in.set("size", body.shape_options.size);
        else if (in.has("size"))
            in.set("size", body.body.size.emplace());
        if (body.body.size && in.has("scale")) in.fail("size", "give one of size and scale");
        in.set("length", body.shape_options.length);
        in.set("thickness", body.shape_options.thickness);
        if (in.has("driver")) in.set_whole("driver", body.driver.emplace());
        in.set("scale", body.body.scale);
        if (in.has("particles") && in.has("spacing")) in.fail("spacing", "give one of particles and spacing");
        in.set_whole("particles", body.body.cells.count);
        in.set("spacing", body.body.cells.spacing);
        body.material_name = read_material(in, body.material);
        in.set("centre", body.centre);
        body.rotation = in.rotation("rotate");
        in.set("velocity", body.velocity);
        in.set("spin", body.spin);
        body.spin *= kDegree;
        in.set("color", body.color);
        body.may_sleep = in.flag("may_sleep", true);
        body.name = name_of(in, body);
        if (!in.has("repeat")) return scene_.bodies.push_back(std::move(body));
        const SceneRepeat repeat = in.repeat("repeat");
        body.group = body.name;
        for (std::size_t k = 0; k < repeat.bodies(); ++k) scene_.bodies.push_back(repeated(body, repeat, k));
    }

    std::string name_of(const SceneTable& in, const SceneBody& body) const {
        const auto is_taken = [&](const std::string& name) {
            return std::any_of(scene_.bodies.begin(), scene_.bodies.end(),
                               [&](const SceneBody& other) { return other.name == name || other.group == name; });
        };
        if (in.has("name")) {
            const std::string name = in.text("name");
            if (name != plain_name(name)) in.fail("name", "a body's name is made of letters, digits, - and _");
            if (is_taken(name)) in.fail("name", "two bodies are called '" + name + "'");
            return name;
        }
        const std::string base = plain_name(body.mesh.empty() ? body.shape : fs::path(body.mesh).stem().string());
        std::string name = base;
        for (int number = 2; is_taken(name); ++number) name = fmt::format("{}{}", base, number);
        return name;
    }

    static const NamedMaterial& material_called(std::string_view name) {
        return *std::ranges::find(named_materials(), name, &NamedMaterial::name);
    }

    /// Refuses keys that do nothing for the body's model.
    static void refuse_other_models(const SceneTable& in, MaterialModel model) {
        constexpr std::array kNames = {"fem", "springs", "meshfree", "rigid", "mpm"};
        const auto refuse = [&](std::string_view key, const char* models) {
            if (in.has(key))
                in.fail(key, fmt::format("'{}' in [[body]] is for model = {}, and this body's is \"{}\"", key, models,
                                         kNames[std::size_t(model)]));
        };
        const bool is_mpm = model == MaterialModel::mpm;
        if (model == MaterialModel::springs || model == MaterialModel::rigid)
            refuse("yield_stress", "\"fem\", \"meshfree\" or \"mpm\"");
        if (model != MaterialModel::meshfree && model != MaterialModel::fem)
            refuse("creep_time", "\"fem\" or \"meshfree\"");
        if (!is_mpm)
            for (const char* key : {"temperature", "melting_from", "melting_to", "viscosity", "heating", "conductivity",
                                    "specific_heat", "latent_heat"})
                refuse(key, "\"mpm\"");
        if (is_mpm) refuse("internal_damping", "\"fem\", \"springs\" or \"meshfree\"");
        if (model != MaterialModel::springs) refuse("bending", "\"springs\"");
        if (model == MaterialModel::springs) refuse("poisson_ratio", "\"fem\" or \"meshfree\"");
        if (model == MaterialModel::rigid)
            for (const char* key : {"young_modulus", "poisson_ratio", "internal_damping"})
                refuse(key, "\"fem\", \"springs\" or \"meshfree\"");
    }

    /// Returns the name of the one it began as.
    static std::string read_material(const SceneTable& in, Material& material) {
        std::vector<std::string_view> names;
        for (const NamedMaterial& named : named_materials()) names.push_back(named.name);
        const std::string name = in.has("material") ? in.text("material") : std::string(names[0]);
        const auto found = std::find(names.begin(), names.end(), name);
        if (found == names.end()) {
            const std::string alike = most_alike(name, names);
            in.fail("material", fmt::format("there is no material '{}'{}; there are {}", name,
                                            alike.empty() ? "" : " ('" + alike + "'?)", fmt::join(names, ", ")));
        }
        material = named_materials()[std::size_t(found - names.begin())].material;
        material.model = static_cast<MaterialModel>(in.word("model", static_cast<int>(material.model)));
        refuse_other_models(in, material.model);
        const MaterialModel model = material.model; // as another, a material that yields or melts does not
        if (model != MaterialModel::mpm) material.melting_from = material.melting_to = Material::kNever;
        if (model == MaterialModel::springs || model == MaterialModel::rigid) material.yield_stress = Material::kNever;
        in.set("density", material.density);
        in.set("young_modulus", material.young_modulus);
        in.set("poisson_ratio", material.poisson_ratio);
        in.set("damping", material.damping);
        in.set("internal_damping", material.internal_damping);
        in.set("bending", material.bending);
        in.set("yield_stress", material.yield_stress);
        in.set("creep_time", material.creep_time);
        in.set("temperature", material.temperature);
        in.set("melting_from", material.melting_from);
        in.set("melting_to", material.melting_to);
        in.set("viscosity", material.viscosity);
        in.set("heating", material.heating);
        in.set("conductivity", material.conductivity);
        in.set("specific_heat", material.specific_heat);
        in.set("latent_heat", material.latent_heat);
        if (std::string wrong = check_material(material); !wrong.empty()) {
            while (wrong.back() == '.') wrong.pop_back();
            in.fail(in.line(), wrong);
        }
        return name;
    }

    void read_obstacle(const SceneTable& in) {
        SceneObstacle obstacle;
        obstacle.line = in.line();
        if (!in.has("shape")) in.fail(in.line(), "[[obstacle]] needs a shape: ground, ball, box or mesh");
        in.word("shape", 0);
        obstacle.shape = in.text("shape");
        in.refuse_others(obstacle.shape);
        in.set("point", obstacle.ground.point);
        in.set("normal", obstacle.ground.normal);
        if (!(obstacle.ground.normal.norm() > 0)) in.fail("normal", "the normal has no length");
        obstacle.ground.normal.normalize();
        in.set("centre", obstacle.centre);
        obstacle.ball.centre = obstacle.box.centre = obstacle.centre.value_or(Vec3d::Zero());
        in.set("radius", obstacle.ball.radius);
        in.set("size", obstacle.box.size);
        if (!(obstacle.box.size.minCoeff() > 0)) in.fail("size", "the sides of a box must be above 0");
        if (obstacle.shape == "mesh" && !in.has("mesh")) in.fail(in.line(), "an obstacle of shape mesh needs a mesh");
        if (in.has("mesh")) obstacle.mesh = in.file("mesh");
        in.set("scale", obstacle.scale);
        in.set("spacing", obstacle.spacing);
        obstacle.motion = in.motion();
        in.set("friction", obstacle.friction);
        in.set("restitution", obstacle.restitution);
        obstacle.sets_restitution = in.has("restitution");
        in.set("stiffness", obstacle.stiffness);
        obstacle.temperature = in.keyed_number("temperature", obstacle.temperature.constant);
        in.set("heat_transfer", obstacle.heat_transfer);
        in.set("color", obstacle.color);
        obstacle.visible = in.flag("visible", true);
        scene_.obstacles.push_back(std::move(obstacle));
    }

    /// The bodies that a pin, force or fracture names: one, or all of a repeated one.
    std::vector<std::size_t> bodies_of(const SceneTable& in) const {
        std::vector<std::size_t> found;
        const std::string name = in.text("body");
        const bool is_one_group = !in.has("body") && !scene_.bodies.front().group.empty() &&
                                  scene_.bodies.front().group == scene_.bodies.back().group;
        for (std::size_t b = 0; b < scene_.bodies.size(); ++b)
            if (is_one_group || (!name.empty() && scene_.bodies[b].group == name)) found.push_back(b);
        return found.empty() ? std::vector<std::size_t>{body_of(in)} : found;
    }
    /// The body that a hand or crack names.
    std::size_t body_of(const SceneTable& in) const {
        if (!in.has("body")) {
            if (scene_.bodies.size() > 1)
                in.fail(in.line(), "there are several bodies; say which with body = \"name\"");
            return 0;
        }
        std::vector<std::string_view> names;
        for (const SceneBody& body : scene_.bodies)
            if (body.group.empty() || names.empty() || names.back() != body.group)
                names.push_back(body.group.empty() ? body.name : body.group);
        const std::string name = in.text("body");
        for (std::size_t b = 0; b < scene_.bodies.size(); ++b)
            if (scene_.bodies[b].name == name) return b;
        if (std::ranges::count(scene_.bodies, name, &SceneBody::group) > 0)
            in.fail("body", fmt::format("'{0}' is repeated; name one of them, such as '{0}.1'", name));
        in.fail("body", fmt::format("there is no body '{}'; there are {}", name, fmt::join(names, ", ")));
    }

    /// Numbers of the bodies of this name or pattern, of a repeated one, or of this material.
    std::vector<std::size_t> bodies_called(const SceneTable& in, std::string_view key) const {
        if (!in.has(key)) in.fail(in.line(), "[[pair]] needs first and second: names of bodies or materials");
        const std::string name = in.text(key);
        std::vector<std::size_t> found;
        for (std::size_t b = 0; b < scene_.bodies.size(); ++b)
            if (fits(scene_.bodies[b].name, name) || scene_.bodies[b].group == name) found.push_back(b);
        if (!found.empty()) return found;
        for (std::size_t b = 0; b < scene_.bodies.size(); ++b)
            if (scene_.bodies[b].material_name == name) found.push_back(b);
        if (found.empty()) in.fail(key, "no body is called '" + name + "', nor made of it");
        return found;
    }

    void read_pair(const SceneTable& in) {
        PairContact contact{scene_.body_friction, scene_.body_restitution};
        in.set("friction", contact.friction);
        in.set("restitution", contact.restitution);
        scene_.pairs.push_back({bodies_called(in, "first"), bodies_called(in, "second"), contact});
    }

    void read_fracture(const SceneTable& in) {
        for (const std::size_t body : bodies_of(in)) read_fracture(in, body);
    }
    void read_fracture(const SceneTable& in, std::size_t body) {
        SceneFracture fracture;
        fracture.line = in.line();
        fracture.body = body;
        const NamedMaterial& named = material_called(scene_.bodies[body].material_name);
        const Material& material = scene_.bodies[fracture.body].material;
        if (material.model != MaterialModel::fem)
            in.fail(in.line(),
                    "only bodies of model = \"fem\" break, and '" + scene_.bodies[fracture.body].name +
                        "' is of another; give its [[body]] a material that breaks (brittle-stone, glass, plaster), or "
                        "add model = \"fem\" and young_modulus = 2e7 (stiffer takes longer; with fem, clay dents and "
                        "tears as well)");
        for (const SceneFracture& other : scene_.fractures)
            if (other.body == fracture.body) in.fail(in.line(), "a body has one [[fracture]] at most");
        in.set_whole("pieces", fracture.pattern.pieces);
        in.set_whole("clump", fracture.pattern.clump);
        fracture.pattern.kind = static_cast<FracturePatternKind>(in.word("pattern", 0));
        fracture.at = in.points("at");
        if (fracture.pattern.kind == FracturePatternKind::radial && fracture.at.size() > 1)
            in.fail("at", "the pattern radial begins at one point");
        in.set("grain", fracture.pattern.grain);
        if (fracture.pattern.grain && !(fracture.pattern.grain->norm() > 0))
            in.fail("grain", "the grain has no direction");
        in.set("stretch", fracture.pattern.stretch);
        in.set("roughness", fracture.pattern.roughness);
        fracture.material.seed = 1;
        in.set_whole("seed", fracture.material.seed);
        fracture.material.strength = material.is_plastic() ? 3 * material.yield_stress : 0.01 * material.young_modulus;
        if (named.strength > 0) // it breaks at the same strain where another stiffness is given
            fracture.material.strength = named.strength * material.young_modulus / named.material.young_modulus;
        if (named.energy > 0) fracture.energy = named.energy;
        in.set("strength", fracture.material.strength);
        if (in.has("plastic_opening")) {
            if (!material.is_plastic())
                in.fail("plastic_opening", "'plastic_opening' in [[fracture]] is for a body with a yield_stress");
            in.set("plastic_opening", fracture.material.plastic_opening);
        }
        in.set("scatter", fracture.material.scatter);
        if (in.has("energy")) in.set("energy", fracture.energy.emplace());
        fracture.keep_closed = in.flag("keep_closed", false);
        scene_.fractures.push_back(std::move(fracture));
    }

    void read_crack(const SceneTable& in) {
        SceneCrack crack;
        crack.line = in.line();
        crack.body = body_of(in);
        const auto breaks = [&](const SceneFracture& fracture) { return fracture.body == crack.body; };
        if (std::ranges::none_of(scene_.fractures, breaks)) in.fail(in.line(), "this body has no [[fracture]]");
        in.set("time", crack.time);
        if (in.has("pieces")) crack.pieces = in.ids("pieces");
        crack.region = in.region();
        scene_.cracks.push_back(std::move(crack));
    }

    void read_hand(const SceneTable& in) {
        SceneHand hand;
        hand.line = in.line();
        hand.body = hand.hand.body = body_of(in);
        if (in.has("point") == in.has("vertex")) in.fail(in.line(), "[[hand]] takes one of point and vertex");
        in.set("point", hand.point);
        if (in.has("vertex")) in.set_whole("vertex", hand.vertex.emplace());
        if (!in.has("target")) in.fail(in.line(), "[[hand]] needs a target: where it pulls to");
        hand.hand.target = in.keyed("target");
        in.set("stiffness", hand.hand.stiffness);
        in.set("from", hand.hand.from);
        in.set("until", hand.hand.until);
        if (!(hand.hand.from < hand.hand.until)) in.fail("until", "a hand lets go after it takes hold");
        scene_.hands.push_back(std::move(hand));
    }

    void read_picture(const SceneTable& in) {
        ScenePicture& picture = scene_.picture;
        picture.view = static_cast<View>(in.word("view", static_cast<int>(View::iso)));
        picture.up = static_cast<UpAxis>(in.word("up", static_cast<int>(UpAxis::y)));
        in.set("eye", picture.eye);
        in.set("target", picture.target);
        if (picture.eye.has_value() != picture.target.has_value())
            in.fail(in.line(), "eye and target of the camera go together");
        if (picture.eye && *picture.eye == *picture.target) in.fail("eye", "eye and target are the same point");
        in.set("field_of_view", picture.field_of_view);
        if (in.has("size")) std::tie(picture.width, picture.height) = in.pixels("size");
        if (in.has("background")) {
            const std::string colors = in.text("background");
            const std::size_t comma = colors.find(',');
            picture.background_top = in.color("background", colors.substr(0, comma));
            picture.background_bottom =
                comma == std::string::npos ? picture.background_top : in.color("background", colors.substr(comma + 1));
        }
        picture.ground = in.flag("ground", true);
        picture.obstacles = in.flag("obstacles", true);
        picture.particles = in.flag("particles", false);
        in.set_whole("passes", picture.passes);
        in.set_whole("most_triangles", picture.most_triangles);
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

Result<SceneFile> read_scene(const std::string& path, std::span<const SceneValue> values) {
    try {
        SceneReader reader(path);
        for (const SceneValue& value : values) reader.set(value);
        return reader.read();
    } catch (const BadResultAccess& failure) {
        return failure.error();
    }
}

Error scene_error(const SceneFile& scene, unsigned line, ErrorCode code, const std::string& what) {
    return error_at(scene.path, line, code, what);
}

} // namespace filigree
