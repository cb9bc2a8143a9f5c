// Pins vertices of the driver, or takes their pins out, by painting over the surface.
#include "drawn_objects.h"
#include "pins.h"
#include "tools/tool.h"

#include <algorithm>
#include <limits>

namespace filigree::studio {

namespace {

class PinTool : public Tool {
public:
    using Tool::Tool;

    bool press(const Hit& hit) override {
        if (!hit.surface()) return false;
        unpins_ = hit.reverses();
        painted_ = VertexSet(workbench().state().model->driver().vertices.size());
        move(hit);
        return true;
    }

    /// Adds the driver's vertices within the grip of what is under the mouse, and the nearest one in any case.
    void move(const Hit& hit) override {
        const std::optional<Picked>& picked = hit.surface();
        if (!picked) return;
        const std::vector<Vec3f>& driver = context_.drawn.pose().positions;
        const Vec3f at = (picked->at - context_.drawn.origin()).cast<float>();
        const auto reach = static_cast<float>(grip());
        Index nearest = 0;
        float least = std::numeric_limits<float>::infinity();
        for (Index v = 0; v < driver.size(); ++v) {
            const float distance = (driver[v] - at).norm();
            if (distance < least) {
                least = distance;
                nearest = v;
            }
            if (distance <= reach) painted_.add(v);
        }
        painted_.add(nearest);
    }

    void release() override {
        const std::vector<Index> painted = std::exchange(painted_, VertexSet(0)).members();
        unpins_ ? workbench().unpin(painted) : workbench().pin(painted);
    }

    void cancel() override { painted_ = VertexSet(0); }

    bool takes_double_clicks() const override { return true; }
    double radius() const override { return grip(); }

    /// The pins as they will be.
    void draw(OverlayContent& content, bool) const override {
        if (painted_.members().empty() || workbench().mode() != Mode::deform) return;
        std::vector<Index> pins = pinned_vertices(workbench().state().handles);
        if (unpins_)
            std::erase_if(pins, [this](Index v) { return painted_.contains(v); });
        else
            pins.insert(pins.end(), painted_.members().begin(), painted_.members().end());
        content.pins = context_.camera.places_of(pins, context_.drawn.pose().positions, context_.drawn.origin());
    }

private:
    VertexSet painted_{0};
    bool unpins_ = false; ///< what is painted
};

} // namespace

const ToolEntry kPinTool = {"pin",
                            "Pi&n",
                            "Click or paint the surface to pin it; with Ctrl to take pins out",
                            "N",
                            {{StrokeKind::ellipse, {8, 5.2, 3.2}},
                             {StrokeKind::line, {8, 8.4, 8, 13.6}},
                             {StrokeKind::line, {4.5, 13.6, 11.5, 13.6}}},
                            {{"drag the surface", "pins it"}, {"Ctrl+drag", "takes pins out"}},
                            make_tool<PinTool>};

} // namespace filigree::studio
