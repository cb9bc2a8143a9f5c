// What `pack` and `info` say of coded files.
#pragma once

#include "report.h"

#include "filigree/io/model_file.h"

#include <optional>

namespace filigree::cli {

/// Bits a vertex, by part. bytes: of all; unset: not said.
void add_coding_shares(const PackedBytes& parts, std::size_t vertices, std::optional<std::uint64_t> bytes,
                       Report& report);

/// Which level of a stream is whole at which byte, and how far it is off. Nothing for other files.
void add_stream_marks(const ModelOutline& model, Report& report);

/// What `pack` and `export` warn of where PackReport says so.
inline constexpr const char* kLevelsLackAttributes =
    "The mesh has so many seams that its levels cannot have its texture, colours and materials: these come back when "
    "all of the stream is read, and a page shows none.";

} // namespace filigree::cli
