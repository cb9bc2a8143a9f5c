#include "filigree/mesh/mesh_map.h"

#include <algorithm>

namespace filigree {

namespace {

constexpr std::string_view kChannels = "rgba", kColor = "color.";
constexpr std::array<std::string_view, 5> kNamed = {"scalar", "group", "object", "material", "joint"};

struct MapName {
    std::string_view kind, name;
};
/// "group left ear" as its kind and name.
MapName split_name(std::string_view from) {
    const std::size_t space = std::min(from.find(' '), from.size());
    return {from.substr(0, space), space < from.size() ? from.substr(space + 1) : ""};
}

Error lacks(std::string_view from, const std::string& instead) {
    return {ErrorCode::unsuitable, "The mesh has nothing for '" + std::string(from) + "'; it has " + instead + "."};
}
std::string listed(const std::vector<std::string>& names, std::string_view what) {
    std::string list = (names.empty() ? "no " : "the ") + std::string(what) + "s";
    for (std::size_t n = 0; n < names.size(); ++n) list += (n == 0 ? " " : ", ") + names[n];
    return list;
}

Result<std::vector<float>> scalar_map(const Mesh& mesh, std::string_view from, std::string_view name) {
    std::vector<std::string> names;
    for (const VertexScalar& scalar : mesh.scalars) {
        if (scalar.name == name) return scalar.values;
        names.push_back(scalar.name);
    }
    return lacks(from, listed(names, "scalar"));
}

/// Of each vertex, the part of the faces around it that have a label like this.
Result<std::vector<float>> label_map(const Mesh& mesh, const FaceLabels& labels, std::string_view from,
                                     const MapName& name) {
    std::vector<std::uint8_t> fits;
    for (const std::string& known : labels.names) fits.push_back(fits_pattern(known, name.name));
    if (labels.empty() || std::ranges::count(fits, 1) == 0)
        return lacks(from, listed(labels.empty() ? std::vector<std::string>() : labels.names, name.kind));
    std::vector<float> labelled(mesh.vertex_count()), faces(mesh.vertex_count());
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        for (const Index v : mesh.face(f)) {
            ++faces[v];
            if (labels.of_face[f] != kNoIndex && fits[labels.of_face[f]]) ++labelled[v];
        }
    for (std::size_t v = 0; v < faces.size(); ++v) labelled[v] /= std::max(faces[v], 1.0f);
    return labelled;
}

} // namespace

bool fits_pattern(std::string_view name, std::string_view pattern) {
    const std::size_t star = pattern.find('*');
    if (star == std::string_view::npos) return name == pattern;
    if (!name.starts_with(pattern.substr(0, star))) return false;
    for (std::size_t from = star; from <= name.size(); ++from)
        if (fits_pattern(name.substr(from), pattern.substr(star + 1))) return true;
    return false;
}

std::string check_mesh_map(std::string_view from) {
    const bool is_color = from.starts_with(kColor) && from.size() == kColor.size() + 1 &&
                          kChannels.find(from.back()) != std::string_view::npos;
    const MapName name = split_name(from);
    const bool is_named = std::ranges::find(kNamed, name.kind) != kNamed.end() && !name.name.empty();
    if (is_color || is_named) return "";
    return "'" + std::string(from) +
           "' names no numbers of a mesh; write color.r (or g, b, a), scalar NAME, group NAME, object NAME, material "
           "NAME or joint NAME";
}

Result<std::vector<float>> mesh_map(const Mesh& mesh, std::string_view from) {
    if (const std::string wrong = check_mesh_map(from); !wrong.empty()) return Error{ErrorCode::usage, wrong + "."};
    if (from.starts_with(kColor)) {
        if (mesh.colors.empty()) return lacks(from, "no colours of vertices");
        std::vector<float> channel;
        for (const Vec4f& color : mesh.colors) channel.push_back(color[Eigen::Index(kChannels.find(from.back()))]);
        return channel;
    }
    const MapName name = split_name(from);
    if (name.kind == "joint")
        return lacks(from, "no joints: those of a skin count where a body follows it, as [[follow]] and flesh make it");
    if (name.kind == "scalar") return scalar_map(mesh, from, name.name);
    return label_map(mesh,
                     name.kind == "group"    ? mesh.groups
                     : name.kind == "object" ? mesh.objects
                                             : mesh.materials,
                     from, name);
}

std::vector<float> in_range(std::vector<float> numbers, const std::array<double, 2>& values,
                            const std::array<double, 2>& range) {
    for (float& number : numbers) {
        const double part = std::clamp((double(number) - values[0]) / (values[1] - values[0]), 0.0, 1.0);
        number = float(range[0] + part * (range[1] - range[0]));
    }
    return numbers;
}

} // namespace filigree
