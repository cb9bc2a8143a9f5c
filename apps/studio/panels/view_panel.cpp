#include "panels/view_panel.h"

#include "status_bar.h"
#include "window.h"

namespace filigree::studio {

ViewPanel::ViewPanel(Workbench& workbench, Viewport& viewport, MainWindow& window, QWidget* parent)
    : Panel("view", parent), workbench_(workbench), viewport_(viewport), window_(window) {
    const auto add_switch = [this](QGridLayout* rows, const char* name, const QString& label, const QString& tooltip,
                                   bool ViewSettings::*field) {
        QCheckBox* box = check(rows, QLatin1String(name), label, tooltip);
        switches_.push_back({box, field});
        connect(box, &QCheckBox::toggled, this,
                [this, field](bool on) { change([&](ViewSettings& settings) { settings.*field = on; }); });
        return box;
    };
    QGridLayout* rows = section("Surface");
    style_ =
        choice(rows, "view.style", "Style", {"Shaded", "Shaded with edges", "Wireframe"}, "How the surface is drawn");
    coloring_ =
        choice(rows, "view.coloring", "Colours", {"Its own", "Error", "Levels", "Patches"},
               "The mesh's own; how far it is from the full deformation; at which level a vertex is added; patches of "
               "regular quads");
    error_ = text(rows, "view.error", Tone::quiet);
    measure_ = new ActionButton("view.measure", window.actions().find("view.measure_error"), {}, page());
    beside(rows, {measure_});
    add_switch(rows, "view.split", "Split view", "Driver, restored mesh and full deformation side by side",
               &ViewSettings::split);
    add_switch(rows, "view.driver", "Driver over the mesh", "The driver's edges over the mesh", &ViewSettings::driver);

    rows = section("Inside");
    add_switch(rows, "view.inside_points", "Inside points", "Points inside the mesh at rest",
               &ViewSettings::inside_points);
    NumberSpec spec = {.least = 100, .most = 100000, .decimals = 0, .logarithmic = true, .neutral = 3000};
    points_ = number(rows, "view.point_count", "Count", spec, "About so many points");
    add_switch(rows, "view.clip", "Clip plane", "Cuts the mesh open", &ViewSettings::clip);
    clip_axis_ = choice(rows, "view.clip_axis", "Across", {"x", "y", "z"}, "The axis that the plane stands across");
    spec = {.least = 0, .most = 100, .step = 1, .decimals = 0, .unit = "%", .neutral = 50};
    clip_ = number(rows, "view.clip_at", "At", spec, "Where along the axis, per cent of the box");

    rows = section("Speed");
    add_switch(rows, "view.level_by_distance", "Level by distance",
               "The level shown follows the size on the screen: far away, fewer vertices are drawn",
               &ViewSettings::level_by_distance);
    drawn_ = text(rows, "view.drawn", Tone::quiet);
    add_switch(rows, "view.keep_up", "Coarser while moving", "A coarser level while things move, where drawing is slow",
               &ViewSettings::keep_up);

    rows = section("Scene");
    add_switch(rows, "view.ground", "Ground", "The ground with the object's shadow", &ViewSettings::ground);
    up_ = choice(rows, "view.up", "Up", {"x", "y", "z"}, "The axis that points up; gravity pulls the other way");
    theme_ = choice(rows, "view.theme", "Theme", {"As the system", "Light", "Dark"}, "The colours of the window");

    const auto connect_choice = [this](QComboBox* box, auto set) {
        connect(box, &QComboBox::currentIndexChanged, this,
                [this, set](int index) { change([&](ViewSettings& settings) { set(settings, index); }); });
    };
    connect_choice(style_, [](ViewSettings& s, int i) { s.style = static_cast<SurfaceStyle>(i); });
    connect_choice(coloring_, [](ViewSettings& s, int i) { s.coloring = static_cast<Coloring>(i); });
    connect_choice(clip_axis_, [](ViewSettings& s, int i) { s.clip_axis = i; });
    connect_choice(up_, [](ViewSettings& s, int i) { s.up = static_cast<UpAxis>(i); });
    connect(theme_, &QComboBox::currentIndexChanged, this, [this](int i) { window_.set_theme(static_cast<Theme>(i)); });
    connect(points_, &NumberControl::changed, this,
            [this](double count) { change([&](ViewSettings& s) { s.inside_count = std::size_t(count); }); });
    connect(clip_, &NumberControl::changed, this,
            [this](double percent) { change([&](ViewSettings& s) { s.clip_at = percent / 100; }); });

    connect(&workbench_.view(), &ViewState::changed, this, &ViewPanel::refresh);
    connect(&workbench_, &Workbench::error_measured, this, &ViewPanel::show_error);
    connect(&workbench_, &Workbench::pose_changed, this, &ViewPanel::show_error);
    connect(&window_, &MainWindow::theme_changed, this, &ViewPanel::refresh);
    connect(&viewport_, &Viewport::timings_changed, this, &ViewPanel::show_drawn);
    refresh();
}

void ViewPanel::change(const std::function<void(ViewSettings&)>& edit) {
    ViewSettings settings = workbench_.view().settings();
    edit(settings);
    workbench_.view().set(settings);
}

void ViewPanel::refresh() {
    const ViewSettings& settings = workbench_.view().settings();
    set_silently(style_, int(settings.style));
    set_silently(coloring_, int(settings.coloring));
    for (const Switch& one : switches_) set_silently(one.box, settings.*one.field);
    points_->set_value(double(settings.inside_count));
    points_->set_visible(settings.inside_points);
    set_silently(clip_axis_, settings.clip_axis);
    show_row(clip_axis_, settings.clip);
    clip_->set_value(100 * settings.clip_at);
    clip_->set_visible(settings.clip);
    set_silently(up_, int(settings.up));
    set_silently(theme_, int(window_.theme()));
    show_error();
    show_drawn();
}

void ViewPanel::show_error() {
    const bool shown = workbench_.view().settings().coloring == Coloring::error;
    const QString text = error_text(workbench_, true);
    error_->setText(text.isEmpty() ? QStringLiteral("Not measured for what is shown.") : text);
    error_->setVisible(shown);
    measure_->setVisible(shown);
}

void ViewPanel::show_drawn() {
    const Timings& timings = viewport_.timings();
    drawn_->setText(timings.vertices == 0 ? QString()
                                          : QStringLiteral("Drawn: level %1, %2.")
                                                .arg(timings.level)
                                                .arg(counted(timings.vertices, "vertex", "vertices")));
    drawn_->setVisible(timings.vertices > 0);
}

} // namespace filigree::studio
