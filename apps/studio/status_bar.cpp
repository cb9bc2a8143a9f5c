#include "panels/panels.h"

#include "actions.h"
#include "controls.h"
#include "words.h"

#include <QBoxLayout>
#include <QProgressBar>
#include <QStatusBar>

namespace filigree::studio {
namespace {

class StatusBar : public QStatusBar {
public:
    StatusBar(Workbench& workbench, Viewport& viewport, const Actions& actions, QWidget* parent)
        : QStatusBar(parent), workbench_(workbench), viewport_(viewport) {
        setObjectName("status");
        const auto part = [&](const char* name, const char* tooltip) {
            auto* text = new ElidedText(QLatin1String(name), Qt::ElideRight, Tone::plain, this);
            text->setToolTip(QLatin1String(tooltip));
            text->setContentsMargins(4, 0, 4, 0);
            addPermanentWidget(text);
            return text;
        };
        work_ = new QWidget(this);
        work_->setObjectName("status.work");
        auto* row = new QHBoxLayout(work_);
        row->setContentsMargins(4, 0, 8, 0);
        row->setSpacing(8);
        job_ = new ElidedText("status.job", Qt::ElideRight, Tone::plain, work_);
        job_->setToolTip("The work that runs, and what it is at");
        job_->setMaximumWidth(32 * fontMetrics().averageCharWidth());
        progress_ = new QProgressBar(work_);
        progress_->setObjectName("status.progress");
        progress_->setAccessibleName("Progress");
        progress_->setToolTip("How much of this phase is done");
        progress_->setRange(0, 1000);
        progress_->setTextVisible(false);
        progress_->setFixedWidth(110);
        progress_->setMaximumHeight(fontMetrics().height());
        row->addWidget(job_);
        row->addWidget(progress_);
        row->addWidget(new ActionButton("status.cancel", actions.find("edit.cancel"), "Cancel", work_));
        addPermanentWidget(work_);
        work_->hide();

        vertices_ = part("status.vertices", "Vertices drawn, and in the driver that moves them");
        milliseconds_ = part("status.milliseconds",
                             "What the last picture took: moving the driver, restoring the mesh, drawing it");
        rate_ = part("status.rate", "Pictures a second, while things move");
        auto* measure = new ActionButton("status.measure", actions.find("view.measure_error"), "Error", this);
        addPermanentWidget(measure);
        error_ = part("status.error", "");

        connect(&viewport_, &Viewport::timings_changed, this, [this] {
            show_counts();
            show_timings();
        });
        connect(&workbench_.document(), &Document::changed, this, &StatusBar::show_counts);
        connect(&workbench_, &Workbench::error_measured, this, &StatusBar::show_error);
        connect(&workbench_, &Workbench::pose_changed, this, &StatusBar::show_error);
        Jobs& jobs = workbench_.jobs();
        connect(&jobs, &Jobs::started, this, &StatusBar::show_job);
        connect(&jobs, &Jobs::progressed, this, &StatusBar::show_job);
        connect(&jobs, &Jobs::finished, this, &StatusBar::show_job);
        show_counts();
        show_timings();
        show_error();
        show_job();
    }

private:
    void show_counts() {
        const State& state = workbench_.state();
        if (!state.model) return vertices_->setText("no mesh");
        const Timings& timings = viewport_.timings();
        const std::size_t shown = timings.vertices > 0 ? timings.vertices : state.model->vertex_count();
        vertices_->setText(counted(shown, "vertex", "vertices") + QStringLiteral(" · driver ") +
                           with_commas(state.model->driver().vertices.size()));
    }

    void show_timings() {
        const Timings& timings = viewport_.timings();
        const auto ms = [](double value) { return QString::number(value, 'f', value < 10 ? 1 : 0); };
        milliseconds_->setText(QStringLiteral("driver %1 ms · restore %2 ms · draw %3 ms")
                                   .arg(ms(timings.driver), ms(timings.restore), ms(timings.draw)));
        rate_->setText(timings.frames_per_second > 0
                           ? QStringLiteral("%1 pictures/s").arg(timings.frames_per_second, 0, 'f', 0)
                           : QStringLiteral("still"));
    }

    void show_error() {
        const QString text = error_text(workbench_, false);
        error_->setText(text);
        error_->setVisible(!text.isEmpty());
        error_->setToolTip(text.isEmpty() ? QStringLiteral("Press Error to measure") : error_text(workbench_, true));
    }

    void show_job() {
        const Jobs& jobs = workbench_.jobs();
        work_->setVisible(jobs.is_busy());
        if (!jobs.is_busy()) return;
        const QString phase = jobs.phase(), whole = phase.isEmpty() ? jobs.title() : jobs.title() + ": " + phase;
        job_->setText(whole);
        progress_->setValue(int(1000 * jobs.fraction()));
    }

    Workbench& workbench_;
    Viewport& viewport_;
    Text *vertices_, *milliseconds_, *rate_, *error_, *job_;
    QProgressBar* progress_;
    QWidget* work_; ///< the job's part
};

} // namespace

QString error_text(const Workbench& workbench, bool in_full) {
    const auto& error = workbench.error();
    if (!error || !workbench.state().source) return {};
    const double diagonal = workbench.state().source->topology.box.diagonal(), unit = diagonal > 0 ? diagonal : 1;
    const QString rms = number_text(error->rms / unit, 2), most = number_text(error->max / unit, 2),
                  normals = number_text(error->normal_p95_deg, 2);
    if (!in_full) return QStringLiteral("rms %1 · max %2 · %3°").arg(rms, most, normals);
    return QStringLiteral("From the full deformation: %1 of the diagonal (root mean square), %2 at most; 95 % of the "
                          "normals within %3°.")
        .arg(rms, most, normals);
}

QStatusBar* make_status_bar(Workbench& workbench, Viewport& viewport, const Actions& actions, QWidget* parent) {
    return new StatusBar(workbench, viewport, actions, parent);
}

} // namespace filigree::studio
