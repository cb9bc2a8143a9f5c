#include "filigree/io/gltf/glb_compression.h"

#include "filigree/io/gltf/gltf_component.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <meshoptimizer.h>
#include <vector>

namespace filigree {

namespace {

using Json = nlohmann::ordered_json;

constexpr int kByte = 5120, kUint16 = 5123, kFloat = 5126, kIndices = 34963;
constexpr std::size_t kLargestStride = 256;

std::size_t numbers_of(const std::string& type) {
    return type == "SCALAR" ? 1 : type == "VEC2" ? 2 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 16;
}
std::size_t bytes_of_component(int component) { return component < 5122 ? 1 : component < 5125 ? 2 : 4; }

std::size_t element_bytes(const Json& accessor) {
    return numbers_of(accessor["type"]) * bytes_of_component(accessor["componentType"]);
}

/// Four bytes a normal, the last one nothing.
std::string normals_in_bytes(std::string_view floats) {
    std::string bytes(floats.size() / 12 * 4, '\0');
    for (std::size_t i = 0; i < bytes.size() / 4; ++i) {
        std::array<float, 3> normal;
        std::memcpy(normal.data(), floats.data() + 12 * i, 12);
        for (std::size_t k = 0; k < 3; ++k)
            bytes[4 * i + k] = static_cast<char>(std::lround(127 * std::clamp(normal[k], -1.0f, 1.0f)));
    }
    return bytes;
}

struct PackedView {
    std::string bytes;
    const char* mode;
    std::size_t stride, count;
};

PackedView packed_vertices(std::string_view raw, std::size_t stride) {
    PackedView view{{}, "ATTRIBUTES", stride, raw.size() / stride};
    view.bytes.resize(meshopt_encodeVertexBufferBound(view.count, stride));
    view.bytes.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(view.bytes.data()), view.bytes.size(),
                                                 raw.data(), view.count, stride));
    return view;
}

std::string packed_triangles(std::span<const unsigned> indices, std::size_t vertices) {
    std::string bytes(meshopt_encodeIndexBufferBound(indices.size(), vertices), '\0');
    bytes.resize(meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(), indices.data(),
                                           indices.size()));
    return bytes;
}

PackedView packed_indices(std::string_view raw, int component, bool are_triangles) {
    const std::size_t size = bytes_of_component(component);
    std::vector<unsigned> indices(raw.size() / size);
    for (std::size_t i = 0; i < indices.size(); ++i) {
        std::uint32_t index = 0;
        std::memcpy(&index, raw.data() + size * i, size);
        indices[i] = index;
    }
    const std::size_t vertices = indices.empty() ? 0 : std::size_t{*std::ranges::max_element(indices)} + 1;
    PackedView view{{}, are_triangles ? "TRIANGLES" : "INDICES", size, indices.size()};
    meshopt_encodeIndexVersion(1);
    if (!are_triangles) {
        view.bytes.resize(meshopt_encodeIndexSequenceBound(indices.size(), vertices));
        view.bytes.resize(meshopt_encodeIndexSequence(reinterpret_cast<unsigned char*>(view.bytes.data()),
                                                      view.bytes.size(), indices.data(), indices.size()));
        return view;
    }
    // Neighbours that follow each other pack well; where the mesh has its triangles like that, they stay.
    std::vector<unsigned> ordered(indices.size());
    meshopt_optimizeVertexCacheStrip(ordered.data(), indices.data(), indices.size(), vertices);
    view.bytes = packed_triangles(indices, vertices);
    if (std::string other = packed_triangles(ordered, vertices); other.size() < view.bytes.size())
        view.bytes = std::move(other);
    return view;
}

void add_extension(Json& document, const char* name) {
    for (const char* list : {"extensionsUsed", "extensionsRequired"}) {
        Json& names = document[list];
        if (!names.is_array()) names = Json::array();
        if (std::ranges::find(names, Json(name)) == names.end()) names.push_back(name);
    }
}

} // namespace

Result<std::string> compress_views(Json& document, std::string_view data, std::span<const FilteredView> filtered) {
    Json& views = document["bufferViews"];
    std::vector<std::vector<Json*>> accessors(views.size()); // of each view
    for (Json& accessor : document["accessors"])
        accessors[accessor["bufferView"].get<std::size_t>()].push_back(&accessor);
    std::vector<bool> holds_normals(views.size()), holds_triangles(views.size());
    const auto view_of = [&](const Json& accessor) {
        return document["accessors"][accessor.get<std::size_t>()]["bufferView"].get<std::size_t>();
    };
    for (const Json& mesh : document.value("meshes", Json::array()))
        for (const Json& primitive : mesh["primitives"]) {
            if (primitive["attributes"].contains("NORMAL"))
                holds_normals[view_of(primitive["attributes"]["NORMAL"])] = true;
            if (primitive.contains("indices") && primitive.value("mode", 4) == 4)
                holds_triangles[view_of(primitive["indices"])] = true;
        }
    std::string packed;
    std::size_t unpacked = 0;
    for (std::size_t k = 0; k < views.size(); ++k) {
        Json& view = views[k];
        std::string_view raw = data.substr(view.value("byteOffset", std::size_t{0}), view["byteLength"]);
        std::string bytes;
        const auto place = [&](std::string_view what, Json& in) {
            in["byteOffset"] = packed.size();
            in["byteLength"] = what.size();
            packed += what;
            packed.resize((packed.size() + 3) / 4 * 4);
        };
        if (accessors[k].empty() || raw.size() < 64) { // a picture; too little to pack
            place(raw, view);
            continue;
        }
        Json& first = *accessors[k][0];
        if (holds_normals[k] && accessors[k].size() == 1 && first["componentType"] == kFloat) {
            bytes = normals_in_bytes(raw);
            raw = bytes;
            first["componentType"] = kByte;
            first["normalized"] = true;
            view["byteStride"] = 4;
            add_extension(document, "KHR_mesh_quantization");
        }
        const auto by_filter = std::ranges::find(filtered, k, &FilteredView::view);
        const bool is_filtered = by_filter != filtered.end();
        const bool are_indices = view.value("target", 0) == kIndices;
        const std::size_t element = view.value("byteStride", accessors[k].size() == 1 ? element_bytes(first) : 4);
        PackedView made;
        if (is_filtered) {
            made = packed_vertices(by_filter->bytes, by_filter->stride);
        } else if (are_indices && accessors[k].size() == 1 && first["componentType"] >= kUint16) {
            made = packed_indices(raw, first["componentType"],
                                  holds_triangles[k] && first["count"].get<std::size_t>() % 3 == 0);
        } else if (element % 4 == 0 && element <= kLargestStride && raw.size() % element == 0) {
            made = packed_vertices(raw, element);
        } else {
            place(raw, view);
            continue;
        }
        view["buffer"] = 1;
        view["byteOffset"] = unpacked;
        view["byteLength"] = raw.size();
        unpacked += (raw.size() + 3) / 4 * 4;
        Json extension = {{"buffer", 0}};
        place(made.bytes, extension);
        extension["byteStride"] = made.stride;
        extension["mode"] = made.mode;
        extension["count"] = made.count;
        if (is_filtered) extension["filter"] = by_filter->filter;
        view["extensions"]["EXT_meshopt_compression"] = std::move(extension);
    }
    document["buffers"] = Json::array({{{"byteLength", packed.size()}}});
    if (unpacked > 0) {
        document["buffers"].push_back(
            {{"byteLength", unpacked}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}});
        add_extension(document, "EXT_meshopt_compression");
    }
    return packed;
}

} // namespace filigree
