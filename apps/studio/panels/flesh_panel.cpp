#include "panels/panels.h"

#include "actions.h"
#include "coloring.h"
#include "fleshing.h"
#include "panel.h"

#include <QListWidget>

namespace filigree::studio {
namespace {

class FleshPanel : public Panel {
public:
    FleshPanel(Workbench& workbench, const Actions& actions) : Panel("flesh", workbench) {
        add_character(actions);
        add_flesh();
        add_soft_joints();
        QGridLayout* rows = section({});
        beside(rows, {new ActionButton("flesh.make_button", actions.find("flesh.make"), {}, page())});
        const auto is_flesh = [this](const ViewSettings&) { return this->is_flesh(); };
        check(rows,
              view_settings().setting("flesh.skin", "Show plain skinning", "The skin alone, in place of the flesh",
                                      field(&ViewSettings::original), {}, is_flesh));
        const Field<ViewSettings> colored = {
            [](const ViewSettings& of) { return double(of.coloring == &kErrorColors); },
            [](ViewSettings& of, double on) { of.coloring = on ? &kErrorColors : &kOwnColors; }};
        check(rows,
              view_settings().setting("flesh.colored", "Distance from the skin as colours",
                                      "How far the flesh is from where plain skinning has it", colored, {}, is_flesh));
        figures_ = text(rows, "flesh.figures");
        figures_->setTextFormat(Qt::RichText);
        advice_ = text(rows, "flesh.advice");
        beside(rows, {new ActionButton("flesh.save", actions.find("fit.save_packed"), {}, page()),
                      new ActionButton("flesh.export", actions.find("file.export_animation"), "Export…", page())});
        connect(&workbench, &Workbench::flesh_settings_changed, this, &FleshPanel::refresh);
        refresh();
    }

private:
    OptionsAccess<FleshSettings> settings() {
        return {[this] { return workbench().flesh_settings(); },
                [this](const FleshSettings& to, const std::string&) { workbench().set_flesh_settings(to); }};
    }

    void add_character(const Actions& actions) {
        QGridLayout* rows = section("Character");
        beside(rows, {new ActionButton("flesh.open_button", actions.find("fit.open"), {}, page())});
        facts_ = text(rows, "flesh.facts", Tone::quiet);
        clip_ = choice(rows,
                       {"flesh.clip", "Clip", "Which of the file's animations",
                        [this] { return original() ? double(original()->clip) : 0; },
                        [this](double row) {
                            if (original() && row >= 0) workbench().show_clip(std::size_t(row));
                        },
                        [this] { return original() && original()->clips.size() > 1; }},
                       {});
    }

    void add_flesh() {
        QGridLayout* rows = section("Flesh");
        const FleshSettings usual;
        number(rows,
               settings().setting("flesh.stiffness", "Stiffness",
                                  "Young's modulus, pascals: 5 kPa wobbles, 50 kPa holds",
                                  field(&FleshSettings::stiffness)),
               {.least = 1e3,
                .most = 1e6,
                .decimals = 0,
                .unit = "Pa",
                .logarithmic = true,
                .neutral = usual.stiffness,
                .thousands = true});
        number(rows,
               settings().setting("flesh.core", "Core",
                                  "How far from the bones to the skin all is held: 0 nothing, 1 everything",
                                  field(&FleshSettings::core)),
               {.least = 0, .most = 1, .step = 0.05, .decimals = 2, .neutral = usual.core});
        number(rows,
               settings().setting("flesh.damping", "Damping", "How soon motion beside the animation ends, 1/s",
                                  field(&FleshSettings::damping)),
               {.least = 0, .most = 30, .step = 0.5, .decimals = 1, .unit = "1/s", .neutral = usual.damping});
        number(rows,
               settings().setting("flesh.particles", "Particles", "About so many; more are finer and slower",
                                  field(&FleshSettings::particles)),
               {.least = 300, .most = 50000, .decimals = 0, .logarithmic = true, .neutral = double(usual.particles)});
        number(rows,
               settings().setting("flesh.joints", "Joints", "Of the result, about; fewer make a smaller file",
                                  field(&FleshSettings::joints)),
               {.least = 12, .most = 5000, .decimals = 0, .logarithmic = true, .neutral = double(usual.joints)});
        check(rows, settings().setting("flesh.loop", "Loop",
                                       "The clip is a cycle: its flesh ends as it begins. It is simulated up to six "
                                       "times.",
                                       field(&FleshSettings::loop)));
        check(rows, settings().setting("flesh.ground", "Ground", "A floor at the lowest point of the clip",
                                       field(&FleshSettings::ground)));
    }

    void add_soft_joints() {
        QGridLayout* rows = section("Soft joints");
        joints_ = new QListWidget(page());
        joints_->setObjectName("flesh.soft");
        joints_->setAccessibleName("Soft joints");
        joints_->setToolTip("Joints that hold little, with all below them, such as a tail or an ear");
        joints_->setSelectionMode(QAbstractItemView::MultiSelection);
        joints_->setMaximumHeight(6 * fontMetrics().lineSpacing());
        rows->addWidget(joints_, rows->rowCount(), 0, 1, 3);
        connect(joints_, &QListWidget::itemSelectionChanged, this, [this] {
            FleshSettings to = workbench().flesh_settings();
            to.soft.clear();
            for (const QListWidgetItem* item : joints_->selectedItems()) to.soft.push_back(item->text().toStdString());
            workbench().set_flesh_settings(to);
        });
        number(rows,
               settings().setting("flesh.strength", "Strength", "How strongly these joints hold, of 1",
                                  field(&FleshSettings::strength)),
               {.least = 0, .most = 1, .step = 0.01, .decimals = 2, .neutral = FleshSettings().strength});
    }

    std::shared_ptr<const MovingMesh> original() const {
        return state().recording ? state().recording->original : nullptr;
    }
    bool is_flesh() const { return original() && state().recording->fitted && state().recording->fitted->flesh; }

    /// Names of another file.
    void show_names() {
        const auto of = original();
        QStringList clips, joints;
        for (const std::string& name : of ? of->clips : std::vector<std::string>())
            clips << QString::fromStdString(name);
        for (const std::string& name : of ? of->joints : std::vector<std::string>())
            joints << QString::fromStdString(name);
        if (std::exchange(clips_, clips) != clips) {
            const QSignalBlocker silent(clip_);
            clip_->clear();
            clip_->addItems(clips);
        }
        if (std::exchange(joint_names_, joints) != joints) {
            {
                const QSignalBlocker silent(joints_);
                joints_->clear();
                joints_->addItems(joints);
            }
            FleshSettings to = workbench().flesh_settings();
            to.soft.clear(); // of another character
            workbench().set_flesh_settings(to);
        }
    }

    void refresh() override {
        show_names();
        Panel::refresh();
        facts_->setText(
            workbench().can_make_flesh()
                ? QStringLiteral("%1: %2.").arg(file_name(original()->path),
                                                counted(original()->joints.size(), "joint", "joints"))
            : original() ? QStringLiteral("%1 has no skin that flesh can be made of.").arg(file_name(original()->path))
                         : QStringLiteral("An animated glTF (.glb, .gltf) with a skin."));
        joints_->setEnabled(!joint_names_.isEmpty());
        figures_->setText(is_flesh() ? flesh_table(*state().recording) : QString());
        figures_->setVisible(is_flesh());
        advice_->setText(is_flesh() ? flesh_advice(*state().recording) : QString());
        advice_->setVisible(!advice_->text().isEmpty());
    }

    Text *facts_ = nullptr, *figures_, *advice_;
    QComboBox* clip_ = nullptr;
    QListWidget* joints_ = nullptr;
    QStringList clips_, joint_names_;
};

} // namespace

QWidget* make_flesh_panel(Workbench& workbench, const Actions& actions) { return new FleshPanel(workbench, actions); }

} // namespace filigree::studio
