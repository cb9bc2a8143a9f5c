// Below the viewport: reset, play, step, the frame shown, and what to make of the recording.
#pragma once

#include "actions.h"
#include "controls.h"

#include <QSlider>

namespace filigree::studio {

class Timeline : public QWidget {
    Q_OBJECT
public:
    Timeline(Workbench& workbench, const Actions& actions, QWidget* parent = nullptr);

    QSize minimumSizeHint() const override; ///< of the narrow form

protected:
    void resizeEvent(QResizeEvent* event) override;

private:
    void refresh();
    void be_narrow(bool narrow);

    Workbench& workbench_;
    QSlider* scrub_;
    Text* frame_;
    ActionButton *film_, *meshes_;
    bool is_narrow_ = true;
    int narrow_width_ = 0, whole_width_ = 0;
};

} // namespace filigree::studio
