// Above the tabs, as in the report's window: zoom, less and more detail, deform, animate.
#pragma once

#include "actions.h"
#include "controls.h"
#include "number_control.h"

namespace filigree::studio {

class Overview : public QWidget {
    Q_OBJECT
public:
    Overview(Workbench& workbench, const Actions& actions, QWidget* parent = nullptr);

private:
    void refresh();

    Workbench& workbench_;
    NumberControl* zoom_;
    Text* level_;
};

} // namespace filigree::studio
