// The mesh: where it came from, what it is, what is wrong with it, where to save it.
#pragma once

#include "controls.h"
#include "workbench.h"

#include <QMenu>

namespace filigree::studio {

class Actions;

class ModelPanel : public Panel {
    Q_OBJECT
public:
    ModelPanel(Workbench& workbench, const Actions& actions, QMenu* recent_files, QWidget* parent = nullptr);

private:
    void refresh();
    void show_shape();
    void show_defects();
    /// A field of the shape's options, changed by its slider.
    void change_shape(const std::string& merge, const std::function<void(studio::Shape&)>& edit);

    Workbench& workbench_;
    Text *name_, *facts_, *warnings_, *verdict_, *defects_;
    QComboBox* shape_;
    NumberControl *resolution_, *frequency_, *amplitude_, *size_, *length_, *thickness_;
    QCheckBox* show_defects_;
    const Source* shown_ = nullptr; ///< whose defects are listed
};

} // namespace filigree::studio
