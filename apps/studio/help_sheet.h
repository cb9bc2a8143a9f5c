// Every key and every gesture of the mouse on one sheet, from the actions themselves.
#pragma once

#include "actions.h"

#include <QDialog>

namespace filigree::studio {

class HelpSheet : public QDialog {
    Q_OBJECT
public:
    explicit HelpSheet(const Actions& actions, QWidget* parent = nullptr);
};

} // namespace filigree::studio
