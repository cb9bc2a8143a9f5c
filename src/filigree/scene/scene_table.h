// One table of a scene file, its values read by the rules of scene_keys.h. Private to the layer: it knows TOML.
// Everything here throws BadResultAccess with file and line where a value is not as its rule says.
#pragma once

#include "filigree/scene/scene_file.h"
#include "filigree/scene/scene_keys.h"

#include <array>
#include <numbers>

#include <toml++/toml.h>

namespace filigree {

inline constexpr double kDegree = std::numbers::pi / 180; // radians

/// "path:line: what", with one full stop or question mark at its end.
Error error_at(const std::string& path, unsigned line, ErrorCode code, const std::string& what);
[[noreturn]] void fail_at(const std::string& path, unsigned line, const std::string& what,
                          ErrorCode code = ErrorCode::bad_file);

class SceneTable {
public:
    /// Refuses keys that no rule of `name` allows.
    SceneTable(const std::string& path, std::string_view name, const toml::table& table);

    unsigned line() const;
    unsigned line(std::string_view key) const; ///< of the key; of the table where it is not there
    bool has(std::string_view key) const { return table_.contains(key); }
    [[noreturn]] void fail(unsigned line, const std::string& what) const { fail_at(path_, line, what); }
    [[noreturn]] void fail(std::string_view key, const std::string& what) const { fail(line(key), what); }

    double number(std::string_view key, double unset) const;
    bool flag(std::string_view key, bool unset) const;
    std::string text(std::string_view key) const; ///< "" where it is not there
    /// The place of a word among those of its rule; `unset` where it is not there.
    int word(std::string_view key, int unset) const;

    /// What is in the file, into `value`; untouched where the key is not there.
    void set(std::string_view key, double& value) const { value = number(key, value); }
    void set(std::string_view key, Vec3d& value) const;
    void set(std::string_view key, std::optional<Vec3d>& value) const;
    void set(std::string_view key, std::optional<Vec3f>& value) const; ///< a colour
    template <class Number>
    void set_whole(std::string_view key, Number& value) const {
        if (const toml::node* node = table_.get(key))
            value = static_cast<Number>(whole_of(*node, key, *find_key(name_, key)));
    }

    std::vector<Vec3d> points(std::string_view key) const; ///< one or a list; empty where it is not there
    Vec3f color(std::string_view key, const std::string& written) const;
    /// Numbers that change in time, times `unit`.
    Keyed<Vec3d> keyed(std::string_view key, double unit = 1) const;
    Keyed<double> keyed_number(std::string_view key, double unset) const;
    SceneMotion motion() const;
    std::vector<Index> ids(std::string_view key) const;
    SceneRegion region() const;
    Eigen::AngleAxisd rotation(std::string_view key) const;
    SceneRepeat repeat(std::string_view key) const;
    std::pair<unsigned, unsigned> pixels(std::string_view key) const;
    /// A file's name, seen from the scene's folder; it has to be there.
    std::string file(std::string_view key) const;
    /// Refuses keys that belong to another shape, or to none.
    void refuse_others(std::string_view shape) const;

private:
    [[noreturn]] void wrong(const toml::node& node, std::string_view key, const std::string& wanted) const;
    double finite_of(const toml::node& node, std::string_view key, const std::string& wanted) const;
    double number_of(const toml::node& node, std::string_view key, const KeyRule& rule) const;
    std::int64_t whole_of(const toml::node& node, std::string_view key, const KeyRule& rule) const;
    Vec3d vector_of(const toml::node& node, std::string_view key) const;
    const toml::table& sub_table(std::string_view key, std::array<std::string_view, 2> keys) const;
    /// The time of one of a list of keys, which ascend; `before`: those read by now.
    /// may_jump: two moments may have one time.
    double time_of(const toml::node& entry, std::string_view key, std::span<const double> before, bool may_jump,
                   const char* wanted) const;

    const std::string& path_;
    std::string_view name_;
    const toml::table& table_;
};

} // namespace filigree
