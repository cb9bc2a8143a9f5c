#include "filigree/io/model/model_file.h"

#include "filigree/blend/blend_code.h"
#include "filigree/io/model/mesh_sections.h"
#include "filigree/io/model/model_code.h"
#include "filigree/io/model/model_records.h"
#include "filigree/io/model/model_sections.h"
#include "filigree/io/model/runtime_code.h"
#include "filigree/io/system/file.h"

#include "filigree/core/parallel_for.h"

#include <cmath>
#include <new>

namespace filigree {

namespace {

constexpr std::uint32_t kFloatRecords = 0, kInt16Records = 1; // bl.prec

/// Throws where the records are not floats. Programs before 0.1.0 wrote int16 records, too.
void require_float_records(const SectionReader& in) {
    const auto kind = in.value<std::uint32_t>("bl.prec");
    if (kind == kInt16Records)
        throw FileDamage{"has int16 records, which are no longer read",
                         "strip the mesh again, and pack it for the runtime to make it small", ErrorCode::unsuitable};
    if (kind != kFloatRecords) throw FileDamage{"has records of a kind that is not known"};
}

void write_blend(SectionWriter& out, const Model& model, const BlendDetail& detail) {
    out.value("bl.prec", kFloatRecords);
    out.array("bl.cell", detail.cells);
    write_chunk_records(out, detail, model.mesh.positions);
    out.array("bl.gap", detail.across_gap);
    out.array("bl.away", detail.facing_away);
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
        const auto is_finite = [](const auto& value) { return value.allFinite(); };
        if (!std::all_of(pose.positions.begin(), pose.positions.end(), is_finite) ||
            !std::all_of(pose.gradients.begin(), pose.gradients.end(), is_finite))
            return name + " has a number that is not finite";
    }
    return "";
}

/// Whether the mesh's last vertices are those of a driver that was made elsewhere (of a file that is not coded).
bool has_driver_behind(const SectionReader& in) { return !in.array<std::uint32_t>("mesh.drv").empty(); }

BlendDetail read_blend(const SectionReader& in) {
    BlendDetail detail;
    detail.cells = in.array<Triangle>("bl.cell");
    const auto vertices = in.value<std::uint64_t>("mesh.num");
    if (vertices >= kNoIndex || chunk_count(vertices) != in.count("bl.run").first)
        throw FileDamage{"is inconsistent: there are not as many chunks as its vertices fill"};
    read_chunk_records(in, 0, chunk_count(vertices), vertices, 0, detail);
    detail.across_gap = in.array<Index>("bl.gap");
    detail.facing_away = in.array<Index>("bl.away");
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

Model read_sections(const FileReader& file, const std::string& name, const RunContext& context) {
    const SectionReader in(file);
    if (is_coded(in)) {
        Model model = read_model_code(in, read_mesh_sections(in), context);
        model.source_order = in.array<Index>("mesh.ord");
        if (const std::string wrong = check_model(model); !wrong.empty()) throw FileDamage{"is inconsistent: " + wrong};
        return model;
    }
    if (has_reference_code(in))
        throw Error{ErrorCode::unsuitable, name + ": has the report's reference code, which this cannot work with; "
                                                  "strip its mesh with the blend code."};
    require_float_records(in);
    Model model;
    model.mesh = read_mesh_sections(in);
    model.source_order = in.array<Index>("mesh.ord");
    model.driver_is_behind = has_driver_behind(in);
    model.levels = read_level_sections(in);
    model.detail = read_blend(in);
    if (in.value<std::uint64_t>("mesh.num") != model.mesh.vertex_count())
        throw FileDamage{"does not have as many positions as it says"};
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
PackedBytes lossless_parts(const std::vector<std::pair<std::string, std::uint64_t>>& sizes) {
    PackedBytes parts;
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
        else if (is_one_of({"lev", "drv.", "bl.cell"}))
            parts.driver += bytes;
        else if (is_one_of({"bl.", "ck.", "code"}))
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
    if (has_reference_code(in)) {
        outline.references = in.value<std::array<std::uint32_t, 2>>("rf.par")[1];
        outline.patches = in.item_count<std::array<Index, 4>>("rf.base");
    } else {
        require_float_records(in);
        outline.across_gap = in.array<Index>("bl.gap");
        outline.facing_away = in.array<Index>("bl.away");
    }
    if (in.is_decoded()) outline.coding = runtime_coding_of(in);
    read_frames(in, outline);
    outline.bytes = file.size();
    return outline;
}

/// The positions of some vertices, ascending.
std::vector<Vec3f> positions_of(const SectionReader& in, std::span<const Index> vertices) {
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

Mesh read_one_level(const FileReader& file, unsigned k, const std::string& name, const RunContext& context) {
    const SectionReader in(file);
    const std::uint32_t level_count = is_coded(in) ? 1 : in.value<std::uint32_t>("levels");
    if (k > level_count)
        throw Error{ErrorCode::usage, "The model has levels 0 to " + std::to_string(level_count) +
                                          "; there is no level " + std::to_string(k) + "."};
    const bool is_reference = !is_coded(in) && has_reference_code(in);
    if (!is_reference && (is_coded(in) || k == level_count)) return level_mesh(read_sections(file, name, context), k);
    if (k == level_count) {
        Mesh finest = read_mesh_sections(in);
        if (const std::string wrong = check_mesh(finest); !wrong.empty()) throw FileDamage{"is inconsistent: " + wrong};
        return finest;
    }
    if (!is_reference) require_float_records(in);
    const std::vector<Index> vertices = in.array<Index>("lev.vert", k);
    if (!std::is_sorted(vertices.begin(), vertices.end()))
        throw FileDamage{"is inconsistent: a level's vertices do not ascend"};
    Mesh mesh;
    const auto origin = in.value<std::array<double, 3>>("mesh.org");
    mesh.origin = {origin[0], origin[1], origin[2]};
    read_faces(in, "lev", k, mesh.face_offsets, mesh.corners);
    mesh.positions = positions_of(in, vertices);
    const auto per_vertex = [&](const std::string& section) { return in.item_count<Index>(section + ".cor") == 0; };
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

} // namespace

bool is_model_file(std::string_view bytes) {
    return bytes.starts_with(std::string_view(kModelMagic, sizeof kModelMagic));
}

bool is_model_file(const FileReader& file) {
    char first[sizeof kModelMagic];
    return file.size() >= sizeof first && file.read(0, first) && is_model_file(std::string_view(first, sizeof first));
}

namespace {

void write_sections(SectionWriter& out, const Model& model, const PoseSequence& poses) {
    write_mesh_sections(out, model.mesh, true);
    out.array("mesh.ord", model.source_order);
    if (model.driver_is_behind) out.value("mesh.drv", std::uint32_t{1});
    out.value("code", kBlendCode);
    write_level_sections(out, model.levels);
    write_blend(out, model, model.detail);
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

Result<PackReport> pack_model(const Model& model, const PoseSequence& poses, const PackOptions& options,
                              const std::filesystem::path& path, const RunContext& context) {
    if (const Status fits = check_fits(poses, model, path); !fits) return fits.error();
    context.report("code", 0);
    try {
        const bool is_free = !options.records && has_free_weights(model);
        const bool keeps_weights = is_free && !options.surface && !options.keep_order && !options.levels;
        if (options.records || keeps_weights) {
            Result<RuntimeCode> coded = code_for_runtime(model, poses, options, context);
            if (!coded) return coded.error();
            coded->report.has_records = true;
            context.report("code", 1);
            SectionWriter out;
            write_runtime_code(out, *coded);
            const std::vector<std::string_view> file = out.finish();
            if (std::optional<Error> error = too_plain_to_pack(coded->unpacked_bytes, file)) return *error;
            if (const Status status = write_file(path, file); !status) return status.error();
            return coded->report;
        }
        Result<PackedModel> coded = code_model(model, poses, options, context);
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
        coded->report.loses_weights = is_free;
        return coded->report;
    } catch (const Error& error) {
        return error;
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, path.string() + ": not enough memory for the file's bytes."};
    }
}

Result<LosslessPackReport> pack_model_lossless(const Model& model, const PoseSequence& poses,
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
        return LosslessPackReport{lossless_parts(sizes), plain_bytes};
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
        read_guarded(file, name, context, [&](const FileReader& from) { return read_sections(from, name, context); });
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
    return read_guarded(file, name, context, read_pose_sections);
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
    return read_guarded(file, name, context, read_outline_sections);
}

Result<Mesh> read_model_level(const FileReader& file, unsigned level, const std::string& name,
                              const RunContext& context) {
    return read_guarded(file, name, context,
                        [&](const FileReader& from) { return read_one_level(from, level, name, context); });
}

} // namespace filigree
