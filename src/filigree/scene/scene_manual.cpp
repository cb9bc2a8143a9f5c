// The tables of docs/scenes.md, written from the rows of scene_keys.cpp.
#include "filigree/physics/material.h"
#include "filigree/scene/scene_keys.h"

#include <array>
#include <cmath>

#include <fmt/format.h>

namespace filigree {

namespace {

// What the manual calls a value, by its type.
template <class T>
std::string type_text(const T*) {
    return std::is_integral_v<T> ? "whole number" : "number";
}
std::string type_text(const bool*) { return "true or false"; }
std::string type_text(const std::string*) { return "text"; }
std::string type_text(const Vec3d*) { return "three numbers"; }
std::string type_text(const Vec3f*) { return "colour"; }
std::string type_text(const Keyed<double>*) { return "number, or keys"; }
std::string type_text(const Keyed<Vec3d>*) { return "three numbers, or keys"; }
std::string type_text(const std::vector<Vec3d>*) { return "three numbers, or a list of such"; }
std::string type_text(const std::vector<Index>*) { return "list of numbers from 0"; }
std::string type_text(const Eigen::AngleAxisd*) { return "axis and degrees"; }
std::string type_text(const std::array<unsigned, 2>*) { return "two whole numbers"; }
std::string type_text(const std::array<double, 2>*) { return "two numbers"; }
std::string type_text(const SceneBackground*) { return "text"; }
std::string type_text(const Box*) { return "box"; }
std::string type_text(const Ball*) { return "ball"; }
std::string type_text(const SceneRepeat*) { return "table"; }
template <class T>
std::string type_text(const std::optional<T>*) {
    return type_text(static_cast<const T*>(nullptr));
}

// The value as a file would say it; "" for one that no default says anything about.
template <class T>
std::string spelled(const SceneKey& key, const T& value) {
    if constexpr (std::is_enum_v<T>) {
        std::vector<std::string> words;
        each_word(key.values.words, [&](std::string_view word) { words.emplace_back(word); });
        return words[std::size_t(value)];
    } else if constexpr (std::is_arithmetic_v<T>) {
        return fmt::format("{}", value);
    } else {
        return "";
    }
}
std::string spelled(const SceneKey&, const std::string& value) { return value; }
std::string spelled(const SceneKey&, const Vec3d& value) { return fmt::format("[{}]", fmt::join(value, ", ")); }
std::string spelled(const SceneKey&, const std::array<unsigned, 2>& value) {
    return fmt::format("[{}]", fmt::join(value, ", "));
}
std::string spelled(const SceneKey&, const std::array<double, 2>& value) {
    return fmt::format("[{}]", fmt::join(value, ", "));
}
template <class T>
std::string spelled(const SceneKey& key, const Keyed<T>& value) {
    return spelled(key, value.constant);
}

std::string table_head(std::string_view table) {
    return fmt::format("\n### `{}`\n\n| key | type | unit | default | range | meaning |\n|---|---|---|---|---|---|\n",
                       shown_table(table));
}

std::string manual_row(const SceneKey& key) {
    std::string uses, range = range_text(key.values);
    const auto add_use = [&](std::string_view word) { uses += fmt::format("{}{}", uses.empty() ? "" : ", ", word); };
    if (key.table == "obstacle") each_word(key.use.shapes, add_use);
    each_word(key.use.models, add_use);
    each_word(key.values.words,
              [&](std::string_view word) { range += fmt::format("{}`{}`", range.empty() ? "" : ", ", word); });
    const std::string type = key.values.words.empty()
                                 ? std::visit([](const auto* value) { return type_text(value); }, key.fresh_place())
                                 : "word";
    return fmt::format("| `{}` | {} | {} | {} | {} | {}{}{} |\n", key.name, type, key.unit, unset_text(key), range,
                       uses, uses.empty() || key.text.empty() ? "" : ": ", key.text);
}

std::string or_never(double value) { return std::isinf(value) ? "" : fmt::format("{}", value); }

std::string materials_text() {
    std::string text =
        "\n### Materials\n\n| name | model | density | young_modulus | poisson_ratio | damping | internal_damping | "
        "yield_stress | creep_time | melting_from, melting_to | viscosity | strength, energy | behaviour |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    const SceneKey& model = *find_key("body", "model");
    for (const NamedMaterial& named : named_materials()) {
        const Material& m = named.material;
        text +=
            fmt::format("| `{}` | {} | {} | {:.0e} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", named.name,
                        spelled(model, m.model), m.density, m.young_modulus, m.poisson_ratio, m.damping,
                        m.internal_damping, or_never(m.yield_stress), m.is_plastic() ? or_never(m.creep_time) : "",
                        m.melts() ? fmt::format("{}, {}", m.melting_from, m.melting_to) : "",
                        m.melts() ? fmt::format("{}", m.viscosity) : "",
                        named.strength > 0 ? fmt::format("{:.0e}, {}", named.strength, named.energy) : "", named.text);
    }
    return text;
}

} // namespace

std::string range_text(const KeyValues& values) {
    const bool has_least = !std::isinf(values.least), has_most = !std::isinf(values.most);
    if (!has_least) return "";
    if (values.above)
        return has_most ? fmt::format("above {:g}, to {:g}", values.least, values.most)
                        : fmt::format("above {:g}", values.least);
    return has_most ? fmt::format("{:g} to {:g}", values.least, values.most) : fmt::format("{:g} and up", values.least);
}

std::string unset_text(const SceneKey& key) {
    if (!key.unset.empty()) return std::string(key.unset);
    return std::visit([&](const auto* value) { return spelled(key, *value); }, key.fresh_place());
}

std::string scene_manual() {
    std::string manual;
    std::string_view table;
    for (const SceneKey& key : scene_keys()) {
        if (key.table != table) manual += table_head(key.table);
        table = key.table;
        manual += manual_row(key);
    }
    return (manual + materials_text()).substr(1);
}

} // namespace filigree
