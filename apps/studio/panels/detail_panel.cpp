#include "panels/detail_panel.h"

#include "panels/overview.h"

#include <array>

namespace filigree::studio {
namespace {

constexpr std::array<unsigned, 3> kReferences = {3, 4, 6};
constexpr std::size_t kLeastDriver = 3; // vertices: a face

std::size_t level_faces(const Model& model, unsigned level) {
    return level < model.levels.size() ? model.levels[level].face_count() : model.mesh.face_count();
}

int law_index(const std::optional<HeightLaw>& law) { return law ? 1 + int(*law) : 0; }

} // namespace

DetailPanel::DetailPanel(Workbench& workbench, QWidget* parent) : Panel("detail", parent), workbench_(workbench) {
    QGridLayout* rows = section("Levels");
    level_ = number(rows, "detail.level", "Level", {.least = 0, .most = 1, .step = 1, .decimals = 0},
                    "The level shown: 0 is the driver, the last the whole mesh");
    levels_ = text(rows, "detail.levels");
    levels_->setTextFormat(Qt::RichText);

    rows = section("Driver");
    NumberSpec spec;
    spec.least = kLeastDriver;
    spec.most = 20000;
    spec.decimals = 0;
    spec.logarithmic = true;
    spec.unit = "vertices";
    driver_ = number(rows, "detail.driver", "Size", spec, "About so many vertices move; all others follow");
    code_ =
        choice(rows, "detail.code", "Code", {"Blend (any mesh)", "Reference (the report's)"},
               "How detail is stored. Blend: three driver vertices and an offset. Reference: the report's, for regular "
               "quads.");
    references_ = choice(rows, "detail.references", "References", {"3 vertices", "4 vertices", "6 vertices"},
                         "How many vertices of the coarser level a vertex is stored by");
    precision_ =
        choice(rows, "detail.precision", "Precision", {"32 bit (20 bytes a vertex)", "16 bit (10 bytes a vertex)"},
               "Of what is stored for each vertex");

    rows = section("Returning detail");
    law_ =
        choice(rows, "detail.law", "Height", {"Automatic", "Keep", "Inverse (the report's)", "Proportional", "Volume"},
               "How the height of detail follows its surroundings. Automatic: proportional for the blend code, inverse "
               "for the reference code. Keep: as at rest. Inverse: lower where stretched. Proportional: as the "
               "surroundings grow. Volume: what is between stays as much.");
    thin_shell_ = check(rows, "detail.thin_shell", "Thin shell",
                        "Bumps keep their shape (cloth, skin) instead of stretching with the body; blend code");

    rows = section("Report");
    report_ = text(rows, "detail.report", Tone::quiet);

    connect(level_, &NumberControl::changed, this,
            [this](double level) { workbench_.set_level(unsigned(level), "detail.level"); });
    connect(level_, &NumberControl::released, this, [this] { workbench_.document().end_merge(); });
    const auto strip_again = [this](const std::function<void(StripOptions&)>& edit, const std::string& merge) {
        if (!workbench_.state().model) return;
        StripOptions options = workbench_.wanted_strip();
        edit(options);
        workbench_.set_strip(options, merge);
    };
    connect(driver_, &NumberControl::changed, this, [strip_again](double count) {
        strip_again(
            [count](StripOptions& options) {
                options.levels.reset();
                options.error.reset();
                options.base = std::size_t(count);
            },
            "detail.driver");
    });
    connect(driver_, &NumberControl::released, this, [this] { workbench_.document().end_merge(); });
    connect(code_, &QComboBox::currentIndexChanged, this, [strip_again](int index) {
        strip_again(
            [index](StripOptions& options) {
                options = {};
                options.code = index == 1 ? DetailCode::reference : DetailCode::blend;
            },
            {});
    });
    connect(references_, &QComboBox::currentIndexChanged, this, [strip_again](int index) {
        strip_again([index](StripOptions& options) { options.references = kReferences[std::size_t(index)]; }, {});
    });
    connect(precision_, &QComboBox::currentIndexChanged, this, [strip_again](int index) {
        strip_again(
            [index](StripOptions& options) { options.precision = index ? Precision::int16 : Precision::float32; }, {});
    });
    connect(law_, &QComboBox::currentIndexChanged, this, [this](int index) {
        workbench_.set_law(index == 0 ? std::nullopt : std::optional(static_cast<HeightLaw>(index - 1)));
    });
    connect(thin_shell_, &QCheckBox::toggled, this, [this](bool thin) { workbench_.set_thin_shell(thin); });

    connect(&workbench_.document(), &Document::changed, this, &DetailPanel::refresh);
    connect(&workbench_, &Workbench::opened, this, &DetailPanel::refresh);
    connect(&workbench_.jobs(), &Jobs::finished, this, &DetailPanel::refresh); // a strip that failed: back to what is
    refresh();
}

void DetailPanel::refresh() {
    const State& state = workbench_.state();
    page()->setEnabled(state.model != nullptr);
    if (!state.model) return;
    const Model& model = *state.model;
    const bool blend = model.code() == DetailCode::blend;
    level_->set_range(0, model.finest_level());
    level_->set_value(state.level());
    level_->set_enabled(model.finest_level() > 0);
    driver_->set_range(kLeastDriver, double(std::max(model.mesh.vertex_count(), kLeastDriver)));
    driver_->set_value(double(state.strip.base.value_or(model.driver().vertices.size())));
    driver_->set_enabled(blend);
    set_silently(code_, blend ? 0 : 1);
    const auto references = std::find(kReferences.begin(), kReferences.end(), state.strip.references);
    set_silently(references_, references == kReferences.end() ? 0 : int(references - kReferences.begin()));
    show_row(references_, !blend);
    set_silently(precision_, state.strip.precision == Precision::int16 ? 1 : 0);
    show_row(precision_, blend);
    set_silently(law_, law_index(state.restore.law));
    set_silently(thin_shell_, state.restore.thin_shell);
    thin_shell_->setEnabled(blend);
    show_levels();
    show_report();
}

void DetailPanel::show_levels() {
    const State& state = workbench_.state();
    const Model& model = *state.model;
    QString table = QStringLiteral("<table width='100%' cellspacing='0' cellpadding='1'>");
    for (unsigned level = model.finest_level() + 1; level-- > 0;) {
        const QString name = level == 0                      ? QStringLiteral("0, the driver")
                             : level == model.finest_level() ? QStringLiteral("%1, the mesh").arg(level)
                                                             : QString::number(level);
        const bool shown = level == state.level();
        const auto cell = [shown](const QString& content, const char* align) {
            return QStringLiteral("<td align='%1'>%2</td>")
                .arg(QLatin1String(align), shown ? "<b>" + content + "</b>" : content);
        };
        table += "<tr>" + cell(name, "left") + cell(with_commas(level_vertices(model, level)) + " vertices", "right") +
                 cell(with_commas(level_faces(model, level)) + " faces", "right") + "</tr>";
    }
    levels_->setText(table + "</table>");
}

void DetailPanel::show_report() {
    const State& state = workbench_.state();
    const StripReport& report = state.strip_report;
    const double seconds = report.simplify_seconds + report.bind_seconds + report.encode_seconds;
    QStringList lines;
    lines << QStringLiteral("%1 move %2, one in %3.")
                 .arg(counted(state.model->driver().vertices.size(), "vertex", "vertices"),
                      with_commas(state.model->mesh.vertex_count()),
                      number_text(double(state.model->mesh.vertex_count()) /
                                  double(std::max<std::size_t>(1, state.model->driver().vertices.size()))));
    if (seconds > 0) lines << QStringLiteral("Stripped in %1 s.").arg(number_text(seconds, 2));
    if (report.welded_vertices > 0)
        lines << counted(report.welded_vertices, "vertex lies", "vertices lie") + " at the place of another.";
    if (report.across_gap > 0)
        lines << counted(report.across_gap, "vertex is", "vertices are") + " bound across a gap to another part.";
    if (report.facing_away > 0)
        lines << counted(report.facing_away, "vertex is", "vertices are") + " bound to a face that looks away.";
    if (report.forced_collapses > 0)
        lines << counted(report.forced_collapses, "edge", "edges") + " had to go against the mesh's topology.";
    report_->setText(lines.join('\n'));
}

} // namespace filigree::studio
