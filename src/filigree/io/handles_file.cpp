#include "filigree/io/handles_file.h"

#include "filigree/io/file.h"

#include <algorithm>
#include <array>
#include <numbers>

#include <nlohmann/json.hpp>

namespace filigree {

namespace {

using HandlesJson = nlohmann::ordered_json;

/// Thrown from the depths of the JSON, as its own errors are; read_handles makes them errors.
struct BadHandle {
    std::string what;
};

Vec3d read_vec(const HandlesJson& json, const std::string& key) {
    const HandlesJson& value = json.at(key);
    if (!value.is_array() || value.size() != 3) throw BadHandle{"\"" + key + "\" must be three numbers"};
    return {value[0].get<double>(), value[1].get<double>(), value[2].get<double>()};
}

std::vector<Index> read_vertices(const HandlesJson& json) {
    if (!json.is_array()) throw BadHandle{"\"vertices\" must be a list of vertex ids"};
    std::vector<Index> vertices;
    for (const HandlesJson& id : json) {
        if (!id.is_number_unsigned() || id.get<std::uint64_t>() >= kNoIndex)
            throw BadHandle{"\"vertices\" must be whole numbers from 0 up, and " + id.dump() + " is no vertex id"};
        vertices.push_back(id.get<Index>());
    }
    return vertices;
}

void check_words(const HandlesJson& json) {
    static constexpr std::array<std::string_view, 9> kWords = {"name", "vertices", "box",    "sphere", "move",
                                                               "axis", "degrees",  "centre", "comment"};
    for (const auto& [key, value] : json.items())
        if (std::find(kWords.begin(), kWords.end(), key) == kWords.end())
            throw BadHandle{"\"" + key + "\" is not a word of a handle (docs/handles.md lists them)"};
}

Eigen::AngleAxisd read_rotation(const HandlesJson& json) {
    if (json.contains("axis") != json.contains("degrees")) throw BadHandle{"\"axis\" and \"degrees\" go together"};
    if (!json.contains("axis")) return Eigen::AngleAxisd::Identity();
    const Vec3d axis = read_vec(json, "axis");
    if (!(axis.norm() > 0)) throw BadHandle{"\"axis\" must not be zero"};
    return Eigen::AngleAxisd(json.at("degrees").get<double>() * std::numbers::pi / 180, axis.normalized());
}

HandleRegion read_region(const HandlesJson& json) {
    check_words(json);
    HandleRegion handle;
    handle.name = json.value("name", "");
    if (json.contains("vertices")) handle.vertices = read_vertices(json.at("vertices"));
    if (json.contains("box")) handle.box = Box{read_vec(json.at("box"), "min"), read_vec(json.at("box"), "max")};
    if (json.contains("sphere"))
        handle.sphere = {read_vec(json.at("sphere"), "centre"), json.at("sphere").at("radius").get<double>()};
    if (json.contains("vertices") + json.contains("box") + json.contains("sphere") != 1)
        throw BadHandle{"a handle needs exactly one of \"vertices\", \"box\" and \"sphere\""};
    if (json.contains("move")) handle.move = read_vec(json, "move");
    handle.rotation = read_rotation(json);
    if (json.contains("centre")) handle.centre = read_vec(json, "centre");
    return handle;
}

} // namespace

Result<std::vector<HandleRegion>> read_handles(const std::filesystem::path& path) {
    const Result<std::string> bytes = read_file(path);
    if (!bytes) return bytes.error();
    std::vector<HandleRegion> handles;
    try {
        const HandlesJson json = HandlesJson::parse(*bytes);
        for (const HandlesJson& handle : json.at("handles")) handles.push_back(read_region(handle));
    } catch (const BadHandle& bad) {
        return Error{ErrorCode::usage,
                     path.string() + ": handle " + std::to_string(handles.size() + 1) + ": " + bad.what + "."};
    } catch (const HandlesJson::exception& error) {
        const std::string what = error.what(); // "[json.exception.type_error.302] type must be number, ..."
        const std::size_t bracket = what.find("] ");
        return Error{ErrorCode::bad_file, path.string() + ": " +
                                              what.substr(bracket == std::string::npos ? 0 : bracket + 2) +
                                              " (see docs/handles.md)."};
    }
    if (handles.empty()) return Error{ErrorCode::usage, path.string() + ": there are no handles."};
    return handles;
}

} // namespace filigree
