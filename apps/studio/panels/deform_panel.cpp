#include "panels/deform_panel.h"

#include "actions.h"
#include "warp_ranges.h"

namespace filigree::studio {

DeformPanel::DeformPanel(Workbench& workbench, const Actions& actions, QWidget* parent)
    : Panel("deform", parent), workbench_(workbench) {
    QGridLayout* rows = section("By hand");
    Text* hint = text(rows, "deform.hint", Tone::quiet);
    hint->setText("Drag the surface to pull it; pins hold it.");
    beside(rows, {new ActionButton("deform.pull", actions.find("tool.pull"), {}, page()),
                  new ActionButton("deform.pin", actions.find("tool.pin"), {}, page()),
                  new ActionButton("deform.turn", actions.find("tool.turn"), {}, page())});
    NumberSpec spec = {.least = 1, .most = 50, .decimals = 1, .unit = "%", .logarithmic = true, .neutral = 6};
    grip_ = number(rows, "deform.grip", "Grip", spec,
                   "How far around the mouse the surface is held, per cent of the mesh's diagonal");
    spec.least = 5;
    spec.most = 200;
    spec.neutral = 45;
    reach_ = number(rows, "deform.reach", "Reach", spec,
                    "How far around the mouse the surface follows; beyond it stays. Per cent of the mesh's diagonal");
    pins_ = new Text("deform.pins", Tone::quiet, page());
    pins_->setToolTip("Vertices of the driver that are held");
    QHBoxLayout* line =
        beside(rows, {pins_, new ActionButton("deform.unpin_all", actions.find("edit.unpin_all"), {}, page())});
    line->setStretch(1, 0);

    rows = section("By numbers");
    axis_ = choice(rows, "deform.axis", "Axis", {"x", "y", "z"}, "The axis that all five go along");
    const auto add = [&](const char* name, const QString& label, const NumberSpec& how, double Warps::*field,
                         double scale, const QString& tooltip) {
        NumberControl* control = number(rows, QStringLiteral("deform.") + name, label, how, tooltip);
        warps_.push_back({control, field, scale});
        const std::string merge = std::string("deform.") + name;
        connect(control, &NumberControl::changed, this, [this, field, scale, merge](double value) {
            Warps warps = workbench_.state().warps;
            warps.*field = value / scale;
            workbench_.set_warps(warps, merge);
        });
        connect(control, &NumberControl::released, this, [this] { workbench_.document().end_merge(); });
    };
    NumberSpec factor;
    factor.least = kLeastFactor;
    factor.most = kMostFactor;
    factor.decimals = 2;
    factor.unit = "×";
    factor.logarithmic = true;
    factor.digits = 3;
    factor.neutral = 1;
    NumberSpec angle = {.least = -kMostBend, .most = kMostBend, .step = 1, .decimals = 0, .unit = "°", .neutral = 0};
    add("stretch", "Stretch", factor, &Warps::stretch, 1, "Longer along the axis; a factor");
    add("squeeze", "Squeeze", factor, &Warps::squeeze, 1,
        "Longer along the axis and thinner across, the volume stays; a factor");
    add("bend", "Bend", angle, &Warps::bend, 1, "Into an arc from end to end, degrees");
    angle.least = -kMostTwist;
    angle.most = kMostTwist;
    angle.step = 5;
    add("twist", "Twist", angle, &Warps::twist, 1, "Turned about the axis from end to end, degrees");
    add("taper", "Taper", factor, &Warps::taper, 1, "Size of the far end, as a factor of the near end's");
    beside(rows, {new ActionButton("deform.reset", actions.find("edit.reset_deformation"), "Reset all", page())});

    connect(axis_, &QComboBox::currentIndexChanged, this, [this](int index) {
        Warps warps = workbench_.state().warps;
        warps.axis = static_cast<Axis>(index);
        workbench_.set_warps(warps);
    });
    const auto connect_view = [this](NumberControl* control, double ViewSettings::*field) {
        connect(control, &NumberControl::changed, this, [this, field](double value) {
            ViewSettings settings = workbench_.view().settings();
            settings.*field = value / 100;
            workbench_.view().set(settings);
        });
    };
    connect_view(grip_, &ViewSettings::grip);
    connect_view(reach_, &ViewSettings::reach);
    connect(&workbench_.document(), &Document::changed, this, &DeformPanel::refresh);
    connect(&workbench_, &Workbench::opened, this, &DeformPanel::refresh);
    connect(&workbench_.view(), &ViewState::changed, this, &DeformPanel::refresh);
    refresh();
}

void DeformPanel::refresh() {
    const State& state = workbench_.state();
    set_silently(axis_, int(state.warps.axis));
    for (const WarpControl& warp : warps_) warp.control->set_value(state.warps.*warp.field * warp.scale);
    grip_->set_value(100 * workbench_.view().settings().grip);
    reach_->set_value(100 * workbench_.view().settings().reach);
    std::size_t pinned = 0;
    for (const Handle& handle : state.handles)
        if (handle.pinned) pinned += handle.vertices.size();
    pins_->setText(pinned == 0 ? QStringLiteral("No pins") : counted(pinned, "vertex pinned", "vertices pinned"));
}

} // namespace filigree::studio
