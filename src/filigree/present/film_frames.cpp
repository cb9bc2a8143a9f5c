#include "filigree/present/film_frames.h"

#include "filigree/present/level_shape.h"

namespace filigree {

Status film_frames(std::size_t frames,
                   const std::function<Result<Picture>(std::size_t frame, const RunContext& quiet)>& draw,
                   std::span<FilmWriter> writers, std::string_view phase, const RunContext& context) {
    RunContext quiet = context;
    quiet.progress = nullptr;
    for (std::size_t frame = 0; frame < frames; ++frame) {
        if (context.is_cancelled()) return cancelled_error();
        context.report(phase, double(frame) / double(frames));
        const Result<Picture> picture = draw(frame, quiet);
        if (!picture) return picture.error();
        for (FilmWriter& writer : writers)
            if (const Status added = writer.add(*picture); !added) return added;
    }
    context.report(phase, 1);
    return Success{};
}

unsigned level_within(const Model& model, std::size_t most_triangles) {
    unsigned level = model.finest_level();
    while (level > 0 && level_facts(model, level).triangles > most_triangles) --level;
    return level;
}

} // namespace filigree
