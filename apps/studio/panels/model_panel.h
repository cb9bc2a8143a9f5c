// The mesh: where it came from, what it is, what is wrong with it, where to save it.
#pragma once

#include "panel.h"

#include <QMenu>

namespace filigree::studio {

class Actions;

class ModelPanel : public Panel {
    Q_OBJECT
public:
    ModelPanel(Workbench& workbench, const Actions& actions, QMenu* recent_files, QWidget* parent = nullptr);

private:
    void add_mesh(const Actions& actions, QMenu* recent_files);
    void add_shape();
    void refresh() override;
    void show_facts();
    void show_warnings();
    void show_defects();

    Text *name_ = nullptr, *facts_ = nullptr, *warnings_ = nullptr, *verdict_, *defects_;
    const Source* shown_ = nullptr; ///< whose defects are listed
};

} // namespace filigree::studio
