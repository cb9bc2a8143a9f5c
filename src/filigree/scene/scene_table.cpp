#include "filigree/scene/scene_table.h"

#include "filigree/core/color.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include <fmt/format.h>

namespace filigree {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostShown = 4; ///< values of a list

unsigned line_of(const toml::node& node) { return node.source().begin.line; }

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
    if (const toml::array* list = node.as_array()) {
        if (list->empty()) return "an empty list";
        if (list->size() > kMostShown) return fmt::format("a list of {}", list->size());
        std::vector<std::string> values;
        for (const toml::node& value : *list) values.push_back(shown(value));
        return fmt::format("[{}]", fmt::join(values, ", "));
    }
    if (const toml::table* table = node.as_table()) {
        std::vector<std::string_view> keys;
        for (const auto& [key, value] : *table) keys.push_back(key.str());
        return keys.empty() ? "an empty table" : fmt::format("a table with {}", fmt::join(keys, ", "));
    }
    return "a date or time";
}

std::string wanted_number(const char* kind, const KeyRule& rule) {
    const std::string range = range_text(rule);
    return range.empty() ? kind : fmt::format("{}, {}", kind, range);
}

} // namespace

Error error_at(const std::string& path, unsigned line, ErrorCode code, const std::string& what) {
    std::string sentence = what;
    while (!sentence.empty() && sentence.back() == '.') sentence.pop_back();
    const std::string place =
        line == 0 ? path : fmt::format("{}:{}", path, line); // 0: a value that came from elsewhere
    return {code, fmt::format("{}: {}{}", place, sentence, sentence.ends_with('?') ? "" : ".")};
}

void fail_at(const std::string& path, unsigned line, const std::string& what, ErrorCode code) {
    throw BadResultAccess(error_at(path, line, code, what));
}

SceneTable::SceneTable(const std::string& path, std::string_view name, const toml::table& table)
    : path_(path), name_(name), table_(table) {
    std::vector<std::string_view> known;
    for (const KeyRule& rule : scene_keys())
        if (rule.table == name) known.push_back(rule.key);
    for (const auto& [key, value] : table)
        if (!find_key(name, key.str())) {
            const std::string other = table_with(key.str());
            const std::string hint =
                other.empty() ? suggestion(key.str(), known) : fmt::format("; it belongs to {}", other);
            fail(key.source().begin.line, fmt::format("unknown key '{}' in {}{}", key.str(), shown_table(name), hint));
        }
}

unsigned SceneTable::line() const { return line_of(table_); }
unsigned SceneTable::line(std::string_view key) const { return has(key) ? line_of(*table_.get(key)) : line(); }

double SceneTable::number(std::string_view key, double unset) const {
    const toml::node* node = table_.get(key);
    return node ? number_of(*node, key, *find_key(name_, key)) : unset;
}

bool SceneTable::flag(std::string_view key, bool unset) const {
    const toml::node* node = table_.get(key);
    if (!node) return unset;
    const auto value = node->value_exact<bool>();
    if (!value) wrong(*node, key, "true or false");
    return *value;
}

std::string SceneTable::text(std::string_view key) const {
    const toml::node* node = table_.get(key);
    if (!node) return "";
    const auto value = node->value_exact<std::string>();
    if (!value || value->empty()) wrong(*node, key, "a text");
    return *value;
}

int SceneTable::word(std::string_view key, int unset) const {
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

void SceneTable::set(std::string_view key, Vec3d& value) const {
    if (const toml::node* node = table_.get(key)) value = vector_of(*node, key);
}

void SceneTable::set(std::string_view key, std::optional<Vec3d>& value) const {
    if (const toml::node* node = table_.get(key)) value = vector_of(*node, key);
}

void SceneTable::set(std::string_view key, std::optional<Vec3f>& value) const {
    if (has(key)) value = color(key, text(key));
}

std::vector<Vec3d> SceneTable::points(std::string_view key) const {
    std::vector<Vec3d> points;
    const toml::node* node = table_.get(key);
    if (!node) return points;
    const toml::array* list = node->as_array();
    if (!list || list->empty() || !list->get(0)->is_array()) return {vector_of(*node, key)};
    for (const toml::node& entry : *list) points.push_back(vector_of(entry, key));
    return points;
}

Vec3f SceneTable::color(std::string_view key, const std::string& written) const {
    const std::optional<Vec3f> color = parse_color(written);
    if (!color) fail(key, fmt::format("{}: '{}' is no colour; write it as #rrggbb, such as #d04030", key, written));
    return *color;
}

Keyed<Vec3d> SceneTable::keyed(std::string_view key, double unit) const {
    Keyed<Vec3d> value{{}, {}, Vec3d::Zero()};
    const toml::node* node = table_.get(key);
    if (!node) return value;
    const toml::array* list = node->as_array();
    if (!list || list->empty() || !list->get(0)->is_table()) {
        value.constant = unit * vector_of(*node, key);
        return value;
    }
    for (const toml::node& entry : *list) {
        value.times.push_back(
            time_of(entry, key, value.times, true, "three numbers, or a list of { time = t, value = [x, y, z] }"));
        value.values.push_back(unit * vector_of(*entry.as_table()->get("value"), fmt::format("{}.value", key)));
    }
    return value;
}

Keyed<double> SceneTable::keyed_number(std::string_view key, double unset) const {
    Keyed<double> value{{}, {}, unset};
    const toml::node* node = table_.get(key);
    if (!node) return value;
    const KeyRule& rule = *find_key(name_, key);
    const toml::array* list = node->as_array();
    if (!list || list->empty()) {
        value.constant = number_of(*node, key, rule);
        return value;
    }
    for (const toml::node& entry : *list) {
        value.times.push_back(
            time_of(entry, key, value.times, false, "a number, or a list of { time = t, value = v }"));
        value.values.push_back(number_of(*entry.as_table()->get("value"), key, rule));
    }
    return value;
}

SceneMotion SceneTable::motion() const {
    SceneMotion motion{keyed("move"), keyed("turn", kDegree), {}};
    set("pivot", motion.pivot);
    return motion;
}

SceneRegion SceneTable::region() const {
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

Eigen::AngleAxisd SceneTable::rotation(std::string_view key) const {
    if (!has(key)) return Eigen::AngleAxisd::Identity();
    const toml::table& table = sub_table(key, {"axis", "degrees"});
    const Vec3d axis = vector_of(*table.get("axis"), "rotate.axis");
    if (!(axis.norm() > 0)) wrong(*table.get("axis"), "rotate.axis", "a direction with a length");
    return Eigen::AngleAxisd(kDegree * finite_of(*table.get("degrees"), "rotate.degrees", "a number"),
                             axis.normalized());
}

SceneRepeat SceneTable::repeat(std::string_view key) const {
    constexpr std::array<std::string_view, 5> kParts = {"count", "step", "jitter", "turn", "seed"};
    constexpr double kMost = 10'000;
    const toml::node& node = *table_.get(key);
    const toml::table* table = node.as_table();
    if (!table || !table->contains("count"))
        wrong(node, key, "a table such as { count = [5, 8, 1], step = [0.3, 0.2, 0.3] }");
    for (const auto& [part, value] : *table)
        if (std::ranges::find(kParts, part.str()) == kParts.end())
            fail(key, fmt::format("unknown key '{}' in {}{}", part.str(), key, suggestion(part.str(), kParts)));
    const auto whole = [&](const toml::node& value, const char* what, double least, double most) {
        const auto number = value.value_exact<std::int64_t>();
        if (!number || double(*number) < least || double(*number) > most)
            wrong(value, fmt::format("{}.{}", key, what), fmt::format("a whole number, {:g} to {:g}", least, most));
        return *number;
    };
    SceneRepeat repeat;
    const toml::node& count = *table->get("count");
    const toml::array* counts = count.as_array();
    if (counts && counts->size() != 3) wrong(count, "repeat.count", "one whole number or three");
    repeat.is_row = !counts;
    for (std::size_t axis = 0; axis < (counts ? 3 : 1); ++axis)
        repeat.count[axis] = unsigned(whole(counts ? *counts->get(axis) : count, "count", 1, kMost));
    if (double(repeat.bodies()) > kMost)
        fail(key, fmt::format("these are {} bodies, and {:g} are the most", repeat.bodies(), kMost));
    if (const toml::node* step = table->get("step")) repeat.step = vector_of(*step, "repeat.step");
    const auto amount = [&](const char* what) {
        const toml::node* value = table->get(what);
        const double number = value ? finite_of(*value, fmt::format("{}.{}", key, what), "a number, 0 and up") : 0;
        if (number < 0) wrong(*value, fmt::format("{}.{}", key, what), "a number, 0 and up");
        return number;
    };
    repeat.jitter = amount("jitter");
    repeat.turn = kDegree * amount("turn");
    if (const toml::node* seed = table->get("seed")) repeat.seed = std::uint64_t(whole(*seed, "seed", 0, 1e9));
    return repeat;
}

std::pair<unsigned, unsigned> SceneTable::pixels(std::string_view key) const {
    const toml::node& node = *table_.get(key);
    const toml::array* list = node.as_array();
    if (!list || list->size() != 2) wrong(node, key, "two whole numbers");
    const KeyRule& rule = *find_key(name_, key);
    return {static_cast<unsigned>(whole_of(*list->get(0), key, rule)),
            static_cast<unsigned>(whole_of(*list->get(1), key, rule))};
}

std::string SceneTable::file(std::string_view key) const {
    const fs::path named = text(key), path = named.is_absolute() ? named : fs::path(path_).parent_path() / named;
    std::error_code ignored;
    if (!fs::exists(path, ignored))
        fail_at(path_, line(key), fmt::format("there is no file '{}' (looked for {})", text(key), path.string()),
                ErrorCode::not_found);
    return path.string();
}

void SceneTable::refuse_others(std::string_view shape) const {
    for (const auto& [key, value] : table_) {
        const KeyRule& rule = *find_key(name_, key.str());
        if (rule.only.empty()) continue;
        const std::string words = fmt::format(" {} ", rule.only);
        if (words.find(fmt::format(" {} ", shape)) == std::string::npos)
            fail(key.source().begin.line, fmt::format("'{}' in {} is for {}, and this is a {}", key.str(),
                                                      shown_table(name_), rule.only, shape));
    }
}

void SceneTable::wrong(const toml::node& node, std::string_view key, const std::string& wanted) const {
    fail(line_of(node), fmt::format("'{}' in {} must be {}, and is {}", key, shown_table(name_), wanted, shown(node)));
}

double SceneTable::finite_of(const toml::node& node, std::string_view key, const std::string& wanted) const {
    const bool is_number = node.is_integer() || node.is_floating_point();
    const double value = is_number ? *node.value<double>() : std::nan("");
    if (!std::isfinite(value)) wrong(node, key, wanted);
    return value;
}

double SceneTable::number_of(const toml::node& node, std::string_view key, const KeyRule& rule) const {
    const std::string wanted = wanted_number("a number", rule);
    const double value = finite_of(node, key, wanted);
    if (value < rule.least || value > rule.most || (rule.above && value == rule.least)) wrong(node, key, wanted);
    return value;
}

std::int64_t SceneTable::whole_of(const toml::node& node, std::string_view key, const KeyRule& rule) const {
    const auto value = node.value_exact<std::int64_t>();
    if (!value || double(*value) < rule.least || double(*value) > rule.most)
        wrong(node, key, wanted_number("a whole number", rule));
    return *value;
}

Vec3d SceneTable::vector_of(const toml::node& node, std::string_view key) const {
    const toml::array* list = node.as_array();
    if (!list || list->size() != 3) wrong(node, key, "three numbers");
    Vec3d value;
    for (int i = 0; i < 3; ++i) value[i] = finite_of(*list->get(std::size_t(i)), key, "three numbers");
    return value;
}

std::vector<Index> SceneTable::ids(std::string_view key) const {
    const toml::node& node = *table_.get(key);
    const toml::array* list = node.as_array();
    if (!list || list->empty()) wrong(node, key, "a list of whole numbers from 0");
    std::vector<Index> ids;
    for (const toml::node& entry : *list) {
        const auto id = entry.value_exact<std::int64_t>();
        if (!id || *id < 0 || *id >= std::int64_t{kNoIndex}) wrong(entry, key, "a list of whole numbers from 0");
        ids.push_back(static_cast<Index>(*id));
    }
    return ids;
}

const toml::table& SceneTable::sub_table(std::string_view key, std::array<std::string_view, 2> keys) const {
    const toml::node& node = *table_.get(key);
    const toml::table* table = node.as_table();
    if (!table || table->size() != 2 || !table->contains(keys[0]) || !table->contains(keys[1]))
        wrong(node, key, fmt::format("a table with {} and {}", keys[0], keys[1]));
    return *table;
}

double SceneTable::time_of(const toml::node& entry, std::string_view key, std::span<const double> before, bool may_jump,
                           const char* wanted) const {
    const toml::table* table = entry.as_table();
    if (!table || table->size() != 2 || !table->contains("time") || !table->contains("value"))
        wrong(entry, key, wanted);
    const double time = finite_of(*table->get("time"), fmt::format("{}.time", key), "a number");
    if (!before.empty() && (may_jump ? time < before.back() : time <= before.back()))
        fail(line_of(entry), fmt::format("the times of '{}' in {} must ascend", key, shown_table(name_)));
    return time;
}

} // namespace filigree
