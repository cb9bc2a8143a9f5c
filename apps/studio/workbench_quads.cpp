// Quads of the mesh, by its wish.
#include "workbench_content.h"

#include "quads.h"

namespace filigree::studio {

const QuadRemeshOptions& Workbench::quad_options() const { return content_->quad_options; }

void Workbench::set_quad_options(const QuadRemeshOptions& options) {
    content_->quad_options = options;
    Q_EMIT quad_options_changed();
}

void Workbench::make_quads() {
    for (const auto& [topic, sentence] :
         {std::pair(kOpenTopic, "A file is being opened: make quads of it once it is there, or cancel."),
          std::pair(kModelTopic, "The mesh is still being made: make quads of it once it is there.")})
        if (jobs_.is_pending(topic)) {
            Q_EMIT told(sentence, true);
            return;
        }
    pause();
    forget_measuring();
    State next = state();
    next.strip.levels.reset(); // quads have other levels
    jobs_.start<State>(
        "Making quads", kQuadsTopic,
        [next = std::move(next), options = content_->quad_options](const RunContext& context) mutable -> Result<State> {
            Result<std::shared_ptr<const Source>> quads = make_quads_of(input_of_quads(next.source), options, context);
            if (!quads) return quads.error();
            next.source = std::move(*quads);
            next.shape.reset();
            return stripped_state(std::move(next), context);
        },
        [this](const State& made) {
            if (is_pulling_) end_pull();
            State now = state(); // warps and settings may have changed meanwhile
            now.source = made.source;
            now.shape = made.shape;
            take_model(now, made);
            document_.change("Make quads", std::move(now));
            Q_EMIT told(quads_summary(*made.source), false);
        });
}

} // namespace filigree::studio
