#include "panels/quads_panel.h"

#include "actions.h"
#include "quads.h"

namespace filigree::studio {
namespace {

constexpr int kMostLevels = 6;
constexpr double kLeastQuads = 100, kMostQuads = 2'000'000;

} // namespace

QuadsPanel::QuadsPanel(Workbench& workbench, const Actions& actions, QWidget* parent)
    : Panel("quads", parent), workbench_(workbench) {
    QGridLayout* rows = section("Quads of this mesh");
    const QuadRemeshOptions usual;
    NumberSpec spec = {.least = kLeastQuads, .most = kMostQuads, .decimals = 0, .logarithmic = true};
    spec.neutral = double(usual.quads);
    count_ = number(rows, "quads.count", "Quads", spec, "About so many");
    QStringList levels = {"Automatic"};
    for (int k = 1; k <= kMostLevels; ++k) levels << QString::number(k);
    levels_ = choice(rows, "quads.levels", "Levels", levels,
                     "How often each patch is halved: at 3 a patch has 8 × 8 quads, and three levels of detail can go. "
                     "Automatic: as many as leave enough patches.");
    spec = {.least = 0, .most = 180, .step = 1, .decimals = 0, .unit = "°", .neutral = usual.feature_angle_deg};
    feature_angle_ = number(rows, "quads.feature_angle", "Features", spec,
                            "Edges whose faces meet at more than this angle stay sharp; 180°: none do");
    small_parts_ = choice(rows, "quads.small_parts", "Small parts", {"Remove", "Keep"},
                          "Handles and parts too small for the patches, which in scans are mostly noise");
    beside(rows, {new ActionButton("quads.make_button", actions.find("quads.make"), {}, page())});

    rows = section("Report");
    none_ = text(rows, "quads.none", Tone::quiet);
    none_->setText("Patches of regular quads, as the report's method needs them: the reference code works on them, and "
                   "whole levels of detail can go.");
    figures_ = text(rows, "quads.figures");
    figures_->setTextFormat(Qt::RichText);
    remarks_ = text(rows, "quads.remarks", Tone::quiet);

    connect(count_, &NumberControl::changed, this,
            [this](double count) { change([count](QuadRemeshOptions& o) { o.quads = std::size_t(count); }); });
    connect(levels_, &QComboBox::currentIndexChanged, this, [this](int index) {
        change([index](QuadRemeshOptions& o) {
            o.levels = index > 0 ? std::optional<unsigned>(unsigned(index)) : std::nullopt;
        });
    });
    connect(feature_angle_, &NumberControl::changed, this,
            [this](double angle) { change([angle](QuadRemeshOptions& o) { o.feature_angle_deg = angle; }); });
    connect(small_parts_, &QComboBox::currentIndexChanged, this, [this](int index) {
        change([index](QuadRemeshOptions& o) { o.small_parts = index == 1 ? SmallParts::keep : SmallParts::remove; });
    });
    connect(&workbench_, &Workbench::quad_options_changed, this, &QuadsPanel::show_options);
    connect(&workbench_.document(), &Document::changed, this, &QuadsPanel::show_report);
    connect(&workbench_, &Workbench::opened, this, &QuadsPanel::show_report);
    show_options();
    show_report();
}

void QuadsPanel::change(const std::function<void(QuadRemeshOptions&)>& edit) {
    QuadRemeshOptions options = workbench_.quad_options();
    edit(options);
    workbench_.set_quad_options(options);
}

void QuadsPanel::show_options() {
    const QuadRemeshOptions& options = workbench_.quad_options();
    count_->set_value(double(options.quads));
    set_silently(levels_, std::min(kMostLevels, int(options.levels.value_or(0))));
    feature_angle_->set_value(options.feature_angle_deg);
    set_silently(small_parts_, options.small_parts == SmallParts::keep ? 1 : 0);
}

void QuadsPanel::show_report() {
    const auto& source = workbench_.state().source;
    const MadeQuads* const quads = source ? source->quads.get() : nullptr;
    none_->setVisible(!quads);
    figures_->setText(quads ? quads_table(*quads) : QString());
    figures_->setVisible(quads);
    QString remarks = quads ? quads_remarks(*quads) : QString();
    if (quads)
        remarks +=
            (remarks.isEmpty() ? "" : "\n") + QStringLiteral("Other quads are made of the mesh before: %1.")
                                                  .arg(counted(quads->input->mesh.face_count(), "face", "faces"));
    remarks_->setText(remarks);
    remarks_->setVisible(!remarks.isEmpty());
}

} // namespace filigree::studio
