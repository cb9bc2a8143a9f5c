#include "document.h"

#include "filigree/io/model_file.h"

#include <QUndoCommand>

#include <cstring>

namespace filigree::studio {

bool Shape::operator==(const Shape& other) const {
    const ShapeOptions &a = options, &b = other.options;
    return name == other.name && a.resolution == b.resolution && a.frequency == b.frequency &&
           a.amplitude == b.amplitude && a.size == b.size && a.length == b.length && a.thickness == b.thickness;
}

bool BodySettings::operator==(const BodySettings& other) const {
    const auto same_material = [](const Material& a, const Material& b) {
        return a.model == b.model && a.density == b.density && a.young_modulus == b.young_modulus &&
               a.poisson_ratio == b.poisson_ratio && a.damping == b.damping &&
               a.internal_damping == b.internal_damping && a.bending == b.bending && a.yield_stress == b.yield_stress &&
               a.creep_time == b.creep_time && a.temperature == b.temperature && a.melting_from == b.melting_from &&
               a.melting_to == b.melting_to && a.viscosity == b.viscosity && a.heating == b.heating &&
               a.conductivity == b.conductivity;
    };
    return preset == other.preset && same_material(material, other.material) && particles == other.particles &&
           size == other.size && drop == other.drop && gravity == other.gravity && ground == other.ground &&
           obstacle == other.obstacle && friction == other.friction && restitution == other.restitution;
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

namespace {

/// Values one after the other, each with its length where it has one.
class Bytes {
public:
    template <class T>
    requires std::is_arithmetic_v<T> || std::is_enum_v<T>
    void add(const T& value) { bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T)); }
    void add(const std::string& text) {
        add(text.size());
        bytes_ += text;
    }
    template <class T>
    void add(const std::optional<T>& value) {
        add(value.has_value());
        if (value) add(*value);
    }
    template <class T>
    void add(const std::vector<T>& items) {
        add(items.size());
        bytes_.append(reinterpret_cast<const char*>(items.data()), items.size() * sizeof(T));
    }
    void add(const Vec3f& v) {
        for (int k = 0; k < 3; ++k) add(v[k]);
    }
    template <class... T>
    void all(const T&... values) {
        (add(values), ...);
    }
    std::string take() { return std::move(bytes_); }

private:
    std::string bytes_;
};

} // namespace

std::string Document::bytes() const {
    const State& s = state_;
    Bytes out;
    if (s.source) out.all(s.source->path, s.source->name);
    out.add(s.shape.has_value());
    if (s.shape) {
        const ShapeOptions& o = s.shape->options;
        out.all(s.shape->name, o.resolution, o.frequency, o.amplitude, o.size, o.length, o.thickness);
    }
    out.all(s.strip.code, s.strip.base, s.strip.levels, s.strip.error, s.strip.precision, s.strip.references);
    if (s.model) out.add(s.recording ? write_model(*s.model, *s.recording) : write_model(*s.model));
    out.all(s.restore.law, s.restore.thin_shell, s.restore.level);
    const Warps& w = s.warps;
    out.all(w.axis, w.stretch, w.squeeze, w.bend, w.twist, w.taper);
    out.add(s.handles.size());
    for (const Handle& h : s.handles)
        out.all(h.vertices, h.targets, h.pinned, h.held, h.centre, h.grip, h.reach, h.move);
    out.add(s.handle_pose != nullptr);
    out.add(s.pose_from_file);
    if (s.handle_pose) out.all(s.handle_pose->positions, s.handle_pose->gradients);
    const BodySettings& b = s.body;
    const Material& m = b.material;
    out.all(b.preset, b.particles, b.size, b.drop, b.gravity, b.ground, b.obstacle, b.friction, b.restitution);
    out.all(m.model, m.density, m.young_modulus, m.poisson_ratio, m.damping, m.internal_damping, m.bending,
            m.yield_stress, m.creep_time, m.temperature, m.melting_from, m.melting_to, m.viscosity, m.heating,
            m.conductivity);
    return out.take();
}

} // namespace filigree::studio
