#include "panels/panels.h"

#include "actions.h"
#include "panel.h"
#include "pins.h"
#include "words.h"

namespace filigree::studio {
namespace {

class DeformPanel : public Panel {
public:
    DeformPanel(Workbench& workbench, const Actions& actions)
        : Panel("deform", workbench), pins_(new Text("deform.pins", Tone::quiet, page())) {
        const auto button = [&](const char* name, const char* action, const QString& text = {}) {
            return new ActionButton(name, actions.find(action), text, page());
        };
        QGridLayout* rows = section("By hand");
        text(rows, "deform.hint", Tone::quiet)->setText("Drag the surface to pull it; pins hold it.");
        beside(rows, {button("deform.pull", "tool.pull"), button("deform.pin", "tool.pin"),
                      button("deform.turn", "tool.turn")});
        const auto view = view_settings();
        NumberSpec spec = {.least = 1, .most = 50, .decimals = 1, .unit = "%", .logarithmic = true, .neutral = 6};
        number(rows,
               view.setting("deform.grip", "Grip",
                            "How far around the mouse the surface is held, per cent of the mesh's diagonal",
                            field(&ViewSettings::grip, 100)),
               spec);
        spec.least = 5;
        spec.most = 200;
        spec.neutral = 45;
        number(rows,
               view.setting(
                   "deform.reach", "Reach",
                   "How far around the mouse the surface follows; beyond it stays. Per cent of the mesh's diagonal",
                   field(&ViewSettings::reach, 100)),
               spec);
        pins_->setToolTip("Vertices of the driver that are held");
        beside(rows, {pins_, button("deform.unpin_all", "edit.unpin_all")})->setStretch(1, 0);

        rows = section("By numbers");
        const OptionsAccess<Warps> warps = {
            [this] { return state().warps; },
            [this](const Warps& to, const std::string& merge) { this->workbench().set_warps(to, merge); }};
        choice(rows, warps.setting("deform.axis", "Axis", "The axis that all five go along", field(&Warps::axis)),
               {"x", "y", "z"});
        for (const WarpInfo& info : warp_infos()) {
            if (info.amount == nullptr) continue;
            const NumberSpec factor = {.least = 1 / info.most,
                                       .most = info.most,
                                       .decimals = 2,
                                       .unit = "×",
                                       .logarithmic = true,
                                       .digits = 3,
                                       .neutral = 1};
            const NumberSpec angle = {
                .least = -info.most, .most = info.most, .step = info.step, .decimals = 0, .unit = "°", .neutral = 0};
            const std::string name(info.name);
            number(rows,
                   warps.setting(QString::fromStdString("deform." + name), title_of(name),
                                 QString::fromUtf8(info.action.data(), qsizetype(info.action.size())),
                                 field(info.amount)),
                   info.is_factor ? factor : angle);
        }
        beside(rows, {button("deform.reset", "edit.reset_deformation", "Reset all")});
        refresh();
    }

private:
    void refresh() override {
        Panel::refresh();
        const std::size_t pinned = pinned_vertices(state().handles).size();
        pins_->setText(pinned == 0 ? QStringLiteral("No pins") : counted(pinned, "vertex pinned", "vertices pinned"));
    }

    Text* pins_;
};

} // namespace

QWidget* make_deform_panel(Workbench& workbench, const Actions& actions) { return new DeformPanel(workbench, actions); }

} // namespace filigree::studio
