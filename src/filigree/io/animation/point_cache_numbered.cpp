// Numbered meshes: NAME_0001.ply, NAME_0002.ply and so on, a mesh a frame.
#include "filigree/blend/pose_mesh.h"
#include "filigree/file.h"
#include "filigree/io/animation/point_cache.h"
#include "filigree/io/animation/point_cache_formats.h"
#include "filigree/io/animation/pose_match.h"
#include "filigree/io/system/file_batch.h"
#include "filigree/io/system/file_error.h"
#include "filigree/io/system/new_folders.h"
#include "filigree/io/system/numbered_name.h"
#include "filigree/io/system/text_scanner.h"

#include <algorithm>
#include <map>

namespace filigree {

namespace {

namespace fs = std::filesystem;

/// Files by number; those of one NumberedName.
using Numbers = std::map<std::uint64_t, fs::path>;

Error cannot_list(const fs::path& folder) {
    return {ErrorCode::not_found, folder.string() + ": cannot be read: there is no such folder, or it is closed."};
}

/// Names of the files in a folder, sorted.
Result<std::vector<std::string>> file_names_in(const fs::path& folder) {
    std::vector<std::string> names;
    std::error_code failed;
    fs::directory_iterator entry(folder.empty() ? "." : folder, failed);
    if (failed) return cannot_list(folder);
    while (entry != fs::directory_iterator()) {
        names.push_back(entry->path().filename().string());
        entry.increment(failed); // which makes it the end when it fails
        if (failed) return cannot_list(folder);
    }
    std::sort(names.begin(), names.end());
    return names;
}

/// The one name that numbered meshes in a folder share.
Result<NumberedName> only_name_in(const fs::path& folder, const std::vector<std::string>& files) {
    std::optional<NumberedName> found;
    for (const std::string& file : files) {
        if (file.starts_with('.') || !mesh_format(path_of(file))) continue;
        const std::string stem = path_of(file).stem().string();
        const std::size_t digits = std::size_t(std::find_if_not(stem.rbegin(), stem.rend(), is_digit) - stem.rbegin());
        if (digits == 0) continue; // a mesh that lies there too, such as the driver at rest
        const NumberedName name{folder, stem.substr(0, stem.size() - digits), path_of(file).extension().string()};
        if (found && (found->before != name.before || found->after != name.after))
            return Error{ErrorCode::usage, folder.string() + ": holds " + found->before + "####" + found->after +
                                               " and " + name.before + "####" + name.after +
                                               "; name one of them so, in place of the folder."};
        found = name;
    }
    if (!found)
        return Error{ErrorCode::not_found,
                     folder.string() + ": holds no numbered meshes, such as moved_0001.ply, moved_0002.ply."};
    return *found;
}

/// The sequence's files in order. Errors: two of one number, a gap.
Result<std::vector<fs::path>> numbered_files(const NumberedName& name, const std::vector<std::string>& names) {
    Numbers files;
    for (const std::string& file : names) {
        const auto number = name.number_of(file);
        if (!number) continue;
        const auto [known, is_new] = files.emplace(*number, name.folder / path_of(file));
        if (!is_new)
            return Error{ErrorCode::usage, (name.folder / path_of(file)).string() + ": has the number of " +
                                               known->second.string() + "; keep one of the two."};
    }
    if (files.empty())
        return Error{ErrorCode::not_found, name.file(1).string() + ": there is no such file, nor of another number."};
    std::vector<fs::path> sequence;
    for (const auto& [number, file] : files) {
        if (number != files.begin()->first + sequence.size())
            return Error{ErrorCode::not_found, name.file(files.begin()->first + sequence.size()).string() +
                                                   ": is missing, and its sequence goes on to number " +
                                                   std::to_string(files.rbegin()->first) + "."};
        sequence.push_back(file);
    }
    return sequence;
}

/// What the meshes of a sequence have in common, which its first says.
struct SequenceKind {
    std::size_t points = 0; ///< of a file
    std::optional<bool> has_gradients;
    std::optional<VertexMatch> match; ///< where vertices were split on the way
};

Result<Mesh> read_sequence_mesh(const fs::path& file, const RunContext& context) {
    std::error_code ignored;
    const fs::file_status status = fs::status(file, ignored); // a pipe would wait for its writer
    if (fs::exists(status) && !fs::is_regular_file(status))
        return Error{ErrorCode::unsupported, file.string() + ": is a pipe, a device or a folder, and the meshes of a "
                                                             "sequence are files; take it out of the sequence."};
    Result<MeshFile> read = read_mesh(file, context);
    if (!read) return read.error();
    return std::move(read->mesh);
}

Error other_points(const fs::path& file, std::size_t has, std::size_t wanted) {
    return {ErrorCode::mismatch, file.string() + ": has " + std::to_string(has) +
                                     " vertices, and what it should move has " + std::to_string(wanted) +
                                     "; it is of another mesh, or vertices were merged or split."};
}

/// A moved mesh as a pose of so many points.
Result<Pose> read_pose(const fs::path& file, std::size_t points, const Vec3d& origin, const SequenceKind& kind,
                       const RunContext& context) {
    const Result<Mesh> mesh = read_sequence_mesh(file, context);
    if (!mesh) return mesh.error();
    if (mesh->vertex_count() != kind.points) return other_points(file, mesh->vertex_count(), points);
    Pose pose = pose_of_mesh(*mesh, origin);
    if (kind.has_gradients && *kind.has_gradients == pose.gradients.empty())
        return Error{ErrorCode::mismatch, file.string() + ": has " + (*kind.has_gradients ? "no " : "") +
                                              "gradients (f00 to f22), unlike the first of its sequence."};
    if (!kind.match) return pose;
    Pose matched;
    matched.positions.resize(points);
    if (Status done = kind.match->apply(pose.positions, matched.positions, file); !done) return done.error();
    if (!pose.gradients.empty())
        for (const Index source : kind.match->source) matched.gradients.push_back(pose.gradients[source]);
    return matched;
}

/// What the first mesh of a sequence says of all. Vertices that were split are matched by their places in it.
Result<SequenceKind> look_at_first(const fs::path& file, std::size_t points, const Vec3d& origin,
                                   const PoseFileOptions& options, const RunContext& context) {
    const Result<Mesh> mesh = read_sequence_mesh(file, context);
    if (!mesh) return mesh.error();
    Pose pose = pose_of_mesh(*mesh, origin);
    SequenceKind kind{mesh->vertex_count(), !pose.gradients.empty(), {}};
    if (kind.points == points) return kind;
    if (options.up) turn_up(pose.positions, origin, *options.up);
    if (options.rest.size() == points) kind.match = match_by_place(options.rest, pose.positions);
    if (!kind.match) return other_points(file, kind.points, points);
    if (options.warnings)
        options.warnings->push_back(file.string() + ": its " + std::to_string(kind.points) +
                                    " vertices were split, and were matched to the driver's " + std::to_string(points) +
                                    " by their places in this first mesh.");
    return kind;
}

/// Refuses a sequence of which a killed process has put only some files into their places.
Status check_placed(const NumberedName& name) {
    std::size_t waiting = 0;
    fs::path aside;
    for (const fs::path& file : unplaced_files(name.folder))
        if (name.number_of(file.filename().string())) ++waiting, aside = file.parent_path();
    if (waiting == 0) return Success{};
    return Error{ErrorCode::bad_file, name.file(1).string() + ": an interrupted program has not put " +
                                          std::to_string(waiting) +
                                          " files of its sequence into their places; write the sequence again, or "
                                          "move them there from " +
                                          aside.string() + "."};
}

void add_new(std::vector<std::string>& warnings, const std::vector<std::string>& more) {
    for (const std::string& warning : more)
        if (std::find(warnings.begin(), warnings.end(), warning) == warnings.end()) warnings.push_back(warning);
}

/// Says that a longer sequence of this name was there before, whose end would be read as this one's.
void warn_of_leftovers(const NumberedName& name, std::size_t frames, std::vector<std::string>& warnings) {
    const Result<std::vector<std::string>> names = file_names_in(name.folder);
    if (!names) return;
    const auto others = std::count_if(names->begin(), names->end(), [&](const std::string& file) {
        const auto number = name.number_of(file);
        return number && (*number == 0 || *number > frames);
    });
    if (others > 0)
        warnings.push_back(name.folder.string() + ": holds " + std::to_string(others) + " more of " + name.before +
                           "####" + name.after + " from before; a reader would take them for a part of this sequence.");
}

} // namespace

std::vector<fs::path> animation_files(const fs::path& path) {
    std::error_code ignored;
    const std::optional<NumberedName> name = numbered_name(path);
    if (!name && !fs::is_directory(path, ignored)) return {path};
    const fs::path folder = name ? name->folder : path;
    std::vector<fs::path> files;
    const Result<std::vector<std::string>> names = file_names_in(folder);
    for (const std::string& file : names ? *names : std::vector<std::string>{})
        if (!name || name->number_of(file)) files.push_back(folder / path_of(file));
    return files;
}

Result<FrameSource<Pose>> open_numbered(const fs::path& path, std::size_t points, const Vec3d& origin,
                                        const PoseFileOptions& options, const RunContext& context) {
    std::optional<NumberedName> name = numbered_name(path);
    const Result<std::vector<std::string>> names = file_names_in(name ? name->folder : path);
    if (!names) return names.error();
    if (!name) {
        Result<NumberedName> only = only_name_in(path, *names);
        if (!only) return only.error();
        name = std::move(*only);
    }
    if (Status placed = check_placed(*name); !placed) return placed.error();
    Result<std::vector<fs::path>> files = numbered_files(*name, *names);
    if (!files) return files.error();
    RunContext silent = context; // whoever fetches tells of frames
    silent.progress = nullptr;
    Result<SequenceKind> kind = look_at_first(files->front(), points, origin, options, silent);
    if (!kind) return kind.error();
    const std::size_t frames = files->size();
    return FrameSource<Pose>{frames, options.frames_per_second.value_or(kUnsaidRate),
                             [files = std::move(*files), points, origin, kind = *std::move(kind), silent](
                                 std::size_t frame) { return read_pose(files[frame], points, origin, kind, silent); }};
}

namespace {

/// What write_numbered_meshes does in a folder that is there.
class NumberedWriter {
public:
    explicit NumberedWriter(const RunContext& context) : context_(context), silent_(context) {
        silent_.progress = nullptr; // the bar tells of frames
    }

    Status write(std::span<const NumberedMeshes> parts, const fs::path& folder) {
        const std::size_t frames = parts.front().meshes.frames;
        Result<FileBatch> files = FileBatch::create(folder);
        if (!files) return files.error();
        for (std::size_t frame = 0; frame < frames; ++frame) {
            context_.report("writing", double(frame) / double(frames));
            for (const NumberedMeshes& part : parts) {
                if (context_.is_cancelled()) return cancelled_error();
                if (Status written = write_frame(part, frame, *files); !written) return written;
            }
        }
        if (context_.is_cancelled()) return cancelled_error();
        return files->finish();
    }
    std::vector<std::string>& warnings() { return warnings_; }

private:
    const RunContext& context_;
    RunContext silent_;
    std::vector<std::string> warnings_;

    Status write_frame(const NumberedMeshes& part, std::size_t frame, const FileBatch& files) {
        const fs::path target = part.name.file(frame + 1), file = files.path(target.filename().string());
        if (Status free = files.check_place(target.filename().string()); !free) return free;
        Result<Mesh> mesh = part.meshes.frame(frame);
        if (!mesh) return mesh.error();
        const Result<MeshFormat> format = mesh_format(target);
        const bool is_obj = format && *format == MeshFormat::obj;
        if (is_obj && !mesh->embedded_materials.empty()) { // a library and its pictures for every frame, else
            mesh->embedded_materials.clear();
            add_new(warnings_, {"OBJ files of a sequence do not have embedded materials; left out."});
        }
        const auto written = write_mesh(*mesh, file, {}, silent_);
        if (!written) return renamed(written.error(), file, target);
        add_new(warnings_, *written);
        return Success{};
    }
};

} // namespace

Result<std::vector<std::string>> write_numbered_meshes(const FrameSource<Mesh>& meshes, const fs::path& path,
                                                       const RunContext& context) {
    std::optional<NumberedName> name = numbered_name(path);
    if (!name) {
        const fs::path folder = path.has_filename() ? path : path.parent_path();
        name = NumberedName{folder, folder.filename().string() + "_", ".ply"};
    }
    const NumberedMeshes only{*name, meshes};
    return write_numbered_meshes(std::span(&only, 1), context);
}

Result<std::vector<std::string>> write_numbered_meshes(std::span<const NumberedMeshes> parts,
                                                       const RunContext& context) {
    const fs::path& named = parts.front().name.folder;
    const fs::path folder = named.empty() ? fs::path(".") : named;
    const NewFolders folders(folder);
    if (!folders.are_there()) return cannot_write(folder, "the folder cannot be made");
    NumberedWriter writer(context);
    if (Status written = writer.write(parts, folder); !written) {
        folders.remove();
        return written.error();
    }
    context.report("writing", 1);
    for (const NumberedMeshes& part : parts) warn_of_leftovers(part.name, part.meshes.frames, writer.warnings());
    return writer.warnings();
}

} // namespace filigree
