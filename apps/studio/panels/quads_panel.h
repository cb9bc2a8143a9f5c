// Quads of any mesh: how many, in which patches, and how well they came out.
#pragma once

#include "panel.h"

namespace filigree::studio {

class Actions;

class QuadsPanel : public Panel {
    Q_OBJECT
public:
    QuadsPanel(Workbench& workbench, const Actions& actions, QWidget* parent = nullptr);

private:
    void refresh() override;

    Text *figures_, *remarks_, *none_;
};

} // namespace filigree::studio
