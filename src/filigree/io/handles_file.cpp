#include "filigree/io/handles_file.h"

#include "filigree/types.h"

#include "filigree/io/file.h"
#include "filigree/io/text_scanner.h"

#include <algorithm>
#include <initializer_list>
#include <numbers>
#include <set>

#include <nlohmann/json.hpp>

namespace filigree {

namespace {

using HandlesJson = nlohmann::ordered_json;
using Words = std::initializer_list<std::string_view>;

/// Thrown from the depths of the JSON; read_handles makes it an error.
struct BadHandle {
    std::string what;
};

/// The value of a word. of: what has that word.
const HandlesJson& value_of(const HandlesJson& json, std::string_view word, const std::string& of) {
    const auto found = json.find(word);
    if (found == json.end()) throw BadHandle{of + " has no " + in_quotes(word)};
    return *found;
}

void check_words(const HandlesJson& json, const Words& words, const std::string& of) {
    if (!json.is_object()) throw BadHandle{of + " must be an object, {...}"};
    for (const auto& [key, value] : json.items())
        if (std::ranges::find(words, key) == words.end())
            throw BadHandle{in_quotes(key) + " is not a word of " + of + " (docs/handles.md lists them)"};
}

double read_number(const HandlesJson& json, std::string_view word, const std::string& of) {
    const HandlesJson& value = value_of(json, word, of);
    if (!value.is_number()) throw BadHandle{in_quotes(word) + " must be a number"};
    return value.get<double>();
}

Vec3d read_vec(const HandlesJson& json, std::string_view word, const std::string& of) {
    const HandlesJson& value = value_of(json, word, of);
    if (!value.is_array() || value.size() != 3 ||
        !std::ranges::all_of(value, [](const HandlesJson& v) { return v.is_number(); }))
        throw BadHandle{in_quotes(word) + " must be three numbers, [x, y, z]"};
    return {value[0].get<double>(), value[1].get<double>(), value[2].get<double>()};
}

std::vector<Index> read_vertices(const HandlesJson& json) {
    if (!json.is_array()) throw BadHandle{"'vertices' must be a list of vertex ids"};
    std::vector<Index> vertices;
    for (const HandlesJson& id : json) {
        if (!id.is_number_unsigned() || id.get<std::uint64_t>() >= kNoIndex)
            throw BadHandle{"'vertices' must be whole numbers from 0 up, and " + id.dump() + " is no vertex id"};
        vertices.push_back(id.get<Index>());
    }
    return vertices;
}

Box read_box(const HandlesJson& json) {
    check_words(json, {"min", "max"}, "a box");
    return {read_vec(json, "min", "the box"), read_vec(json, "max", "the box")};
}

std::pair<Vec3d, double> read_sphere(const HandlesJson& json) {
    check_words(json, {"centre", "radius"}, "a sphere");
    const double radius = read_number(json, "radius", "the sphere");
    if (!(radius >= 0)) throw BadHandle{"'radius' must not be below 0"};
    return {read_vec(json, "centre", "the sphere"), radius};
}

Eigen::AngleAxisd read_rotation(const HandlesJson& json) {
    if (json.contains("axis") != json.contains("degrees")) throw BadHandle{"'axis' and 'degrees' go together"};
    if (!json.contains("axis")) return Eigen::AngleAxisd::Identity();
    const Vec3d axis = read_vec(json, "axis", "the handle");
    if (axis.isZero(0)) throw BadHandle{"'axis' must not be zero"};
    const double degrees = read_number(json, "degrees", "the handle");
    return Eigen::AngleAxisd(radians(degrees), axis.stableNormalized());
}

HandleRegion read_region(const HandlesJson& json) {
    check_words(json, {"name", "vertices", "box", "sphere", "move", "axis", "degrees", "centre", "comment"},
                "a handle");
    HandleRegion handle;
    if (json.contains("name")) {
        if (!json["name"].is_string()) throw BadHandle{"'name' must be text"};
        handle.name = json["name"];
    }
    if (json.contains("vertices")) handle.vertices = read_vertices(json["vertices"]);
    if (json.contains("box")) handle.box = read_box(json["box"]);
    if (json.contains("sphere")) handle.sphere = read_sphere(json["sphere"]);
    if (json.contains("vertices") + json.contains("box") + json.contains("sphere") != 1)
        throw BadHandle{"a handle needs exactly one of 'vertices', 'box' and 'sphere'"};
    if (json.contains("move")) handle.move = read_vec(json, "move", "the handle");
    handle.rotation = read_rotation(json);
    if (json.contains("centre")) handle.centre = read_vec(json, "centre", "the handle");
    return handle;
}

/// Words that stand twice in one object would hide each other.
HandlesJson parse(const std::string& bytes) {
    std::vector<std::set<std::string>> words; // of each object around
    return HandlesJson::parse(bytes, [&](int, HandlesJson::parse_event_t event, const HandlesJson& parsed) {
        using enum HandlesJson::parse_event_t;
        if (event == object_start) words.emplace_back();
        if (event == object_end) words.pop_back();
        if (event == key && !words.back().insert(parsed.get<std::string>()).second)
            throw BadHandle{in_quotes(parsed.get<std::string>()) + " stands there twice"};
        return true;
    });
}

} // namespace

Result<std::vector<HandleRegion>> read_handles(const std::filesystem::path& path) {
    const Result<std::string> bytes = read_file(path);
    if (!bytes) return bytes.error();
    const auto error = [&](ErrorCode code, const std::string& what) {
        return Error{code, path.string() + ": " + what};
    };
    HandlesJson json;
    try {
        json = parse(*bytes);
        check_words(json, {"handles", "comment"}, "the file");
        if (!value_of(json, "handles", "the file").is_array()) throw BadHandle{"'handles' must be a list, [...]"};
    } catch (const BadHandle& bad) {
        return error(ErrorCode::bad_file, bad.what + " (see docs/handles.md).");
    } catch (const HandlesJson::exception& bad) {
        const std::string what = bad.what(); // "[json.exception.parse_error.101] parse error at line 2, ..."
        return error(ErrorCode::bad_file, what.substr(what.find("] ") + 2) + " (see docs/handles.md).");
    }
    std::vector<HandleRegion> handles;
    try {
        for (const HandlesJson& handle : json["handles"]) handles.push_back(read_region(handle));
    } catch (const BadHandle& bad) {
        return error(ErrorCode::usage, "handle " + std::to_string(handles.size() + 1) + ": " + bad.what + ".");
    }
    if (handles.empty()) return error(ErrorCode::usage, "there are no handles.");
    return handles;
}

} // namespace filigree
