// Shapes, quads, levels and the detail code.
#include "workbench_impl.h"

#include "pieces.h"
#include "quads.h"
#include "words.h"

namespace filigree::studio {

namespace {

/// What handles and recordings refer to is another driver now.
void drop_what_refers_to_driver(State& state) {
    state.handles.clear();
    state.handle_pose = nullptr;
    state.pose_from_file = false;
    state.recording = nullptr;
}

} // namespace

Result<State> stripped_state(State state, const RunContext& context) {
    if (state.source->pieces) {
        const PieceOptions options = state.source->pieces->options;
        return state_in_pieces(std::move(state), options, context);
    }
    const bool was_finest = !state.model || state.level() == state.model->finest_level();
    Result<Stripped> stripped = strip(state.source->mesh, state.strip, context);
    if (!stripped) return stripped.error();
    state.strip_report = stripped->report;
    state.model = std::make_shared<const Model>(std::move(stripped->model));
    const unsigned finest = state.model->finest_level();
    state.restore.level = was_finest ? finest : std::min(state.level(), finest);
    drop_what_refers_to_driver(state);
    return state;
}

Result<State> state_of_shape(State state, const Shape& shape, const RunContext& context) {
    Result<Mesh> mesh = filigree::make_shape(shape.name, shape.options);
    if (!mesh) return mesh.error();
    state.source = source_of(std::move(*mesh), "", title_of(shape.name).toStdString(), context);
    state.shape = shape;
    return stripped_state(std::move(state), context);
}

const std::optional<Shape>& Workbench::wanted_shape() const {
    return jobs_.is_pending(kModelTopic) ? impl_->wanted_shape : state().shape;
}

const StripOptions& Workbench::wanted_strip() const {
    return jobs_.is_pending(kModelTopic) ? impl_->wanted_strip : state().strip;
}

void Workbench::make_shape(const Shape& shape, const std::string& merge) {
    if (wanted_shape() == shape) return;
    const bool is_another = !wanted_shape() || wanted_shape()->name != shape.name;
    const StripOptions strip = is_another ? StripOptions() : wanted_strip();
    if (state().shape == shape && strip == state().strip) return jobs_.drop(kModelTopic); // back again
    make_model("Making the " + title_of(shape.name).toLower(), shape, strip, merge);
}

void Workbench::set_strip(const StripOptions& options, const std::string& merge) {
    make_model("Taking the detail off", wanted_shape(), options, merge);
}

/// Tells why not, when work of that topic is to end first.
bool Workbench::is_refused(const std::string& topic, const QString& sentence) {
    if (!jobs_.is_pending(topic)) return false;
    Q_EMIT told(sentence, true);
    return true;
}

/// In the background. Shape and options go together, so that a change of one does not lose one of the other that is
/// still being made.
void Workbench::make_model(const QString& title, std::optional<Shape> shape, const StripOptions& strip,
                           const std::string& merge) {
    if (is_refused(kOpenTopic, "A file is being opened: change the model once it is there, or cancel.") ||
        is_refused(kSourceTopic, "Quads or pieces are being made: change the model once they are there, or cancel."))
        return;
    State next = state();
    next.strip = strip;
    const bool is_new_shape = shape != next.shape;
    impl_->wanted_shape = shape;
    impl_->wanted_strip = strip;
    forget_measuring();
    jobs_.start<State>(
        title, kModelTopic,
        [next = std::move(next), shape = std::move(shape), is_new_shape](const RunContext& context) {
            return is_new_shape ? state_of_shape(next, *shape, context) : stripped_state(next, context);
        },
        [this, is_new_shape, key = document_.merge_key(merge)](const State& made) {
            State now = state(); // warps and settings may have changed meanwhile
            const Shape before = now.shape.value_or(Shape{.name = "", .options = {}});
            const QString name =
                is_new_shape ? name_of_change(before, *made.shape) : name_of_change(now.strip, made.strip);
            const bool is_another_shape = is_new_shape && before.name != made.shape->name;
            now.source = made.source;
            now.shape = made.shape;
            take_model(now, made);
            document_.change(name, std::move(now), key);
            if (is_another_shape) Q_EMIT opened();
        });
}

void Workbench::take_model(State& now, const State& made) const {
    const bool is_finest = now.level() == now.model->finest_level();
    now.strip = made.strip;
    now.strip_report = made.strip_report;
    now.model = made.model;
    const unsigned finest = now.model->finest_level();
    now.restore.level = is_finest ? finest : std::min(now.level(), finest);
    drop_what_refers_to_driver(now);
}

void Workbench::change_level(unsigned level, const QString& name, const std::string& merge) {
    document_.edit(
        name, [&](State& next) { next.restore.level = std::min(level, next.model->finest_level()); }, merge);
}

void Workbench::set_level(unsigned level, const std::string& merge) {
    change_level(level, QString("Level %1").arg(std::min(level, state().model->finest_level())), merge);
}
void Workbench::remove_detail() {
    if (state().level() > 0) change_level(state().level() - 1, "Remove detail", {});
}
void Workbench::add_detail() { change_level(state().level() + 1, "Add detail", {}); }

const QuadRemeshOptions& Workbench::quad_options() const { return impl_->quad_options; }

void Workbench::set_quad_options(const QuadRemeshOptions& options) {
    impl_->quad_options = options;
    Q_EMIT quad_options_changed();
}

/// In the background: the document's mesh becomes another one. make: from the state as it is now. then: once it is so.
void Workbench::change_source(const QString& title, const QString& name,
                              std::function<Result<State>(State, const RunContext&)> make,
                              std::function<void(const Source&)> then) {
    if (is_refused(kOpenTopic, "A file is being opened: go on once it is there, or cancel.") ||
        is_refused(kModelTopic, "The mesh is still being made: go on once it is there."))
        return;
    pause();
    forget_measuring();
    jobs_.start<State>(
        title, kSourceTopic,
        [before = state(), make = std::move(make)](const RunContext& context) { return make(before, context); },
        [this, name, then = std::move(then)](const State& made) {
            if (is_pulling()) end_pull();
            State now = state(); // warps and settings may have changed meanwhile
            now.source = made.source;
            now.shape = made.shape;
            take_model(now, made);
            document_.change(name, std::move(now));
            then(*made.source);
        });
}

void Workbench::make_quads() {
    change_source(
        "Making quads", "Make quads",
        [options = impl_->quad_options](State next, const RunContext& context) -> Result<State> {
            const auto input = input_of_quads(whole_source(next.source));
            Result<std::shared_ptr<const Source>> quads = make_quads_of(input, options, context);
            if (!quads) return quads.error();
            next.source = std::move(*quads);
            next.shape.reset();
            next.strip.levels.reset(); // quads have other levels
            return stripped_state(std::move(next), context);
        },
        [this](const Source& source) { Q_EMIT told(quads_summary(source), false); });
}

const PieceOptions& Workbench::piece_options() const { return impl_->piece_options; }

void Workbench::set_piece_options(const PieceOptions& options) {
    impl_->piece_options = options;
    Q_EMIT piece_options_changed();
}

void Workbench::cut_pieces() {
    change_source(
        "Cutting pieces", "Cut pieces",
        [options = impl_->piece_options](State next, const RunContext& context) {
            return state_in_pieces(std::move(next), options, context);
        },
        [this](const Source& source) { Q_EMIT told(pieces_summary(*source.pieces), false); });
}

void Workbench::make_whole() {
    if (!state().source->pieces) return;
    change_source("Making it whole", "Make whole", state_made_whole, [](const Source&) {});
}

} // namespace filigree::studio
