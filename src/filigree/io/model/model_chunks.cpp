#include "filigree/io/model/model_chunks.h"

#include "filigree/blend/blend_code.h"
#include "filigree/io/animation/point_cache.h"
#include "filigree/io/animation/point_cache_formats.h"
#include "filigree/io/model/model_file.h"
#include "filigree/io/model/model_records.h"
#include "filigree/io/system/extension.h"
#include "filigree/io/system/file.h"

#include <algorithm>
#include <new>
#include <numeric>

namespace filigree {

namespace {

Error no_chunks(const std::string& name, const char* why) {
    return {ErrorCode::unsuitable, name + ": " + why + ", and has no chunks that are restored alone."};
}

/// The driver as a mesh that hangs on itself.
Model model_of_driver(Mesh driver, const BlendDetail& whole) {
    Model model;
    Level& level = model.levels.emplace_back();
    level.vertices.resize(driver.vertex_count());
    std::iota(level.vertices.begin(), level.vertices.end(), Index{0});
    level.face_offsets = driver.face_offsets;
    level.corners = driver.corners;
    BlendDetail detail;
    detail.cells = {whole.cells.front()};
    detail.cell_offsets = {0, static_cast<Index>(driver.vertex_count())};
    detail.order = level.vertices;
    detail.u.assign(driver.vertex_count(), 0);
    detail.v = detail.u;
    model.mesh = std::move(driver);
    model.detail = std::move(detail);
    return model;
}

} // namespace

struct ModelChunks::Content {
    FileReader file;
    std::string name;
    std::optional<SectionReader> sections; ///< of the file
    Model driver;
    BlendDetail shared; ///< what all chunks have: cells
    std::vector<FileBox> boxes;
    std::size_t vertices = 0;     ///< of the mesh
    std::size_t all_vertices = 0; ///< in the file: with those of a driver behind them

    Content(FileReader opened, std::string called) : file(std::move(opened)), name(std::move(called)) {}
    BlendRestorer restorer(std::size_t k, const RunContext& context) const;
};

BlendRestorer ModelChunks::Content::restorer(std::size_t k, const RunContext& context) const {
    // The driver's positions first, then the chunk's: what the restorer takes for the mesh.
    const Index drivers = static_cast<Index>(driver.mesh.vertex_count());
    const std::size_t count = std::min(kChunkVertices, all_vertices - k * kChunkVertices);
    std::vector<Vec3f> positions = driver.mesh.positions;
    BlendDetail detail = shared;
    read_chunk_records(*sections, k, k + 1, all_vertices, drivers, detail);
    for (std::size_t r = 0; r < count; ++r)
        if (!(std::abs(detail.u[r]) <= 1 && std::abs(detail.v[r]) <= 1))
            throw FileDamage{"is inconsistent: a weight is out of range"};
    const std::vector<Vec3f> own = sections->array<Vec3f>("mesh.pos", static_cast<std::uint32_t>(k));
    if (own.size() != count) throw FileDamage{"is inconsistent: a chunk lacks positions"};
    for (const Vec3f& p : own)
        if (!p.allFinite()) throw FileDamage{"is inconsistent: a position is not finite"};
    positions.insert(positions.end(), own.begin(), own.end());
    std::vector<BlendRestorer::Item> items(std::min(count, vertices - k * kChunkVertices));
    for (Index i = 0; i < items.size(); ++i) items[i] = {drivers + i, i};
    return BlendRestorer(detail, positions, driver.driver().vertices, items, {}, context);
}

ModelChunks::ModelChunks(std::unique_ptr<Content> content) : content_(std::move(content)) {}
ModelChunks::ModelChunks(ModelChunks&&) noexcept = default;
ModelChunks& ModelChunks::operator=(ModelChunks&&) noexcept = default;
ModelChunks::~ModelChunks() = default;

const Model& ModelChunks::driver() const { return content_->driver; }
std::size_t ModelChunks::vertex_count() const { return content_->vertices; }
std::size_t ModelChunks::count() const { return chunk_count(content_->vertices); }
std::size_t ModelChunks::first_vertex(std::size_t k) const { return std::min(k * kChunkVertices, content_->vertices); }

Box ModelChunks::box(std::size_t k) const {
    const FileBox& kept = content_->boxes[k];
    Box box;
    for (const std::array<float, 3>& corner : {kept.min, kept.max}) box.extend(Vec3d(corner[0], corner[1], corner[2]));
    return box;
}

Result<ModelChunks> ModelChunks::open(FileReader file, const std::string& name, const RunContext& context) {
    const Result<ModelOutline> outline = read_model_outline(file, name, context);
    if (!outline) return outline.error();
    if (outline->references > 0) return no_chunks(name, "has the reference code");
    if (outline->coding) return no_chunks(name, "is packed in one piece");
    Result<Mesh> driver = read_model_level(file, 0, name, context);
    if (!driver) return driver.error();
    auto content = std::make_unique<Content>(std::move(file), name);
    try {
        const SectionReader& in = content->sections.emplace(content->file);
        content->vertices = outline->levels.back().vertices;
        content->all_vertices = content->vertices + (outline->driver_is_behind ? outline->levels.front().vertices : 0);
        if (content->all_vertices >= kNoIndex || in.count("bl.run").first != chunk_count(content->all_vertices))
            throw FileDamage{"is inconsistent: there are not as many chunks as its vertices fill"};
        content->boxes = in.array<FileBox>("ck.box");
        if (content->boxes.size() != chunk_count(content->all_vertices))
            throw FileDamage{"is inconsistent: there is not one box a chunk"};
        content->shared.cells = in.array<Triangle>("bl.cell");
        if (content->shared.cells.empty()) throw FileDamage{"is inconsistent: it has no cells"};
        for (const Triangle& cell : content->shared.cells)
            for (const Index v : cell)
                if (v >= driver->vertex_count())
                    throw FileDamage{"is inconsistent: a cell names a driver vertex that is not there"};
    } catch (const FileDamage& damage) {
        return error_of(damage, name);
    } catch (const Error& error) {
        return error;
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, name + " does not fit into memory."};
    }
    content->driver = model_of_driver(std::move(*driver), content->shared);
    if (const std::string wrong = check_model(content->driver); !wrong.empty())
        return error_of({"is inconsistent: " + wrong}, name);
    return ModelChunks(std::move(content));
}

Result<BlendRestorer> ModelChunks::restorer(std::size_t k, const RunContext& context) const {
    try {
        return content_->restorer(k, context);
    } catch (const FileDamage& damage) {
        return error_of(damage, content_->name);
    } catch (const Error& error) {
        return error;
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, content_->name + ": a chunk does not fit into memory."};
    }
}

namespace {

/// Driver positions and gradients of some frames.
struct KnownPoses {
    std::size_t first = 0;
    std::vector<Pose> poses;
};

Result<KnownPoses> poses_with_gradients(const Restorer& driver, const FrameSource<Pose>& stream, std::size_t first,
                                        std::size_t last, const RunContext& silent) {
    KnownPoses known{first, {}};
    for (std::size_t frame = first; frame < last; ++frame) {
        if (silent.is_cancelled()) return cancelled_error();
        Result<Pose> pose = stream.frame(frame);
        if (!pose) return pose.error();
        Result<std::vector<Mat3f>> gradients = driver.gradients(*pose, silent);
        if (!gradients) return gradients.error();
        known.poses.push_back({std::move(pose->positions), std::move(*gradients)});
    }
    return known;
}

/// Restores frames first to last - 1, chunk by chunk, into a PC2.
class ChunkRestoration {
public:
    ChunkRestoration(const ModelChunks& model, const FrameSource<Pose>& poses, const std::filesystem::path& path,
                     const RunContext& context)
        : model_(model), poses_(poses), context_(context), silent_(context),
          frames_(animation_, path, model.driver().mesh.origin) {
        silent_.progress = nullptr;
        animation_.rest = &model.driver().mesh; // its origin, and a size to hold lost digits against
        animation_.positions = [this](std::size_t frame, std::span<Vec3f> out) -> Status {
            const Pose& pose = known_.poses[frame - known_.first];
            restorer_->restore(pose.positions, pose.gradients, out, {}, true, silent_);
            return Success{};
        };
    }

    Status write(const RestoreOptions& options, std::size_t first, std::size_t last, const WriteAt& write_at) {
        constexpr std::size_t kKnownBytes = std::size_t{256} << 20;
        const Result<Restorer> driver = Restorer::create(model_.driver(), options, silent_);
        if (!driver) return driver.error();
        const std::size_t pose_bytes = model_.driver().mesh.vertex_count() * (sizeof(Vec3f) + sizeof(Mat3f));
        const std::size_t batch = std::max<std::size_t>(1, kKnownBytes / pose_bytes);
        const double all = double((last - first) * model_.count());
        std::size_t done = 0;
        for (std::size_t begin = first; begin < last; begin += batch) {
            Result<KnownPoses> known =
                poses_with_gradients(*driver, poses_, begin, std::min(last, begin + batch), silent_);
            if (!known) return known.error();
            known_ = std::move(*known);
            for (std::size_t k = 0; k < model_.count(); ++k) {
                if (Status written = write_chunk(k, write_at); !written) return written;
                context_.report("writing", double(done += known_.poses.size()) / all);
            }
        }
        return Success{};
    }
    void warn(std::vector<std::string>& warnings) const { frames_.warn(warnings); }

private:
    Status write_chunk(std::size_t k, const WriteAt& write_at) {
        Result<BlendRestorer> restorer = model_.restorer(k, context_);
        if (!restorer) return restorer.error();
        restorer_.emplace(std::move(*restorer));
        points_.resize(model_.first_vertex(k + 1) - model_.first_vertex(k));
        const std::string_view bytes(reinterpret_cast<const char*>(points_.data()), points_.size() * sizeof(Vec3f));
        for (std::size_t i = 0; i < known_.poses.size(); ++i) {
            if (context_.is_cancelled()) return cancelled_error();
            const std::size_t frame = known_.first + i;
            if (Status fetched = frames_.fetch(frame, points_); !fetched) return fetched;
            const std::uint64_t point = std::uint64_t{frame} * model_.vertex_count() + model_.first_vertex(k);
            if (Status written = write_at(kPc2HeaderBytes + point * sizeof(Vec3f), bytes); !written) return written;
        }
        return Success{};
    }

    const ModelChunks& model_;
    const FrameSource<Pose>& poses_;
    const RunContext& context_;
    RunContext silent_;
    MeshAnimation animation_;
    CheckedFrames frames_;
    KnownPoses known_;
    std::optional<BlendRestorer> restorer_; ///< of the chunk that is written
    std::vector<Vec3f> points_;
};

Status check_chunk_output(const RestoreOptions& options, const std::filesystem::path& path) {
    if (options.level)
        return Error{ErrorCode::usage, "Chunks are of the finest level; a level is restored from the whole model."};
    if (lower_extension(path) != ".pc2")
        return Error{ErrorCode::usage,
                     path.string() + ": chunks are written of .pc2 alone, whose frames all have one size."};
    return Success{};
}

} // namespace

Result<std::vector<std::string>> write_restored_chunks(const ModelChunks& model, const FrameSource<Pose>& poses,
                                                       const RestoreOptions& options, const std::filesystem::path& path,
                                                       const RunContext& context) {
    if (Status sound = check_chunk_output(options, path); !sound) return sound.error();
    if (poses.frames == 0) return Error{ErrorCode::unsuitable, path.string() + ": not written: there are no frames."};
    const Result<std::string> header = pc2_header(poses.frames, model.vertex_count(), path);
    if (!header) return header.error();
    Result<FileWriter> file = FileWriter::create(path);
    if (!file) return file.error();
    const std::uint64_t points = std::uint64_t{poses.frames} * model.vertex_count();
    if (Status reserved = file->reserve(kPc2HeaderBytes + points * sizeof(Vec3f)); !reserved) return reserved.error();
    if (Status written = file->write(*header); !written) return written.error();
    ChunkRestoration restoration(model, poses, path, context);
    const WriteAt write_at = [&](std::uint64_t offset, std::string_view bytes) {
        return file->write_at(offset, bytes);
    };
    if (Status written = restoration.write(options, 0, poses.frames, write_at); !written) return written.error();
    if (context.is_cancelled()) return cancelled_error();
    if (Status finished = file->finish(); !finished) return finished.error();
    std::vector<std::string> warnings;
    restoration.warn(warnings);
    return warnings;
}

Result<ChunkReport> write_restored_chunks(const ModelChunks& model, const FrameSource<Pose>& poses,
                                          const RestoreOptions& options, const std::filesystem::path& path,
                                          const WorkChunk& chunk, const RunContext& context) {
    if (Status sound = check_chunk_output(options, path); !sound) return sound.error();
    return write_shared_pc2(
        poses.frames, model.vertex_count(), path, chunk,
        [&](std::size_t first, std::size_t last, const WriteAt& write_at) {
            return ChunkRestoration(model, poses, path, context).write(options, first, last, write_at);
        });
}

} // namespace filigree
