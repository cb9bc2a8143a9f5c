// Animations in many files or by many processes; the rest is in filigree/file.h.
#pragma once

#include "filigree/context.h"
#include "filigree/file.h"
#include "filigree/io/system/numbered_name.h"
#include "filigree/io/system/shared_work.h"
#include "filigree/result.h"
#include "filigree/strip.h"
#include "filigree/types.h"

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace filigree {

/// The files that exist under the name of an animation: itself, those of a numbered sequence, or all in a folder.
std::vector<std::filesystem::path> animation_files(const std::filesystem::path& path);

/// Whether a name is that of USD, text or binary.
bool is_usd(const std::filesystem::path& path);
/// What to say of an Alembic file (.abc), which no reader is there for.
std::optional<Error> alembic_error(const std::filesystem::path& path);

struct ChunkReport {
    std::size_t first_frame = 0, frames = 0; ///< of this chunk
    bool was_done = false;                   ///< before: nothing was written
    std::size_t chunks_done = 0;             ///< of all, this one too
    bool is_whole = false;                   ///< the file is in its place
};

/// Writes a chunk's frames into a .pc2 (frames are shared out evenly). The frames of all gather in the folder
/// PATH.chunks; whoever writes the last one puts the file into its place and removes the folder. PATH.plan says what
/// the file is made of, and stays. Each chunk may be written again, at the same time too: it writes the same bytes. A
/// process that is killed at any moment leaves a chunk to be written again, and what stood at `path` as it was.
/// Errors: usage (a number beyond the count, a name that does not end in .pc2), mismatch (another job is at work
/// there), unsuitable, unwritable, cancelled. Cost: the chunk's frames; memory one frame.
Result<ChunkReport> write_animation_chunk(const MeshAnimation& animation, const std::filesystem::path& path,
                                          const WorkChunk& chunk, const RunContext& context);

/// Meshes that are numbered under one name.
struct NumberedMeshes {
    NumberedName name;
    FrameSource<Mesh> meshes;
};
/// Writes several sequences side by side into one folder, all or none. parts: one or more, all with the first one's
/// folder and number of frames.
Result<std::vector<std::string>> write_numbered_meshes(std::span<const NumberedMeshes> parts,
                                                       const RunContext& context);

} // namespace filigree
