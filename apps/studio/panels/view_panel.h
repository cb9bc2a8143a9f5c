// How the mesh is shown.
#pragma once

#include "controls.h"
#include "viewport.h"

namespace filigree::studio {

class Actions;
class MainWindow;

class ViewPanel : public Panel {
    Q_OBJECT
public:
    ViewPanel(Workbench& workbench, Viewport& viewport, MainWindow& window, QWidget* parent = nullptr);

private:
    void refresh();
    void show_error();
    void show_drawn();
    void change(const std::function<void(ViewSettings&)>& edit);

    Workbench& workbench_;
    Viewport& viewport_;
    MainWindow& window_;
    QComboBox *style_, *coloring_, *clip_axis_, *up_, *theme_;
    struct Switch {
        QCheckBox* box;
        bool ViewSettings::*field;
    };
    std::vector<Switch> switches_;
    NumberControl *points_, *clip_;
    QPushButton* measure_;
    Text *error_, *drawn_;
};

} // namespace filigree::studio
