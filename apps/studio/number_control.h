// A value with a label, a slider and a number.
#pragma once

#include <QDoubleSpinBox>
#include <QLabel>
#include <QSlider>

#include <array>
#include <optional>

namespace filigree::studio {

struct NumberSpec {
    double least = 0, most = 1;
    double step = 0.01;                 ///< of the slider and the number's arrows; linear only
    int decimals = 2;                   ///< of the number; 0: whole numbers
    QString unit = {};                  ///< shown after the number
    bool logarithmic = false;           ///< least above 0
    int digits = 2;                     ///< significant ones that a logarithmic slider stops at
    std::optional<double> neutral = {}; ///< where a double click on slider or label goes
    bool thousands = false;             ///< the number as "20 k", "1.5 M" before the unit
};

/// Label, slider and number for one value: objects "NAME.label", "NAME" and "NAME.number".
class NumberControl : public QObject {
    Q_OBJECT
public:
    NumberControl(const QString& name, const QString& label, const NumberSpec& spec, const QString& tooltip,
                  QWidget* parent);

    double value() const { return value_; }
    void set_value(double value); ///< silent; waits while the user has the slider in the hand
    void set_range(double least, double most);
    void set_enabled(bool enabled);
    void set_visible(bool visible);

    QLabel* label() const { return label_; }
    QSlider* slider() const { return slider_; }
    QDoubleSpinBox* number() const { return number_; }

Q_SIGNALS:
    void changed(double value); ///< by the user: while dragging, too
    void released();            ///< the change is complete

protected:
    bool eventFilter(QObject* object, QEvent* event) override;

private:
    std::array<QWidget*, 3> parts() const { return {label_, slider_, number_}; }
    double value_at(int position) const;
    int position_of(double value) const;
    void follow_slider(int position);
    void follow_number(double value);
    void show_value();

    NumberSpec spec_;
    double value_ = 0;
    bool key_is_down_ = false;
    QLabel* label_;
    QSlider* slider_;
    QDoubleSpinBox* number_;
};

} // namespace filigree::studio
