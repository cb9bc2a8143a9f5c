#include "filigree/io/model_file.h"

#include "filigree/io/model_code.h"
#include "filigree/io/model_records.h"
#include "filigree/io/model_sections.h"

#include "filigree/core/parallel_for.h"

#include <cmath>
#include <new>
#include <stdexcept>

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

void write_pictures(SectionWriter& out, const std::vector<MeshMaterial>& materials) {
    const std::vector<const std::string*> pictures = pictures_of(materials);
    for (std::uint32_t i = 0; i < pictures.size(); ++i) out.bytes("mat.pic", *pictures[i], i);
}

void write_mesh_sections(SectionWriter& out, const Mesh& mesh, bool with_positions, bool with_pictures = true) {
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

void write_blend(SectionWriter& out, const Model& model, const BlendDetail& detail) {
    out.value("bl.prec", static_cast<std::uint32_t>(detail.precision));
    out.array("bl.cell", detail.cells);
    if (detail.precision == Precision::float32) {
        write_chunk_records(out, detail, model.mesh.positions);
    } else { // boxes are of the positions that are read back
        std::vector<Vec3f> decoded = model.mesh.positions;
        decode_rest(detail, model.driver().vertices, decoded);
        write_chunk_records(out, detail, decoded);
        out.array("bl.scale", detail.cell_scales);
        out.array("drv.pos", driver_positions(model));
    }
    out.array("bl.gap", detail.across_gap);
    out.array("bl.away", detail.facing_away);
}

void write_reference(SectionWriter& out, const ReferenceDetail& detail) {
    out.value("rf.par", std::array<std::uint32_t, 2>{detail.patches.levels, detail.references});
    out.value("rf.ext", detail.extent);
    out.array("rf.base", detail.patches.base);
    out.array("rf.grid", detail.patches.grid);
    out.array("rf.drv", detail.rest_driver);
    out.array("rf.rec", detail.records);
    out.array("rf.loose", detail.loose);
}

using FileGradient = std::array<float, 9>; // row-major

void write_poses(SectionWriter& out, const PoseSequence& poses) {
    if (poses.empty()) return;
    out.value("pose.fps", poses.frames_per_second);
    for (std::uint32_t frame = 0; frame < poses.frames.size(); ++frame) {
        const Pose& pose = poses.frames[frame];
        out.array("pose.pos", pose.positions, frame);
        std::vector<FileGradient> gradients(pose.gradients.size());
        for (std::size_t v = 0; v < gradients.size(); ++v)
            for (int k = 0; k < 9; ++k) gradients[v][std::size_t(k)] = pose.gradients[v](k / 3, k % 3);
        out.array("pose.grd", std::move(gradients), frame);
    }
}

/// The first thing wrong with poses for a driver of so many vertices, or "".
std::string check_poses(const PoseSequence& poses, std::size_t driver_vertices) {
    if (!poses.empty() && !(std::isfinite(poses.frames_per_second) && poses.frames_per_second > 0))
        return "its rate is not a number above 0";
    for (std::size_t frame = 0; frame < poses.frames.size(); ++frame) {
        const Pose& pose = poses.frames[frame];
        const std::string name = "pose " + std::to_string(frame + 1);
        if (pose.positions.size() != driver_vertices)
            return name + " has " + std::to_string(pose.positions.size()) + " vertices and the driver " +
                   std::to_string(driver_vertices);
        if (pose.gradients.empty() != poses.frames[0].gradients.empty() ||
            (!pose.gradients.empty() && pose.gradients.size() != driver_vertices))
            return name + " does not have the gradients that the others have";
        if (!pose.ghosts.empty()) return name + " has ghost points, which files do not hold";
        const auto is_finite = [](const auto& value) { return value.allFinite(); };
        if (!std::all_of(pose.positions.begin(), pose.positions.end(), is_finite) ||
            !std::all_of(pose.gradients.begin(), pose.gradients.end(), is_finite))
            return name + " has a number that is not finite";
    }
    return "";
}

template <class T>
CornerAttribute<T> read_attribute(const SectionReader& in, const std::string& name) {
    return {in.array<T>(name + ".val"), in.array<Index>(name + ".cor")};
}

FaceLabels read_labels(const SectionReader& in, const std::string& name) {
    return {in.strings(name + ".nam"), in.array<Index>(name + ".fac")};
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

/// Whether the mesh's last vertices are those of a driver that was made elsewhere (of a file that is not coded).
bool has_driver_behind(const SectionReader& in) { return !in.array<std::uint32_t>("mesh.drv").empty(); }

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

BlendDetail read_blend(const SectionReader& in) {
    BlendDetail detail;
    const auto precision = in.value<std::uint32_t>("bl.prec");
    if (precision > 1) throw FileDamage{"has records of a precision that is not known"};
    detail.precision = static_cast<Precision>(precision);
    detail.cells = in.array<Triangle>("bl.cell");
    if (detail.precision == Precision::int16) detail.cell_scales = in.array<float>("bl.scale");
    if (in.version() == 1) {
        detail.cell_offsets = in.array<Index>("bl.coff");
        detail.order = in.array<Index>("bl.order");
        if (detail.precision == Precision::float32) {
            detail.u = in.array<float>("bl.u");
            detail.v = in.array<float>("bl.v");
        } else {
            for (std::int16_t step : in.array<std::int16_t>("bl.u16"))
                detail.u.push_back(float(step) * (1.0f / 32767.0f));
            for (std::int16_t step : in.array<std::int16_t>("bl.v16"))
                detail.v.push_back(float(step) * (1.0f / 32767.0f));
            detail.offsets = in.array<std::array<std::int16_t, 3>>("bl.off16");
        }
    } else {
        const auto vertices = in.value<std::uint64_t>("mesh.num");
        if (vertices >= kNoIndex || chunk_count(vertices) != in.count("bl.run").first)
            throw FileDamage{"is inconsistent: there are not as many chunks as its vertices fill"};
        read_chunk_records(in, 0, chunk_count(vertices), vertices, 0, detail);
    }
    detail.across_gap = in.array<Index>("bl.gap");
    detail.facing_away = in.array<Index>("bl.away");
    return detail;
}

ReferenceDetail read_reference(const SectionReader& in) {
    ReferenceDetail detail;
    const auto parameters = in.value<std::array<std::uint32_t, 2>>("rf.par");
    detail.patches.levels = parameters[0];
    detail.references = parameters[1];
    detail.extent = in.value<float>("rf.ext");
    detail.patches.base = in.array<std::array<Index, 4>>("rf.base");
    detail.patches.grid = in.array<Index>("rf.grid");
    detail.rest_driver = in.array<Vec3f>("rf.drv");
    detail.records = in.array<Vec3f>("rf.rec");
    detail.loose = in.array<Index>("rf.loose");
    return detail;
}

/// Frames 0 .. n - 1 without a gap: so no index is larger than the table is long.
std::size_t frame_count(const SectionReader& in, const std::string& name) {
    const auto [count, last] = in.count(name);
    if (count > 0 && last != count - 1) throw FileDamage{"lacks one of its poses (" + name + ")", "simulate it again"};
    return count;
}

PoseSequence read_pose_sections(const FileReader& file) {
    const SectionReader in(file);
    if (is_coded(in) && clip_of(in).frames > 0) return read_clips(in);
    PoseSequence poses;
    const std::size_t frames = frame_count(in, "pose.pos"), with_gradients = frame_count(in, "pose.grd");
    if (frames == 0 && with_gradients == 0) return poses;
    if (with_gradients != 0 && with_gradients != frames)
        throw FileDamage{"has gradients for some of its poses alone", "simulate it again"};
    poses.frames_per_second = in.value<double>("pose.fps");
    poses.frames.resize(frames);
    for (std::uint32_t frame = 0; frame < frames; ++frame) {
        Pose& pose = poses.frames[frame];
        pose.positions = in.array<Vec3f>("pose.pos", frame);
        for (const FileGradient& entries : in.array<FileGradient>("pose.grd", frame)) {
            Mat3f& gradient = pose.gradients.emplace_back();
            for (int k = 0; k < 9; ++k) gradient(k / 3, k % 3) = entries[std::size_t(k)];
        }
    }
    const std::size_t driver = is_coded(in) ? read_file_code(in).driver_vertices : in.array<Index>("lev.vert").size();
    if (const std::string wrong = check_poses(poses, driver); !wrong.empty())
        throw FileDamage{"is inconsistent: " + wrong, "simulate it again"};
    return poses;
}

Model read_sections(const FileReader& file, const RunContext& context) {
    const SectionReader in(file);
    if (is_coded(in)) {
        Model model = read_model_code(in, read_mesh_sections(in), context);
        model.source_order = in.array<Index>("mesh.ord");
        if (const std::string wrong = check_model(model); !wrong.empty()) throw FileDamage{"is inconsistent: " + wrong};
        return model;
    }
    Model model;
    model.mesh = read_mesh_sections(in);
    model.source_order = in.array<Index>("mesh.ord");
    model.driver_is_behind = has_driver_behind(in);
    const auto level_count = in.value<std::uint32_t>("levels");
    if (level_count > 64) throw FileDamage{"has more levels than make sense"};
    for (std::uint32_t k = 0; k < level_count; ++k) {
        Level& level = model.levels.emplace_back();
        level.vertices = in.array<Index>("lev.vert", k);
        read_faces(in, "lev", k, level.face_offsets, level.corners);
    }
    const auto code = in.value<std::uint32_t>("code");
    if (code > 1) throw FileDamage{"has a detail code that is not known"};
    if (static_cast<DetailCode>(code) == DetailCode::reference)
        model.detail = read_reference(in);
    else
        model.detail = read_blend(in);

    // Float models hold every position. int16 models hold the driver's positions alone; the others come from the
    // records, once those are known to be sound.
    const std::vector<Vec3f> driver = in.array<Vec3f>("drv.pos");
    const auto vertex_count = in.value<std::uint64_t>("mesh.num");
    if (driver.empty() && vertex_count != model.mesh.vertex_count())
        throw FileDamage{"does not have as many positions as it says"};
    if (!driver.empty()) {
        auto* detail = std::get_if<BlendDetail>(&model.detail);
        if (!detail || vertex_count != detail->order.size() || model.levels.empty() ||
            driver.size() != model.driver().vertices.size() || detail->precision != Precision::int16)
            throw FileDamage{"has records that do not fit its vertices"};
        model.mesh.positions.assign(vertex_count, Vec3f::Zero());
        for (std::size_t i = 0; i < driver.size(); ++i)
            if (model.driver().vertices[i] < vertex_count) model.mesh.positions[model.driver().vertices[i]] = driver[i];
        if (const std::string wrong = check_model(model); !wrong.empty()) throw FileDamage{"is inconsistent: " + wrong};
        decode_rest(*detail, model.driver().vertices, model.mesh.positions);
    }
    if (const std::string wrong = check_model(model); !wrong.empty()) throw FileDamage{"is inconsistent: " + wrong};
    return model;
}

void read_frames(const SectionReader& in, ModelOutline& outline) {
    if (const FileClip clip = is_coded(in) ? clip_of(in) : FileClip(); clip.frames > 0) {
        outline.frames = clip.frames;
        outline.has_gradients = clip.numbers > 3;
        outline.frames_per_second = in.value<double>("pose.fps");
        return;
    }
    outline.frames = frame_count(in, "pose.pos");
    outline.has_gradients = frame_count(in, "pose.grd") > 0;
    if (outline.frames > 0) outline.frames_per_second = in.value<double>("pose.fps");
}

/// What sections of so many bytes are parts of.
CodedBytes lossless_parts(const std::vector<std::pair<std::string, std::uint64_t>>& sizes) {
    CodedBytes parts;
    for (const auto& [name, bytes] : sizes) {
        const auto is_one_of = [&](std::initializer_list<std::string_view> names) {
            return std::ranges::any_of(names, [&](std::string_view start) { return name.starts_with(start); });
        };
        if (is_one_of({"mesh.siz", "mesh.off", "mesh.cor"}))
            parts.connectivity += bytes;
        else if (is_one_of({"mesh.ord"}))
            parts.order += bytes;
        else if (is_one_of({"mesh."}))
            parts.places += bytes;
        else if (is_one_of({"lev", "drv.", "rf.drv", "bl.cell"}))
            parts.driver += bytes;
        else if (is_one_of({"bl.", "ck.", "rf.", "code"}))
            parts.records += bytes;
        else if (is_one_of({"pose."}))
            parts.clips += bytes;
        else
            parts.attributes += bytes;
    }
    return parts;
}

ModelOutline read_outline_sections(const FileReader& file) {
    const SectionReader in(file);
    ModelOutline outline;
    if (is_coded(in)) {
        const FileCode code = read_file_code(in);
        outline.levels = {{code.driver_vertices, code.driver_faces, code.driver_corners},
                          {code.vertices, code.faces, code.corners}};
        outline.precision = static_cast<Precision>(code.precision);
        outline.coding = coding_of(in, code);
        read_frames(in, outline);
        outline.bytes = file.size();
        return outline;
    }
    if (in.is_lossless()) outline.lossless = lossless_parts(in.coded_sizes());
    const auto faces = [&](const std::string& name, std::uint32_t index) {
        const std::size_t corners = in.item_count<Index>(name + ".cor", index);
        const std::vector<Index> size = in.array<Index>(name + ".siz", index);
        const std::size_t offsets = in.item_count<Index>(name + ".off", index);
        return size.size() == 1 && size[0] > 0 ? corners / size[0] : offsets - (offsets > 0);
    };
    const auto level_count = in.value<std::uint32_t>("levels");
    if (level_count < 1 || level_count > 64) throw FileDamage{"has a number of levels that makes no sense"};
    for (std::uint32_t k = 0; k < level_count; ++k)
        outline.levels.push_back(
            {in.item_count<Index>("lev.vert", k), faces("lev", k), in.item_count<Index>("lev.cor", k)});
    outline.driver_is_behind = has_driver_behind(in);
    const std::uint64_t all = in.value<std::uint64_t>("mesh.num"),
                        behind = outline.driver_is_behind ? outline.levels[0].vertices : 0;
    if (behind > all) throw FileDamage{"is inconsistent: its driver has more vertices than there are"};
    outline.levels.push_back({all - behind, faces("mesh", 0), in.item_count<Index>("mesh.cor")});
    if (in.value<std::uint32_t>("code") == static_cast<std::uint32_t>(DetailCode::reference)) {
        outline.code = DetailCode::reference;
        outline.references = in.value<std::array<std::uint32_t, 2>>("rf.par")[1];
        outline.patches = in.item_count<std::array<Index, 4>>("rf.base");
    } else {
        const auto precision = in.value<std::uint32_t>("bl.prec");
        if (precision > 1) throw FileDamage{"has records of a precision that is not known"};
        outline.precision = static_cast<Precision>(precision);
        outline.across_gap = in.array<Index>("bl.gap");
        outline.facing_away = in.array<Index>("bl.away");
    }
    read_frames(in, outline);
    outline.bytes = file.size();
    return outline;
}

/// The positions of some vertices, ascending.
std::vector<Vec3f> positions_of(const SectionReader& in, std::span<const Index> vertices) {
    if (in.version() == 1) return in.chosen<Vec3f>("mesh.pos", vertices);
    std::vector<Vec3f> positions;
    std::vector<Index> in_chunk;
    for (std::size_t begin = 0, end = 0; begin < vertices.size(); begin = end) {
        const std::size_t chunk = vertices[begin] / kChunkVertices;
        in_chunk.clear();
        for (; end < vertices.size() && vertices[end] / kChunkVertices == chunk; ++end)
            in_chunk.push_back(static_cast<Index>(vertices[end] % kChunkVertices));
        const std::vector<Vec3f> some = in.chosen<Vec3f>("mesh.pos", in_chunk, static_cast<std::uint32_t>(chunk));
        if (some.size() != in_chunk.size()) throw FileDamage{"lacks positions of a level"};
        positions.insert(positions.end(), some.begin(), some.end());
    }
    return positions;
}

Mesh read_level_sections(const FileReader& file, unsigned k, const RunContext& context) {
    const SectionReader in(file);
    const std::uint32_t level_count = is_coded(in) ? 1 : in.value<std::uint32_t>("levels");
    if (k > level_count)
        throw Error{ErrorCode::usage, "The model has levels 0 to " + std::to_string(level_count) +
                                          "; there is no level " + std::to_string(k) + "."};
    const bool positions_are_coded = in.count("mesh.pos").first == 0;
    if (k == level_count || positions_are_coded) return level_mesh(read_sections(file, context), k);
    const std::vector<Index> vertices = in.array<Index>("lev.vert", k);
    if (!std::is_sorted(vertices.begin(), vertices.end()))
        throw FileDamage{"is inconsistent: a level's vertices do not ascend"};
    Mesh mesh;
    const auto origin = in.value<std::array<double, 3>>("mesh.org");
    mesh.origin = {origin[0], origin[1], origin[2]};
    read_faces(in, "lev", k, mesh.face_offsets, mesh.corners);
    mesh.positions = positions_of(in, vertices);
    const auto per_vertex = [&](const std::string& name) { return in.item_count<Index>(name + ".cor") == 0; };
    if (per_vertex("uv")) mesh.uvs.values = in.chosen<Vec2f>("uv.val", vertices);
    if (per_vertex("nrm")) mesh.normals.values = in.chosen<Vec3f>("nrm.val", vertices);
    mesh.colors = in.chosen<Vec4f>("col.val", vertices);
    mesh.colors_have_alpha = !in.array<std::uint32_t>("col.alp").empty();
    const std::vector<std::string> names = in.strings("scal.nam");
    for (std::uint32_t i = 0; i < names.size(); ++i)
        mesh.scalars.push_back({names[i], in.chosen<float>("scal.val", vertices, i)});
    if (const std::string wrong = check_mesh(mesh); !wrong.empty()) throw FileDamage{"is inconsistent: " + wrong};
    return mesh;
}

/// What `read` makes of a file; what it throws as an Error.
template <class Read>
auto guarded(const FileReader& file, const std::string& name, const RunContext& context, const Read& read)
    -> Result<decltype(read(file))> {
    if (context.is_cancelled()) return cancelled_error();
    try {
        if (!is_model_file(file))
            return Error{ErrorCode::bad_file, name + " is not a Filigree model: strip a mesh to make one."};
        return read(file);
    } catch (const Error& error) {
        return error;
    } catch (const FileDamage& damage) {
        return error_of(damage, name);
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, name + " does not fit into memory."};
    } catch (const std::length_error&) {
        return Error{ErrorCode::out_of_memory, name + " does not fit into memory."};
    }
}

} // namespace

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

bool is_model_file(std::string_view bytes) {
    return bytes.starts_with(std::string_view(kModelMagic, sizeof kModelMagic));
}

bool is_model_file(const FileReader& file) {
    char first[sizeof kModelMagic];
    return file.size() >= sizeof first && file.read(0, first) && is_model_file(std::string_view(first, sizeof first));
}

namespace {

void write_sections(SectionWriter& out, const Model& model, const PoseSequence& poses) {
    const auto* blend = std::get_if<BlendDetail>(&model.detail);
    write_mesh_sections(out, model.mesh, !blend || blend->precision == Precision::float32);
    out.array("mesh.ord", model.source_order);
    if (model.driver_is_behind) out.value("mesh.drv", std::uint32_t{1});
    out.value("code", static_cast<std::uint32_t>(model.code()));
    out.value("levels", static_cast<std::uint32_t>(model.levels.size()));
    for (std::uint32_t k = 0; k < model.levels.size(); ++k) {
        out.array("lev.vert", model.levels[k].vertices, k);
        write_faces(out, "lev", k, model.levels[k].face_offsets, model.levels[k].corners);
    }
    if (blend)
        write_blend(out, model, *blend);
    else
        write_reference(out, std::get<ReferenceDetail>(model.detail));
    write_poses(out, poses);
}

} // namespace

std::string write_model(const Model& model, const PoseSequence& poses) {
    SectionWriter out;
    write_sections(out, model, poses);
    std::string file;
    for (const std::string_view piece : out.finish()) file += piece;
    return file;
}

std::string write_model(const Model& model) { return write_model(model, PoseSequence()); }

namespace {

Status check_fits(const PoseSequence& poses, const Model& model, const std::filesystem::path& path) {
    const std::string wrong = poses.empty() ? "" : check_poses(poses, model.driver().vertices.size());
    if (wrong.empty()) return Success{};
    return Error{ErrorCode::mismatch, path.string() + ": not written: " + wrong + "."};
}

} // namespace

Status write_model(const Model& model, const PoseSequence& poses, const std::filesystem::path& path,
                   const RunContext& context) {
    if (context.is_cancelled()) return cancelled_error();
    if (const Status fits = check_fits(poses, model, path); !fits) return fits.error();
    context.report("write", 0);
    try {
        SectionWriter out;
        write_sections(out, model, poses);
        Status status = write_file(path, out.finish());
        context.report("write", 1);
        return status;
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, path.string() + ": not enough memory for the file's bytes."};
    }
}

Result<CodingReport> write_coded_model(const Model& model, const PoseSequence& poses, const MeshCodeOptions& options,
                                       const std::filesystem::path& path, const RunContext& context) {
    if (const Status fits = check_fits(poses, model, path); !fits) return fits.error();
    context.report("code", 0);
    try {
        Result<CodedModel> coded = code_model(model, poses, options, context);
        if (!coded) return coded.error();
        context.report("code", 1);
        SectionWriter out;
        write_mesh_sections(out, coded->mesh.rest, false, false);
        if (options.keep_order) out.array("mesh.ord", model.source_order);
        write_model_code(out, *coded);
        write_pictures(out, coded->mesh.rest.embedded_materials); // a stream's shape is there first
        write_end_of_code(out, *coded);
        const std::vector<std::string_view> file = out.finish();
        const double scalars = double(coded->mesh.rest.scalars.size() * coded->code.vertices * sizeof(float));
        const double mesh = unpacked_bytes(coded->code) + scalars, clips = unpacked_bytes(coded->clip, coded->code);
        if (std::optional<Error> error = too_plain_to_pack(std::max(mesh, clips), file)) return *error;
        if (const Status status = write_file(path, file); !status) return status.error();
        return coded->report;
    } catch (const Error& error) {
        return error;
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, path.string() + ": not enough memory for the file's bytes."};
    }
}

Result<LosslessReport> write_lossless_model(const Model& model, const PoseSequence& poses,
                                            const std::filesystem::path& path, const RunContext& context) {
    if (const Status fits = check_fits(poses, model, path); !fits) return fits.error();
    context.report("code", 0);
    try {
        SectionWriter plain;
        write_sections(plain, model, poses);
        const std::vector<FileSection>& sections = plain.sections();
        std::map<std::pair<std::string, std::uint32_t>, std::size_t> number;
        for (std::size_t k = 0; k < sections.size(); ++k)
            number.try_emplace({name_of(sections[k]), sections[k].index}, k);
        const SectionGuide guide([&](std::string_view name, std::uint32_t index) {
            const auto found = number.find({std::string(name), index});
            return found == number.end() ? std::string() : std::string(plain.section_bytes(found->second));
        });
        std::vector<std::string> codes(sections.size());
        constexpr std::size_t kAtOnce = 16; // between two reports
        for (std::size_t first = 0; first < codes.size(); first += kAtOnce) {
            if (context.is_cancelled()) return cancelled_error();
            parallel_for(context, std::min(kAtOnce, codes.size() - first), 1, [&](std::size_t begin, std::size_t end) {
                for (std::size_t k = first + begin; k < first + end; ++k)
                    codes[k] = encode_section(sections[k], plain.section_bytes(k), guide);
            });
            context.report("code", double(std::min(first + kAtOnce, codes.size())) / double(codes.size()));
        }
        SectionWriter out;
        out.array("ll.tab", sections);
        std::vector<std::pair<std::string, std::uint64_t>> sizes;
        for (std::uint32_t k = 0; k < codes.size(); ++k) {
            out.bytes("ll.sec", codes[k], k);
            sizes.emplace_back(name_of(sections[k]), codes[k].size());
        }
        const std::vector<std::string_view> file = out.finish();
        double unpacked = 0;
        for (const FileSection& section : sections) unpacked += double(section.count) * section.item_size;
        if (std::optional<Error> error = too_plain_to_pack(unpacked, file)) return *error;
        if (const Status status = write_file(path, file); !status) return status.error();
        std::uint64_t plain_bytes = 0;
        for (const std::string_view piece : plain.finish()) plain_bytes += piece.size();
        return LosslessReport{lossless_parts(sizes), plain_bytes};
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, path.string() + ": not enough memory for the file's bytes."};
    }
}

Status write_model(const Model& model, const std::filesystem::path& path, const RunContext& context) {
    return write_model(model, PoseSequence(), path, context);
}

Result<Model> read_model(const FileReader& file, const std::string& name, const RunContext& context) {
    context.report("read", 0);
    Result<Model> model =
        guarded(file, name, context, [&](const FileReader& from) { return read_sections(from, context); });
    context.report("read", 1);
    return model;
}

Result<Model> read_model(std::string_view bytes, const std::string& name, const RunContext& context) {
    return read_model(FileReader(bytes), name, context);
}

Result<Model> read_model(const std::filesystem::path& path, const RunContext& context) {
    const Result<FileReader> file = FileReader::open(path);
    if (!file) return file.error();
    return read_model(*file, path.string(), context);
}

Result<PoseSequence> read_poses(const FileReader& file, const std::string& name, const RunContext& context) {
    return guarded(file, name, context, read_pose_sections);
}

Result<PoseSequence> read_poses(std::string_view bytes, const std::string& name, const RunContext& context) {
    return read_poses(FileReader(bytes), name, context);
}

Result<PoseSequence> read_poses(const std::filesystem::path& path, const RunContext& context) {
    const Result<FileReader> file = FileReader::open(path);
    if (!file) return file.error();
    return read_poses(*file, path.string(), context);
}

Result<ModelOutline> read_model_outline(const FileReader& file, const std::string& name, const RunContext& context) {
    return guarded(file, name, context, read_outline_sections);
}

Result<Mesh> read_model_level(const FileReader& file, unsigned level, const std::string& name,
                              const RunContext& context) {
    return guarded(file, name, context,
                   [&](const FileReader& from) { return read_level_sections(from, level, context); });
}

} // namespace filigree
