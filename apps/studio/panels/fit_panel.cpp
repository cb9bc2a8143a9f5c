#include "panels/panels.h"

#include "actions.h"
#include "coloring.h"
#include "fitting.h"
#include "panel.h"

namespace filigree::studio {
namespace {

class FitPanel : public Panel {
public:
    FitPanel(Workbench& workbench, const Actions& actions) : Panel("fit", workbench) {
        add_animation(actions);
        add_fit(actions);
        QGridLayout* rows = section("Report");
        none_ = text(rows, "fit.none", Tone::quiet);
        none_->setText("A fit finds the smallest driver whose restored mesh follows the animation.");
        figures_ = text(rows, "fit.figures");
        figures_->setTextFormat(Qt::RichText);
        beside(rows, {new ActionButton("fit.save", actions.find("fit.save_packed"), {}, page()),
                      new ActionButton("fit.export", actions.find("file.export_animation"), "Export…", page())});
        connect(&workbench, &Workbench::fit_settings_changed, this, &FitPanel::refresh);
        refresh();
    }

private:
    OptionsAccess<FitSettings> settings() {
        return {[this] { return workbench().fit_settings(); },
                [this](const FitSettings& to, const std::string&) { workbench().set_fit_settings(to); }};
    }

    void add_animation(const Actions& actions) {
        QGridLayout* rows = section("Animation");
        beside(rows, {new ActionButton("fit.open_button", actions.find("fit.open"), {}, page())});
        facts_ = text(rows, "fit.facts", Tone::quiet);
        clip_ = choice(rows,
                       {"fit.clip", "Clip", "Which of the file's animations",
                        [this] { return original() ? double(original()->clip) : 0; },
                        [this](double row) {
                            if (original() && row >= 0) workbench().open_motion(original()->path, std::size_t(row));
                        },
                        [this] { return original() && original()->clips.size() > 1; }},
                       {});
        number(rows,
               settings().setting("fit.rate", "Rate",
                                  "Frames a second: that are taken of a glTF, or that a .pc2 or numbered meshes are "
                                  "played at",
                                  field(&FitSettings::frames_per_second)),
               {.least = 1, .most = 240, .step = 1, .decimals = 0, .unit = "/s", .neutral = 30});
    }

    void add_fit(const Actions& actions) {
        QGridLayout* rows = section("Fit");
        number(rows,
               settings().setting("fit.error", "Error",
                                  "How far the restored mesh may be from the animation: root of the mean square over "
                                  "all vertices and frames, per cent of the diagonal. Half of it takes a driver of "
                                  "nearly twice as many vertices.",
                                  field(&FitSettings::error, 100)),
               {.least = 0.001, .most = 1, .decimals = 4, .unit = "%", .logarithmic = true, .neutral = 0.01});
        beside(rows, {new ActionButton("fit.make_button", actions.find("fit.make"), {}, page())});
        const auto view = view_settings();
        const auto is_fitted = [this](const ViewSettings&) { return this->is_fitted(); };
        check(rows,
              view.setting("fit.original", "Show the original", "The animation itself, in place of what follows it",
                           field(&ViewSettings::original), {}, is_fitted));
        const Field<ViewSettings> colored = {
            [](const ViewSettings& of) { return double(of.coloring == &kErrorColors); },
            [](ViewSettings& of, double on) { of.coloring = on ? &kErrorColors : &kOwnColors; }};
        check(rows, view.setting("fit.colored", "Error as colours", "How far each vertex is from the animation",
                                 colored, {}, is_fitted));
    }

    std::shared_ptr<const MovingMesh> original() const {
        return state().recording ? state().recording->original : nullptr;
    }
    bool is_fitted() const { return original() && state().recording->fitted && !state().recording->fitted->flesh; }

    void refresh() override {
        const auto of = original();
        QStringList clips;
        for (const std::string& name : of ? of->clips : std::vector<std::string>())
            clips << QString::fromStdString(name);
        if (clips != clips_) {
            const QSignalBlocker silent(clip_);
            clip_->clear();
            clip_->addItems(clips);
            clips_ = clips;
        }
        Panel::refresh();
        facts_->setText(
            of ? QStringLiteral("%1: %2 of %3, %4.")
                     .arg(file_name(of->path), counted(of->frames.size(), "frame", "frames"),
                          counted(state().source->mesh.vertex_count(), "vertex", "vertices"),
                          size_text(of->frames.size() * state().source->mesh.vertex_count() * sizeof(Vec3f)))
               : QStringLiteral("An animated glTF, numbered meshes, or a point cache (.pc2, .mdd) of the mesh "
                                "that is open."));
        none_->setVisible(!is_fitted());
        figures_->setText(is_fitted() ? fit_table(*state().recording) : QString());
        figures_->setVisible(is_fitted());
    }

    Text *facts_ = nullptr, *none_, *figures_;
    QComboBox* clip_ = nullptr;
    QStringList clips_;
};

} // namespace

QWidget* make_fit_panel(Workbench& workbench, const Actions& actions) { return new FitPanel(workbench, actions); }

} // namespace filigree::studio
