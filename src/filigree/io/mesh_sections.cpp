#include "filigree/io/mesh_sections.h"

#include "filigree/io/model_records.h"

#include <algorithm>
#include <map>
#include <memory>

namespace filigree {

namespace {

template <class T>
void write_attribute(SectionWriter& out, const std::string& name, const CornerAttribute<T>& attribute) {
    out.array(name + ".val", attribute.values);
    out.array(name + ".cor", attribute.corners);
}

void write_labels(SectionWriter& out, const std::string& name, const FaceLabels& labels) {
    out.strings(name + ".nam", labels.names);
    out.array(name + ".fac", labels.of_face);
}

/// Faces as one size when all have it, else as their offsets.
void write_faces(SectionWriter& out, const std::string& name, std::uint32_t index, const std::vector<Index>& offsets,
                 const std::vector<Index>& corners) {
    const Index size = offsets.size() > 1 ? offsets[1] : 0;
    bool uniform = size > 0;
    for (std::size_t f = 0; uniform && f < offsets.size(); ++f) uniform = offsets[f] == f * size;
    if (uniform)
        out.array(name + ".siz", std::vector<Index>{size}, index);
    else
        out.array(name + ".off", offsets, index);
    out.array(name + ".cor", corners, index);
}

/// An embedded material; its name stands in mat.nam.
struct FileMaterial {
    std::array<float, 3> color;
    float opacity, metallic, roughness;
    std::uint32_t double_sided;
    std::uint32_t picture; ///< index of a mat.pic, or kNoIndex
};
static_assert(sizeof(FileMaterial) == 32);

/// Each once, in the order in which materials have them.
std::vector<const std::string*> pictures_of(const std::vector<MeshMaterial>& materials) {
    std::vector<const std::string*> pictures;
    for (const MeshMaterial& m : materials)
        if (m.picture_bytes && !m.picture_bytes->empty() &&
            std::find(pictures.begin(), pictures.end(), m.picture_bytes.get()) == pictures.end())
            pictures.push_back(m.picture_bytes.get());
    return pictures;
}

void write_material_sections(SectionWriter& out, const std::vector<MeshMaterial>& materials) {
    std::vector<FileMaterial> records;
    const std::vector<const std::string*> pictures = pictures_of(materials);
    for (const MeshMaterial& m : materials) {
        const auto found = std::find(pictures.begin(), pictures.end(), m.picture_bytes.get());
        const std::uint32_t picture =
            found == pictures.end() ? kNoIndex : static_cast<std::uint32_t>(found - pictures.begin());
        records.push_back({{m.color[0], m.color[1], m.color[2]},
                           m.opacity,
                           m.metallic,
                           m.roughness,
                           m.double_sided ? 1u : 0u,
                           picture});
    }
    out.array("mat.emb", std::move(records));
}

template <class T>
CornerAttribute<T> read_attribute(const SectionReader& in, const std::string& name) {
    return {in.array<T>(name + ".val"), in.array<Index>(name + ".cor")};
}

FaceLabels read_labels(const SectionReader& in, const std::string& name) {
    return {in.strings(name + ".nam"), in.array<Index>(name + ".fac")};
}

} // namespace

void write_pictures(SectionWriter& out, const std::vector<MeshMaterial>& materials) {
    const std::vector<const std::string*> pictures = pictures_of(materials);
    for (std::uint32_t i = 0; i < pictures.size(); ++i) out.bytes("mat.pic", *pictures[i], i);
}

void write_mesh_sections(SectionWriter& out, const Mesh& mesh, bool with_positions, bool with_pictures) {
    if (with_positions)
        for (std::uint32_t k = 0; k < chunk_count(mesh.vertex_count()); ++k) {
            const std::size_t begin = k * kChunkVertices, count = std::min(kChunkVertices, mesh.vertex_count() - begin);
            out.items("mesh.pos", std::span(mesh.positions).subspan(begin, count), k);
        }
    out.value("mesh.org", std::array<double, 3>{mesh.origin[0], mesh.origin[1], mesh.origin[2]});
    out.value("mesh.num", static_cast<std::uint64_t>(mesh.vertex_count()));
    write_faces(out, "mesh", 0, mesh.face_offsets, mesh.corners);
    write_attribute(out, "uv", mesh.uvs);
    write_attribute(out, "nrm", mesh.normals);
    out.array("col.val", mesh.colors);
    if (mesh.colors_have_alpha) out.value("col.alp", std::uint32_t{1});
    std::vector<std::string> names;
    for (std::uint32_t i = 0; i < mesh.scalars.size(); ++i) {
        names.push_back(mesh.scalars[i].name);
        out.array("scal.val", mesh.scalars[i].values, i);
    }
    out.strings("scal.nam", names);
    write_labels(out, "obj", mesh.objects);
    write_labels(out, "grp", mesh.groups);
    write_labels(out, "mat", mesh.materials);
    write_material_sections(out, mesh.embedded_materials);
    if (with_pictures) write_pictures(out, mesh.embedded_materials);
    out.array("smooth", mesh.smoothing);
    out.strings("mtllib", mesh.material_files);
}

Mesh read_mesh_sections(const SectionReader& in) {
    Mesh mesh;
    mesh.positions = in.all<Vec3f>("mesh.pos");
    const auto origin = in.value<std::array<double, 3>>("mesh.org");
    mesh.origin = {origin[0], origin[1], origin[2]};
    read_faces(in, "mesh", 0, mesh.face_offsets, mesh.corners);
    mesh.uvs = read_attribute<Vec2f>(in, "uv");
    mesh.normals = read_attribute<Vec3f>(in, "nrm");
    mesh.colors = in.array<Vec4f>("col.val");
    mesh.colors_have_alpha = !in.array<std::uint32_t>("col.alp").empty();
    const std::vector<std::string> names = in.strings("scal.nam");
    for (std::uint32_t i = 0; i < names.size(); ++i) mesh.scalars.push_back({names[i], in.array<float>("scal.val", i)});
    mesh.objects = read_labels(in, "obj");
    mesh.groups = read_labels(in, "grp");
    mesh.materials = read_labels(in, "mat");
    mesh.embedded_materials = read_embedded_materials(in, mesh.materials.names, true);
    mesh.smoothing = in.array<Index>("smooth");
    mesh.material_files = in.strings("mtllib");
    return mesh;
}

std::vector<MeshMaterial> read_embedded_materials(const SectionReader& in, const std::vector<std::string>& names,
                                                  bool with_pictures) {
    const std::vector<FileMaterial> records = in.array<FileMaterial>("mat.emb");
    if (records.empty()) return {};
    if (records.size() != names.size()) throw FileDamage{"has another number of materials than of their names"};
    std::map<std::uint32_t, std::shared_ptr<const std::string>> pictures;
    std::vector<MeshMaterial> materials;
    for (std::size_t i = 0; i < records.size(); ++i) {
        const FileMaterial& record = records[i];
        MeshMaterial& material = materials.emplace_back();
        material.name = names[i];
        material.color = {record.color[0], record.color[1], record.color[2]};
        material.opacity = record.opacity;
        material.metallic = record.metallic;
        material.roughness = record.roughness;
        material.double_sided = record.double_sided != 0;
        if (record.picture == kNoIndex || !with_pictures) continue;
        std::shared_ptr<const std::string>& picture = pictures[record.picture];
        if (!picture) {
            const std::vector<char> bytes = in.array<char>("mat.pic", record.picture);
            if (bytes.empty()) throw FileDamage{"lacks the picture of a material"};
            picture = std::make_shared<const std::string>(bytes.begin(), bytes.end());
        }
        material.picture_bytes = picture;
    }
    return materials;
}

void write_level_sections(SectionWriter& out, const std::vector<Level>& levels) {
    out.value("levels", static_cast<std::uint32_t>(levels.size()));
    for (std::uint32_t k = 0; k < levels.size(); ++k) {
        out.array("lev.vert", levels[k].vertices, k);
        write_faces(out, "lev", k, levels[k].face_offsets, levels[k].corners);
    }
}

std::vector<Level> read_level_sections(const SectionReader& in) {
    const auto level_count = in.value<std::uint32_t>("levels");
    if (level_count > 64) throw FileDamage{"has more levels than make sense"};
    std::vector<Level> levels(level_count);
    for (std::uint32_t k = 0; k < level_count; ++k) {
        levels[k].vertices = in.array<Index>("lev.vert", k);
        read_faces(in, "lev", k, levels[k].face_offsets, levels[k].corners);
    }
    return levels;
}

void read_faces(const SectionReader& in, const std::string& name, std::uint32_t index, std::vector<Index>& offsets,
                std::vector<Index>& corners) {
    corners = in.array<Index>(name + ".cor", index);
    const std::vector<Index> size = in.array<Index>(name + ".siz", index);
    if (size.empty()) {
        offsets = in.array<Index>(name + ".off", index);
        if (offsets.empty()) offsets = {0};
        return;
    }
    if (size.size() != 1 || size[0] == 0 || corners.size() % size[0] != 0)
        throw FileDamage{"has faces that do not divide their corners"};
    offsets.resize(corners.size() / size[0] + 1);
    for (std::size_t f = 0; f < offsets.size(); ++f) offsets[f] = static_cast<Index>(f * size[0]);
}

} // namespace filigree
