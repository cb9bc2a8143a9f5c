// How the mesh is shown.
#pragma once

#include "panel.h"
#include "viewport.h"

namespace filigree::studio {

class Actions;
class MainWindow;

class ViewPanel : public Panel {
    Q_OBJECT
public:
    ViewPanel(Workbench& workbench, Viewport& viewport, MainWindow& window, QWidget* parent = nullptr);

private:
    void add_surface(MainWindow& window);
    void refresh() override;
    void show_error();
    void show_drawn();

    Viewport& viewport_;
    QPushButton* measure_ = nullptr;
    Text *error_ = nullptr, *drawn_;
};

} // namespace filigree::studio
