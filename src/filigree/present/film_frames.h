// The loop of every film: frames drawn one after the other, each written as it is there.
#pragma once

#include "filigree/context.h"
#include "filigree/render.h"
#include "filigree/strip.h"

#include <functional>
#include <span>

namespace filigree {

/// Draws frame after frame into every writer, which then is to be finished. draw: the frame of that number, from 0; its
/// context has no progress, as the bar tells of frames. Progress: `phase`. Errors: draw's, FilmWriter::add's,
/// cancelled.
Status film_frames(std::size_t frames,
                   const std::function<Result<Picture>(std::size_t frame, const RunContext& quiet)>& draw,
                   std::span<FilmWriter> writers, std::string_view phase, const RunContext& context);

/// The finest level with no more triangles, for what is drawn again and again; 0 where even that has more.
unsigned level_within(const Model& model, std::size_t most_triangles);

} // namespace filigree
