// Deforming by numbers and by hand.
#pragma once

#include "panel.h"

namespace filigree::studio {

class Actions;

class DeformPanel : public Panel {
    Q_OBJECT
public:
    DeformPanel(Workbench& workbench, const Actions& actions, QWidget* parent = nullptr);

private:
    void refresh() override;

    Text* pins_;
};

} // namespace filigree::studio
