// Works that processes share which know nothing of each other, on one machine or many: parts gather in a folder.
#pragma once

#include "filigree/context.h"
#include "filigree/file.h"
#include "filigree/result.h"

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace filigree {

/// One part of a work.
struct WorkChunk {
    std::size_t number = 1, count = 1; ///< 1 .. count
    /// What the work is made of, as a line of text: a hash of the inputs and the settings. Chunks of different works
    /// are not mixed.
    std::string job;

    /// Its share of so many things, from 0 on.
    std::size_t first_of(std::size_t things) const { return things * (number - 1) / count; }
    std::size_t end_of(std::size_t things) const { return things * number / count; }
};

/// Errors: usage, where the number is not one of 1 .. count.
Status check_chunk(const WorkChunk& chunk);

/// The folder PATH.chunks, in which the parts of what becomes PATH gather. It holds a plan that says what they belong
/// to; PATH.plan says what a finished PATH was made of. A process may be killed at any moment: whoever comes next goes
/// on from what is there.
class SharedFolder {
public:
    /// plan: lines of text. is_in_place: whether what stands at `path` may be this work, finished.
    SharedFolder(std::filesystem::path path, std::string plan, std::function<bool()> is_in_place);

    /// Whether this very work is finished. Another work may have begun since.
    bool is_finished() const;
    /// Whether the folder is this work's: others may have finished it, and begun another.
    bool is_ours() const;
    /// Makes the folder, or joins it. True: the work is finished. Errors: mismatch (parts of another work lie there),
    /// unwritable.
    Result<bool> begin() const;
    /// Puts a whole file into the folder, unless it is there. Errors: unwritable.
    Status add(const std::string& name, const std::function<Status(const std::filesystem::path& file)>& make) const;
    /// Puts a file into the folder of which the name says all, unless it is there. Errors: unwritable, also where the
    /// folder is this work's no more, as others finished it.
    Status mark(const std::string& name) const;
    std::filesystem::path file(const std::string& name) const { return folder_ / path_of(name); }
    /// Which of these files are there.
    std::vector<bool> are_there(std::span<const std::string> names) const;
    /// What was made is in its place: says so in PATH.plan, and removes the folder. Errors: unwritable.
    Status end() const;
    /// The work is finished: removes what is left of the folder where the process that did so was killed.
    void clear() const;

private:
    bool has_plan(const std::filesystem::path& file) const;

    std::filesystem::path path_, folder_, aside_, finished_;
    std::string plan_;
    std::function<bool()> is_in_place_;
};

/// Things that are made one by one, each a file in the folder: pictures of a film, rows of a table.
struct SharedItems {
    std::filesystem::path path;     ///< what they become, or the name that they have in common
    std::string what;               ///< a line for the plan: "pictures"
    std::vector<std::string> names; ///< of the files, one an item
    std::string phase;              ///< of the progress
};

struct SharedItemsReport {
    std::size_t first = 0, count = 0; ///< of the chunk
    std::size_t made = 0;             ///< here; the others were there before
    std::size_t done = 0, items = 0;  ///< of all; all
    bool is_whole = false;            ///< all are in their place
};

/// Makes a chunk's items (all are shared out evenly); whoever makes the last one has `place` put them into their place,
/// which may happen more than once. An item that is there is not made again, however many chunks there were before.
/// make: an item's bytes, the same in every process. place: from the items' files, which it leaves. is_in_place: as of
/// SharedFolder. Errors: as of check_chunk and SharedFolder::begin, make's, place's, unwritable, cancelled; items that
/// were made stay.
Result<SharedItemsReport> make_shared_items(
    const SharedItems& items, const WorkChunk& chunk, const std::function<Result<std::string>(std::size_t item)>& make,
    const std::function<Status(const std::function<std::filesystem::path(std::size_t item)>& file)>& place,
    const std::function<bool()>& is_in_place, const RunContext& context);

/// A hash of bytes, as 32 hexadecimal digits.
std::string hash_of_bytes(std::string_view bytes);
/// A hash of files' bytes, in this order. Errors: as of read_file.
Result<std::string> hash_of_files(std::span<const std::filesystem::path> paths);

} // namespace filigree
