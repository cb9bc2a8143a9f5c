// The body: what it is made of, where it stands, how it moves.
#pragma once

#include "controls.h"
#include "workbench.h"

namespace filigree::studio {

class Actions;

class BodyPanel : public Panel {
    Q_OBJECT
public:
    BodyPanel(Workbench& workbench, const Actions& actions, QWidget* parent = nullptr);

    bool is_unfolded() const; ///< the advanced settings
    void set_unfolded(bool unfolded);

private:
    void add_material();
    void add_advanced();
    void add_world();
    /// A number of the settings: read, written and its merge key.
    NumberControl* setting(QGridLayout* rows, const QString& name, const QString& label, const NumberSpec& spec,
                           const QString& tooltip, std::function<double(const BodySettings&)> get,
                           std::function<void(BodySettings&, double)> set);
    NumberControl* material(QGridLayout* rows, const QString& name, const QString& label, const NumberSpec& spec,
                            const QString& tooltip, double Material::*field, double off = 0);
    void change(const std::string& merge, const std::function<void(BodySettings&)>& edit);
    void change_material(const std::string& merge, const std::function<void(Material&)>& edit);
    /// Of the mesh at that size, m³; 0 where it is open.
    double volume(const BodySettings& settings) const;
    void refresh();
    void show_rows();
    QString report() const;

    struct Setting {
        NumberControl* control;
        std::function<double(const BodySettings&)> get;
    };
    Workbench& workbench_;
    std::vector<Setting> settings_;
    QComboBox *preset_, *model_, *obstacle_;
    Text *sentence_, *report_;
    QCheckBox *ground_, *gravity_, *particles_, *plastic_, *melts_;
    QToolButton *fold_, *play_;
    QWidget* advanced_;
    NumberControl *poisson_, *bending_, *yield_, *creep_, *melting_from_, *melting_to_, *viscosity_, *temperature_,
        *heating_, *drop_, *spacing_;
};

} // namespace filigree::studio
