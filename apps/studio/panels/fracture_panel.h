// Pieces: where the mesh would break, how they look apart, and how hard it is to break.
#pragma once

#include "panel.h"

namespace filigree::studio {

class Actions;

class FracturePanel : public Panel {
    Q_OBJECT
public:
    FracturePanel(Workbench& workbench, const Actions& actions, QWidget* parent = nullptr);

private:
    void add_pieces(const Actions& actions);
    void add_look();
    void add_strength(const Actions& actions);
    void refresh() override;
    QString motion() const; ///< what the body's pieces do

    Text *none_, *figures_, *motion_;
};

} // namespace filigree::studio
