// Every command of the window, by name: menus, toolbar, panels, the help sheet and scripts share these.
#pragma once

#include "viewport.h"

#include <QAction>

namespace filigree::studio {

class MainWindow;

/// The actions' object names are "menu.command" ("file.open", "detail.remove", "body.play"). Each has a text, a
/// tooltip, a shortcut where one is usual, and is enabled only when it can do something.
class Actions : public QObject {
    Q_OBJECT
public:
    Actions(Workbench& workbench, Viewport& viewport, MainWindow& window);

    QAction* find(const QString& name) const; ///< null: there is none
    std::vector<QAction*> all() const;        ///< in the order of the menus

private:
    struct Content;
    std::unique_ptr<Content> content_;

public:
    ~Actions() override;
};

} // namespace filigree::studio
