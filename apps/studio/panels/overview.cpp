#include "panels/overview.h"

namespace filigree::studio {

std::size_t level_vertices(const Model& model, unsigned level) {
    return level < model.levels.size() ? model.levels[level].vertices.size() : model.mesh.vertex_count();
}

Overview::Overview(Workbench& workbench, const Actions& actions, QWidget* parent)
    : QWidget(parent), workbench_(workbench) {
    setObjectName("overview");
    NumberSpec spec;
    spec.least = ViewState::kLeastZoom;
    spec.most = ViewState::kMostZoom;
    spec.logarithmic = true;
    spec.neutral = 1;
    spec.unit = "×";
    zoom_ = new NumberControl("view.zoom", "Zoom", spec, "How large the object is shown; 1 × shows all of it", this);
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
    const auto pair = [&](int row, QWidget* left, QWidget* right) {
        auto* line = new QHBoxLayout;
        line->setSpacing(6);
        line->addWidget(left, 1);
        line->addWidget(right, 1);
        rows->addLayout(line, row, 0, 1, 3);
    };
    pair(1, new ActionButton("overview.remove_detail", actions.find("detail.remove"), {}, this),
         new ActionButton("overview.add_detail", actions.find("detail.add"), {}, this));
    rows->addWidget(level_, 2, 0, 1, 3);
    pair(3, new ActionButton("overview.deform", actions.find("deform.open"), {}, this),
         new ActionButton("overview.animate", actions.find("body.animate"), {}, this));

    connect(zoom_, &NumberControl::changed, this, [this](double zoom) { workbench_.view().set_zoom(zoom); });
    connect(&workbench_.view(), &ViewState::camera_changed, this, &Overview::refresh);
    connect(&workbench_.document(), &Document::changed, this, &Overview::refresh);
    connect(&workbench_, &Workbench::opened, this, &Overview::refresh);
    refresh();
}

void Overview::refresh() {
    zoom_->set_value(workbench_.view().zoom());
    const State& state = workbench_.state();
    if (!state.model) {
        level_->setText("no mesh");
        return;
    }
    level_->setText(QStringLiteral("level %1 of %2 – %3")
                        .arg(state.level())
                        .arg(state.model->finest_level())
                        .arg(counted(level_vertices(*state.model, state.level()), "vertex", "vertices")));
}

} // namespace filigree::studio
