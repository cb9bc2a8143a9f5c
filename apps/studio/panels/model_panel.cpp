#include "panels/model_panel.h"

#include "actions.h"
#include "icons.h"

namespace filigree::studio {
namespace {

int index_of(const std::string& name) {
    const auto names = shape_names();
    return int(std::find(names.begin(), names.end(), name) - names.begin());
}

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

QString size_text(const Vec3d& size) {
    return QStringLiteral("%1 × %2 × %3 units")
        .arg(number_text(size.x()), number_text(size.y()), number_text(size.z()));
}

} // namespace

ModelPanel::ModelPanel(Workbench& workbench, const Actions& actions, QMenu* recent_files, QWidget* parent)
    : Panel("model", parent), workbench_(workbench) {
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
    auto* recent = button("model.recent", "Recent", "Files opened lately");
    recent->setMenu(recent_files);
    beside(rows, {new ActionButton("model.open", actions.find("file.open"), {}, page()), recent});

    rows = section("Built-in shape");
    QStringList names;
    for (const std::string_view name : shape_names()) names << shape_title(std::string(name));
    names << "None of these";
    shape_ = choice(rows, "model.shape", "Shape", names, "A shape to try things with, made anew at once");
    NumberSpec spec;
    spec.least = 3;
    spec.most = 512;
    spec.decimals = 0;
    spec.logarithmic = true;
    spec.neutral = 64;
    resolution_ = number(rows, "model.resolution", "Resolution", spec, "Quads along a side");
    spec = {.least = 0, .most = 20, .step = 0.25, .decimals = 2, .neutral = 5};
    frequency_ = number(rows, "model.frequency", "Frequency", spec, "Waves along a side, or around");
    spec = {.least = 0, .most = 20, .step = 0.1, .decimals = 1, .unit = "%", .neutral = 4};
    amplitude_ =
        number(rows, "model.amplitude", "Amplitude", spec, "Height of the waves, per cent of the side or radius");
    spec = {.least = 1, .most = 12, .step = 0.1, .decimals = 1, .unit = "×", .neutral = 4};
    length_ = number(rows, "model.length", "Length", spec, "As a multiple of the side or diameter");
    spec = {.least = 5, .most = 90, .step = 1, .decimals = 0, .unit = "%", .neutral = 30};
    thickness_ = number(rows, "model.thickness", "Thickness", spec, "Of the tube, per cent of the ring's radius");
    spec = {.least = 0.01, .most = 100, .decimals = 2, .unit = "units", .logarithmic = true, .neutral = 1};
    size_ = number(rows, "model.size", "Size", spec, "Side or diameter, model units");

    rows = section("Defects");
    verdict_ = text(rows, "model.verdict");
    defects_ = text(rows, "model.defects");
    show_defects_ = check(rows, "view.defects", "Show in the view", "Marks open and non-manifold edges in the view");

    rows = section("Save");
    beside(rows, {new ActionButton("model.save", actions.find("file.save"), "Model", page()),
                  new ActionButton("model.save_mesh", actions.find("file.save_mesh"), "Mesh…", page()),
                  new ActionButton("model.save_driver", actions.find("file.save_driver"), "Driver…", page())});

    connect(shape_, &QComboBox::currentIndexChanged, this, [this](int index) {
        if (index < 0 || std::size_t(index) >= shape_names().size()) return refresh();
        change_shape({}, [index](studio::Shape& shape) { shape.name = shape_names()[std::size_t(index)]; });
    });
    const auto connect_number = [this](NumberControl* control, const std::string& merge, auto set) {
        connect(control, &NumberControl::changed, this, [this, merge, set](double value) {
            change_shape(merge, [set, value](studio::Shape& shape) { set(shape.options, value); });
        });
        connect(control, &NumberControl::released, this, [this] { workbench_.document().end_merge(); });
    };
    connect_number(resolution_, "model.resolution", [](ShapeOptions& o, double v) { o.resolution = unsigned(v); });
    connect_number(frequency_, "model.frequency", [](ShapeOptions& o, double v) { o.frequency = v; });
    connect_number(amplitude_, "model.amplitude", [](ShapeOptions& o, double v) { o.amplitude = v / 100; });
    connect_number(length_, "model.length", [](ShapeOptions& o, double v) { o.length = v; });
    connect_number(thickness_, "model.thickness", [](ShapeOptions& o, double v) { o.thickness = v / 100; });
    connect_number(size_, "model.size", [](ShapeOptions& o, double v) { o.size = v; });
    connect(show_defects_, &QCheckBox::toggled, this, [this](bool shown) {
        ViewSettings settings = workbench_.view().settings();
        settings.defects = shown;
        workbench_.view().set(settings);
    });
    connect(&workbench_.document(), &Document::changed, this, &ModelPanel::refresh);
    connect(&workbench_, &Workbench::opened, this, &ModelPanel::refresh);
    connect(&workbench_.jobs(), &Jobs::finished, this, &ModelPanel::refresh);
    connect(&workbench_.view(), &ViewState::changed, this, &ModelPanel::refresh);
    refresh();
}

void ModelPanel::change_shape(const std::string& merge, const std::function<void(studio::Shape&)>& edit) {
    studio::Shape shape = workbench_.wanted_shape().value_or(studio::Shape{});
    edit(shape);
    if (shape != workbench_.wanted_shape()) workbench_.make_shape(shape, merge);
}

void ModelPanel::refresh() {
    set_silently(show_defects_, workbench_.view().settings().defects);
    show_shape();
    const auto& source = workbench_.state().source;
    if (source.get() == shown_ && source) return;
    shown_ = source.get();
    if (!source) {
        name_->setText("No mesh");
        facts_->setText("Open one, or choose a shape below.");
    } else {
        const TopologyReport& topology = source->topology;
        name_->setText(QString::fromStdString(source->name));
        name_->setToolTip(source->path.empty() ? QStringLiteral("A built-in shape")
                                               : QString::fromStdString(source->path));
        const QString kind = topology.faces == 0                    ? QStringLiteral("points only")
                             : topology.quads == topology.faces     ? QStringLiteral("quads")
                             : topology.triangles == topology.faces ? QStringLiteral("triangles")
                                                                    : QStringLiteral("mixed polygons");
        QString facts = counted(topology.vertices, "vertex", "vertices") + ", " +
                        counted(topology.faces, "face", "faces") + QStringLiteral(" (%1)\n").arg(kind) +
                        size_text(topology.box.size());
        if (topology.faces > 0)
            facts += (topology.is_closed() ? QStringLiteral("\nclosed, ") : QStringLiteral("\nopen, ")) +
                     counted(topology.components, "part", "parts");
        facts_->setText(facts);
    }
    QStringList warnings;
    if (source)
        for (const std::string& warning : source->warnings) warnings << QString::fromStdString(warning);
    constexpr qsizetype kShown = 4;
    const qsizetype left = warnings.size() - kShown;
    if (left > 0) warnings = warnings.mid(0, kShown) << QStringLiteral("… and %1 more").arg(left);
    warnings_->setText(warnings.join('\n'));
    warnings_->setVisible(!warnings.isEmpty());
    show_defects();
}

void ModelPanel::show_shape() {
    const auto& shape = workbench_.state().shape;
    const auto names = shape_names();
    set_silently(shape_, shape ? index_of(shape->name) : int(names.size()));
    const std::string name = shape ? shape->name : "";
    const bool waves = name.starts_with("wavy") || name == "torus", is_long = name == "bar" || name == "cylinder";
    resolution_->set_visible(shape.has_value());
    size_->set_visible(shape.has_value());
    frequency_->set_visible(waves);
    amplitude_->set_visible(waves);
    length_->set_visible(is_long);
    thickness_->set_visible(name == "torus");
    if (!shape) return;
    const ShapeOptions& options = shape->options;
    resolution_->set_value(options.resolution);
    frequency_->set_value(options.frequency);
    amplitude_->set_value(100 * options.amplitude);
    size_->set_value(options.size);
    length_->set_value(options.length);
    thickness_->set_value(100 * options.thickness);
}

void ModelPanel::show_defects() {
    QStringList found;
    if (shown_)
        for (const DefectRow& row : kDefects)
            if (const std::size_t count = (shown_->topology.*row.finding).count; count > 0)
                found << counted(count, row.one, row.many);
    const bool is_surface = shown_ && shown_->topology.faces > 0, is_good = is_surface && found.isEmpty();
    verdict_->setText(is_good ? QStringLiteral("✓ No defects") : QStringLiteral("Points have no defects to look for."));
    verdict_->set_tone(is_good ? Tone::good : Tone::quiet);
    verdict_->setVisible(is_good || (shown_ && !is_surface));
    defects_->setText(is_surface ? found.join('\n') : QString());
    defects_->setVisible(is_surface && !found.isEmpty());
    show_defects_->setVisible(is_surface &&
                              shown_->topology.open_edges.count + shown_->topology.nonmanifold_edges.count > 0);
}

} // namespace filigree::studio
