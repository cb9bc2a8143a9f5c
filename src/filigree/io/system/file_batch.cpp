#include "filigree/io/system/file_batch.h"

#include "filigree/io/system/file.h"
#include "filigree/io/system/file_descriptor.h"
#include "filigree/io/system/file_error.h"
#include "filigree/io/system/temporary_file.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <map>
#include <optional>
#include <string_view>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace filigree {

namespace {

namespace fs = std::filesystem;

// What a batch's folder holds.
constexpr const char* kNew = "new";       // files for their places, under their names
constexpr const char* kOld = "old";       // what was in the places
constexpr const char* kLock = "lock";     // locked while its process lives
constexpr const char* kBefore = "before"; // a Stamp of every place that had a file
constexpr std::string_view kMaking = "-making", kPlacing = "-placing";

bool is_batch(const std::string& name, std::string_view state) {
    return name.starts_with(".filigree-") && name.ends_with(state);
}

/// Names in a folder; none when it cannot be read.
std::vector<std::string> names_in(const fs::path& folder) {
    std::vector<std::string> names;
    std::error_code failed;
    fs::directory_iterator entry(folder.empty() ? "." : folder, failed);
    while (!failed && entry != fs::directory_iterator()) {
        names.push_back(entry->path().filename().string());
        entry.increment(failed);
    }
    std::sort(names.begin(), names.end());
    return names;
}

/// A lock that goes with the process.
class Lock {
public:
    /// flags: for open.
    Lock(const fs::path& file, int flags) : descriptor_(::open(file.c_str(), O_RDWR | O_CLOEXEC | flags, 0600)) {
        if (!descriptor_.is_open()) return;
        struct stat status {};
        const bool is_locked = ::flock(descriptor_.get(), LOCK_EX | LOCK_NB) == 0;
        is_lost_ = !is_locked && errno == EWOULDBLOCK;
        if (::fstat(descriptor_.get(), &status) == 0 && status.st_nlink == 0)
            is_lost_ = true; // removed before we had it
        is_held_ = is_locked && !is_lost_;
    }
    bool is_there() const { return descriptor_.is_open(); }
    bool is_held() const { return is_held_; }
    /// Another has it. (Neither held nor lost: the file system has no locks.)
    bool is_lost() const { return is_lost_; }

private:
    FileDescriptor descriptor_;
    bool is_held_ = false, is_lost_ = false;
};

/// What tells one content of a file from another.
struct Stamp {
    long long seconds = 0, nanoseconds = 0, size = 0;
    bool operator==(const Stamp&) const = default;
};

std::optional<struct stat> status_of(const fs::path& path) {
    struct stat status {};
    if (::lstat(path.c_str(), &status) != 0) return {};
    return status;
}

Stamp stamp_of(const struct stat& status) {
    return {status.st_mtim.tv_sec, status.st_mtim.tv_nsec, static_cast<long long>(status.st_size)};
}

/// Stamps by name as a file's bytes: "seconds nanoseconds size name", each with a zero behind it, as names may hold
/// everything else.
using Stamps = std::map<std::string, Stamp>;

std::string stamp_bytes(const Stamps& stamps) {
    std::string bytes;
    for (const auto& [name, stamp] : stamps)
        bytes += std::to_string(stamp.seconds) + " " + std::to_string(stamp.nanoseconds) + " " +
                 std::to_string(stamp.size) + " " + name + '\0';
    return bytes;
}

Stamps read_stamps(const fs::path& file) {
    Stamps stamps;
    const Result<std::string> bytes = read_file(file);
    if (!bytes) return stamps;
    for (std::size_t at = 0, end = 0; (end = bytes->find('\0', at)) != std::string::npos; at = end + 1) {
        const std::string line = bytes->substr(at, end - at);
        Stamp stamp;
        int used = 0;
        if (std::sscanf(line.c_str(), "%lld %lld %lld%n", &stamp.seconds, &stamp.nanoseconds, &stamp.size, &used) == 3)
            stamps[line.substr(static_cast<std::size_t>(used) + 1)] = stamp; // behind a blank
    }
    return stamps;
}

/// Whether a file can be put there. What a link leads to would not be replaced, so links are refused.
Status check_target(const fs::path& target) {
    const std::optional<struct stat> status = status_of(target);
    if (!status) return Success{};
    if (S_ISDIR(status->st_mode)) return cannot_write(target, "it is a folder");
    if (S_ISLNK(status->st_mode))
        return cannot_write(target, "it is a symbolic link; remove it, or choose another name");
    if (!S_ISREG(status->st_mode)) return cannot_write(target, "it is a pipe or a device");
    if (::access(target.c_str(), W_OK) != 0) return cannot_write(target, "permission is denied");
    return Success{};
}

Error cannot_replace(const fs::path& target, int error_number) {
    return cannot_write(target, "it cannot be replaced: " + cause_of(error_number));
}

void keep_permissions(const fs::path& file, const fs::path& target) {
    if (const auto status = status_of(target))
        ::chmod(file.c_str(), status->st_mode & 07777); // best effort, as for some mounts
}

/// Moves the files that a killed batch had still to place, unless something newer is there.
Status place_rest(const fs::path& batch, const fs::path& folder) {
    const Stamps before = read_stamps(batch / kBefore);
    for (const std::string& name : names_in(batch / kNew)) {
        const fs::path file = batch / kNew / name, target = folder / name;
        if (const auto status = status_of(target)) {
            const auto known = before.find(name);
            if (!S_ISREG(status->st_mode) || known == before.end() || known->second != stamp_of(*status)) continue;
        }
        keep_permissions(file, target);
        if (::rename(file.c_str(), target.c_str()) != 0)
            return Error{ErrorCode::unwritable, target.string() + ": cannot be put in place: " + cause_of(errno) +
                                                    "; an earlier writing was interrupted, and its files are in " +
                                                    (batch / kNew).string() + "."};
    }
    return Success{};
}

/// The lock goes last, so that what a kill leaves of it can be told from a batch at work.
void remove_batch(const fs::path& batch) {
    std::error_code ignored;
    for (const std::string& part : names_in(batch)) // also what a kill left of writing kBefore
        if (part != kLock) fs::remove_all(batch / part, ignored);
    fs::remove(batch / kLock, ignored);
    fs::remove(batch, ignored);
}

} // namespace

/// The hidden folder of a batch at work.
class FileBatch::Folder {
public:
    explicit Folder(fs::path target) : target_(std::move(target)) {}
    ~Folder() {
        if (path_.empty()) return;
        try {
            remove_batch(path_);
        } catch (const std::bad_alloc&) { // it stays, as after a kill, and the next batch clears it away
        }
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;

    /// 0 or the error number.
    int make() {
        constexpr int kTries = 8; // another process may clear a folder away before it is locked
        for (int i = 0; i < kTries; ++i) {
            path_ = temporary_path(target_, kMaking);
            if (::mkdir(path_.c_str(), 0777) != 0) return std::exchange(path_, {}), errno;
            lock_.emplace(path_ / kLock, O_CREAT | O_EXCL);
            if (lock_->is_lost() || !lock_->is_there()) continue;
            if (::mkdir((path_ / kNew).c_str(), 0777) == 0 && ::mkdir((path_ / kOld).c_str(), 0777) == 0) return 0;
            return errno;
        }
        return EIO;
    }

    const fs::path& target() const { return target_; }
    fs::path file(const std::string& name) const { return path_ / kNew / name; }

    Status finish() {
        const std::vector<std::string> names = names_in(path_ / kNew);
        if (Status ready = prepare(names); !ready) return ready;
        for (const std::string& name : names) {
            Status placed = place(name);
            if (placed) continue;
            take_back();
            return placed;
        }
        sync_folder(target_);
        return Success{};
    }

private:
    struct Placed {
        std::string name;
        bool replaced; ///< something that is in `old` now
    };
    fs::path target_, path_;
    std::optional<Lock> lock_;
    std::vector<Placed> placed_;

    /// Checks all places before any changes, notes what is there, and says that placing begins.
    Status prepare(const std::vector<std::string>& names) {
        Stamps before;
        for (const std::string& name : names) {
            if (Status free = check_target(target_ / name); !free) return free;
            if (const auto status = status_of(target_ / name)) before[name] = stamp_of(*status);
        }
        if (Status written = write_file(path_ / kBefore, stamp_bytes(before)); !written) return written;
        sync_folder(path_ / kNew);
        return rename_to(kPlacing);
    }

    /// Ends the hidden folder's name so.
    Status rename_to(std::string_view state) {
        const std::string name = path_.filename().string();
        const fs::path renamed = target_ / name.substr(0, name.rfind('-')).append(state);
        if (::rename(path_.c_str(), renamed.c_str()) != 0) return cannot_write(target_, errno);
        path_ = renamed;
        sync_folder(target_);
        return Success{};
    }

    Status place(const std::string& name) {
        const fs::path place = target_ / name, before = path_ / kOld / name;
        if (Status free = check_target(place); !free) return free;
        const bool replaces = status_of(place).has_value();
        if (replaces) {
            keep_permissions(file(name), place);
            if (::link(place.c_str(), before.c_str()) != 0 && // so that the place is never empty
                ::rename(place.c_str(), before.c_str()) != 0) // without hard links
                return cannot_replace(place, errno);
        }
        placed_.push_back({name, replaces});
        if (::rename(file(name).c_str(), place.c_str()) != 0) return cannot_replace(place, errno);
        return Success{};
    }

    /// In this order a kill in between is like one while they were placed.
    void take_back() {
        for (auto it = placed_.rbegin(); it != placed_.rend(); ++it) {
            const fs::path place = target_ / it->name;
            if (!status_of(file(it->name))) ::rename(place.c_str(), file(it->name).c_str());
            if (it->replaced) ::rename((path_ / kOld / it->name).c_str(), place.c_str());
        }
        placed_.clear();
        (void)rename_to(kMaking);
    }
};

FileBatch::FileBatch(std::unique_ptr<Folder> folder) : folder_(std::move(folder)) {}
FileBatch::FileBatch(FileBatch&&) noexcept = default;
FileBatch& FileBatch::operator=(FileBatch&&) noexcept = default;
FileBatch::~FileBatch() = default;

Result<FileBatch> FileBatch::create(const fs::path& folder) {
    const fs::path target = folder.empty() ? fs::path(".") : folder;
    if (Status completed = complete_batches(target); !completed) return completed.error();
    auto made = std::make_unique<Folder>(target);
    if (const int failed = made->make()) return cannot_write(target, failed);
    return FileBatch(std::move(made));
}

fs::path FileBatch::path(const std::string& name) const { return folder_->file(name); }
Status FileBatch::check_place(const std::string& name) const { return check_target(folder_->target() / name); }
Status FileBatch::finish() { return folder_->finish(); }

Status complete_batches(const fs::path& folder) {
    for (const std::string& name : names_in(folder)) {
        const bool placing = is_batch(name, kPlacing);
        if (!placing && !is_batch(name, kMaking)) continue;
        const fs::path batch = folder / name;
        const auto status = status_of(batch);
        if (!status || !S_ISDIR(status->st_mode) || status->st_uid != ::geteuid()) continue;
        const Lock lock(batch / kLock, O_NOFOLLOW);
        if (!lock.is_there()) ::rmdir(batch.c_str()); // all but the empty folder was removed
        if (!lock.is_held()) continue;
        if (placing)
            if (Status placed = place_rest(batch, folder); !placed) return placed;
        remove_batch(batch);
    }
    return Success{};
}

std::vector<fs::path> unplaced_files(const fs::path& folder) {
    std::vector<fs::path> unplaced;
    for (const std::string& batch : names_in(folder))
        if (is_batch(batch, kPlacing))
            for (const std::string& name : names_in(folder / batch / kNew))
                unplaced.push_back(folder / batch / kNew / name);
    return unplaced;
}

} // namespace filigree
