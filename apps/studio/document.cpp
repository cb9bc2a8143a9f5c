#include "document.h"

#include "filigree/file.h"

#include <QUndoCommand>

namespace filigree::studio {

std::shared_ptr<Source> source_of(Mesh mesh, const std::string& path, const std::string& name,
                                  const RunContext& context) {
    auto source = std::make_shared<Source>();
    source->mesh = std::move(mesh);
    source->path = path;
    source->name = name;
    source->box = world_bounds(source->mesh);
    source->topology = analyse_topology(source->mesh, context);
    source->materials = load_surface_materials(source->mesh, path_of(path));
    return source;
}

bool is_same_body(BodySettings a, const BodySettings& b) {
    a.air_temperature = b.air_temperature;
    return a == b;
}

void Recording::follow(const PoseSequence& poses, std::span<const std::shared_ptr<const Mesh>> surfaces_of_all) {
    frames_per_second = poses.frames_per_second;
    surfaces.assign(surfaces_of_all.begin(), surfaces_of_all.end());
    for (std::size_t k = frames.size(); k < poses.frames.size(); ++k)
        frames.push_back(std::make_shared<const Pose>(poses.frames[k]));
}

PoseSequence Recording::poses() const {
    PoseSequence result{frames_per_second, {}};
    for (const auto& frame : frames) result.frames.push_back(*frame);
    return result;
}

/// Holds the state before and after, so undo and redo bring back the very same one.
class StateChange : public QUndoCommand {
public:
    StateChange(Document& document, const QString& name, State after, std::uint64_t after_id, std::string key)
        : QUndoCommand(name), document_(document), before_(document.state_), after_(std::move(after)),
          before_id_(document.state_id_), after_id_(after_id), key_(std::move(key)) {}

    void undo() override { document_.go_to(before_, before_id_); }
    /// The stack calls this when the step is pushed as well; change() goes there itself, when the stack is in order.
    void redo() override {
        if (std::exchange(is_pushed_, true)) document_.go_to(after_, after_id_);
    }
    int id() const override { return key_.empty() ? -1 : 1; }
    bool mergeWith(const QUndoCommand* other) override {
        const auto& next = static_cast<const StateChange&>(*other);
        if (next.key_ != key_) return false;
        after_ = next.after_;
        after_id_ = next.after_id_;
        setText(next.text());
        return true;
    }

private:
    Document& document_;
    State before_, after_;
    std::uint64_t before_id_, after_id_;
    std::string key_;
    bool is_pushed_ = false;
};

Document::Document(QObject* parent) : QObject(parent) { state_.restore.level = 0; }

std::string Document::merge_key(const std::string& merge) const {
    if (merge.empty() || merge.find('\n') != std::string::npos) return merge;
    return merge + '\n' + std::to_string(merge_run_);
}

void Document::change(const QString& name, State next, const std::string& merge) {
    const std::uint64_t id = ++last_id_;
    undo_stack_.push(new StateChange(*this, name, next, id, merge_key(merge)));
    set(std::move(next), id);
}

void Document::replace(State next) {
    undo_stack_.clear();
    end_merge();
    set(std::move(next), ++last_id_);
}

void Document::go_to(const State& next, std::uint64_t id) {
    end_merge(); // what is dragged after an undo is another step
    set(next, id);
}

void Document::set(State next, std::uint64_t id) {
    const State before = std::exchange(state_, std::move(next));
    state_id_ = id;
    Q_EMIT changed(before);
}

} // namespace filigree::studio
