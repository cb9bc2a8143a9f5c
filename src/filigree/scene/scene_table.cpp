#include "filigree/scene/scene_table.h"

#include "filigree/core/color.h"
#include "filigree/file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include <fmt/format.h>

namespace filigree {

namespace {

namespace fs = std::filesystem;

constexpr double kDegree = std::numbers::pi / 180; // radians
constexpr std::size_t kMostShown = 4;              ///< values of a list

unsigned line_of(const toml::node& node) { return node.source().begin.line; }

/// "; did you mean 'this'?" or where to look.
std::string suggestion(std::string_view word, std::span<const std::string_view> words) {
    const std::string alike = most_alike(word, words);
    return alike.empty() ? " (docs/scenes.md lists what there is)" : fmt::format("; did you mean '{}'?", alike);
}

/// The table that has such a key, as it is written; "" when there is none.
std::string table_with(std::string_view key) {
    for (const SceneKey& known : scene_keys())
        if (known.name == key) return shown_table(known.table);
    return "";
}

/// Whether it is one of the lists of tables within a table, such as [[follow.joint]].
bool is_list_within(std::string_view table, std::string_view key, const toml::node& value) {
    const std::string name = fmt::format("{}.{}", table, key);
    return value.is_array_of_tables() &&
           std::ranges::any_of(scene_keys(), [&](const SceneKey& known) { return known.table == name; });
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

/// The value of a key, into a member by the type of the member.
class KeyReader {
public:
    KeyReader(const std::string& path, const SceneKey& key) : path_(path), key_(key) {}

    /// Numbers and words.
    template <class T>
    void set(const toml::node& node, T& value) const {
        if constexpr (std::is_enum_v<T>)
            value = static_cast<T>(word_of(node));
        else
            value = static_cast<T>(whole_of(node));
    }
    template <class T>
    void set(const toml::node& node, std::optional<T>& value) const {
        set(node, value.emplace());
    }
    void set(const toml::node& node, double& value) const { value = number_of(node); }
    void set(const toml::node& node, bool& value) const {
        const auto flag = node.value_exact<bool>();
        if (!flag) wrong(node, "true or false");
        value = *flag;
    }
    void set(const toml::node& node, std::string& value) const {
        if (!key_.values.words.empty()) word_of(node);
        value = key_.values.is_file ? file_of(node) : text_of(node);
    }
    void set(const toml::node& node, Vec3d& value) const { value = unit() * vector_of(node, key_.name); }
    void set(const toml::node& node, Vec3f& value) const { value = color_of(node, text_of(node)); }
    void set(const toml::node& node, Keyed<double>& value) const {
        const toml::array* list = node.as_array();
        if (!list || list->empty()) return set(node, value.constant);
        set_keys(*list, value, Times::ascend, "a number, or a list of { time = t, value = v }",
                 [&](const toml::node& entry) { return number_of(entry); });
    }
    void set(const toml::node& node, Keyed<Vec3d>& value) const {
        const toml::array* list = node.as_array();
        if (!list || list->empty() || !list->get(0)->is_table()) return set(node, value.constant);
        set_keys(*list, value, Times::may_jump, "three numbers, or a list of { time = t, value = [x, y, z] }",
                 [&](const toml::node& entry) { return Vec3d(unit() * vector_of(entry, part("value"))); });
    }
    void set(const toml::node& node, std::vector<Vec3d>& value) const {
        const toml::array* list = node.as_array();
        value.clear();
        if (!list || list->empty() || !list->get(0)->is_array())
            value.push_back(vector_of(node, key_.name));
        else
            for (const toml::node& entry : *list) value.push_back(vector_of(entry, key_.name));
    }
    void set(const toml::node& node, std::vector<Index>& value) const {
        constexpr const char* kWanted = "a list of whole numbers from 0";
        const toml::array* list = node.as_array();
        if (!list || list->empty()) wrong(node, kWanted);
        value.clear();
        for (const toml::node& entry : *list) {
            const auto id = entry.value_exact<std::int64_t>();
            if (!id || *id < 0 || *id >= std::int64_t{kNoIndex}) wrong(entry, kWanted);
            value.push_back(static_cast<Index>(*id));
        }
    }
    void set(const toml::node& node, Eigen::AngleAxisd& value) const {
        const toml::table& table = sub_table(node, {"axis", "degrees"});
        const Vec3d axis = vector_of(*table.get("axis"), part("axis"));
        if (!(axis.norm() > 0)) wrong(*table.get("axis"), "a direction with a length", part("axis"));
        const double degrees = finite_of(*table.get("degrees"), part("degrees"), "a number");
        value = Eigen::AngleAxisd(kDegree * degrees, axis.normalized());
    }
    void set(const toml::node& node, std::array<unsigned, 2>& value) const {
        const toml::array* list = node.as_array();
        if (!list || list->size() != 2) wrong(node, "two whole numbers");
        for (std::size_t k = 0; k < 2; ++k) set(*list->get(k), value[k]);
    }
    void set(const toml::node& node, std::array<double, 2>& value) const {
        const toml::array* list = node.as_array();
        if (!list || list->size() != 2) wrong(node, "two numbers");
        for (std::size_t k = 0; k < 2; ++k) set(*list->get(k), value[k]);
    }
    void set(const toml::node& node, SceneBackground& value) const {
        const std::string colors = text_of(node);
        const std::size_t comma = colors.find(',');
        value.top = value.bottom = color_of(node, colors.substr(0, comma));
        if (comma != std::string::npos) value.bottom = color_of(node, colors.substr(comma + 1));
    }
    void set(const toml::node& node, Box& value) const {
        const toml::table& table = sub_table(node, {"max", "min"});
        value = Box{vector_of(*table.get("min"), part("min")), vector_of(*table.get("max"), part("max"))};
        if (value.empty()) fail(node, "the box's min is not below its max");
    }
    void set(const toml::node& node, Ball& value) const {
        const toml::table& table = sub_table(node, {"centre", "radius"});
        const toml::node& radius = *table.get("radius");
        value = Ball{vector_of(*table.get("centre"), part("centre")),
                     finite_of(radius, part("radius"), "a number above 0")};
        if (!(value.radius > 0)) wrong(radius, "a number above 0", part("radius"));
    }
    void set(const toml::node& node, SceneRepeat& value) const;

private:
    enum class Times { ascend, may_jump };

    [[noreturn]] void fail(const toml::node& node, const std::string& what) const {
        fail_at(path_, line_of(node), what);
    }
    [[noreturn]] void wrong(const toml::node& node, const std::string& wanted, std::string_view name = "") const {
        fail(node, fmt::format("'{}' in {} must be {}, and is {}", name.empty() ? key_.name : name,
                               shown_table(key_.table), wanted, shown(node)));
    }
    std::string part(const char* name) const { return fmt::format("{}.{}", key_.name, name); }
    /// Vectors of degrees are axes times angles, which the structs hold in radians.
    double unit() const { return key_.unit.starts_with("degrees") ? kDegree : 1; }
    std::string wanted_number(const char* kind) const {
        const std::string range = range_text(key_.values);
        return range.empty() ? kind : fmt::format("{}, {}", kind, range);
    }

    double finite_of(const toml::node& node, std::string_view name, const std::string& wanted) const {
        const bool is_number = node.is_integer() || node.is_floating_point();
        const double value = is_number ? *node.value<double>() : std::nan("");
        if (!std::isfinite(value)) wrong(node, wanted, name);
        return value;
    }
    double number_of(const toml::node& node) const {
        const KeyValues& may = key_.values;
        const std::string wanted = wanted_number("a number");
        const double value = finite_of(node, key_.name, wanted);
        if (value < may.least || value > may.most || (may.above && value == may.least)) wrong(node, wanted);
        return value;
    }
    std::int64_t whole_of(const toml::node& node) const {
        const auto value = node.value_exact<std::int64_t>();
        if (!value || double(*value) < key_.values.least || double(*value) > key_.values.most)
            wrong(node, wanted_number("a whole number"));
        return *value;
    }
    std::string text_of(const toml::node& node) const {
        const auto value = node.value_exact<std::string>();
        if (!value || value->empty()) wrong(node, "a text");
        return *value;
    }
    /// The place of a word among those of the row.
    std::size_t word_of(const toml::node& node) const {
        std::vector<std::string_view> words;
        each_word(key_.values.words, [&](std::string_view word) { words.push_back(word); });
        const auto value = node.value_exact<std::string>();
        if (value && !former_word_sentence(key_, *value).empty()) return 0;
        const auto found = std::ranges::find(words, value.value_or(""));
        if (found == words.end()) wrong(node, fmt::format("one of {}", fmt::join(words, ", ")));
        return static_cast<std::size_t>(found - words.begin());
    }
    Vec3d vector_of(const toml::node& node, std::string_view name) const {
        const toml::array* list = node.as_array();
        if (!list || list->size() != 3) wrong(node, "three numbers", name);
        Vec3d value;
        for (int i = 0; i < 3; ++i) value[i] = finite_of(*list->get(std::size_t(i)), name, "three numbers");
        return value;
    }
    Vec3f color_of(const toml::node& node, const std::string& written) const {
        const std::optional<Vec3f> color = parse_color(written);
        if (!color)
            fail(node, fmt::format("{}: '{}' is no colour; write it as #rrggbb, such as #d04030", key_.name, written));
        return *color;
    }
    /// A file's name, seen from the scene's folder; it has to be there.
    std::string file_of(const toml::node& node) const {
        const fs::path named = path_of(text_of(node)),
                       path = named.is_absolute() ? named : path_of(path_).parent_path() / named;
        std::error_code ignored;
        if (!fs::exists(path, ignored))
            fail_at(path_, line_of(node),
                    fmt::format("there is no file '{}' (looked for {})", named.string(), path.string()),
                    ErrorCode::not_found);
        return path.string();
    }
    const toml::table& sub_table(const toml::node& node, std::array<std::string_view, 2> keys) const {
        const toml::table* table = node.as_table();
        if (!table || table->size() != 2 || !table->contains(keys[0]) || !table->contains(keys[1]))
            wrong(node, fmt::format("a table with {} and {}", keys[0], keys[1]));
        return *table;
    }
    template <class T, class Read>
    void set_keys(const toml::array& list, Keyed<T>& value, Times times, const char* wanted, const Read& read) const {
        value.times.clear();
        value.values.clear();
        for (const toml::node& entry : list) {
            const toml::table* table = entry.as_table();
            if (!table || table->size() != 2 || !table->contains("time") || !table->contains("value"))
                wrong(entry, wanted);
            const double time = finite_of(*table->get("time"), part("time"), "a number");
            if (!value.times.empty() &&
                (times == Times::may_jump ? time < value.times.back() : time <= value.times.back()))
                fail(entry, fmt::format("the times of '{}' in {} must ascend", key_.name, shown_table(key_.table)));
            value.times.push_back(time);
            value.values.push_back(read(*table->get("value")));
        }
    }

    const std::string& path_;
    const SceneKey& key_;
};

void KeyReader::set(const toml::node& node, SceneRepeat& repeat) const {
    constexpr std::array<std::string_view, 5> kParts = {"count", "step", "jitter", "turn", "seed"};
    constexpr double kMost = 10'000;
    const toml::table* table = node.as_table();
    if (!table || !table->contains("count"))
        wrong(node, "a table such as { count = [5, 8, 1], step = [0.3, 0.2, 0.3] }");
    for (const auto& [name, value] : *table)
        if (std::ranges::find(kParts, name.str()) == kParts.end())
            fail(node, fmt::format("unknown key '{}' in {}{}", name.str(), key_.name, suggestion(name.str(), kParts)));
    const auto whole = [&](const toml::node& value, const char* what, double least, double most) {
        const auto number = value.value_exact<std::int64_t>();
        if (!number || double(*number) < least || double(*number) > most)
            wrong(value, fmt::format("a whole number, {:g} to {:g}", least, most), part(what));
        return *number;
    };
    const auto amount = [&](const char* what) {
        const toml::node* value = table->get(what);
        const double number = value ? finite_of(*value, part(what), "a number, 0 and up") : 0;
        if (number < 0) wrong(*value, "a number, 0 and up", part(what));
        return number;
    };
    const toml::node& count = *table->get("count");
    const toml::array* counts = count.as_array();
    if (counts && counts->size() != 3) wrong(count, "one whole number or three", part("count"));
    repeat.is_row = !counts;
    for (std::size_t axis = 0; axis < (counts ? 3 : 1); ++axis)
        repeat.count[axis] = unsigned(whole(counts ? *counts->get(axis) : count, "count", 1, kMost));
    if (double(repeat.bodies()) > kMost)
        fail(node, fmt::format("these are {} bodies, and {:g} are the most", repeat.bodies(), kMost));
    if (const toml::node* step = table->get("step")) repeat.step = vector_of(*step, part("step"));
    repeat.jitter = amount("jitter");
    repeat.turn = kDegree * amount("turn");
    if (const toml::node* seed = table->get("seed")) repeat.seed = std::uint64_t(whole(*seed, "seed", 0, 1e9));
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
    for (const SceneKey& key : scene_keys())
        if (key.table == name) known.push_back(key.name);
    for (const auto& [key, value] : table)
        if (!find_key(name, key.str()) && !is_list_within(name, key.str(), value)) {
            const std::string other = table_with(key.str());
            const std::string hint =
                other.empty() ? suggestion(key.str(), known) : fmt::format("; it belongs to {}", other);
            fail_at(path_, key.source().begin.line,
                    fmt::format("unknown key '{}' in {}{}", key.str(), shown_table(name), hint));
        }
}

unsigned SceneTable::line() const { return line_of(table_); }
unsigned SceneTable::line(std::string_view key) const { return has(key) ? line_of(*table_.get(key)) : line(); }

void SceneTable::read(SceneOwner owner) const {
    for (const SceneKey& key : scene_keys())
        if (key.table == name_ && key.is_in(owner)) read(key.name, owner);
}

void SceneTable::read(std::string_view name, SceneOwner owner) const {
    const toml::node* node = table_.get(name);
    if (!node) return;
    const SceneKey& key = *find_key(name_, name);
    std::visit([&](auto* value) { KeyReader(path_, key).set(*node, *value); }, key.place(owner));
}

std::vector<std::string> SceneTable::former_words() const {
    std::vector<std::string> sentences;
    for (const auto& [name, value] : table_)
        if (const auto word = value.value_exact<std::string>())
            if (const std::string sentence = former_word_sentence(*find_key(name_, name.str()), *word);
                !sentence.empty())
                sentences.push_back(fmt::format("{}:{}: {}", path_, line(name.str()), sentence));
    return sentences;
}

void SceneTable::refuse_both(std::string_view one, std::string_view other) const {
    if (has(one) && has(other)) fail(other, fmt::format("give one of {} and {}", one, other));
}

void SceneTable::refuse_two_regions() const {
    if (has("box") + has("ball") + has("vertices") > 1)
        fail(shown_table(name_) + " takes one of box, ball and vertices");
}

void SceneTable::refuse_other_shapes(std::string_view shape) const {
    for (const auto& [name, value] : table_) {
        const std::string_view shapes = find_key(name_, name.str())->use.shapes;
        if (!shapes.empty() && !has_word(shapes, shape))
            fail(name.str(),
                 fmt::format("'{}' in {} is for {}, and this is a {}", name.str(), shown_table(name_), shapes, shape));
    }
}

void SceneTable::refuse_other_models(MaterialModel model) const {
    std::vector<std::string_view> all;
    each_word(find_key(name_, "model")->values.words, [&](std::string_view word) { all.push_back(word); });
    const std::string_view own = all[std::size_t(model)];
    for (const auto& [name, value] : table_) {
        const std::string_view models = find_key(name_, name.str())->use.models;
        if (models.empty() || has_word(models, own)) continue;
        std::string right; // "a", "b" or "c"
        each_word(models, [&](std::string_view word) {
            const bool is_last = word.end() == models.end();
            right += fmt::format("{}\"{}\"", right.empty() ? "" : is_last ? " or " : ", ", word);
        });
        fail(name.str(), fmt::format("'{}' in {} is for model = {}, and this body's is \"{}\"", name.str(),
                                     shown_table(name_), right, own));
    }
}

} // namespace filigree
