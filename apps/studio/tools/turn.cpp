// Turns the view, also over the shape: a tool that takes hold of nothing.
#include "tools/tool.h"

namespace filigree::studio {

namespace {

class TurnTool : public Tool {
public:
    using Tool::Tool;
    bool press(const Hit&) override { return false; }
    bool hover(const Hit&) override { return false; }
};

} // namespace

const ToolEntry kTurnTool = {"turn",
                             "&Turn",
                             "Drag anywhere to turn the view",
                             "T",
                             {{StrokeKind::ellipse, {8, 8, 2.2}},
                              {StrokeKind::arc, {2, 2, 12, 12, 20, 130}},
                              {StrokeKind::arc, {2, 2, 12, 12, 200, 130}},
                              {StrokeKind::head, {13.7, 6, 290, 3.2}},
                              {StrokeKind::head, {2.3, 10, 110, 3.2}}},
                             {},
                             make_tool<TurnTool>};

} // namespace filigree::studio
