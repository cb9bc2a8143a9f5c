#include "filigree/io/system/shared_work.h"

#include "filigree/file.h"
#include "filigree/io/system/file.h"
#include "filigree/io/system/file_error.h"
#include "filigree/io/system/platform.h"
#include "filigree/io/system/temporary_file.h"

#include <algorithm>
#include <cerrno>
#include <unordered_set>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace filigree {

namespace {

namespace fs = std::filesystem;

constexpr const char* kPlanName = "plan";

std::string hexadecimal(const XXH128_hash_t& hash) {
    constexpr char kHexDigits[] = "0123456789abcdef";
    std::string text;
    for (const XXH64_hash_t half : {hash.high64, hash.low64})
        for (int shift = 60; shift >= 0; shift -= 4) text += kHexDigits[half >> shift & 15];
    return text;
}

/// Removes a folder that nobody finds any more under the name it had. Whoever was about to write a file there when it
/// was renamed may do so while it is being emptied, and another process may be removing the same.
void remove_folder(const fs::path& folder) {
    constexpr int kMostTries = 100; // each follows a file that came, or went, in between
    for (int tries = 0; tries < kMostTries; ++tries) {
        std::error_code failed;
        fs::remove_all(folder, failed);
        if (failed != std::errc::directory_not_empty && failed != std::errc::no_such_file_or_directory) return;
    }
}

} // namespace

Status check_chunk(const WorkChunk& chunk) {
    if (chunk.number >= 1 && chunk.number <= chunk.count) return Success{};
    return Error{ErrorCode::usage, "There is no chunk " + std::to_string(chunk.number) + " of " +
                                       std::to_string(chunk.count) + "; they are counted from 1."};
}

SharedFolder::SharedFolder(fs::path path, std::string plan, std::function<bool()> is_in_place)
    : path_(std::move(path)), folder_(path_of(path_.string() + ".chunks")), aside_(path_of(folder_.string() + ".done")),
      finished_(path_of(path_.string() + ".plan")), plan_(std::move(plan)), is_in_place_(std::move(is_in_place)) {}

bool SharedFolder::has_plan(const fs::path& file) const {
    const Result<std::string> there = read_file(file);
    return there && *there == plan_;
}

bool SharedFolder::is_finished() const {
    // A folder without a plan is of somebody who finds out in begin() that all is done.
    return !is_ours() && has_plan(finished_) && is_in_place_();
}

bool SharedFolder::is_ours() const { return has_plan(file(kPlanName)); }

Result<bool> SharedFolder::begin() const {
    if (is_finished()) {
        clear();
        return true;
    }
    const int made = platform::make_folder(folder_);
    if (made != 0 && made != EEXIST) return cannot_write(folder_, made);
    if (is_finished()) { // by others, since we asked
        if (made == 0) platform::remove_empty_folder(folder_);
        return true;
    }
    const Status planned = add(kPlanName, [&](const fs::path& plan) { return write_file(plan, plan_); });
    if (is_ours()) return false;
    if (is_finished()) return true;
    if (!planned) return planned.error();
    return Error{ErrorCode::mismatch, folder_.string() +
                                          ": holds parts of another job (other inputs, settings or number "
                                          "of chunks); let it end, delete the folder, or write to "
                                          "another name."};
}

Status SharedFolder::add(const std::string& name, const std::function<Status(const fs::path& file)>& make) const {
    std::error_code ignored;
    if (fs::exists(file(name), ignored)) return Success{};
    const fs::path temporary = temporary_path(folder_);
    Status made = make(temporary);
    // Whoever comes second finds the first one's.
    if (made)
        if (const int failed = platform::link(temporary, file(name)); failed != 0 && failed != EEXIST)
            made = cannot_write(file(name), failed);
    platform::remove_file(temporary);
    return made;
}

Status SharedFolder::mark(const std::string& name) const {
    if (!is_ours()) return cannot_write(file(name), ENOENT);
    if (const int failed = platform::link(file(kPlanName), file(name)); failed != 0 && failed != EEXIST)
        return cannot_write(file(name), failed);
    platform::flush_folder(folder_);
    return Success{};
}

std::vector<bool> SharedFolder::are_there(std::span<const std::string> names) const {
    std::unordered_set<std::string> found;
    std::error_code failed;
    for (fs::directory_iterator entry(folder_, failed); !failed && entry != fs::directory_iterator();
         entry.increment(failed))
        found.insert(entry->path().filename().string());
    std::vector<bool> there;
    for (const std::string& name : names) there.push_back(found.contains(name));
    return there;
}

Status SharedFolder::end() const {
    clear();
    if (!is_ours()) return Success{}; // others ended it, and another work may have begun
    // At no moment is it gone: another process may have ended, and whoever comes now asks for it.
    if (!has_plan(finished_)) {
        const fs::path plan =
            temporary_path(folder_); // there, so that a kill leaves no file of ours under another name
        int failed = platform::link(file(kPlanName), plan);
        if (failed == 0) failed = platform::rename(plan, finished_);
        if (failed != 0 && failed != ENOENT) return cannot_write(finished_, failed);
    }
    // Renamed first, so that nobody takes half of it for parts that are missing.
    if (const int failed = platform::rename(folder_, aside_); failed != 0 && failed != ENOENT)
        return cannot_write(folder_, failed);
    clear(); // what is left hinders nobody
    platform::flush_folder(path_.parent_path());
    return Success{};
}

void SharedFolder::clear() const { remove_folder(aside_); }

Result<SharedItemsReport>
make_shared_items(const SharedItems& items, const WorkChunk& chunk,
                  const std::function<Result<std::string>(std::size_t item)>& make,
                  const std::function<Status(const std::function<fs::path(std::size_t item)>& file)>& place,
                  const std::function<bool()>& is_in_place, const RunContext& context) {
    if (Status right = check_chunk(chunk); !right) return right.error();
    const SharedFolder folder(items.path,
                              "Filigree's " + items.what + ", made in chunks\njob " + chunk.job + "\nitems " +
                                  std::to_string(items.names.size()) + "\n",
                              is_in_place);
    SharedItemsReport report;
    report.items = items.names.size();
    report.first = chunk.first_of(items.names.size());
    report.count = chunk.end_of(items.names.size()) - report.first;
    const auto whole = [&] {
        folder.clear();
        report.done = items.names.size();
        report.is_whole = true;
        return report;
    };
    const Result<bool> begun = folder.begin();
    if (!begun) return begun.error();
    if (*begun) return whole();

    const std::vector<bool> before = folder.are_there(items.names);
    for (std::size_t k = 0; k < report.count; ++k) {
        context.report(items.phase, double(k) / double(report.count));
        if (context.is_cancelled()) return cancelled_error();
        if (before[report.first + k]) continue;
        const Result<std::string> bytes = make(report.first + k);
        if (!bytes) return bytes.error();
        const fs::path file = folder.file(items.names[report.first + k]);
        const Status written = folder.is_ours() ? write_file(file, *bytes) : Status(cannot_write(file, ENOENT));
        if (!written && folder.is_finished()) return whole(); // another process made the same, and was the last
        if (!written) return written.error();
        ++report.made;
    }
    context.report(items.phase, 1);

    const std::vector<bool> after = folder.are_there(items.names);
    report.done = std::size_t(std::ranges::count(after, true));
    if (folder.is_finished()) return whole();
    if (report.done < items.names.size()) return report;
    Status placed = folder.is_ours() ? place([&](std::size_t item) { return folder.file(items.names[item]); })
                                     : Status(cannot_write(items.path, ENOENT));
    if (placed) placed = folder.end();
    if (!placed && !folder.is_finished()) return placed.error();
    return whole();
}

std::string hash_of_bytes(std::string_view bytes) { return hexadecimal(XXH3_128bits(bytes.data(), bytes.size())); }

Result<std::string> hash_of_files(std::span<const fs::path> paths) {
    XXH3_state_t* const state = XXH3_createState();
    if (!state) return Error{ErrorCode::out_of_memory, "Not enough memory to hash a file."};
    XXH3_128bits_reset(state);
    const auto take = [&](const fs::path& path) -> Status {
        const Result<FileReader> file = FileReader::open(path);
        if (!file) return file.error();
        std::string piece;
        for (std::uint64_t offset = 0; offset < file->size(); offset += piece.size()) {
            piece.resize(std::min<std::uint64_t>(std::uint64_t{1} << 20, file->size() - offset));
            if (Status filled = file->read(offset, piece); !filled) return filled;
            XXH3_128bits_update(state, piece.data(), piece.size());
        }
        return Success{};
    };
    Status taken = Success{};
    for (const fs::path& path : paths)
        if (taken) taken = take(path);
    const XXH128_hash_t hash = XXH3_128bits_digest(state);
    XXH3_freeState(state);
    if (!taken) return taken.error();
    return hexadecimal(hash);
}

} // namespace filigree
