#include "filigree/present/film_frames.h"

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
    const auto triangles = [&](unsigned k) {
        return k == model.finest_level() ? model.mesh.corner_count() - 2 * model.mesh.face_count()
                                         : model.levels[k].corners.size() - 2 * model.levels[k].face_count();
    };
    while (level > 0 && triangles(level) > most_triangles) --level;
    return level;
}

} // namespace filigree
