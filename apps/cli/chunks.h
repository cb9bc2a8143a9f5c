// --chunk: a part of a work that other processes do the rest of.
#pragma once

#include "session.h"

#include "filigree/io/system/shared_work.h"

#include <string>

namespace filigree::cli {

/// "3/40" as the third of forty chunks. Refuses what is none.
WorkChunk chunk_of(const std::string& text);

/// What items a chunk made, and whether all are there. things: what they are called, "pictures".
void report_chunk(const std::string& output, const WorkChunk& chunk, const SharedItemsReport& written,
                  const std::string& things, double seconds, Session& session);

} // namespace filigree::cli
