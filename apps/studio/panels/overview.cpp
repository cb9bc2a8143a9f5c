#include "panels/panels.h"

#include "actions.h"
#include "panel.h"

namespace filigree::studio {
namespace {

class Overview : public QWidget {
public:
    Overview(Workbench& workbench, const Actions& actions, QWidget* parent) : QWidget(parent), workbench_(workbench) {
        setObjectName("overview");
        zoom_ = new NumberControl("view.zoom", "Zoom",
                                  {.least = ViewState::kLeastZoom,
                                   .most = ViewState::kMostZoom,
                                   .unit = "×",
                                   .logarithmic = true,
                                   .neutral = 1},
                                  "How large the object is shown; 1 × shows all of it", this);
        level_ = new Text("detail.shown", Tone::quiet, this);
        level_->setAlignment(Qt::AlignCenter);
        level_->setToolTip("The level of detail shown, and its vertices");

        auto* rows = new QGridLayout(this);
        rows->setContentsMargins(12, 10, 12, 8);
        line_up(rows);
        rows->setVerticalSpacing(6);
        rows->addWidget(zoom_->label(), 0, 0);
        rows->addWidget(zoom_->slider(), 0, 1);
        rows->addWidget(zoom_->number(), 0, 2);
        const auto button = [&](const char* name, const char* action) {
            return new ActionButton(name, actions.find(action), {}, this);
        };
        beside(rows, {button("overview.remove_detail", "detail.remove"), button("overview.add_detail", "detail.add")});
        rows->addWidget(level_, rows->rowCount(), 0, 1, 3);
        beside(rows, {button("overview.deform", "deform.open"), button("overview.animate", "body.animate")});

        connect(zoom_, &NumberControl::changed, this, [this](double zoom) { workbench_.view().set_zoom(zoom); });
        connect(&workbench_.view(), &ViewState::camera_changed, this, &Overview::refresh);
        connect(&workbench_.document(), &Document::changed, this, &Overview::refresh);
        connect(&workbench_, &Workbench::opened, this, &Overview::refresh);
        refresh();
    }

private:
    void refresh() {
        zoom_->set_value(workbench_.view().zoom());
        const State& state = workbench_.state();
        level_->setText(
            state.model ? QStringLiteral("level %1 of %2 – %3")
                              .arg(state.level())
                              .arg(state.model->finest_level())
                              .arg(counted(level_counts(*state.model, state.level()).vertices, "vertex", "vertices"))
                        : QStringLiteral("no mesh"));
    }

    Workbench& workbench_;
    NumberControl* zoom_;
    Text* level_;
};

} // namespace

QWidget* make_overview(Workbench& workbench, const Actions& actions, QWidget* parent) {
    return new Overview(workbench, actions, parent);
}

} // namespace filigree::studio
