// What is shown and what it costs; and the work that runs, with its cancel button.
#pragma once

#include "actions.h"
#include "controls.h"

#include <QBoxLayout>
#include <QProgressBar>
#include <QStatusBar>

namespace filigree::studio {

class StatusBar : public QStatusBar {
    Q_OBJECT
public:
    StatusBar(Workbench& workbench, Viewport& viewport, const Actions& actions, QWidget* parent = nullptr);

private:
    void show_counts();
    void show_timings();
    void show_error();
    void show_job();

    Workbench& workbench_;
    Viewport& viewport_;
    Text *vertices_, *milliseconds_, *rate_, *error_, *job_;
    QProgressBar* progress_;
    QPushButton* cancel_;
    QWidget* work_; ///< the job's part
};

/// "rms 2.1e-05, max 1.3e-04 of the diagonal; normals 95 %: 0.42°"; "" when nothing was measured.
QString error_text(const Workbench& workbench, bool in_full);

} // namespace filigree::studio
