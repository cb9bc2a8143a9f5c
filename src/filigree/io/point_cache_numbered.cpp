// Numbered meshes: NAME_0001.ply, NAME_0002.ply and so on, a mesh a frame.
#include "filigree/io/mesh_file.h"
#include "filigree/io/new_folders.h"
#include "filigree/io/point_cache_formats.h"

#include <algorithm>
#include <charconv>
#include <map>

#include <sys/stat.h>
#include <unistd.h>

namespace filigree {

namespace {

namespace fs = std::filesystem;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Files by number; those of one NumberedName.
using Numbers = std::map<std::uint64_t, fs::path>;

/// The number in a file's name, if it is of that name.
std::optional<std::uint64_t> number_of(const std::string& file, const NumberedName& name) {
    if (file.size() <= name.before.size() + name.after.size() || !file.starts_with(name.before) ||
        !file.ends_with(name.after))
        return {};
    const char* const first = file.data() + name.before.size();
    const char* const last = file.data() + file.size() - name.after.size();
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(first, last, number);
    if (error != std::errc() || end != last) return {};
    return number;
}

Error cannot_list(const fs::path& folder) {
    return {ErrorCode::not_found, folder.string() + ": cannot be read: there is no such folder, or it is closed."};
}

/// Names of the files in a folder, sorted.
Result<std::vector<std::string>> names_in(const fs::path& folder) {
    std::vector<std::string> names;
    std::error_code failed;
    fs::directory_iterator entry(folder.empty() ? "." : folder, failed);
    if (failed) return cannot_list(folder);
    for (; entry != fs::directory_iterator(); entry.increment(failed)) {
        if (failed) return cannot_list(folder);
        names.push_back(entry->path().filename().string());
    }
    std::sort(names.begin(), names.end());
    return names;
}

/// The one name that numbered meshes in a folder share.
Result<NumberedName> only_name_in(const fs::path& folder, const std::vector<std::string>& files) {
    std::optional<NumberedName> found;
    for (const std::string& file : files) {
        if (file.starts_with('.') || !mesh_format(file)) continue;
        const std::string stem = fs::path(file).stem().string();
        const std::size_t digits = std::size_t(std::find_if_not(stem.rbegin(), stem.rend(), is_digit) - stem.rbegin());
        if (digits == 0) continue; // a mesh that lies there too, such as the driver at rest
        const NumberedName name{folder, stem.substr(0, stem.size() - digits), fs::path(file).extension().string()};
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
        const auto number = number_of(file, name);
        if (!number) continue;
        const auto [known, is_new] = files.emplace(*number, name.folder / file);
        if (!is_new)
            return Error{ErrorCode::usage, (name.folder / file).string() + ": has the number of " +
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

/// A moved mesh as a pose. has_gradients: as the first of its sequence, where that is known.
Result<Pose> read_pose(const fs::path& file, std::size_t points, const Vec3d& origin, std::optional<bool> has_gradients,
                       const RunContext& context) {
    std::error_code ignored;
    const fs::file_status status = fs::status(file, ignored); // a pipe would wait for its writer
    if (fs::exists(status) && !fs::is_regular_file(status))
        return Error{ErrorCode::unsupported, file.string() + ": is a pipe, a device or a folder, and the meshes of a "
                                                             "sequence are files; take it out of the sequence."};
    const Result<MeshFile> read = read_mesh(file, context);
    if (!read) return read.error();
    if (read->mesh.vertex_count() != points)
        return Error{ErrorCode::mismatch, file.string() + ": has " + std::to_string(read->mesh.vertex_count()) +
                                              " vertices, and what it should move has " + std::to_string(points) +
                                              "; it is of another mesh, or vertices were merged or split."};
    Pose pose = pose_of_mesh(read->mesh, origin);
    if (has_gradients && *has_gradients == pose.gradients.empty())
        return Error{ErrorCode::mismatch, file.string() + ": has " + (*has_gradients ? "no " : "") +
                                              "gradients (f00 to f22), unlike the first of its sequence."};
    return pose;
}

/// A folder beside files to come, which goes with all that is left in it.
class TemporaryFolder {
public:
    explicit TemporaryFolder(const fs::path& in)
        : path_(in / (".filigree-" + std::to_string(::getpid()) + "-frames.tmp")) {
        std::error_code ignored;
        fs::remove_all(path_, ignored); // left by a killed process with our number
        is_there_ = fs::create_directory(path_, ignored);
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        if (is_there_) fs::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    bool is_there() const { return is_there_; }
    const fs::path& path() const { return path_; }

private:
    fs::path path_;
    bool is_there_ = false;
};

Error cannot_write(const fs::path& path, const std::string& cause) {
    return {ErrorCode::unwritable, path.string() + ": cannot be written: " + cause + "."};
}

/// Whether a file can be put there. What a link leads to would not be replaced, so links are refused.
Status check_target(const fs::path& target) {
    struct stat status {};
    if (::lstat(target.c_str(), &status) != 0) return Success{};
    if (S_ISDIR(status.st_mode)) return cannot_write(target, "it is a folder");
    if (S_ISLNK(status.st_mode))
        return cannot_write(target, "it is a symbolic link; remove it, or choose another name");
    if (!S_ISREG(status.st_mode)) return cannot_write(target, "it is a pipe or a device");
    if (::access(target.c_str(), W_OK) != 0) return cannot_write(target, "permission is denied");
    return Success{};
}

/// Puts files in the places of others, all or none.
class Replacement {
public:
    /// aside: a folder for what was there before.
    explicit Replacement(fs::path aside) : aside_(std::move(aside)) {}
    ~Replacement() {
        std::error_code ignored;
        for (auto place = replaced_.rbegin(); place != replaced_.rend() && !is_kept_; ++place)
            if (place->before.empty())
                fs::remove(place->target, ignored);
            else
                fs::rename(place->before, place->target, ignored);
    }
    Replacement(const Replacement&) = delete;
    Replacement& operator=(const Replacement&) = delete;

    Status replace(const fs::path& file, const fs::path& target) {
        if (Status free = check_target(target); !free) return free;
        std::error_code failed;
        Place place{target, {}};
        struct stat status {};
        if (::stat(target.c_str(), &status) == 0) {
            ::chmod(file.c_str(), status.st_mode & 07777); // best effort, as for some mounts
            place.before = aside_ / ("before-" + std::to_string(replaced_.size()));
            fs::create_hard_link(target, place.before, failed); // the target is never away
            if (failed) fs::rename(target, place.before, failed);
            if (failed) return cannot_write(target, "it cannot be replaced");
        }
        replaced_.push_back(std::move(place));
        fs::rename(file, target, failed);
        if (failed) return cannot_write(target, "it cannot be replaced");
        return Success{};
    }
    void keep() { is_kept_ = true; }

private:
    struct Place {
        fs::path target, before; ///< before: empty where nothing was
    };
    fs::path aside_;
    std::vector<Place> replaced_;
    bool is_kept_ = false;
};

void add_new(std::vector<std::string>& warnings, const std::vector<std::string>& more) {
    for (const std::string& warning : more)
        if (std::find(warnings.begin(), warnings.end(), warning) == warnings.end()) warnings.push_back(warning);
}

/// Says that a longer sequence of this name was there before, whose end would be read as this one's.
void warn_of_leftovers(const NumberedName& name, std::size_t frames, std::vector<std::string>& warnings) {
    const Result<std::vector<std::string>> names = names_in(name.folder);
    if (!names) return;
    const auto others = std::count_if(names->begin(), names->end(), [&](const std::string& file) {
        const auto number = number_of(file, name);
        return number && (*number == 0 || *number > frames);
    });
    if (others > 0)
        warnings.push_back(name.folder.string() + ": holds " + std::to_string(others) + " more of " + name.before +
                           "####" + name.after + " from before; a reader would take them for a part of this sequence.");
}

} // namespace

fs::path NumberedName::file(std::size_t number) const {
    std::string text = std::to_string(number);
    if (text.size() < digits) text.insert(0, digits - text.size(), '0');
    return folder / (before + text + after);
}

std::optional<NumberedName> numbered_name(const fs::path& path) {
    const std::string name = path.filename().string();
    const auto around = [&](std::size_t begin, std::size_t end, std::size_t digits) {
        return NumberedName{path.parent_path(), name.substr(0, begin), name.substr(end), digits};
    };
    if (const std::size_t last = name.rfind('#'); last != std::string::npos) {
        const std::size_t before = name.find_last_not_of('#', last);
        const std::size_t begin = before == std::string::npos ? 0 : before + 1;
        return around(begin, last + 1, last + 1 - begin);
    }
    const std::size_t percent = name.find('%');
    if (percent == std::string::npos) return {};
    std::size_t end = percent + 1;
    while (end < name.size() && is_digit(name[end])) ++end;
    if (end == name.size() || name[end] != 'd') return {};
    unsigned digits = 1; // "%d"
    constexpr unsigned kMostDigits = 20;
    std::from_chars(name.data() + percent + 1, name.data() + end, digits);
    if (digits > kMostDigits) return {};
    return around(percent, end + 1, digits);
}

std::vector<fs::path> animation_files(const fs::path& path) {
    std::error_code ignored;
    const std::optional<NumberedName> name = numbered_name(path);
    if (!name && !fs::is_directory(path, ignored)) return {path};
    const fs::path folder = name ? name->folder : path;
    std::vector<fs::path> files;
    const Result<std::vector<std::string>> names = names_in(folder);
    for (const std::string& file : names ? *names : std::vector<std::string>{})
        if (!name || number_of(file, *name)) files.push_back(folder / file);
    return files;
}

Result<PoseStream> open_numbered(const fs::path& path, std::size_t points, const Vec3d& origin,
                                 const PoseFileOptions& options, const RunContext& context) {
    std::optional<NumberedName> name = numbered_name(path);
    const Result<std::vector<std::string>> names = names_in(name ? name->folder : path);
    if (!names) return names.error();
    if (!name) {
        Result<NumberedName> only = only_name_in(path, *names);
        if (!only) return only.error();
        name = std::move(*only);
    }
    Result<std::vector<fs::path>> files = numbered_files(*name, *names);
    if (!files) return files.error();
    RunContext silent = context; // whoever fetches tells of frames
    silent.progress = nullptr;
    const Result<Pose> first = read_pose(files->front(), points, origin, {}, silent);
    if (!first) return first.error();
    const std::size_t frames = files->size();
    return PoseStream{
        frames, options.frames_per_second.value_or(kUnsaidRate),
        [files = std::move(*files), points, origin, has_gradients = !first->gradients.empty(),
         silent](std::size_t frame) { return read_pose(files[frame], points, origin, has_gradients, silent); }};
}

Result<std::vector<std::string>> write_numbered_meshes(std::size_t frames,
                                                       const std::function<Result<Mesh>(std::size_t frame)>& mesh,
                                                       const fs::path& path, const RunContext& context) {
    std::optional<NumberedName> name = numbered_name(path);
    if (!name) {
        const fs::path folder = path.has_filename() ? path : path.parent_path();
        name = NumberedName{folder, folder.filename().string() + "_", ".ply"};
    }
    const fs::path folder = name->folder.empty() ? fs::path(".") : name->folder;
    const NewFolders folders(folder);
    if (!folders.are_there()) return cannot_write(folder, "the folder cannot be made");
    std::vector<std::string> warnings;
    RunContext silent = context; // the bar tells of frames
    silent.progress = nullptr;
    const Result<MeshFormat> format = mesh_format(name->file(1));
    const bool is_obj = format && *format == MeshFormat::obj;
    const auto write_all = [&]() -> Status {
        const TemporaryFolder temporary(folder);
        if (!temporary.is_there()) return cannot_write(folder, "nothing can be made in the folder");
        const auto temporary_file = [&](std::size_t number) {
            return temporary.path() / (std::to_string(number) + name->after);
        };
        for (std::size_t frame = 0; frame < frames; ++frame) {
            context.report("writing", double(frame) / double(frames));
            if (context.is_cancelled()) return cancelled_error();
            if (Status free = check_target(name->file(frame + 1)); !free) return free;
            Result<Mesh> moved = mesh(frame);
            if (!moved) return moved.error();
            if (is_obj && !moved->embedded_materials.empty()) { // a library and its pictures for every frame, else
                moved->embedded_materials.clear();
                add_new(warnings, {"OBJ files of a sequence do not have embedded materials; left out."});
            }
            if (const std::string wrong = check_mesh(*moved); !wrong.empty())
                return Error{ErrorCode::unsuitable, name->file(frame + 1).string() +
                                                        ": not written: it is beyond what numbers can hold (" + wrong +
                                                        "); deform less."};
            const auto written = write_mesh(*moved, temporary_file(frame + 1), {}, silent);
            if (!written) return written.error();
            add_new(warnings, *written);
        }
        if (context.is_cancelled()) return cancelled_error();
        Replacement replacement(temporary.path());
        for (std::size_t number = 1; number <= frames; ++number)
            if (Status done = replacement.replace(temporary_file(number), name->file(number)); !done) return done;
        replacement.keep();
        return Success{};
    };
    const Status written = write_all();
    if (!written) {
        folders.remove();
        return written.error();
    }
    context.report("writing", 1);
    warn_of_leftovers(*name, frames, warnings);
    return warnings;
}

} // namespace filigree
