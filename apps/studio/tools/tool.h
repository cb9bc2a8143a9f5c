// What the left mouse button does over the picture: one file a tool, one row of kTools each.
#pragma once

#include "icons.h"
#include "overlay.h"
#include "picture_camera.h"

#include "filigree/present/level_shape.h"

#include <functional>
#include <memory>
#include <optional>
#include <vector>

namespace filigree::studio {

/// What tools work with.
struct ToolContext {
    Workbench& workbench;
    DrawnObjects& drawn;
    PictureCamera& camera;
    std::function<std::optional<Picked>(const QPointF&)> pick; ///< what of the surface is under a point of the widget
};

/// The mouse at one place of the widget.
class Hit {
public:
    Hit(const ToolContext& context, const QPointF& at, Qt::KeyboardModifiers keys = {})
        : context_(context), at_(at), keys_(keys) {}

    const QPointF& at() const { return at_; }
    /// Ctrl or Alt is held: the tool does the contrary.
    bool reverses() const { return keys_ & (Qt::ControlModifier | Qt::AltModifier); }
    /// What of the surface is under the mouse; none: nothing. Searched for when it is first asked for.
    const std::optional<Picked>& surface() const {
        if (!surface_) surface_ = context_.pick(at_);
        return *surface_;
    }

private:
    const ToolContext& context_;
    QPointF at_;
    Qt::KeyboardModifiers keys_;
    mutable std::optional<std::optional<Picked>> surface_;
};

/// A drag is press(), then move() any number of times, then release() or cancel().
class Tool {
public:
    explicit Tool(const ToolContext& context) : context_(context) {}
    virtual ~Tool() = default;

    /// The button goes down. False: this place is not for the tool, and the drag turns the view.
    virtual bool press(const Hit& hit) = 0;
    virtual void move(const Hit&) {}
    virtual void release() {}
    /// In place of release(): the drag leaves nothing. Also called when another model has taken the dragged one's
    /// place.
    virtual void cancel() {}

    /// While the button is up: whether press() would take hold of something here.
    virtual bool hover(const Hit& hit) { return !context_.workbench.is_playing() && hit.surface(); }
    /// A double click is a second press; else it looks at that point.
    virtual bool takes_double_clicks() const { return false; }
    /// Radius of the circle around the mouse, model units; 0: no circle.
    virtual double radius() const { return 0; }
    /// is_held: during a drag; else the mouse is over what press() would take hold of.
    virtual Qt::CursorShape cursor(bool /*is_held*/) const { return Qt::CrossCursor; }
    /// What the tool shows over the picture. is_hot: the mouse is over what press() would take hold of, or drags it.
    virtual void draw(OverlayContent&, bool /*is_hot*/) const {}

protected:
    Workbench& workbench() const { return context_.workbench; }
    const ViewSettings& settings() const { return context_.workbench.view().settings(); }
    /// Radius of pulls and pins, model units.
    double grip() const {
        const auto& source = workbench().state().source;
        return source ? settings().grip * source->box.diagonal() : 0;
    }

    const ToolContext& context_;
};

/// What the mouse does, for the help sheet: "Ctrl+drag", "takes pins out".
struct Gesture {
    const char *mouse, *does;
};

/// A tool's row: in the menu, the toolbar, the help sheet and docs/studio.md.
struct ToolEntry {
    const char* name; ///< of its action, after "tool."
    const char *text, *tip, *keys;
    std::vector<Stroke> icon;
    std::vector<Gesture> gestures;
    std::unique_ptr<Tool> (*make)(const ToolContext& context);
    const Coloring* colors = nullptr; ///< what it changes, as one more colouring of the view; null: nothing of the kind
};

/// The tool as `make` of a row.
template <class T>
std::unique_ptr<Tool> make_tool(const ToolContext& context) {
    return std::make_unique<T>(context);
}

extern const ToolEntry kPullTool, kPinTool, kTurnTool, kTorchTool, kSoftenTool;
inline constexpr std::array kTools = {&kPullTool, &kPinTool, &kTurnTool, &kTorchTool, &kSoftenTool};

/// The knobs of the deformations: no tool of the table, but there with some of them.
std::unique_ptr<Tool> make_gizmo(const ToolContext& context);

} // namespace filigree::studio
