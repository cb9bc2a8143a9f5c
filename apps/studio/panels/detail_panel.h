// Levels and the detail code: how coarse the driver is, how detail is stored, and by which law it returns.
#pragma once

#include "controls.h"
#include "workbench.h"

namespace filigree::studio {

class DetailPanel : public Panel {
    Q_OBJECT
public:
    explicit DetailPanel(Workbench& workbench, QWidget* parent = nullptr);

private:
    void refresh();
    void show_levels();
    void show_report();

    Workbench& workbench_;
    NumberControl *level_, *driver_;
    QComboBox *code_, *references_, *precision_, *law_;
    QCheckBox* thin_shell_;
    Text *levels_, *report_;
};

} // namespace filigree::studio
