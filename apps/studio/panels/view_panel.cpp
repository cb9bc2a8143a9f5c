#include "panels/panels.h"

#include "coloring.h"
#include "panel.h"
#include "window.h"

#include <algorithm>

namespace filigree::studio {

namespace {

using Settings = ViewSettings;

/// The colouring as its place in the table.
const Field<Settings> kColoring = {
    [](const Settings& settings) {
        return double(std::ranges::find(colorings(), settings.coloring) - colorings().begin());
    },
    [](Settings& settings, double row) { settings.coloring = colorings()[std::size_t(row)]; }};

QString expected_error_text(const Workbench& workbench) {
    const PoseError::Estimate* estimate = workbench.expected_error().estimate();
    if (!estimate) return QStringLiteral("Not judged yet.");
    return QStringLiteral("Expected from the pose alone: %1 of the diagonal (root mean square).")
        .arg(number_text(estimate->share(), 2));
}

class ViewPanel : public Panel {
public:
    ViewPanel(Workbench& workbench, Viewport& viewport, MainWindow& window)
        : Panel("view", workbench), viewport_(viewport) {
        const auto view = view_settings();
        add_surface(window);

        QGridLayout* rows = section("Inside");
        check(rows, view.setting("view.inside_points", "Inside points", "Points inside the mesh at rest",
                                 field(&Settings::inside_points)));
        number(rows,
               view.setting("view.point_count", "Count", "About so many points", field(&Settings::inside_count),
                            [](const Settings& settings) { return settings.inside_points; }),
               {.least = 100, .most = 100000, .decimals = 0, .logarithmic = true, .neutral = 3000});
        const auto is_clipped = [](const Settings& settings) { return settings.clip; };
        check(rows, view.setting("view.clip", "Clip plane", "Cuts the mesh open", field(&Settings::clip)));
        choice(rows,
               view.setting("view.clip_axis", "Across", "The axis that the plane stands across",
                            field(&Settings::clip_axis), is_clipped),
               {"x", "y", "z"});
        number(rows,
               view.setting("view.clip_at", "At", "Where along the axis, per cent of the box",
                            field(&Settings::clip_at, 100), is_clipped),
               {.least = 0, .most = 100, .step = 1, .decimals = 0, .unit = "%", .neutral = 50});

        rows = section("Speed");
        check(rows, view.setting("view.level_by_distance", "Level by distance",
                                 "The level shown follows the size on the screen: far away, fewer vertices are drawn",
                                 field(&Settings::level_by_distance)));
        drawn_ = text(rows, "view.drawn", Tone::quiet);
        check(rows,
              view.setting("view.keep_up", "Coarser while moving",
                           "A coarser level while things move, where drawing is slow", field(&Settings::keep_up)));

        rows = section("Scene");
        check(rows,
              view.setting("view.ground", "Ground", "The ground with the object's shadow", field(&Settings::ground)));
        choice(
            rows,
            view.setting("view.up", "Up", "The axis that points up; gravity pulls the other way", field(&Settings::up)),
            {"x", "y", "z"});
        check(rows, view.setting("view.follow", "Follow the motion",
                                 "The camera goes along with what moves, as in films", field(&Settings::follow)));
        choice(rows,
               view.setting("view.mouse", "Mouse",
                            "Filigree's: the middle button moves the view. Blender's: it turns it, with Shift it moves "
                            "it, with Ctrl it zooms.",
                            field(&Settings::blender_mouse)),
               {"Filigree's", "Blender's"});
        choice(rows,
               {"view.theme", "Theme", "The colours of the window", [&window] { return double(window.theme()); },
                [&window](double index) { window.set_theme(static_cast<Theme>(int(index))); }},
               {"As the system", "Light", "Dark"});

        connect(&workbench, &Workbench::error_measured, this, &ViewPanel::show_error);
        connect(&workbench, &Workbench::pose_changed, this, &ViewPanel::show_error);
        connect(&workbench.expected_error(), &ExpectedError::changed, this, &ViewPanel::show_error);
        connect(&window, &MainWindow::theme_changed, this, &ViewPanel::refresh);
        connect(&viewport_, &Viewport::timings_changed, this, &ViewPanel::show_drawn);
        refresh();
    }

private:
    void add_surface(MainWindow& window) {
        const auto view = view_settings();
        QStringList choices, tips;
        for (const Coloring* const coloring : colorings()) {
            choices << coloring->choice;
            tips << QString(coloring->choice) + ": " + coloring->tip;
        }
        QGridLayout* rows = section("Surface");
        choice(rows, view.setting("view.style", "Style", "How the surface is drawn", field(&Settings::style)),
               {"Shaded", "Shaded with edges", "Wireframe"});
        choice(rows, view.setting("view.coloring", "Colours", tips.join("\n"), kColoring), choices);
        error_ = text(rows, "view.error", Tone::quiet);
        measure_ = new ActionButton("view.measure", window.actions().find("view.measure_error"), {}, page());
        beside(rows, {measure_});
        check(rows, view.setting("view.split", "Split view", "Driver, restored mesh and full deformation side by side",
                                 field(&Settings::split)));
        check(rows, view.setting("view.driver", "Driver over the mesh", "The driver's edges over the mesh",
                                 field(&Settings::driver)));
    }

    void refresh() override {
        Panel::refresh();
        show_error();
        show_drawn();
    }

    void show_error() {
        const Coloring* const coloring = workbench().view().settings().coloring;
        const bool is_measured = coloring == &kErrorColors;
        const QString text = is_measured ? error_text(workbench(), true) : expected_error_text(workbench());
        error_->setText(text.isEmpty() ? QStringLiteral("Not measured for what is shown.") : text);
        error_->setVisible(is_measured || coloring == &kExpectedErrorColors);
        measure_->setVisible(is_measured);
    }

    void show_drawn() {
        const Timings& timings = viewport_.timings();
        drawn_->setText(QStringLiteral("Drawn: level %1, %2.")
                            .arg(timings.level)
                            .arg(counted(timings.vertices, "vertex", "vertices")));
        drawn_->setVisible(timings.vertices > 0);
    }

    Viewport& viewport_;
    QPushButton* measure_ = nullptr;
    Text *error_ = nullptr, *drawn_;
};

} // namespace

QWidget* make_view_panel(Workbench& workbench, Viewport& viewport, MainWindow& window) {
    return new ViewPanel(workbench, viewport, window);
}

} // namespace filigree::studio
