// The body: what it is made of, where it stands, how it moves.
#pragma once

#include "panel.h"

namespace filigree::studio {

class Actions;

class BodyPanel : public Panel {
    Q_OBJECT
public:
    BodyPanel(Workbench& workbench, const Actions& actions, QWidget* parent = nullptr);

    bool is_unfolded() const { return fold_->isChecked(); } ///< the advanced settings
    void set_unfolded(bool unfolded) { fold_->setChecked(unfolded); }

private:
    void add_material();
    void add_motion(const Actions& actions);
    void add_world();
    void add_advanced();
    void refresh() override;
    OptionsAccess<BodySettings> body();
    /// Of the mesh at that size, m³; 0 where it is open.
    double volume(const BodySettings& settings) const;
    QString sentence() const;
    QString report() const;

    Text *sentence_ = nullptr, *report_ = nullptr;
    QPushButton *fit_driver_ = nullptr, *melt_ = nullptr, *freeze_ = nullptr, *torch_ = nullptr;
    NumberControl* spacing_ = nullptr;
    FoldButton* fold_ = nullptr;
};

} // namespace filigree::studio
