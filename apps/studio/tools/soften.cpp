// Paints softness on the surface.
#include "coloring.h"
#include "softness.h"
#include "tools/tool.h"

namespace filigree::studio {

namespace {

class SoftenTool : public Tool {
public:
    using Tool::Tool;

    bool press(const Hit& hit) override {
        if (!hit.surface()) return false;
        takes_away_ = hit.reverses();
        before_ = softness_of(workbench().state());
        context_.workbench.view().edit([](ViewSettings& view) { view.coloring = &kSoftnessColors; });
        move(hit);
        return true;
    }

    void move(const Hit& hit) override {
        if (hit.surface()) workbench().paint_softness(hit.surface()->vertex, grip(), takes_away_);
    }

    void release() override { workbench().end_painting(); }
    void cancel() override {
        workbench().set_softness(before_);
        workbench().end_painting();
    }

    bool takes_double_clicks() const override { return true; }
    double radius() const override { return grip(); }

private:
    std::shared_ptr<const std::vector<float>> before_;
    bool takes_away_ = false;
};

} // namespace

const ToolEntry kSoftenTool = {
    "soften",
    "Soft&en",
    "Paint where the body is soft; with Ctrl where it is not",
    "K",
    {{StrokeKind::line, {13.5, 2.5, 7.5, 8.5}},
     {StrokeKind::curve, {7.5, 8.5, 5, 8.5, 5, 11, 2.5, 13, 5.5, 14, 9, 13, 9, 10, 9, 9.4, 8.4, 8.8, 7.5, 8.5}}},
    {{"drag the surface", "paints softness"}, {"Ctrl+drag", "takes it away"}},
    make_tool<SoftenTool>,
    &kSoftnessColors};

} // namespace filigree::studio
