// One table of a scene file, read into a struct by the rows of scene_keys.h. Private to the layer: it knows TOML.
// Everything here throws BadResultAccess with file and line where a value is not as its row says.
#pragma once

#include "filigree/scene/scene_keys.h"

#include <toml++/toml.h>

namespace filigree {

/// "path:line: what", with one full stop or question mark at its end.
Error error_at(const std::string& path, unsigned line, ErrorCode code, const std::string& what);
[[noreturn]] void fail_at(const std::string& path, unsigned line, const std::string& what,
                          ErrorCode code = ErrorCode::bad_file);

class SceneTable {
public:
    /// Refuses keys that the table of this name does not have.
    SceneTable(const std::string& path, std::string_view name, const toml::table& table);

    unsigned line() const;
    unsigned line(std::string_view key) const; ///< of the key; of the table where it is not there
    bool has(std::string_view key) const { return table_.contains(key); }
    [[noreturn]] void fail(const std::string& what) const { fail_at(path_, line(), what); }
    [[noreturn]] void fail(std::string_view key, const std::string& what) const { fail_at(path_, line(key), what); }

    /// Sets the members of this struct whose keys are in the file; the others stay as they are.
    void read(SceneOwner owner) const;
    /// The same of one key.
    void read(std::string_view key, SceneOwner owner) const;

    /// Calls read(table) for each entry of a list of tables in this one, such as [[follow.joint]].
    template <class Read>
    void each(std::string_view key, const Read& read) const {
        const toml::array* entries = table_.get_as<toml::array>(key);
        const std::string name = std::string(name_) + "." + std::string(key);
        for (std::size_t k = 0; entries && k < entries->size(); ++k)
            if (const toml::table* entry = entries->get_as<toml::table>(k)) read(SceneTable(path_, name, *entry));
    }
    /// A sentence, with the line, for each word of an older version.
    std::vector<std::string> former_words() const;
    void refuse_both(std::string_view one, std::string_view other) const;
    void refuse_two_regions() const; ///< box, ball and vertices
    /// Refuses keys of other shapes; shape: "mesh" or "shape" for bodies.
    void refuse_other_shapes(std::string_view shape) const;
    void refuse_other_models(MaterialModel model) const;

private:
    const std::string& path_;
    std::string_view name_;
    const toml::table& table_;
};

} // namespace filigree
