// Warms or cools a body that melts where the mouse is held.
#include "coloring.h"
#include "tools/tool.h"

namespace filigree::studio {

namespace {

class TorchTool : public Tool {
public:
    using Tool::Tool;

    bool press(const Hit& hit) override {
        if (!hit.surface()) return false;
        cools_ = hit.reverses();
        move(hit);
        return true;
    }

    /// Beside the body nothing.
    void move(const Hit& hit) override {
        if (hit.surface())
            workbench().hold_torch(hit.surface()->at, cools_);
        else
            workbench().put_out_torch();
    }

    void release() override { workbench().put_out_torch(); }
    void cancel() override { workbench().put_out_torch(); }

    double radius() const override {
        const auto body = workbench().playback().made();
        return body ? torch_radius(*body, workbench().view().torch(cools_)) : grip();
    }

private:
    bool cools_ = false;
};

} // namespace

const ToolEntry kTorchTool = {"torch",
                              "&Torch",
                              "Hold the mouse on a body that melts to warm it; with Ctrl to cool",
                              "H",
                              {{StrokeKind::curve, {8,  1.5, 9,  4, 12, 5.5, 12,  8.5, 12,  11,  10, 12, 8,
                                                    12, 6,   12, 4, 11, 4,   8.5, 4,   6.5, 6.5, 5,  8,  1.5}},
                               {StrokeKind::line, {8, 12, 8, 15}},
                               {StrokeKind::line, {6, 15, 10, 15}}},
                              {{"hold the surface", "warms a body that melts; with Ctrl: cools it"}},
                              make_tool<TorchTool>,
                              &kHeatColors};

} // namespace filigree::studio
