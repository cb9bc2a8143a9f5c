#include "panels/body_panel.h"

#include "actions.h"

#include "filigree/physics/named_materials.h"

#include <cmath>

namespace filigree::studio {
namespace {

constexpr double kCelsius = 273.15; ///< K

constexpr double kLeastParticles = 100, kMostParticles = 100000;

/// What plasticity and melting begin with when they are switched on by hand.
constexpr double kSomeYield = 1e4;                             // Pa: a tenth of a soft material's stiffness
constexpr double kSomeMeltingFrom = 318, kSomeMeltingTo = 338; // K: as wax

} // namespace

BodyPanel::BodyPanel(Workbench& workbench, const Actions& actions, QWidget* parent)
    : Panel("body", parent), workbench_(workbench) {
    add_material();

    QGridLayout* rows = section({});
    beside(rows, {new ActionButton("body.make_body", actions.find("body.make"), {}, page()),
                  new ActionButton("body.drop", actions.find("body.animate"), {}, page())});
    auto* buttons = new QHBoxLayout;
    buttons->setSpacing(4);
    buttons->addWidget(icon_button("body.reset_button", actions.find("body.reset"), page()));
    play_ = icon_button("body.play_button", actions.find("body.play"), page());
    buttons->addWidget(play_);
    buttons->addWidget(icon_button("body.step_button", actions.find("body.step"), page()));
    buttons->addStretch(1);
    particles_ = new QCheckBox("Particles", page());
    particles_->setObjectName("view.particles");
    particles_->setToolTip("The particles of the body instead of its surface");
    particles_->setAccessibleName("Particles");
    particles_->setFocusPolicy(Qt::TabFocus);
    buttons->addWidget(particles_);
    rows->addLayout(buttons, rows->rowCount(), 0, 1, 3);
    report_ = text(rows, "body.report", Tone::quiet);

    add_world();
    add_advanced();

    connect(particles_, &QCheckBox::toggled, this, [this](bool shown) {
        ViewSettings settings = workbench_.view().settings();
        settings.particles = shown;
        workbench_.view().set(settings);
    });
    const auto show_play = [this, &actions] {
        QAction* action = actions.find(workbench_.is_playing() ? "body.pause" : "body.play");
        if (play_->defaultAction() == action) return;
        play_->removeAction(play_->defaultAction());
        play_->setDefaultAction(action);
    };
    connect(&workbench_, &Workbench::timeline_changed, this, show_play);
    connect(&workbench_.playback(), &Playback::state_changed, this, [this, show_play] {
        show_play();
        refresh();
    });
    connect(&workbench_.document(), &Document::changed, this, &BodyPanel::refresh);
    connect(&workbench_, &Workbench::opened, this, &BodyPanel::refresh);
    connect(&workbench_.view(), &ViewState::changed, this, &BodyPanel::refresh);
    refresh();
}

void BodyPanel::add_material() {
    QGridLayout* rows = section("Material");
    QStringList names;
    for (const NamedMaterial& named : named_materials()) names << shape_title(std::string(named.name));
    names << "Custom";
    preset_ = choice(rows, "body.preset", "Preset", names, "Materials to begin with");
    connect(preset_, &QComboBox::currentIndexChanged, this, [this](int index) {
        const auto materials = named_materials();
        change({}, [&](BodySettings& settings) {
            if (index < 0 || std::size_t(index) >= materials.size()) {
                settings.preset = "custom";
                return;
            }
            settings.preset = std::string(materials[std::size_t(index)].name);
            settings.material = materials[std::size_t(index)].material;
        });
    });
    sentence_ = text(rows, "body.sentence", Tone::quiet);
    material(rows, "body.young", "Stiffness",
             {.least = 1e3, .most = 1e10, .decimals = 0, .unit = "Pa", .logarithmic = true, .thousands = true},
             "Young's modulus, pascals: jelly 20 kPa, rubber 1 MPa, steel 200 GPa", &Material::young_modulus);
    material(rows, "body.density", "Density",
             {.least = 10, .most = 20000, .decimals = 0, .unit = "kg/m³", .logarithmic = true},
             "Kilograms a cubic metre: foam 60, water 1,000, steel 7,800", &Material::density);
    setting(
        rows, "body.particles", "Particles",
        {.least = kLeastParticles, .most = kMostParticles, .decimals = 0, .logarithmic = true},
        "About so many particles move; more are finer and slower",
        [](const BodySettings& s) { return double(s.particles); },
        [](BodySettings& s, double v) { s.particles = std::size_t(v); });
    spacing_ = setting(
        rows, "body.spacing", "Spacing", {.least = 0.1, .most = 1000, .decimals = 1, .unit = "mm", .logarithmic = true},
        "How far apart the particles are, about, millimetres: another way to say how many there are",
        [this](const BodySettings& s) { return 1000 * std::cbrt(volume(s) / double(s.particles)); },
        [this](BodySettings& s, double v) {
            const double count = std::round(volume(s) / std::pow(v / 1000, 3));
            if (count > 0) s.particles = std::size_t(std::clamp(count, kLeastParticles, kMostParticles));
        });
    setting(
        rows, "body.size", "Size", {.least = 0.01, .most = 100, .decimals = 2, .unit = "m", .logarithmic = true},
        "The longest side of the mesh, metres", [](const BodySettings& s) { return s.size; },
        [](BodySettings& s, double v) { s.size = v; });
}

void BodyPanel::add_world() {
    QGridLayout* rows = section("World");
    ground_ = check(rows, "body.ground", "Ground", "A floor to fall on");
    gravity_ = check(rows, "body.gravity", "Gravity", "9.81 m/s² downwards");
    connect(ground_, &QCheckBox::toggled, this,
            [this](bool on) { change({}, [on](BodySettings& s) { s.ground = on; }); });
    connect(gravity_, &QCheckBox::toggled, this,
            [this](bool on) { change({}, [on](BodySettings& s) { s.gravity = on; }); });
    drop_ = setting(
        rows, "body.drop_height", "Drop", {.least = 0, .most = 5, .step = 0.05, .decimals = 2, .unit = "m"},
        "Metres above the ground at the start", [](const BodySettings& s) { return s.drop; },
        [](BodySettings& s, double v) { s.drop = v; });
    obstacle_ = choice(rows, "body.obstacle", "Obstacle", {"None", "Ball", "Step", "Slope"}, "Something to fall on");
    connect(obstacle_, &QComboBox::currentIndexChanged, this, [this](int index) {
        change({}, [index](BodySettings& s) { s.obstacle = static_cast<ObstacleChoice>(index); });
    });
    setting(
        rows, "body.friction", "Friction", {.least = 0, .most = 2, .step = 0.05, .decimals = 2},
        "Coulomb's coefficient: 0 slides for ever", [](const BodySettings& s) { return s.friction; },
        [](BodySettings& s, double v) { s.friction = v; });
    setting(
        rows, "body.restitution", "Bounce", {.least = 0, .most = 1, .step = 0.05, .decimals = 2},
        "Restitution of the ground: speed after a bounce over that before, for hard points",
        [](const BodySettings& s) { return s.restitution; }, [](BodySettings& s, double v) { s.restitution = v; });
}

void BodyPanel::add_advanced() {
    fold_ = new FoldButton("body.advanced", "Advanced", "Further settings of the material", page());
    advanced_ = new QWidget(page());
    advanced_->setObjectName("body.advanced.page");
    auto* rows = new QGridLayout(advanced_);
    rows->setContentsMargins(0, 0, 0, 0);
    rows->setVerticalSpacing(5);
    line_up(rows);
    layout_of_page()->insertWidget(layout_of_page()->count() - 1, fold_, 0, Qt::AlignLeft);
    layout_of_page()->insertWidget(layout_of_page()->count() - 1, advanced_);
    advanced_->hide();
    connect(fold_, &QToolButton::toggled, advanced_, &QWidget::setVisible);

    model_ = choice(rows, "body.model", "Method", {"Finite elements", "Springs", "Meshfree"},
                    "How elasticity is computed. Meshfree is the one that flows and melts.");
    connect(model_, &QComboBox::currentIndexChanged, this, [this](int index) {
        change_material({}, [index](Material& m) { m.model = static_cast<MaterialModel>(index); });
    });
    poisson_ =
        material(rows, "body.poisson", "Poisson", {.least = 0, .most = 0.49, .step = 0.01, .decimals = 2},
                 "Poisson's ratio: how much thinner when stretched; 0.49 keeps the volume", &Material::poisson_ratio);
    material(rows, "body.damping", "Air drag", {.least = 0, .most = 10, .step = 0.1, .decimals = 1, .unit = "1/s"},
             "Share of its speed that motion loses a second", &Material::damping);
    material(rows, "body.internal_damping", "Damping",
             {.least = 0, .most = 0.05, .step = 0.0005, .decimals = 4, .unit = "s"},
             "Of the wobbling inside, seconds (Kelvin-Voigt)", &Material::internal_damping);
    bending_ = material(rows, "body.bending", "Bending", {.least = 0, .most = 0.2, .step = 0.01, .decimals = 2},
                        "Springs: share of the stiffness given to bending", &Material::bending);
    plastic_ = check(rows, "body.plastic", "Keeps dents", "Meshfree: stress beyond the yield stress stays as shape");
    connect(plastic_, &QCheckBox::toggled, this, [this](bool on) {
        change_material({}, [on](Material& m) { m.yield_stress = on ? kSomeYield : Material::kNever; });
    });
    yield_ = material(rows, "body.yield", "Yield",
                      {.least = 100, .most = 1e9, .decimals = 0, .unit = "Pa", .logarithmic = true, .thousands = true},
                      "Stress from which shape is lost, pascals", &Material::yield_stress);
    creep_ = material(rows, "body.creep", "Creep", {.least = 0, .most = 1, .step = 0.01, .decimals = 2, .unit = "s"},
                      "How fast stress beyond yield relaxes, seconds; 0: at once", &Material::creep_time);
    melts_ = check(rows, "body.melts", "Melts", "Meshfree: stiff when cold, fluid when warm");
    connect(melts_, &QCheckBox::toggled, this, [this](bool on) {
        change_material({}, [on](Material& m) {
            m.melting_from = on ? kSomeMeltingFrom : Material::kNever;
            m.melting_to = on ? kSomeMeltingTo : Material::kNever;
        });
    });
    const NumberSpec temperature = {.least = -50, .most = 500, .step = 1, .decimals = 0, .unit = "°C"};
    melting_from_ = setting(
        rows, "body.melting_from", "Soft from", temperature, "Stiff below, degrees Celsius",
        [](const BodySettings& s) { return s.material.melting_from - kCelsius; },
        [](BodySettings& s, double v) {
            s.material.melting_from = v + kCelsius;
            s.material.melting_to = std::max(s.material.melting_to, s.material.melting_from);
            s.preset = "custom";
        });
    melting_to_ = setting(
        rows, "body.melting_to", "Fluid from", temperature, "Fluid above, degrees Celsius",
        [](const BodySettings& s) { return s.material.melting_to - kCelsius; },
        [](BodySettings& s, double v) {
            s.material.melting_to = v + kCelsius;
            s.material.melting_from = std::min(s.material.melting_from, s.material.melting_to);
            s.preset = "custom";
        });
    viscosity_ = material(rows, "body.viscosity", "Viscosity",
                          {.least = 0.01, .most = 1e5, .decimals = 2, .unit = "Pa s", .logarithmic = true},
                          "Of the melt, pascal seconds", &Material::viscosity);
    temperature_ = setting(
        rows, "body.temperature", "Temperature", temperature, "At the start, degrees Celsius",
        [](const BodySettings& s) { return s.material.temperature - kCelsius; },
        [](BodySettings& s, double v) {
            s.material.temperature = v + kCelsius;
            s.preset = "custom";
        });
    heating_ =
        material(rows, "body.heating", "Heating", {.least = 0, .most = 200, .step = 1, .decimals = 0, .unit = "K/s"},
                 "How fast the surface warms, kelvins a second", &Material::heating);
}

NumberControl* BodyPanel::setting(QGridLayout* rows, const QString& name, const QString& label, const NumberSpec& spec,
                                  const QString& tooltip, std::function<double(const BodySettings&)> get,
                                  std::function<void(BodySettings&, double)> set) {
    NumberControl* control = number(rows, name, label, spec, tooltip);
    settings_.push_back({control, std::move(get)});
    connect(control, &NumberControl::changed, this,
            [this, set = std::move(set), merge = name.toStdString()](double value) {
                change(merge, [&](BodySettings& settings) { set(settings, value); });
            });
    connect(control, &NumberControl::released, this, [this] { workbench_.document().end_merge(); });
    return control;
}

NumberControl* BodyPanel::material(QGridLayout* rows, const QString& name, const QString& label, const NumberSpec& spec,
                                   const QString& tooltip, double Material::*field, double off) {
    return setting(
        rows, name, label, spec, tooltip,
        [field, off](const BodySettings& s) { return std::isfinite(s.material.*field) ? s.material.*field : off; },
        [field](BodySettings& s, double v) {
            s.material.*field = v;
            s.preset = "custom";
        });
}

void BodyPanel::change(const std::string& merge, const std::function<void(BodySettings&)>& edit) {
    BodySettings settings = workbench_.state().body;
    edit(settings);
    if (!(settings == workbench_.state().body)) workbench_.set_body(settings, merge);
}

void BodyPanel::change_material(const std::string& merge, const std::function<void(Material&)>& edit) {
    change(merge, [&](BodySettings& settings) {
        edit(settings.material);
        settings.preset = "custom";
    });
}

bool BodyPanel::is_unfolded() const { return fold_->isChecked(); }
void BodyPanel::set_unfolded(bool unfolded) { fold_->setChecked(unfolded); }

double BodyPanel::volume(const BodySettings& settings) const {
    const auto& source = workbench_.state().source;
    if (!source || !source->topology.is_closed()) return 0;
    const double scale = settings.size / source->topology.box.size().maxCoeff();
    return std::abs(source->topology.volume) * scale * scale * scale;
}

void BodyPanel::refresh() {
    const BodySettings& settings = workbench_.state().body;
    const auto materials = named_materials();
    const auto named = std::find_if(materials.begin(), materials.end(),
                                    [&](const NamedMaterial& m) { return m.name == settings.preset; });
    set_silently(preset_, int(named - materials.begin()));
    sentence_->setText(named == materials.end()
                           ? QStringLiteral("Changed by hand.")
                           : shape_title(std::string(named->name)) + ": " +
                                 QString::fromUtf8(named->text.data(), qsizetype(named->text.size())) + '.');
    const double cubic_metres = volume(settings);
    spacing_->set_visible(cubic_metres > 0);
    const auto spacing = [&](double count) { // to what the number shows
        return std::max(0.1, std::round(1e4 * std::cbrt(cubic_metres / count)) / 10);
    };
    if (cubic_metres > 0) spacing_->set_range(spacing(kMostParticles), spacing(kLeastParticles));
    for (const Setting& setting : settings_) setting.control->set_value(setting.get(settings));
    set_silently(ground_, settings.ground);
    set_silently(gravity_, settings.gravity);
    set_silently(obstacle_, int(settings.obstacle));
    set_silently(model_, int(settings.material.model));
    set_silently(plastic_, settings.material.is_plastic());
    set_silently(melts_, settings.material.melts());
    set_silently(particles_, workbench_.view().settings().particles);
    particles_->setEnabled(workbench_.playback().has_body());
    show_rows();
    const QString text = report();
    if (report_->text() != text) report_->setText(text);
}

void BodyPanel::show_rows() {
    const Material& material = workbench_.state().body.material;
    const bool meshfree = material.model == MaterialModel::meshfree, springs = material.model == MaterialModel::springs;
    poisson_->set_visible(!springs);
    bending_->set_visible(springs);
    plastic_->setVisible(meshfree);
    melts_->setVisible(meshfree);
    for (NumberControl* control : {yield_, creep_}) control->set_visible(meshfree && material.is_plastic());
    for (NumberControl* control : {melting_from_, melting_to_, viscosity_, temperature_, heating_})
        control->set_visible(meshfree && material.melts());
    drop_->set_enabled(workbench_.state().body.ground);
}

QString BodyPanel::report() const {
    const auto made = workbench_.playback().made();
    if (!made)
        return workbench_.frame_count() > 1 ? QStringLiteral("Recorded; make the body again to go on.")
                                            : QStringLiteral("No body yet.");
    QString text = QStringLiteral("%1, %2 mm apart, %3 kg.")
                       .arg(counted(made->body->particle_count(), "particle", "particles"),
                            number_text(1000 * made->body->spacing()), number_text(made->report.mass));
    if (!made->report.warning.empty()) text += '\n' + QString::fromStdString(made->report.warning);
    return text;
}

} // namespace filigree::studio
