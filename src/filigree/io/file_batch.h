// Several files that come into one folder together: the frames of a sequence.
#pragma once

#include "filigree/result.h"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace filigree {

/// Files that are made aside and put into their places all or none. They replace files, whose permissions they keep,
/// but no folders, symbolic links, pipes or devices.
///
/// They are made in a hidden folder `.filigree-X-making` in the target folder, X random, which finish() renames to
/// `.filigree-X-placing` before it moves the first one. So whenever the process is killed or the power fails:
/// - before that, the places are as they were, and what is left is a hidden folder of new files;
/// - after that, all new files are whole. Some are in their places, and the others in the hidden folder's `new`. The
///   next batch in this folder moves them; until then unplaced_files() names them, so that no reader takes the mixture
///   for a sequence. A file that came to such a place or was changed there after the kill is newer and stays.
/// The next batch also removes what killed ones of the same user left. A lock tells them from those at work, also those
/// of other containers; where the file system has no locks, they stay and may be deleted by hand.
class FileBatch {
public:
    /// Completes what a killed batch left in `folder`, which must be there. Errors: unwritable.
    static Result<FileBatch> create(const std::filesystem::path& folder);
    FileBatch(FileBatch&&) noexcept;
    FileBatch& operator=(FileBatch&&) noexcept;
    /// Unless it was finished, everything is as it was.
    ~FileBatch();

    /// Where the file has to be written that becomes `name` in the folder.
    std::filesystem::path path(const std::string& name) const;
    /// Whether a file can come to `name`. Errors: unwritable (a folder, a link, a pipe or a read-only file is there).
    Status check_place(const std::string& name) const;
    /// Puts the files into their places. When one cannot be put there, those before it are taken back. Errors:
    /// unwritable; then everything is as it was.
    Status finish();

private:
    class Folder;
    explicit FileBatch(std::unique_ptr<Folder> folder);
    std::unique_ptr<Folder> folder_;
};

/// What the next batch in this folder would do first: puts in place what killed batches of this user had still to
/// place, and removes what else they left. Errors: unwritable.
Status complete_batches(const std::filesystem::path& folder);

/// The files that a killed batch (or one at work right now) has still to put into this folder, where they are now: what
/// stands under their names in the folder is older.
std::vector<std::filesystem::path> unplaced_files(const std::filesystem::path& folder);

} // namespace filigree
