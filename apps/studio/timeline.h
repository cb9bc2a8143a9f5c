// Below the viewport: reset, play, step, the frame shown, and what to make of the recording.
#pragma once

#include "actions.h"
#include "controls.h"

namespace filigree::studio {

class Timeline : public QWidget {
    Q_OBJECT
public:
    Timeline(Workbench& workbench, const Actions& actions, QWidget* parent = nullptr);

private:
    void refresh();

    Workbench& workbench_;
    QAction *play_, *pause_;
    QToolButton* play_button_;
    QSlider* scrub_;
    Text* frame_;
};

} // namespace filigree::studio
