#include "panels/panels.h"

#include "actions.h"
#include "panel.h"
#include "pieces.h"
#include "softness.h"

#include "filigree/physics/material.h"
#include "filigree/scene/scene_keys.h"

#include <algorithm>
#include <cmath>

namespace filigree::studio {
namespace {

constexpr double kCelsius = 273.15; ///< K

constexpr double kLeastParticles = 100, kMostParticles = 100000;

/// What plasticity and melting begin with when they are switched on by hand.
constexpr double kSomeYield = 1e4;                             // Pa: a tenth of a soft material's stiffness
constexpr double kSomeMeltingFrom = 318, kSomeMeltingTo = 338; // K: as wax

using Body = BodySettings;

/// A number of the material, by its key in scenes.
const SceneKey& material_key(std::string_view name) { return *find_key("body", name); }
Field<Body> material_field(std::string_view name, double offset = 0) {
    const SceneKey& key = material_key(name);
    return {[=, &key](const Body& body) {
                Material material = body.material;
                return number_in(material, key) - offset;
            },
            [=, &key](Body& body, double number) { number_in(body.material, key) = number + offset; }};
}
/// Whether it does something for the body's model.
bool does_something(std::string_view name, const Body& body) {
    const std::string_view models = material_key(name).use.models;
    std::vector<std::string_view> all;
    each_word(material_key("model").values.words, [&](std::string_view word) { all.push_back(word); });
    return models.empty() || has_word(models, all[std::size_t(body.material.model)]);
}

template <class Value>
Field<Body> drop_field(Value DropOptions::*member) {
    return field(static_cast<Value Body::*>(member));
}

/// The preset as an index of named_materials(), one beyond them for a material changed by hand.
const Field<Body> kPreset = {[](const Body& body) {
                                 const auto materials = named_materials();
                                 return double(std::ranges::find(materials, body.preset, &NamedMaterial::name) -
                                               materials.begin());
                             },
                             [](Body& body, double index) {
                                 const auto materials = named_materials();
                                 const bool is_named = index >= 0 && index < double(materials.size());
                                 body.preset = is_named ? materials[std::size_t(index)].name : "custom";
                                 if (is_named) body.material = materials[std::size_t(index)].material;
                             }};

const Field<Body> kModel = {[](const Body& body) { return double(body.material.model); },
                            [](Body& body, double index) { body.material.model = MaterialModel(int(index)); }};
const Field<Body> kPlastic = {
    [](const Body& body) { return double(body.material.is_plastic()); },
    [](Body& body, double on) { body.material.yield_stress = on ? kSomeYield : Material::kNever; }};
const Field<Body> kMelts = {[](const Body& body) { return double(body.material.melts()); },
                            [](Body& body, double on) {
                                body.material.melting_from = on ? kSomeMeltingFrom : Material::kNever;
                                body.material.melting_to = on ? kSomeMeltingTo : Material::kNever;
                            }};
// Neither end of the melting range goes beyond the other.
const Field<Body> kMeltingFrom = {[](const Body& body) { return body.material.melting_from - kCelsius; },
                                  [](Body& body, double degrees) {
                                      body.material.melting_from = degrees + kCelsius;
                                      body.material.melting_to =
                                          std::max(body.material.melting_to, body.material.melting_from);
                                  }};
const Field<Body> kMeltingTo = {[](const Body& body) { return body.material.melting_to - kCelsius; },
                                [](Body& body, double degrees) {
                                    body.material.melting_to = degrees + kCelsius;
                                    body.material.melting_from =
                                        std::min(body.material.melting_from, body.material.melting_to);
                                }};

bool is_of_mpm(const Body& body) { return body.material.model == MaterialModel::mpm; }
bool may_yield(const Body& body) { return does_something("yield_stress", body); }
bool is_plastic(const Body& body) { return may_yield(body) && body.material.is_plastic(); }
bool melts(const Body& body) { return is_of_mpm(body) && body.material.melts(); }

class BodyPanel : public Panel {
public:
    BodyPanel(Workbench& workbench, const Actions& actions) : Panel("body", workbench) {
        add_material(actions);
        add_motion(actions);
        add_world();
        add_advanced();
        refresh();
    }

private:
    /// A material that is changed is no preset any more.
    OptionsAccess<BodySettings> body() {
        return {[this] { return state().body; },
                [this](const BodySettings& to, const std::string& merge) {
                    BodySettings settings = to;
                    const BodySettings& before = state().body;
                    if (to.material != before.material && to.preset == before.preset) settings.preset = "custom";
                    workbench().set_body(settings, merge);
                }};
    }

    void add_material(const Actions& actions) {
        QGridLayout* rows = section("Material");
        const auto settings = body();
        QStringList names;
        for (const NamedMaterial& named : named_materials()) names << title_of(std::string(named.name));
        choice(rows, settings.setting("body.preset", "Preset", "Materials to begin with", kPreset), names << "Custom");
        sentence_ = text(rows, "body.sentence", Tone::quiet);
        number(rows,
               settings.setting("body.young", "Stiffness",
                                "Young's modulus, pascals: jelly 20 kPa, rubber 1 MPa, steel 200 GPa",
                                material_field("young_modulus")),
               {.least = 1e3, .most = 1e10, .decimals = 0, .unit = "Pa", .logarithmic = true, .thousands = true});
        number(rows,
               settings.setting("body.density", "Density", "Kilograms a cubic metre: foam 60, water 1,000, steel 7,800",
                                material_field("density")),
               {.least = 10, .most = 20000, .decimals = 0, .unit = "kg/m³", .logarithmic = true});
        number(rows,
               settings.setting("body.particles", "Particles",
                                "About so many particles move; more are finer and slower",
                                drop_field(&Body::particles)),
               {.least = kLeastParticles, .most = kMostParticles, .decimals = 0, .logarithmic = true});
        const Field<Body> spacing = {
            [this](const Body& body) { return 1000 * std::cbrt(volume(body) / double(body.particles)); },
            [this](Body& body, double millimetres) {
                const double count = std::round(volume(body) / std::pow(millimetres / 1000, 3));
                if (count > 0) body.particles = std::size_t(std::clamp(count, kLeastParticles, kMostParticles));
            }};
        spacing_ =
            number(rows,
                   settings.setting(
                       "body.spacing", "Spacing",
                       "How far apart the particles are, about, millimetres: another way to say how many there are",
                       spacing, [this](const Body& body) { return volume(body) > 0; }),
                   {.least = 0.1, .most = 1000, .decimals = 1, .unit = "mm", .logarithmic = true});
        number(rows,
               settings.setting("body.size", "Size", "The longest side of the mesh, metres", drop_field(&Body::size)),
               {.least = 0.01, .most = 100, .decimals = 2, .unit = "m", .logarithmic = true});
        const auto is_painted = [this](const Body&) { return softness_of(state()) != nullptr; };
        number(rows,
               settings.setting("body.softest", "Painted",
                                "Stiffness where softness is painted, as a multiple of the material's; above 1 it is "
                                "stiffer there",
                                field(&Body::softest), is_painted),
               {.least = 0.01, .most = 100, .decimals = 2, .unit = "×", .logarithmic = true, .neutral = 0.1});
        beside(rows, {new ActionButton("body.soften", actions.find("tool.soften"), "Paint softness", page()),
                      new ActionButton("body.unpaint", actions.find("body.clear_softness"), {}, page())});
    }

    void add_motion(const Actions& actions) {
        QGridLayout* rows = section({});
        beside(rows, {new ActionButton("body.make_body", actions.find("body.make"), {}, page()),
                      new ActionButton("body.drop", actions.find("body.animate"), {}, page())});
        auto* buttons = new QHBoxLayout;
        buttons->setSpacing(4);
        buttons->addWidget(icon_button("body.reset_button", actions.find("body.reset"), page()));
        buttons->addWidget(play_button("body.play_button", workbench(), actions.find("body.play"),
                                       actions.find("body.pause"), page()));
        buttons->addWidget(icon_button("body.step_button", actions.find("body.step"), page()));
        buttons->addStretch(1);
        buttons->addWidget(check(
            view_settings().setting("view.particles", "Particles", "The particles of the body instead of its surface",
                                    field(&ViewSettings::particles), {},
                                    [this](const ViewSettings&) { return workbench().playback().has_body(); })));
        rows->addLayout(buttons, rows->rowCount(), 0, 1, 3);
        melt_ = new ActionButton("body.melt_button", actions.find("body.melt"), {}, page());
        freeze_ = new ActionButton("body.freeze_button", actions.find("body.freeze"), {}, page());
        torch_ = new ActionButton("body.torch_button", actions.find("tool.torch"), {}, page());
        beside(rows, {melt_, freeze_, torch_});
        const auto can_melt = [this](const ViewSettings&) { return workbench().can_melt(); };
        number(
            rows,
            view_settings().setting("body.torch_size", "Torch size",
                                    "How far around the mouse the torch warms or cools, per cent of the body's longest "
                                    "side; four particles at least",
                                    field(&ViewSettings::torch_size, 100), can_melt),
            {.least = 2, .most = 100, .decimals = 0, .unit = "%", .logarithmic = true, .neutral = 15});
        number(rows,
               view_settings().setting("body.torch_seconds", "Torch melts in",
                                       "How long what the torch is held to takes to melt, seconds: less is hotter",
                                       field(&ViewSettings::torch_seconds), can_melt),
               {.least = 0.05, .most = 10, .decimals = 2, .unit = "s", .logarithmic = true});
        report_ = text(rows, "body.report", Tone::quiet);
        fit_driver_ = new ActionButton("body.fit", actions.find("body.fit_driver"), {}, page());
        beside(rows, {fit_driver_});
    }

    void add_world() {
        QGridLayout* rows = section("World");
        const auto settings = body();
        check(rows, settings.setting("body.ground", "Ground", "A floor to fall on", drop_field(&Body::ground)));
        check(rows, settings.setting("body.gravity", "Gravity", "9.81 m/s² downwards", drop_field(&Body::gravity)));
        number(rows,
               settings.setting("body.drop_height", "Drop", "Metres above the ground at the start",
                                drop_field(&Body::drop), {}, [](const Body& body) { return body.ground; }),
               {.least = 0, .most = 5, .step = 0.05, .decimals = 2, .unit = "m"});
        choice(rows, settings.setting("body.obstacle", "Obstacle", "Something to fall on", drop_field(&Body::obstacle)),
               {"None", "Ball", "Step", "Slope"});
        const Field<Body> air = {[](const Body& body) { return body.air_temperature - kCelsius; },
                                 [](Body& body, double degrees) { body.air_temperature = degrees + kCelsius; }};
        number(rows,
               settings.setting("body.air", "Air", "How warm the air is, degrees Celsius; may change while it plays",
                                air, melts),
               {.least = -150, .most = 1500, .step = 1, .decimals = 0, .unit = "°C"});
        number(rows,
               settings.setting("body.melting_time", "Melts in",
                                "About how long all of it takes to melt in air 60 °C warmer than its melt, seconds",
                                drop_field(&Body::melting_time), melts),
               {.least = 1, .most = 600, .decimals = 0, .unit = "s", .logarithmic = true});
        number(rows,
               settings.setting("body.friction", "Friction", "Coulomb's coefficient: 0 slides for ever",
                                drop_field(&Body::friction)),
               {.least = 0, .most = 2, .step = 0.05, .decimals = 2});
        number(rows,
               settings.setting("body.restitution", "Bounce",
                                "Restitution of the ground: speed after a bounce over that before, for hard points",
                                drop_field(&Body::restitution)),
               {.least = 0, .most = 1, .step = 0.05, .decimals = 2});
    }

    void add_advanced() {
        auto* fold = new FoldButton("body.advanced", "Advanced", "Further settings of the material", page());
        QGridLayout* rows = folded_section(fold);
        const auto settings = body();
        using Condition = OptionsAccess<Body>::Condition;
        /// Shown where its key does something for the model, and where `is_shown` says so.
        const auto add = [&](const char* name, const char* label, const char* key, const NumberSpec& spec,
                             const QString& tooltip, const Condition& is_shown = {}, double offset = 0) {
            const Condition does = [=](const Body& body) {
                return does_something(key, body) && (!is_shown || is_shown(body));
            };
            number(rows, settings.setting(name, label, tooltip, material_field(key, offset), does), spec);
        };
        const auto add_field = [&](const char* name, const char* label, const Field<Body>& of, const NumberSpec& spec,
                                   const QString& tooltip) {
            number(rows, settings.setting(name, label, tooltip, of, melts), spec);
        };
        choice(rows,
               settings.setting("body.model", "Method",
                                "How elasticity is computed. The grid method melts, parts and joins.", kModel),
               {"Finite elements", "Springs", "Meshfree", "Rigid", "Grid (mpm)"});
        add("body.poisson", "Poisson", "poisson_ratio", {.least = 0, .most = 0.49, .step = 0.01, .decimals = 2},
            "Poisson's ratio: how much thinner when stretched; 0.49 keeps the volume");
        add("body.damping", "Air drag", "damping", {.least = 0, .most = 10, .step = 0.1, .decimals = 1, .unit = "1/s"},
            "Share of its speed that motion loses a second");
        add("body.internal_damping", "Damping", "internal_damping",
            {.least = 0, .most = 0.05, .step = 0.0005, .decimals = 4, .unit = "s"},
            "Of the wobbling inside, seconds (Kelvin-Voigt)");
        add("body.bending", "Bending", "bending", {.least = 0, .most = 0.2, .step = 0.01, .decimals = 2},
            "Springs: share of the stiffness given to bending");
        check(rows, settings.setting("body.plastic", "Keeps dents", "Stress beyond the yield stress stays as shape",
                                     kPlastic, may_yield));
        add("body.yield", "Yield", "yield_stress",
            {.least = 100, .most = 1e9, .decimals = 0, .unit = "Pa", .logarithmic = true, .thousands = true},
            "Stress from which shape is lost, pascals", is_plastic);
        add("body.creep", "Creep", "creep_time", {.least = 0, .most = 1, .step = 0.01, .decimals = 2, .unit = "s"},
            "How fast stress beyond yield relaxes, seconds; 0: at once", is_plastic);
        check(rows, settings.setting("body.melts", "Melts", "Stiff when cold, fluid when warm", kMelts, is_of_mpm));
        const NumberSpec temperature = {.least = -50, .most = 500, .step = 1, .decimals = 0, .unit = "°C"};
        add_field("body.melting_from", "Soft from", kMeltingFrom, temperature, "Stiff below, degrees Celsius");
        add_field("body.melting_to", "Fluid from", kMeltingTo, temperature, "Fluid above, degrees Celsius");
        add("body.viscosity", "Viscosity", "viscosity",
            {.least = 0.01, .most = 1e5, .decimals = 2, .unit = "Pa s", .logarithmic = true},
            "Of the melt, pascal seconds", melts);
        add("body.temperature", "Temperature", "temperature", temperature, "At the start, degrees Celsius", melts,
            kCelsius);
        add("body.heating", "Heating", "heating", {.least = 0, .most = 200, .step = 1, .decimals = 0, .unit = "K/s"},
            "How fast the surface warms, kelvins a second", melts);
    }

    /// Of the mesh at that size, m³; 0 where it is open.
    double volume(const BodySettings& settings) const {
        const auto source = whole_source(state().source);
        if (!source || !source->topology.is_closed()) return 0;
        const double scale = settings.size / source->topology.box.size().maxCoeff();
        return std::abs(source->topology.volume) * scale * scale * scale;
    }

    void refresh() override {
        if (const double cubic_metres = volume(state().body); cubic_metres > 0) {
            const auto spacing = [&](double count) { // to what the number shows
                return std::max(0.1, std::round(1e4 * std::cbrt(cubic_metres / count)) / 10);
            };
            spacing_->set_range(spacing(kMostParticles), spacing(kLeastParticles));
        }
        Panel::refresh();
        sentence_->setText(sentence());
        if (const QString text = report(); report_->text() != text) report_->setText(text);
        fit_driver_->setVisible(!workbench().body_warning().isEmpty());
        for (QPushButton* button : {melt_, freeze_, torch_}) button->setVisible(workbench().can_melt());
    }

    QString sentence() const {
        const auto materials = named_materials();
        const auto named = std::ranges::find(materials, state().body.preset, &NamedMaterial::name);
        if (named == materials.end()) return "Changed by hand.";
        return title_of(std::string(named->name)) + ": " + QString::fromStdString(std::string(named->text)) + '.';
    }

    QString report() const {
        const auto made = workbench().playback().made();
        if (!made) return workbench().frame_count() > 1 ? "Recorded; make the body again to go on." : "No body yet.";
        QString text = QStringLiteral("%1, %2 mm apart, %3 kg.")
                           .arg(counted(made->body->particle_count(), "particle", "particles"),
                                number_text(1000 * made->body->spacing()), number_text(made->report.mass));
        const QString warning = workbench().body_warning();
        return warning.isEmpty() ? text : text + '\n' + warning;
    }

    Text *sentence_ = nullptr, *report_ = nullptr;
    QPushButton *fit_driver_ = nullptr, *melt_ = nullptr, *freeze_ = nullptr, *torch_ = nullptr;
    NumberControl* spacing_ = nullptr;
};

} // namespace

QWidget* make_body_panel(Workbench& workbench, const Actions& actions) { return new BodyPanel(workbench, actions); }

} // namespace filigree::studio
