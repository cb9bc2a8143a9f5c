#include "panels/panels.h"

#include "panel.h"

namespace filigree::studio {
namespace {

constexpr std::size_t kLeastDriver = 3; // vertices: a face

class DetailPanel : public Panel {
public:
    explicit DetailPanel(Workbench& workbench) : Panel("detail", workbench) {
        QGridLayout* rows = section("Levels");
        level_ = number(rows,
                        {"detail.level",
                         "Level",
                         "The level shown: 0 is the driver, the last the whole mesh",
                         [this] { return state().level(); },
                         [this](double level) { this->workbench().set_level(unsigned(level), "detail.level"); },
                         {},
                         [this] { return state().model->finest_level() > 0; }},
                        {.least = 0, .most = 1, .step = 1, .decimals = 0});
        levels_ = text(rows, "detail.levels");
        levels_->setTextFormat(Qt::RichText);
        add_driver();
        report_ = text(section("Report"), "detail.report", Tone::quiet);
        refresh();
    }

private:
    void add_driver() {
        QGridLayout* rows = section("Driver");
        const OptionsAccess<StripOptions> options = {
            [this] { return workbench().wanted_strip(); },
            [this](const StripOptions& to, const std::string& merge) { workbench().set_strip(to, merge); }};
        const Field<StripOptions> size = {[this](const StripOptions& of) {
                                              return double(of.base.value_or(state().model->driver().vertices.size()));
                                          },
                                          [](StripOptions& of, double count) {
                                              of.levels.reset();
                                              of.error.reset();
                                              of.base = std::size_t(count);
                                          }};
        driver_ = number(
            rows, options.setting("detail.driver", "Size", "About so many vertices move; all others follow", size),
            {.least = kLeastDriver, .most = 20000, .decimals = 0, .unit = "vertices", .logarithmic = true});
    }

    void refresh() override {
        page()->setEnabled(state().model != nullptr);
        if (!state().model) return;
        const Model& model = *state().model;
        level_->set_range(0, model.finest_level());
        driver_->set_range(kLeastDriver, double(std::max(model.vertex_count(), kLeastDriver)));
        Panel::refresh();
        levels_->setText(levels());
        report_->setText(report());
    }

    QString levels() const {
        const Model& model = *state().model;
        std::vector<std::vector<QString>> rows;
        for (unsigned level = model.finest_level() + 1; level-- > 0;) {
            const QString name = level == 0                      ? QStringLiteral("0, the driver")
                                 : level == model.finest_level() ? QStringLiteral("%1, the mesh").arg(level)
                                                                 : QString::number(level);
            const LevelCounts counts = level_counts(model, level);
            rows.push_back({name, with_commas(counts.vertices) + " vertices", with_commas(counts.faces) + " faces"});
            if (level == state().level())
                for (QString& cell : rows.back()) cell = "<b>" + cell + "</b>";
        }
        return rich_table(rows);
    }

    QString report() const {
        const StripReport& report = state().strip_report;
        const std::size_t all = state().model->vertex_count(), moved = state().model->driver().vertices.size();
        const double seconds = report.simplify_seconds + report.bind_seconds + report.encode_seconds;
        QStringList lines;
        lines << QStringLiteral("%1 move %2, one in %3.")
                     .arg(counted(moved, "vertex", "vertices"), with_commas(all),
                          number_text(double(all) / double(std::max<std::size_t>(1, moved))));
        if (seconds > 0) lines << QStringLiteral("Stripped in %1 s.").arg(number_text(seconds, 2));
        const auto add = [&](std::size_t count, const char* one, const char* many, const char* rest) {
            if (count > 0) lines << counted(count, one, many) + rest;
        };
        add(report.welded_vertices, "vertex lies", "vertices lie", " at the place of another.");
        add(report.across_gap, "vertex is", "vertices are", " bound across a gap to another part.");
        add(report.facing_away, "vertex is", "vertices are", " bound to a face that looks away.");
        add(report.forced_collapses, "edge", "edges", " had to go against the mesh's topology.");
        return lines.join('\n');
    }

    NumberControl *level_, *driver_ = nullptr;
    Text *levels_, *report_;
};

} // namespace

QWidget* make_detail_panel(Workbench& workbench) { return new DetailPanel(workbench); }

} // namespace filigree::studio
