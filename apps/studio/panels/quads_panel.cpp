#include "panels/panels.h"

#include "actions.h"
#include "panel.h"
#include "quads.h"

namespace filigree::studio {
namespace {

constexpr int kMostLevels = 6;

const Field<QuadRemeshOptions> kLevels = {
    [](const QuadRemeshOptions& options) {
        return double(std::min<unsigned>(kMostLevels, options.levels.value_or(0)));
    },
    [](QuadRemeshOptions& options, double levels) {
        options.levels = levels > 0 ? std::optional(unsigned(levels)) : std::nullopt;
    }};
const Field<QuadRemeshOptions> kKeepsSmallParts = {
    [](const QuadRemeshOptions& options) { return double(options.small_parts == SmallParts::keep); },
    [](QuadRemeshOptions& options, double keep) {
        options.small_parts = keep ? SmallParts::keep : SmallParts::remove;
    }};

class QuadsPanel : public Panel {
public:
    QuadsPanel(Workbench& workbench, const Actions& actions) : Panel("quads", workbench) {
        const QuadRemeshOptions usual;
        const OptionsAccess<QuadRemeshOptions> options = {
            [this] { return this->workbench().quad_options(); },
            [this](const QuadRemeshOptions& to, const std::string&) { this->workbench().set_quad_options(to); }};
        QGridLayout* rows = section("Quads of this mesh");
        number(rows, options.setting("quads.count", "Quads", "About so many", field(&QuadRemeshOptions::quads)),
               {.least = 100, .most = 2'000'000, .decimals = 0, .logarithmic = true, .neutral = double(usual.quads)});
        QStringList levels = {"Automatic"};
        for (int k = 1; k <= kMostLevels; ++k) levels << QString::number(k);
        choice(
            rows,
            options.setting("quads.levels", "Levels",
                            "How often each patch is halved: at 3 a patch has 8 × 8 quads, and three levels of detail "
                            "can go. Automatic: as many as leave enough patches.",
                            kLevels),
            levels);
        number(rows,
               options.setting("quads.feature_angle", "Features",
                               "Edges whose faces meet at more than this angle stay sharp; 180°: none do",
                               field(&QuadRemeshOptions::feature_angle_deg)),
               {.least = 0, .most = 180, .step = 1, .decimals = 0, .unit = "°", .neutral = usual.feature_angle_deg});
        choice(rows,
               options.setting("quads.small_parts", "Small parts",
                               "Handles and parts too small for the patches, which in scans are mostly noise",
                               kKeepsSmallParts),
               {"Remove", "Keep"});
        beside(rows, {new ActionButton("quads.make_button", actions.find("quads.make"), {}, page())});

        rows = section("Report");
        none_ = text(rows, "quads.none", Tone::quiet);
        none_->setText("Patches of regular quads: the reference code can take whole levels of detail off them.");
        figures_ = text(rows, "quads.figures");
        figures_->setTextFormat(Qt::RichText);
        remarks_ = text(rows, "quads.remarks", Tone::quiet);
        connect(&workbench, &Workbench::quad_options_changed, this, &QuadsPanel::refresh);
        refresh();
    }

private:
    void refresh() override {
        Panel::refresh();
        const MadeQuads* const quads = state().source ? state().source->quads.get() : nullptr;
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

    Text *figures_, *remarks_, *none_;
};

} // namespace

QWidget* make_quads_panel(Workbench& workbench, const Actions& actions) { return new QuadsPanel(workbench, actions); }

} // namespace filigree::studio
