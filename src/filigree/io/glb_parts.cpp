#include "filigree/io/glb_parts.h"

#include "filigree/core/srgb.h"
#include "filigree/io/file.h"
#include "filigree/io/losses.h"
#include "filigree/mesh.h"
#include "filigree/mesh/normals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <unordered_map>

namespace filigree {

namespace {

using Json = GlbBuilder::Json;

// ---------------------------------------------------------------------------------------------------------- vertices

/// Normals as glTF wants them. A length this close to 1 passes for it (the validator allows 0.0067), so that normals of
/// three decimals keep their digits.
class UnitNormals {
public:
    UnitNormals(const Mesh& mesh, const RunContext& context) : mesh_(mesh), context_(context) {}

    Vec3f at(Index vertex, const Vec3f* given) {
        constexpr double kUnitTolerance = 0.005;
        if (given) {
            const double length = given->cast<double>().norm();
            if (std::abs(length - 1) <= kUnitTolerance) return *given;
            if (length > 0) return (given->cast<double>() / length).cast<float>();
        }
        if (from_faces_.empty()) from_faces_ = vertex_normals(mesh_, mesh_.positions, context_);
        const Vec3f& normal = from_faces_[vertex];
        return normal.isZero(0) ? Vec3f(0, 0, 1) : normal;
    }

private:
    const Mesh& mesh_;
    const RunContext& context_;
    std::vector<Vec3f> from_faces_; ///< made when they are first needed
};

/// Gives every corner an output vertex.
class VertexSplitter {
public:
    VertexSplitter(const Mesh& mesh, bool with_normals, GlbParts& parts, const RunContext& context)
        : mesh_(mesh), parts_(parts), unit_(mesh, context), has_uvs_(!mesh.uvs.empty()),
          has_normals_(with_normals && !mesh.normals.empty()) {}

    /// The output vertex of each corner; empty where it is the mesh's vertex.
    std::vector<Index> split() {
        const std::size_t count = mesh_.vertex_count();
        parts_.mesh_vertices = count;
        if (has_uvs_) parts_.uvs.resize(count, Vec2f::Zero());
        if (has_normals_) parts_.normals.resize(count);
        const bool uv_splits = has_uvs_ && !mesh_.uvs.per_vertex();
        const bool normal_splits = has_normals_ && !mesh_.normals.per_vertex();
        if (!uv_splits && !normal_splits) {
            for (Index v = 0; v < count; ++v) set(v, v, kNoIndex);
            return {};
        }
        std::vector<Index> vertex_of(mesh_.corner_count());
        std::vector<bool> seen(count, false);
        next_.assign(count, kNoIndex);
        for (Index c = 0; c < mesh_.corner_count(); ++c) {
            const Index v = mesh_.corners[c];
            if (!seen[v]) set(v, v, c);
            vertex_of[c] = seen[v] ? find_or_repeat(v, c) : v;
            seen[v] = true;
        }
        for (Index v = 0; v < count; ++v)
            if (!seen[v]) set(v, v, kNoIndex);
        return vertex_of;
    }

private:
    /// The value of a corner (kNoIndex: of the vertex alone), or null.
    template <class T>
    static const T* value(const CornerAttribute<T>& attribute, Index vertex, Index corner) {
        if (attribute.per_vertex()) return &attribute.values[vertex];
        const Index i = corner == kNoIndex ? kNoIndex : attribute.corners[corner];
        return i == kNoIndex ? nullptr : &attribute.values[i];
    }
    Vec2f uv(Index vertex, Index corner) const {
        const Vec2f* const given = value(mesh_.uvs, vertex, corner);
        return given ? Vec2f(given->x(), 1 - given->y()) : Vec2f::Zero();
    }
    Vec3f normal(Index vertex, Index corner) { return unit_.at(vertex, value(mesh_.normals, vertex, corner)); }

    void set(Index output, Index vertex, Index corner) {
        if (has_uvs_) parts_.uvs[output] = uv(vertex, corner);
        if (has_normals_) parts_.normals[output] = normal(vertex, corner);
    }

    Index find_or_repeat(Index vertex, Index corner) {
        const Vec2f uv_here = has_uvs_ ? uv(vertex, corner) : Vec2f::Zero();
        const Vec3f normal_here = has_normals_ ? normal(vertex, corner) : Vec3f::Zero();
        constexpr int kLongestChain = 16; // the hub of a fan can have thousands of UVs
        Index output = vertex;
        int length = 1;
        for (;; output = next_[output], ++length) {
            if ((!has_uvs_ || parts_.uvs[output] == uv_here) &&
                (!has_normals_ || parts_.normals[output] == normal_here))
                return output;
            if (next_[output] == kNoIndex || length == kLongestChain) break;
        }
        const auto repeat = static_cast<Index>(parts_.vertex_count());
        if (length == kLongestChain) {
            const auto [entry, is_new] = beyond_chains_.try_emplace(key(vertex, uv_here, normal_here), repeat);
            if (!is_new) return entry->second;
        } else {
            next_[output] = repeat;
        }
        next_.push_back(kNoIndex);
        parts_.repeats.push_back(vertex);
        if (has_uvs_) parts_.uvs.push_back(uv_here);
        if (has_normals_) parts_.normals.push_back(normal_here);
        return repeat;
    }

    /// A vertex with its values, as bytes: the same for equal values, as the two zeros are made one.
    static std::string key(Index vertex, const Vec2f& uv, const Vec3f& normal) {
        const std::array<float, 5> values = {uv.x() + 0.0f, uv.y() + 0.0f, normal.x() + 0.0f, normal.y() + 0.0f,
                                             normal.z() + 0.0f};
        return bytes_of(std::span<const Index>(&vertex, 1)) + bytes_of(std::span<const float>(values));
    }

    const Mesh& mesh_;
    GlbParts& parts_;
    UnitNormals unit_;
    bool has_uvs_, has_normals_;
    std::vector<Index> next_; ///< the next output vertex of the same mesh vertex, in a chain of bounded length
    std::unordered_map<std::string, Index> beyond_chains_;
};

// -------------------------------------------------------------------------------------------------------- primitives

/// The corner of a face that has a vertex: the first, where the face has it twice. Asked face after face.
class CornerFinder {
public:
    explicit CornerFinder(const Mesh& mesh) : mesh_(mesh) {}

    Index corner(Index face, Index vertex) {
        constexpr Index kFewCorners = 8; // looking through them is quicker than a table
        const Index begin = mesh_.face_offsets[face], end = mesh_.face_offsets[face + 1];
        if (end - begin <= kFewCorners)
            return static_cast<Index>(std::find(mesh_.corners.begin() + begin, mesh_.corners.begin() + end, vertex) -
                                      mesh_.corners.begin());
        if (face != face_in_table_) fill(face, begin, end);
        return corner_of_vertex_[vertex];
    }

private:
    const Mesh& mesh_;
    Index face_in_table_ = kNoIndex;
    std::vector<Index> corner_of_vertex_; ///< of the mesh's vertices; right for those of the face in the table

    void fill(Index face, Index begin, Index end) {
        corner_of_vertex_.resize(mesh_.vertex_count());
        for (Index c = end; c-- > begin;) corner_of_vertex_[mesh_.corners[c]] = c;
        face_in_table_ = face;
    }
};

/// Sorts triangles into primitives. Labels that no face has do not appear; "none" comes last.
class PrimitiveSorter {
public:
    PrimitiveSorter(const Mesh& mesh, bool by_object) : mesh_(mesh), by_object_(by_object && !mesh.objects.empty()) {}

    Result<std::vector<GlbObject>> sort(std::span<const Index> vertex_of, const RunContext& context) {
        const Result<Triangulation> cut = triangulate(mesh_, context);
        if (!cut) return cut.error();
        const Triangulation& faces = *cut;
        CornerFinder finder(mesh_);
        using Labels = std::pair<Index, Index>; // object and material
        std::map<Labels, std::size_t> counts;
        const auto labels_of = [&](Index face) {
            return Labels(by_object_ ? mesh_.objects.of_face[face] : kNoIndex,
                          mesh_.materials.empty() ? kNoIndex : mesh_.materials.of_face[face]);
        };
        for_runs(faces, labels_of,
                 [&](const Labels& labels, std::size_t begin, std::size_t end) { counts[labels] += end - begin; });
        std::vector<GlbObject> objects;
        std::map<Labels, std::pair<std::size_t, std::size_t>> place; // object and primitive
        Index last_object = kNoIndex;
        for (const auto& [labels, count] : counts) {
            if (objects.empty() || labels.first != last_object)
                objects.push_back({labels.first == kNoIndex ? "" : mesh_.objects.names[labels.first], {}});
            last_object = labels.first;
            place[labels] = {objects.size() - 1, objects.back().primitives.size()};
            objects.back().primitives.push_back({labels.second, {}});
            objects.back().primitives.back().indices.reserve(3 * count);
        }
        for_runs(faces, labels_of, [&](const Labels& labels, std::size_t begin, std::size_t end) {
            const auto [object, primitive] = place[labels];
            std::vector<Index>& indices = objects[object].primitives[primitive].indices;
            for (std::size_t t = begin; t < end; ++t)
                for (const Index v : faces.triangles[t])
                    indices.push_back(vertex_of.empty() ? v : vertex_of[finder.corner(faces.source_face[t], v)]);
        });
        return objects;
    }

private:
    template <class LabelsOf, class Take>
    static void for_runs(const Triangulation& faces, const LabelsOf& labels_of, const Take& take) {
        for (std::size_t begin = 0, end = 0; begin < faces.triangles.size(); begin = end) {
            const auto labels = labels_of(faces.source_face[begin]);
            while (end < faces.triangles.size() && labels_of(faces.source_face[end]) == labels) ++end;
            take(labels, begin, end);
        }
    }

    const Mesh& mesh_;
    bool by_object_;
};

GlbObject all_points(std::size_t count) {
    GlbObject points{"", {GlbPrimitive{}}};
    for (Index v = 0; v < count; ++v) points.primitives[0].indices.push_back(v);
    return points;
}

std::vector<std::string> what_is_lost(const Mesh& mesh, bool by_object) {
    std::vector<std::string> lost;
    bool polygons = false;
    for (std::size_t f = 0; f < mesh.face_count() && !polygons; ++f) polygons = mesh.face_size(f) > 3;
    if (polygons) lost.emplace_back(kPolygonLoss);
    if (!by_object && !mesh.objects.empty()) lost.emplace_back("objects");
    if (!mesh.groups.empty()) lost.emplace_back("groups");
    if (needs_smoothing(mesh)) lost.emplace_back("smoothing groups");
    return lost;
}

// ---------------------------------------------------------------------------------------------------------- colours

std::size_t add_colors(GlbBuilder& builder, const GlbParts& parts, const Mesh& mesh) {
    const std::size_t channels = mesh.colors_have_alpha ? 4 : 3;
    std::vector<float> numbers;
    numbers.reserve(channels * parts.vertex_count());
    for (std::size_t v = 0; v < parts.vertex_count(); ++v) {
        const Vec4f& color = mesh.colors[parts.source(v)];
        for (int k = 0; k < 3; ++k)
            numbers.push_back(static_cast<float>(linear_from_srgb(static_cast<double>(color[k]))));
        if (channels == 4) numbers.push_back(std::clamp(color[3], 0.0f, 1.0f));
    }
    return builder.add(
        {.type = channels == 4 ? "VEC4" : "VEC3", .target = GltfTarget::vertices, .count = parts.vertex_count()},
        bytes_of(std::span<const float>(numbers)));
}

/// The name as JSON will hold it: bytes that are no UTF-8 replaced.
std::string as_utf8(const std::string& name) {
    return Json::parse(Json(name).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
}

/// A name that no other attribute has.
std::string attribute_name(const std::string& scalar, const Json& attributes) {
    std::string name = "_" + as_utf8(scalar);
    std::replace(name.begin(), name.end(), '\0', '_'); // where other programs' names end
    std::string free_name = name;
    for (int number = 2; attributes.contains(free_name); ++number) free_name = name + "_" + std::to_string(number);
    return free_name;
}

// --------------------------------------------------------------------------------------------------------- materials

/// A PNG without what glTF wants ignored and its validator warns of: colour profiles, pixels that are not square,
/// further frames of an animation. The bytes as they are where there is nothing of it, or they are damaged.
std::string plain_png(const std::string& bytes) {
    constexpr std::size_t kSignature = 8, kFrame = 12; // of a chunk: length, name, checksum
    constexpr std::string_view kLeftOut[] = {"iCCP", "pHYs", "acTL", "fcTL", "fdAT"};
    std::string plain = bytes.substr(0, kSignature);
    for (std::size_t at = kSignature; at + kFrame <= bytes.size();) {
        std::size_t length = 0;
        for (std::size_t i = 0; i < 4; ++i) length = length << 8 | static_cast<unsigned char>(bytes[at + i]);
        if (length > bytes.size() - at - kFrame) return bytes;
        const std::string_view name = std::string_view(bytes).substr(at + 4, 4);
        if (std::find(std::begin(kLeftOut), std::end(kLeftOut), name) == std::end(kLeftOut))
            plain.append(bytes, at, kFrame + length);
        at += kFrame + length;
        if (name == "IEND") return plain;
    }
    return bytes;
}

/// Pictures as textures, each once.
class TextureAdder {
public:
    TextureAdder(GlbBuilder& builder, std::vector<std::string>& warnings) : builder_(builder), warnings_(warnings) {}

    std::optional<std::size_t> add(const MeshMaterial& material) {
        if (material.picture_bytes) {
            const auto [entry, is_new] = of_bytes_.try_emplace(material.picture_bytes.get());
            if (is_new) entry->second = add(*material.picture_bytes, material.name);
            return entry->second;
        }
        if (material.picture.empty()) return std::nullopt;
        const auto [entry, is_new] = of_file_.try_emplace(material.picture);
        if (is_new) {
            const Result<std::string> bytes = read_file(material.picture);
            if (bytes)
                entry->second = add(*bytes, material.picture.filename().string());
            else
                warnings_.push_back(bytes.error().message);
        }
        return entry->second;
    }

private:
    std::optional<std::size_t> add(const std::string& bytes, const std::string& name) {
        const std::string_view extension = picture_extension(bytes);
        if (extension.empty()) {
            warnings_.push_back("The texture " + name + " is neither PNG nor JPEG and was left out.");
            return std::nullopt;
        }
        Json& json = builder_.json;
        if (!json.contains("samplers")) // smooth, repeated
            json["samplers"] =
                Json::array({{{"magFilter", 9729}, {"minFilter", 9987}, {"wrapS", 10497}, {"wrapT", 10497}}});
        Json image = {{"bufferView", builder_.add_view(extension == ".png" ? plain_png(bytes) : bytes)},
                      {"mimeType", extension == ".png" ? "image/png" : "image/jpeg"}};
        if (!name.empty()) image["name"] = name;
        json["images"].push_back(std::move(image));
        json["textures"].push_back({{"sampler", 0}, {"source", json["images"].size() - 1}});
        return json["textures"].size() - 1;
    }

    GlbBuilder& builder_;
    std::vector<std::string>& warnings_;
    std::map<const std::string*, std::optional<std::size_t>> of_bytes_;
    std::map<std::filesystem::path, std::optional<std::size_t>> of_file_;
};

Json material_json(const MeshMaterial& material, std::optional<std::size_t> texture) {
    const auto in_range = [](float x) { return std::clamp(static_cast<double>(x), 0.0, 1.0); };
    Json color = Json::array();
    for (const float c : material.color) color.push_back(linear_from_srgb(static_cast<double>(c)));
    color.push_back(in_range(material.opacity));
    Json surface = {{"baseColorFactor", std::move(color)}};
    if (texture) surface["baseColorTexture"] = {{"index", *texture}};
    surface["metallicFactor"] = in_range(material.metallic);
    surface["roughnessFactor"] = in_range(material.roughness);
    Json json = Json::object();
    if (!material.name.empty()) json["name"] = material.name;
    json["pbrMetallicRoughness"] = std::move(surface);
    if (material.opacity < 1) json["alphaMode"] = "BLEND";
    if (material.double_sided) json["doubleSided"] = true;
    return json;
}

} // namespace

bool has_unlabelled_faces(const GlbParts& parts) {
    for (const GlbObject& object : parts.objects)
        for (const GlbPrimitive& primitive : object.primitives)
            if (primitive.material == kNoIndex) return true;
    return false;
}

std::size_t add_glb_plain_material(GlbBuilder& builder, const GlbParts& parts) {
    MeshMaterial plain;
    plain.name = "none";
    if (parts.has_colors) plain.color = Vec3f::Ones(); // it is multiplied with theirs
    Json json = material_json(plain, std::nullopt);
    json["extras"] = {{"filigree", "none"}};
    builder.json["materials"].push_back(std::move(json));
    return builder.json["materials"].size() - 1;
}

Result<GlbParts> make_glb_parts(const Mesh& mesh, const GlbPartsOptions& options, const RunContext& context) {
    GlbParts parts;
    const std::vector<Index> vertex_of = VertexSplitter(mesh, options.normals, parts, context).split();
    if (context.is_cancelled()) return cancelled_error();
    parts.is_points = mesh.face_count() == 0;
    if (parts.is_points) {
        parts.objects.push_back(all_points(mesh.vertex_count()));
    } else {
        Result<std::vector<GlbObject>> sorted = PrimitiveSorter(mesh, options.objects).sort(vertex_of, context);
        if (!sorted) return sorted.error();
        parts.objects = *std::move(sorted);
    }
    parts.has_colors = !mesh.colors.empty();
    parts.lost = what_is_lost(mesh, options.objects);
    if (context.is_cancelled()) return cancelled_error();
    return parts;
}

Json add_glb_attributes(GlbBuilder& builder, const GlbParts& parts, const Mesh& mesh) {
    Json attributes = Json::object();
    if (!parts.normals.empty()) attributes["NORMAL"] = builder.add_vectors(parts.normals);
    if (!parts.uvs.empty())
        attributes["TEXCOORD_0"] =
            builder.add({.type = "VEC2", .target = GltfTarget::vertices, .count = parts.uvs.size()},
                        bytes_of(std::span<const Vec2f>(parts.uvs)));
    if (!mesh.colors.empty()) attributes["COLOR_0"] = add_colors(builder, parts, mesh);
    for (const VertexScalar& scalar : mesh.scalars)
        attributes[attribute_name(scalar.name, attributes)] =
            builder.add_scalars(parts.spread(std::span<const float>(scalar.values)), GltfTarget::vertices);
    return attributes;
}

MeshMaterials find_glb_materials(const Mesh& mesh, const std::filesystem::path& materials_beside) {
    if (mesh.materials.empty()) return {};
    if (!mesh.embedded_materials.empty() || !materials_beside.empty()) return read_materials(mesh, materials_beside);
    MeshMaterials grey;
    for (const std::string& name : mesh.materials.names) grey.materials.emplace_back().name = name;
    grey.warnings.emplace_back("The material libraries were not looked for; materials became grey.");
    return grey;
}

GlbMaterials add_glb_materials(GlbBuilder& builder, const GlbParts& parts, std::span<const MeshMaterial> materials) {
    GlbMaterials added;
    Json& list = builder.json["materials"];
    added.first = list.size();
    TextureAdder textures(builder, added.warnings);
    const bool has_pictures = std::any_of(materials.begin(), materials.end(),
                                          [](const MeshMaterial& material) { return material.has_picture(); });
    if (has_pictures && parts.uvs.empty())
        added.warnings.emplace_back("The mesh has no UVs, so its textures were left out.");
    for (const MeshMaterial& material : materials) {
        std::optional<std::size_t> texture;
        if (!parts.uvs.empty()) texture = textures.add(material);
        builder.json["materials"].push_back(material_json(material, texture));
    }
    if (has_unlabelled_faces(parts)) added.none = add_glb_plain_material(builder, parts);
    if (builder.json["materials"].empty()) builder.json.erase("materials");
    return added;
}

Json add_glb_mesh(GlbBuilder& builder, const GlbParts& parts, const GlbObject& object, const GlbMaterials& materials,
                  const Json& attributes) {
    constexpr int kPoints = 0;
    Json mesh = Json::object();
    if (!object.name.empty()) mesh["name"] = object.name;
    for (const GlbPrimitive& primitive : object.primitives) {
        Json json = {{"attributes", attributes}};
        if (parts.is_points)
            json["mode"] = kPoints; // all vertices, in their order
        else
            json["indices"] = builder.add_indices(primitive.indices);
        json["material"] = materials.number(primitive.material);
        mesh["primitives"].push_back(std::move(json));
    }
    return mesh;
}

Json add_glb_repeats(GlbBuilder& builder, const GlbParts& parts) {
    if (parts.repeats.empty() && parts.objects.size() < 2) return nullptr;
    Json numbers = {{"vertices", parts.mesh_vertices}};
    if (!parts.repeats.empty())
        numbers["repeats"] = builder.add({.component = GltfComponent::uint32, .count = parts.repeats.size()},
                                         bytes_of(std::span<const Index>(parts.repeats)));
    return {{"filigree", std::move(numbers)}};
}

std::vector<std::size_t> add_glb_nodes(GlbBuilder& builder, const GlbParts& parts, const Mesh& mesh,
                                       const GlbMaterials& materials) {
    Json attributes = Json::object();
    attributes["POSITION"] = builder.add_positions(parts.spread(std::span<const Vec3f>(mesh.positions)));
    attributes.update(add_glb_attributes(builder, parts, mesh));
    const Json repeats = add_glb_repeats(builder, parts);
    std::vector<std::size_t> nodes;
    for (const GlbObject& object : parts.objects) {
        Json gltf_mesh = add_glb_mesh(builder, parts, object, materials, attributes);
        if (!repeats.is_null()) gltf_mesh["extras"] = repeats;
        builder.json["meshes"].push_back(std::move(gltf_mesh));
        Json node = Json::object();
        if (!object.name.empty()) node["name"] = object.name;
        node["mesh"] = builder.json["meshes"].size() - 1;
        if (!mesh.origin.isZero(0)) node["translation"] = {mesh.origin.x(), mesh.origin.y(), mesh.origin.z()};
        nodes.push_back(builder.json["nodes"].size());
        builder.json["nodes"].push_back(std::move(node));
    }
    return nodes;
}

} // namespace filigree
