#include "panels/panels.h"

#include "actions.h"
#include "panel.h"

#include <QMenu>

namespace filigree::studio {
namespace {

struct DefectRow {
    const char *one, *many;
    const Finding TopologyReport::*finding;
};
constexpr DefectRow kDefects[] = {
    {"open edge", "open edges", &TopologyReport::open_edges},
    {"edge with three faces or more", "edges with three faces or more", &TopologyReport::nonmanifold_edges},
    {"edge between opposed faces", "edges between opposed faces", &TopologyReport::inconsistent_edges},
    {"vertex where surfaces touch", "vertices where surfaces touch", &TopologyReport::nonmanifold_vertices},
    {"face without area", "faces without area", &TopologyReport::degenerate_faces},
    {"face twice", "faces twice", &TopologyReport::duplicate_faces},
    {"vertex in no face", "vertices in no face", &TopologyReport::unused_vertices},
    {"vertex at the place of another", "vertices at the place of another", &TopologyReport::duplicate_vertices},
};

/// A number of the shape's options.
Field<studio::Shape> shape_field(const Field<ShapeOptions>& of) {
    return {[of](const studio::Shape& shape) { return of.get(shape.options); },
            [of](studio::Shape& shape, double number) { of.set(shape.options, number); }};
}

class ModelPanel : public Panel {
public:
    ModelPanel(Workbench& workbench, const Actions& actions, QMenu* recent_files) : Panel("model", workbench) {
        add_mesh(actions, recent_files);
        add_shape();
        QGridLayout* rows = section("Defects");
        verdict_ = text(rows, "model.verdict");
        defects_ = text(rows, "model.defects");
        const auto has_edges_to_mark = [this](const ViewSettings&) {
            const auto& source = state().source;
            return source && source->topology.faces > 0 &&
                   source->topology.open_edges.count + source->topology.nonmanifold_edges.count > 0;
        };
        check(rows, view_settings().setting("view.defects", "Show in the view",
                                            "Marks open and non-manifold edges in the view",
                                            field(&ViewSettings::defects), has_edges_to_mark));
        beside(section("Save"),
               {new ActionButton("model.save", actions.find("file.save"), "Model", page()),
                new ActionButton("model.save_mesh", actions.find("file.save_mesh"), "Mesh…", page()),
                new ActionButton("model.save_driver", actions.find("file.save_driver"), "Driver…", page())});
        refresh();
    }

private:
    void add_mesh(const Actions& actions, QMenu* recent_files) {
        QGridLayout* rows = section({});
        name_ = new ElidedText("model.name", Qt::ElideMiddle, Tone::plain, page());
        rows->addWidget(name_, rows->rowCount(), 0, 1, 3);
        QFont font = name_->font();
        font.setBold(true);
        font.setPointSizeF(font.pointSizeF() * 1.15);
        name_->setFont(font);
        name_->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred);
        facts_ = text(rows, "model.facts", Tone::quiet);
        warnings_ = text(rows, "model.warnings");
        auto* recent = new QPushButton("Recent", page());
        recent->setObjectName("model.recent");
        recent->setToolTip("Files opened lately");
        recent->setAccessibleName("Recent");
        recent->setFocusPolicy(Qt::TabFocus);
        recent->setMenu(recent_files);
        beside(rows, {new ActionButton("model.open", actions.find("file.open"), {}, page()), recent});
    }

    void add_shape() {
        QGridLayout* rows = section("Built-in shape");
        const OptionsAccess<studio::Shape> shape = {
            [this] { return workbench().wanted_shape().value_or(studio::Shape{}); },
            [this](const studio::Shape& to, const std::string& merge) { workbench().make_shape(to, merge); }};
        QStringList titles;
        for (const std::string_view name : shape_names()) titles << title_of(std::string(name));
        choice(rows,
               {"model.shape", "Shape", "A shape to try things with, made anew at once",
                [this] {
                    const auto& wanted = workbench().wanted_shape();
                    const auto names = shape_names();
                    return double(wanted ? std::ranges::find(names, wanted->name) - names.begin() : std::ssize(names));
                },
                [this, shape](double index) {
                    studio::Shape wanted = shape.get();
                    if (index < 0 || index >= double(shape_names().size())) return refresh();
                    wanted.name = shape_names()[std::size_t(index)];
                    shape.set(wanted, {});
                }},
               titles << "None of these");
        using IsFor = bool (*)(std::string_view name); // whether a shape of that name has it
        const auto add = [&](const char* name, const char* label, const char* tooltip, const Field<ShapeOptions>& of,
                             const NumberSpec& spec, IsFor is_for) {
            const auto is_shown = [this, is_for](const studio::Shape&) {
                return state().shape && is_for(state().shape->name);
            };
            number(rows, shape.setting(name, label, tooltip, shape_field(of), is_shown), spec);
        };
        const IsFor any = [](std::string_view) { return true; };
        const IsFor wavy = [](std::string_view name) { return name.starts_with("wavy") || name == "torus"; };
        const IsFor is_long = [](std::string_view name) { return name == "bar" || name == "cylinder"; };
        const IsFor has_thickness = [](std::string_view name) { return name == "torus" || name == "wavy-plate"; };
        using Options = ShapeOptions;
        add("model.resolution", "Resolution", "Quads along a side", field(&Options::resolution),
            {.least = 3, .most = 512, .decimals = 0, .logarithmic = true, .neutral = 64}, any);
        add("model.frequency", "Frequency", "Waves along a side, or around", field(&Options::frequency),
            {.least = 0, .most = 20, .step = 0.25, .decimals = 2, .neutral = 5}, wavy);
        add("model.amplitude", "Amplitude", "Height of the waves, per cent of the side or radius",
            field(&Options::amplitude, 100),
            {.least = 0, .most = 20, .step = 0.1, .decimals = 1, .unit = "%", .neutral = 4}, wavy);
        add("model.length", "Length", "As a multiple of the side or diameter", field(&Options::length),
            {.least = 1, .most = 12, .step = 0.1, .decimals = 1, .unit = "×", .neutral = 4}, is_long);
        add("model.thickness", "Thickness", "Of the tube, per cent of the ring's radius; of a plate, of its side",
            field(&Options::thickness, 100),
            {.least = 1, .most = 90, .step = 1, .decimals = 0, .unit = "%", .neutral = 30}, has_thickness);
        add("model.size", "Size", "Side or diameter, model units", field(&Options::size),
            {.least = 0.01, .most = 100, .decimals = 2, .unit = "units", .logarithmic = true, .neutral = 1}, any);
    }

    void refresh() override {
        Panel::refresh();
        const Source* const source = state().source.get();
        if (source && source == shown_) return;
        shown_ = source;
        show_facts();
        show_warnings();
        show_defects();
    }

    void show_facts() {
        if (!shown_) {
            name_->setText("No mesh");
            return facts_->setText("Open one, or choose a shape below.");
        }
        const TopologyReport& topology = shown_->topology;
        name_->setText(QString::fromStdString(shown_->name));
        name_->setToolTip(shown_->path.empty() ? QStringLiteral("A built-in shape")
                                               : QString::fromStdString(shown_->path));
        const QString kind = topology.faces == 0                    ? "points only"
                             : topology.quads == topology.faces     ? "quads"
                             : topology.triangles == topology.faces ? "triangles"
                                                                    : "mixed polygons";
        const Vec3d size = topology.box.size();
        QString facts =
            QStringLiteral("%1, %2 (%3)\n%4 × %5 × %6 units")
                .arg(counted(topology.vertices, "vertex", "vertices"), counted(topology.faces, "face", "faces"), kind,
                     number_text(size.x()), number_text(size.y()), number_text(size.z()));
        if (topology.faces > 0)
            facts += (topology.is_closed() ? "\nclosed, " : "\nopen, ") + counted(topology.components, "part", "parts");
        facts_->setText(facts);
    }

    void show_warnings() {
        QStringList warnings;
        if (shown_)
            for (const std::string& warning : shown_->warnings) warnings << QString::fromStdString(warning);
        constexpr qsizetype kShown = 4;
        const qsizetype left = warnings.size() - kShown;
        if (left > 0) warnings = warnings.mid(0, kShown) << QStringLiteral("… and %1 more").arg(left);
        warnings_->setText(warnings.join('\n'));
        warnings_->setVisible(!warnings.isEmpty());
    }

    void show_defects() {
        QStringList found;
        if (shown_)
            for (const DefectRow& row : kDefects)
                if (const std::size_t count = (shown_->topology.*row.finding).count; count > 0)
                    found << counted(count, row.one, row.many);
        const bool is_surface = shown_ && shown_->topology.faces > 0, is_good = is_surface && found.isEmpty();
        verdict_->setText(is_good ? QStringLiteral("✓ No defects")
                                  : QStringLiteral("Points have no defects to look for."));
        verdict_->set_tone(is_good ? Tone::good : Tone::quiet);
        verdict_->setVisible(is_good || (shown_ && !is_surface));
        defects_->setText(is_surface ? found.join('\n') : QString());
        defects_->setVisible(is_surface && !found.isEmpty());
    }

    Text *name_ = nullptr, *facts_ = nullptr, *warnings_ = nullptr, *verdict_, *defects_;
    const Source* shown_ = nullptr; ///< whose defects are listed
};

} // namespace

QWidget* make_model_panel(Workbench& workbench, const Actions& actions, QMenu* recent_files) {
    return new ModelPanel(workbench, actions, recent_files);
}

} // namespace filigree::studio
