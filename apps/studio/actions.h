// Every command of the window, by name: menus, toolbar, panels, the help sheet and scripts share these.
#pragma once

#include "viewport.h"

#include <QAction>

namespace filigree::studio {

class MainWindow;

struct ActionMenu {
    const char* name;
    QString title;
    std::vector<QAction*> actions; ///< null: a separator
};

/// The actions' object names are "menu.command" ("file.open", "detail.remove", "body.play"). Each has a text, a
/// tooltip, a shortcut where one is usual, and is enabled only when it can do something.
class Actions : public QObject {
    Q_OBJECT
public:
    Actions(Workbench& workbench, Viewport& viewport, MainWindow& window);
    ~Actions() override;

    QAction* find(const QString& name) const; ///< null: there is none
    const std::vector<ActionMenu>& menus() const;
    std::vector<QAction*> all() const; ///< in the order of the menus

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace filigree::studio
