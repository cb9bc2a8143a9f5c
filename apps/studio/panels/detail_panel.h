// Levels and the detail code: how coarse the driver is, how detail is stored, and by which law it returns.
#pragma once

#include "panel.h"

namespace filigree::studio {

class DetailPanel : public Panel {
    Q_OBJECT
public:
    explicit DetailPanel(Workbench& workbench, QWidget* parent = nullptr);

private:
    void add_driver();
    void add_law();
    void refresh() override;
    QString levels() const;
    QString report() const;

    NumberControl *level_, *driver_ = nullptr;
    Text *levels_, *report_;
};

} // namespace filigree::studio
