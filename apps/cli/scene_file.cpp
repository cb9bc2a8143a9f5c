#include "scene_file.h"

#include "scene_keys.h"
#include "stage.h"

#include "filigree/io/file.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <sstream>

#include <toml++/toml.h>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

constexpr double kDegree = std::numbers::pi / 180;

unsigned line_of(const toml::node& node) { return node.source().begin.line; }

[[noreturn]] void fail_at(const std::string& path, unsigned line, const std::string& what,
                          ErrorCode code = ErrorCode::bad_file) {
    throw Failure{{code, fmt::format("{}:{}: {}.", path, line, what)}};
}

/// "; did you mean 'this'?" or where to look.
std::string suggestion(std::string_view word, std::span<const std::string_view> words) {
    const std::string alike = most_alike(word, words);
    return alike.empty() ? " (docs/scenes.md lists what there is)" : fmt::format("; did you mean '{}'?", alike);
}

/// The table that has such a key, as it is written; "" when there is none.
std::string table_with(std::string_view key) {
    for (const KeyRule& rule : scene_keys())
        if (rule.key == key) return shown_table(rule.table);
    return "";
}

/// A value as messages show it: what was written, or what kind of thing it is.
std::string shown(const toml::node& node) {
    if (const auto text = node.value_exact<std::string>()) return "\"" + *text + "\"";
    if (const auto flag = node.value_exact<bool>()) return *flag ? "true" : "false";
    if (const auto whole = node.value_exact<std::int64_t>()) return fmt::format("{}", *whole);
    if (const auto number = node.value_exact<double>()) return fmt::format("{}", *number);
    if (node.is_array()) return "a list";
    return node.is_table() ? "a table" : "a date or time";
}

/// One table of the file: reads its keys by their rules.
class Section {
public:
    Section(const std::string& path, std::string_view name, const toml::table& table)
        : path_(path), name_(name), table_(table) {
        std::vector<std::string_view> known;
        for (const KeyRule& rule : scene_keys())
            if (rule.table == name) known.push_back(rule.key);
        for (const auto& [key, value] : table)
            if (!find_key(name, key.str())) {
                const std::string other = table_with(key.str());
                const std::string hint =
                    other.empty() ? suggestion(key.str(), known) : fmt::format("; it belongs to {}", other);
                fail_question(key.source().begin.line,
                              fmt::format("unknown key '{}' in {}{}", key.str(), shown_table(name), hint));
            }
    }

    unsigned line() const { return line_of(table_); }
    unsigned line(std::string_view key) const { return has(key) ? line_of(*table_.get(key)) : line(); }
    bool has(std::string_view key) const { return table_.contains(key); }
    [[noreturn]] void fail(unsigned line, const std::string& what) const { fail_at(path_, line, what); }
    [[noreturn]] void fail(std::string_view key, const std::string& what) const { fail(line(key), what); }

    double number(std::string_view key, double unset) const {
        const toml::node* node = table_.get(key);
        return node ? number_of(*node, key, *find_key(name_, key)) : unset;
    }
    void set(std::string_view key, double& value) const { value = number(key, value); }
    template <class Number>
    void set_whole(std::string_view key, Number& value) const {
        if (const toml::node* node = table_.get(key))
            value = static_cast<Number>(whole_of(*node, key, *find_key(name_, key)));
    }
    bool flag(std::string_view key, bool unset) const {
        const toml::node* node = table_.get(key);
        if (!node) return unset;
        const auto value = node->value_exact<bool>();
        if (!value) wrong(*node, key, "true or false");
        return *value;
    }
    /// "" where it is not there.
    std::string text(std::string_view key) const {
        const toml::node* node = table_.get(key);
        if (!node) return "";
        const auto value = node->value_exact<std::string>();
        if (!value || value->empty()) wrong(*node, key, "a text");
        return *value;
    }
    /// The place of a word among those of its rule; `unset` where it is not there.
    int word(std::string_view key, int unset) const {
        const toml::node* node = table_.get(key);
        if (!node) return unset;
        std::vector<std::string_view> words;
        const std::string_view all = find_key(name_, key)->words;
        for (std::size_t at = 0; at < all.size(); at = std::min(all.find(' ', at), all.size()) + 1)
            words.push_back(all.substr(at, all.find(' ', at) - at));
        const auto value = node->value_exact<std::string>();
        const auto found = std::find(words.begin(), words.end(), value.value_or(""));
        if (found == words.end()) wrong(*node, key, fmt::format("one of {}", fmt::join(words, ", ")));
        return static_cast<int>(found - words.begin());
    }
    void set(std::string_view key, Vec3d& value) const {
        if (const toml::node* node = table_.get(key)) value = vector_of(*node, key);
    }
    void set(std::string_view key, std::optional<Vec3d>& value) const {
        if (const toml::node* node = table_.get(key)) value = vector_of(*node, key);
    }
    void set(std::string_view key, std::optional<Vec3f>& value) const {
        if (has(key)) value = color(key, text(key));
    }
    Vec3f color(std::string_view key, const std::string& written) const {
        try {
            return parse_color(written, std::string(key));
        } catch (const Failure& failure) {
            std::string what = failure.error.message;
            what.pop_back(); // the full stop
            fail(key, what);
        }
    }
    /// Numbers that change in time, times `unit`.
    Keyed<Vec3d> keyed(std::string_view key, double unit = 1) const {
        Keyed<Vec3d> value{{}, {}, Vec3d::Zero()};
        const toml::node* node = table_.get(key);
        if (!node) return value;
        const toml::array* list = node->as_array();
        if (!list || list->empty() || !list->get(0)->is_table()) {
            value.constant = unit * vector_of(*node, key);
            return value;
        }
        for (const toml::node& entry : *list) read_key(entry, key, unit, value);
        return value;
    }
    SceneMotion motion() const {
        SceneMotion motion{keyed("move"), keyed("turn", kDegree), {}};
        set("pivot", motion.pivot);
        return motion;
    }
    SceneRegion region() const {
        SceneRegion region;
        if (has("box") + has("ball") + has("vertices") > 1)
            fail(line(), shown_table(name_) + " takes one of box, ball and vertices");
        if (has("box")) {
            const toml::table& table = sub_table("box", {"max", "min"});
            region.box = Box{vector_of(*table.get("min"), "box.min"), vector_of(*table.get("max"), "box.max")};
            if (region.box->empty()) fail("box", "the box's min is not below its max");
        }
        if (has("ball")) {
            const toml::table& table = sub_table("ball", {"centre", "radius"});
            region.ball = Ball{vector_of(*table.get("centre"), "ball.centre"),
                               finite_of(*table.get("radius"), "ball.radius", "a number above 0")};
            if (!(region.ball->radius > 0)) wrong(*table.get("radius"), "ball.radius", "a number above 0");
        }
        if (has("vertices")) region.vertices = ids("vertices");
        return region;
    }
    Eigen::AngleAxisd rotation(std::string_view key) const {
        if (!has(key)) return Eigen::AngleAxisd::Identity();
        const toml::table& table = sub_table(key, {"axis", "degrees"});
        const Vec3d axis = vector_of(*table.get("axis"), "rotate.axis");
        if (!(axis.norm() > 0)) wrong(*table.get("axis"), "rotate.axis", "a direction with a length");
        return Eigen::AngleAxisd(kDegree * finite_of(*table.get("degrees"), "rotate.degrees", "a number"),
                                 axis.normalized());
    }
    std::pair<unsigned, unsigned> pixels(std::string_view key) const {
        const toml::node& node = *table_.get(key);
        const toml::array* list = node.as_array();
        if (!list || list->size() != 2) wrong(node, key, "two whole numbers");
        const KeyRule& rule = *find_key(name_, key);
        return {static_cast<unsigned>(whole_of(*list->get(0), key, rule)),
                static_cast<unsigned>(whole_of(*list->get(1), key, rule))};
    }
    /// A file's name, seen from the scene's folder; it has to be there.
    std::string file(std::string_view key) const {
        const fs::path named = text(key), path = named.is_absolute() ? named : fs::path(path_).parent_path() / named;
        std::error_code ignored;
        if (!fs::exists(path, ignored))
            fail_at(path_, line(key), fmt::format("there is no file '{}' (looked for {})", text(key), path.string()),
                    ErrorCode::not_found);
        return path.string();
    }
    /// Refuses keys that belong to another shape, or to none.
    void refuse_others(std::string_view shape) const {
        for (const auto& [key, value] : table_) {
            const KeyRule& rule = *find_key(name_, key.str());
            if (rule.only.empty()) continue;
            const std::string words = fmt::format(" {} ", rule.only);
            if (words.find(fmt::format(" {} ", shape)) == std::string::npos)
                fail(key.source().begin.line, fmt::format("'{}' in {} is for {}, and this is a {}", key.str(),
                                                          shown_table(name_), rule.only, shape));
        }
    }

private:
    [[noreturn]] void fail_question(unsigned line, const std::string& what) const {
        throw Failure{
            {ErrorCode::bad_file, fmt::format("{}:{}: {}{}", path_, line, what, what.back() == '?' ? "" : ".")}};
    }
    [[noreturn]] void wrong(const toml::node& node, std::string_view key, const std::string& wanted) const {
        fail(line_of(node),
             fmt::format("'{}' in {} must be {}, and is {}", key, shown_table(name_), wanted, shown(node)));
    }
    static std::string wanted_number(const char* kind, const KeyRule& rule) {
        const std::string range = range_text(rule);
        return range.empty() ? kind : fmt::format("{}, {}", kind, range);
    }
    double finite_of(const toml::node& node, std::string_view key, const std::string& wanted) const {
        const bool is_number = node.is_integer() || node.is_floating_point();
        const double value = is_number ? *node.value<double>() : std::nan("");
        if (!std::isfinite(value)) wrong(node, key, wanted);
        return value;
    }
    double number_of(const toml::node& node, std::string_view key, const KeyRule& rule) const {
        const std::string wanted = wanted_number("a number", rule);
        const double value = finite_of(node, key, wanted);
        if (value < rule.least || value > rule.most || (rule.above && value == rule.least)) wrong(node, key, wanted);
        return value;
    }
    std::int64_t whole_of(const toml::node& node, std::string_view key, const KeyRule& rule) const {
        const auto value = node.value_exact<std::int64_t>();
        if (!value || double(*value) < rule.least || double(*value) > rule.most)
            wrong(node, key, wanted_number("a whole number", rule));
        return *value;
    }
    Vec3d vector_of(const toml::node& node, std::string_view key) const {
        const toml::array* list = node.as_array();
        if (!list || list->size() != 3) wrong(node, key, "three numbers");
        Vec3d value;
        for (int i = 0; i < 3; ++i) value[i] = finite_of(*list->get(std::size_t(i)), key, "three numbers");
        return value;
    }
    std::vector<Index> ids(std::string_view key) const {
        const toml::node& node = *table_.get(key);
        const toml::array* list = node.as_array();
        if (!list || list->empty()) wrong(node, key, "a list of vertex ids");
        std::vector<Index> ids;
        for (const toml::node& entry : *list) {
            const auto id = entry.value_exact<std::int64_t>();
            if (!id || *id < 0 || *id >= std::int64_t{kNoIndex}) wrong(entry, key, "a list of vertex ids");
            ids.push_back(static_cast<Index>(*id));
        }
        return ids;
    }
    /// A table with exactly these two keys.
    const toml::table& sub_table(std::string_view key, std::array<std::string_view, 2> keys) const {
        const toml::node& node = *table_.get(key);
        const toml::table* table = node.as_table();
        if (!table || table->size() != 2 || !table->contains(keys[0]) || !table->contains(keys[1]))
            wrong(node, key, fmt::format("a table with {} and {}", keys[0], keys[1]));
        return *table;
    }
    void read_key(const toml::node& entry, std::string_view key, double unit, Keyed<Vec3d>& value) const {
        const toml::table* table = entry.as_table();
        if (!table || table->size() != 2 || !table->contains("time") || !table->contains("value"))
            wrong(entry, key, "three numbers, or a list of { time = t, value = [x, y, z] }");
        const double time = finite_of(*table->get("time"), fmt::format("{}.time", key), "a number");
        if (!value.times.empty() && time <= value.times.back())
            fail(line_of(entry), fmt::format("the times of '{}' in {} must ascend", key, shown_table(name_)));
        value.times.push_back(time);
        value.values.push_back(unit * vector_of(*table->get("value"), fmt::format("{}.value", key)));
    }

    const std::string& path_;
    std::string_view name_;
    const toml::table& table_;
};

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
        const std::string bytes = require(read_file(path));
        try {
            root_ = toml::parse(bytes, path);
        } catch (const toml::parse_error& error) {
            std::string what(error.description());
            while (!what.empty() && what.back() == '.') what.pop_back();
            fail_at(path, std::max(1u, error.source().begin.line), what);
        }
    }

    SceneFile read() {
        check_tables();
        if (const toml::table* table = single("simulation")) read_simulation({scene_.path, "simulation", *table});
        if (const toml::table* table = single("world")) read_world({scene_.path, "world", *table});
        if (const toml::table* table = single("picture")) read_picture({scene_.path, "picture", *table});
        each("body", [&](const Section& section) { read_body(section); });
        if (scene_.bodies.empty())
            throw Failure{{ErrorCode::bad_file, scene_.path + ": there is no [[body]], and a scene needs one "
                                                              "(docs/scenes.md)."}};
        each("obstacle", [&](const Section& section) { read_obstacle(section); });
        each("pin", [&](const Section& section) {
            scene_.pins.push_back({section.line(), body_of(section), section.region(), section.motion()});
        });
        each("force", [&](const Section& section) {
            scene_.forces.push_back({section.line(), body_of(section), section.region(), section.keyed("newtons")});
        });
        each("hand", [&](const Section& section) { read_hand(section); });
        scene_.content = spelled();
        return std::move(scene_);
    }

private:
    void check_tables() const {
        std::vector<std::string_view> tables;
        for (const KeyRule& rule : scene_keys())
            if (tables.empty() || tables.back() != rule.table) tables.push_back(rule.table);
        for (const auto& [key, value] : root_) {
            if (std::find(tables.begin(), tables.end(), key.str()) == tables.end()) {
                const std::string alike = most_alike(key.str(), tables);
                std::string what = fmt::format("unknown table '{}'", key.str());
                if (!alike.empty()) what += fmt::format("; did you mean {}?", shown_table(alike));
                throw Failure{{ErrorCode::bad_file, fmt::format("{}:{}: {}{}", scene_.path, key.source().begin.line,
                                                                what, alike.empty() ? " (docs/scenes.md)." : "")}};
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
        for (const toml::node& entry : *node->as_array()) read(Section(scene_.path, name, *entry.as_table()));
    }

    void read_simulation(const Section& in) {
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
        in.set_whole("descent_substeps", step.descent_substeps);
        in.set_whole("descent_iterations", step.descent_iterations);
        step.contacts_between_bodies = in.flag("contacts_between_bodies", true);
    }

    void read_world(const Section& in) {
        in.set("gravity", scene_.gravity);
        scene_.wind = in.keyed("wind");
        constexpr double kAir = 1.2; // kg/m^3, at 20 degrees Celsius
        scene_.air_density = in.number("air_density", in.has("wind") ? kAir : 0);
        in.set("body_friction", scene_.body_friction);
        in.set("body_restitution", scene_.body_restitution);
    }

    void read_body(const Section& in) {
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
        in.set("size", body.shape_options.size);
        in.set("length", body.shape_options.length);
        in.set("thickness", body.shape_options.thickness);
        in.set_whole("driver", body.driver);
        in.set("scale", body.body.scale);
        if (in.has("particles") && in.has("spacing")) in.fail("spacing", "give one of particles and spacing");
        in.set_whole("particles", body.body.cells.count);
        in.set("spacing", body.body.cells.spacing);
        read_material(in, body.material);
        in.set("centre", body.centre);
        body.rotation = in.rotation("rotate");
        in.set("velocity", body.velocity);
        in.set("spin", body.spin);
        body.spin *= kDegree;
        in.set("color", body.color);
        body.name = name_of(in, body);
        scene_.bodies.push_back(std::move(body));
    }

    std::string name_of(const Section& in, const SceneBody& body) const {
        const auto is_taken = [&](const std::string& name) {
            return std::any_of(scene_.bodies.begin(), scene_.bodies.end(),
                               [&](const SceneBody& other) { return other.name == name; });
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

    /// Refuses keys that do nothing for the body's model.
    static void refuse_other_models(const Section& in, MaterialModel model) {
        constexpr std::array kNames = {"fem", "springs", "meshfree"};
        const auto refuse = [&](std::string_view key, const char* models) {
            if (in.has(key))
                in.fail(key, fmt::format("'{}' in [[body]] is for model = {}, and this body's is \"{}\"", key, models,
                                         kNames[std::size_t(model)]));
        };
        if (model != MaterialModel::meshfree)
            for (const char* key : {"yield_stress", "creep_time", "temperature", "melting_from", "melting_to",
                                    "viscosity", "heating", "conductivity"})
                refuse(key, "\"meshfree\"");
        if (model != MaterialModel::springs) refuse("bending", "\"springs\"");
        if (model == MaterialModel::springs) refuse("poisson_ratio", "\"fem\" or \"meshfree\"");
    }

    static void read_material(const Section& in, Material& material) {
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
        if (material.model != MaterialModel::meshfree) // a flowing material as another model does not flow
            material.yield_stress = material.melting_from = material.melting_to = Material::kNever;
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
        if (std::string wrong = check_material(material); !wrong.empty()) {
            while (wrong.back() == '.') wrong.pop_back();
            in.fail(in.line(), wrong);
        }
    }

    void read_obstacle(const Section& in) {
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
        in.set("color", obstacle.color);
        obstacle.visible = in.flag("visible", true);
        scene_.obstacles.push_back(std::move(obstacle));
    }

    /// The body that a pin, force or hand names.
    std::size_t body_of(const Section& in) const {
        if (!in.has("body")) {
            if (scene_.bodies.size() > 1)
                in.fail(in.line(), "there are several bodies; say which with body = \"name\"");
            return 0;
        }
        std::vector<std::string_view> names;
        for (const SceneBody& body : scene_.bodies) names.push_back(body.name);
        const std::string name = in.text("body");
        const auto found = std::find(names.begin(), names.end(), name);
        if (found == names.end())
            in.fail("body", fmt::format("there is no body '{}'; there are {}", name, fmt::join(names, ", ")));
        return std::size_t(found - names.begin());
    }

    void read_hand(const Section& in) {
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

    void read_picture(const Section& in) {
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

SceneFile read_scene(const std::string& path) { return SceneReader(path).read(); }

void fail_in_scene(const SceneFile& scene, unsigned line, ErrorCode code, const std::string& what) {
    std::string sentence = what;
    while (!sentence.empty() && sentence.back() == '.') sentence.pop_back();
    fail_at(scene.path, line, sentence, code);
}

} // namespace filigree::cli
