// Quads of any mesh: how many, in which patches, and how well they came out.
#pragma once

#include "controls.h"
#include "workbench.h"

namespace filigree::studio {

class Actions;

class QuadsPanel : public Panel {
    Q_OBJECT
public:
    QuadsPanel(Workbench& workbench, const Actions& actions, QWidget* parent = nullptr);

private:
    void show_options();
    void show_report();
    void change(const std::function<void(QuadRemeshOptions&)>& edit);

    Workbench& workbench_;
    NumberControl *count_, *feature_angle_;
    QComboBox *levels_, *small_parts_;
    Text *figures_, *remarks_, *none_;
};

} // namespace filigree::studio
