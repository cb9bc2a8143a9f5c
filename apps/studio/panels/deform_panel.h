// Deforming by numbers and by hand.
#pragma once

#include "controls.h"
#include "workbench.h"

namespace filigree::studio {

class Actions;

class DeformPanel : public Panel {
    Q_OBJECT
public:
    DeformPanel(Workbench& workbench, const Actions& actions, QWidget* parent = nullptr);

private:
    void refresh();

    struct WarpControl {
        NumberControl* control;
        double Warps::*field;
        double scale; ///< of the number shown
    };
    Workbench& workbench_;
    QComboBox* axis_;
    std::vector<WarpControl> warps_;
    NumberControl *grip_, *reach_;
    Text* pins_;
};

} // namespace filigree::studio
