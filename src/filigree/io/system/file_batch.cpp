#include "filigree/io/system/file_batch.h"

#include "filigree/io/system/file.h"
#include "filigree/io/system/file_descriptor.h"
#include "filigree/io/system/file_error.h"
#include "filigree/io/system/platform.h"
#include "filigree/io/system/temporary_file.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <map>
#include <optional>
#include <string_view>

namespace filigree {

namespace {

namespace fs = std::filesystem;
using Kind = platform::Status::Kind;

// What a batch's folder holds.
constexpr char kNew[] = "new";       // files for their places, under their names
constexpr char kOld[] = "old";       // what was in the places
constexpr char kLock[] = "lock";     // locked while its process lives
constexpr char kBefore[] = "before"; // a Stamp of every place that had a file
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
    /// make: a new file, else one that is there.
    Lock(const fs::path& file, bool make) : descriptor_(platform::open_lock_file(file, make)) {
        if (!descriptor_.is_open()) return;
        const platform::Locked locked = platform::lock(descriptor_.get());
        const std::optional<platform::Status> status = platform::status_of(descriptor_.get());
        const bool is_removed = status && status->names == 0; // before we had it
        is_lost_ = locked == platform::Locked::by_another || is_removed;
        is_held_ = locked == platform::Locked::yes && !is_lost_;
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

Stamp stamp_of(const platform::Status& status) {
    return {status.seconds, status.nanoseconds, static_cast<long long>(status.size)};
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
    const std::optional<platform::Status> status = platform::status_of_name(target);
    if (!status) return Success{};
    if (status->kind == Kind::folder) return cannot_write(target, "it is a folder");
    if (status->kind == Kind::link)
        return cannot_write(target, "it is a symbolic link; remove it, or choose another name");
    if (status->kind != Kind::file) return cannot_write(target, "it is a pipe or a device");
    if (platform::refused_writing(target) != 0) return cannot_write(target, "permission is denied");
    return Success{};
}

Error cannot_replace(const fs::path& target, int error_number) {
    return cannot_write(target, "it cannot be replaced: " + cause_of(error_number));
}

void keep_permissions(const fs::path& file, const fs::path& target) {
    if (const auto status = platform::status_of_name(target))
        platform::set_permissions(file, status->permissions); // best effort, as for some mounts
}

/// Moves the files that a killed batch had still to place, unless something newer is there.
Status place_rest(const fs::path& batch, const fs::path& folder) {
    const Stamps before = read_stamps(batch / kBefore);
    for (const std::string& name : names_in(batch / kNew)) {
        const fs::path file = batch / kNew / path_of(name), target = folder / path_of(name);
        if (const auto status = platform::status_of_name(target)) {
            const auto known = before.find(name);
            if (status->kind != Kind::file || known == before.end() || known->second != stamp_of(*status)) continue;
        }
        keep_permissions(file, target);
        if (const int failed = platform::rename(file, target))
            return Error{ErrorCode::unwritable, target.string() + ": cannot be put in place: " + cause_of(failed) +
                                                    "; an earlier writing was interrupted, and its files are in " +
                                                    (batch / kNew).string() + "."};
    }
    return Success{};
}

/// The lock goes last, so that what a kill leaves of it can be told from a batch at work.
void remove_batch(const fs::path& batch) {
    std::error_code ignored;
    for (const std::string& part : names_in(batch)) // also what a kill left of writing kBefore
        if (part != kLock) fs::remove_all(batch / path_of(part), ignored);
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
        lock_.reset();
        platform::remove_empty_folder(path_); // on Windows the lock's file is gone when it is closed
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;

    /// 0 or the error number.
    int make() {
        constexpr int kTries = 8; // another process may clear a folder away before it is locked
        for (int i = 0; i < kTries; ++i) {
            path_ = temporary_path(target_, kMaking);
            if (const int failed = platform::make_folder(path_)) return std::exchange(path_, {}), failed;
            lock_.emplace(path_ / kLock, true);
            if (lock_->is_lost() || !lock_->is_there()) continue;
            if (const int failed = platform::make_folder(path_ / kNew)) return failed;
            return platform::make_folder(path_ / kOld);
        }
        return EIO;
    }

    const fs::path& target() const { return target_; }
    fs::path file(const std::string& name) const { return path_ / kNew / path_of(name); }

    Status finish() {
        const std::vector<std::string> names = names_in(path_ / kNew);
        if (Status ready = prepare(names); !ready) return ready;
        for (const std::string& name : names) {
            Status placed = place(name);
            if (placed) continue;
            take_back();
            return placed;
        }
        platform::flush_folder(target_);
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
            if (Status free = check_target(target_ / path_of(name)); !free) return free;
            if (const auto status = platform::status_of_name(target_ / path_of(name))) before[name] = stamp_of(*status);
        }
        if (Status written = write_file(path_ / kBefore, stamp_bytes(before)); !written) return written;
        platform::flush_folder(path_ / kNew);
        return rename_to(kPlacing);
    }

    /// Ends the hidden folder's name so.
    Status rename_to(std::string_view state) {
        const std::string name = path_.filename().string();
        const fs::path renamed = target_ / path_of(name.substr(0, name.rfind('-')).append(state));
        if (const int failed = platform::rename(path_, renamed)) return cannot_write(target_, failed);
        path_ = renamed;
        platform::flush_folder(target_);
        return Success{};
    }

    Status place(const std::string& name) {
        const fs::path place = target_ / path_of(name), before = path_ / kOld / path_of(name);
        if (Status free = check_target(place); !free) return free;
        const bool replaces = platform::status_of_name(place).has_value();
        if (replaces) {
            keep_permissions(file(name), place);
            if (platform::link(place, before) != 0) // so that the place is never empty
                if (const int failed = platform::rename(place, before))
                    return cannot_replace(place, failed); // no links
        }
        placed_.push_back({name, replaces});
        if (const int failed = platform::rename(file(name), place)) return cannot_replace(place, failed);
        return Success{};
    }

    /// In this order a kill in between is like one while they were placed.
    void take_back() {
        for (auto it = placed_.rbegin(); it != placed_.rend(); ++it) {
            const fs::path place = target_ / path_of(it->name);
            if (!platform::status_of_name(file(it->name))) platform::rename(place, file(it->name));
            if (it->replaced) platform::rename(path_ / kOld / path_of(it->name), place);
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
Status FileBatch::check_place(const std::string& name) const { return check_target(folder_->target() / path_of(name)); }
Status FileBatch::finish() { return folder_->finish(); }

Status complete_batches(const fs::path& folder) {
    for (const std::string& name : names_in(folder)) {
        const bool placing = is_batch(name, kPlacing);
        if (!placing && !is_batch(name, kMaking)) continue;
        const fs::path batch = folder / path_of(name);
        const auto status = platform::status_of_name(batch);
        if (!status || status->kind != Kind::folder || !status->is_own) continue;
        {
            const Lock lock(batch / kLock, false);
            if (lock.is_there() && !lock.is_held()) continue;
            if (lock.is_held()) {
                if (placing)
                    if (Status placed = place_rest(batch, folder); !placed) return placed;
                remove_batch(batch);
            }
        }
        platform::remove_empty_folder(batch); // all but the empty folder was removed, by us or before
    }
    return Success{};
}

std::vector<fs::path> unplaced_files(const fs::path& folder) {
    std::vector<fs::path> unplaced;
    for (const std::string& batch : names_in(folder))
        if (is_batch(batch, kPlacing))
            for (const std::string& name : names_in(folder / path_of(batch) / kNew))
                unplaced.push_back(folder / path_of(batch) / kNew / path_of(name));
    return unplaced;
}

} // namespace filigree
