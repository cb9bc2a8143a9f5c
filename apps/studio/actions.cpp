#include "actions.h"

namespace filigree::studio {

struct Actions::Content {
    std::vector<QAction*> all;
};

Actions::Actions(Workbench&, Viewport&, MainWindow&) : content_(new Content) {}
Actions::~Actions() = default;

QAction* Actions::find(const QString& name) const {
    for (QAction* action : content_->all)
        if (action->objectName() == name) return action;
    return nullptr;
}

std::vector<QAction*> Actions::all() const { return content_->all; }

} // namespace filigree::studio
