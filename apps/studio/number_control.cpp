#include "number_control.h"

#include "controls.h"
#include "words.h"

#include <QEvent>
#include <QKeyEvent>
#include <QLocale>
#include <QSignalBlocker>

#include <algorithm>
#include <array>
#include <cmath>

namespace filigree::studio {

namespace {

constexpr int kLogPositions = 240; ///< of a logarithmic slider

QLocale english() {
    QLocale locale(QLocale::English, QLocale::UnitedStates);
    locale.setNumberOptions(QLocale::OmitGroupSeparator);
    return locale;
}

double rounded(double value, int digits) {
    if (value == 0) return 0;
    const double unit = std::pow(10.0, std::floor(std::log10(std::abs(value))) - digits + 1);
    const double result = std::round(value / unit) * unit;
    return unit >= 1 ? std::round(result) : std::round(result * 1e9) / 1e9;
}

struct Prefix {
    char letter;
    double factor;
};
constexpr Prefix kPrefixes[] = {{'G', 1e9}, {'M', 1e6}, {'k', 1e3}};

/// A spin box that writes 1.5e6 as "1.5 M" before its unit, and reads both.
class NumberBox : public QDoubleSpinBox {
public:
    NumberBox(bool thousands, QWidget* parent) : QDoubleSpinBox(parent), thousands_(thousands) {
        setLocale(english());
        setKeyboardTracking(false);
        setFocusPolicy(Qt::StrongFocus);
        setAlignment(Qt::AlignRight);
        if (!thousands) setCorrectionMode(QAbstractSpinBox::CorrectToNearestValue);
    }

    QString textFromValue(double value) const override {
        if (!thousands_) return QDoubleSpinBox::textFromValue(value);
        for (const Prefix& prefix : kPrefixes)
            if (std::abs(value) >= prefix.factor) return number_text(value / prefix.factor, 4) + ' ' + prefix.letter;
        return number_text(value, 4) + ' ';
    }
    double valueFromText(const QString& text) const override {
        return thousands_ ? parsed(text).value_or(value()) : QDoubleSpinBox::valueFromText(text);
    }
    QValidator::State validate(QString& text, int& position) const override {
        if (!thousands_) return QDoubleSpinBox::validate(text, position);
        const auto number = parsed(text);
        return number && *number >= minimum() && *number <= maximum() ? QValidator::Acceptable
                                                                      : QValidator::Intermediate;
    }

private:
    std::optional<double> parsed(QString text) const {
        while (!suffix().isEmpty() && text.endsWith(suffix())) text.chop(suffix().size()); // once more when typed
        text = text.trimmed();
        double factor = 1;
        for (const Prefix& prefix : kPrefixes)
            if (text.endsWith(prefix.letter)) {
                factor = prefix.factor;
                text.chop(1);
                break;
            }
        bool ok = false;
        const double number = english().toDouble(text.trimmed(), &ok);
        return ok && std::isfinite(number) ? std::optional(number * factor) : std::nullopt;
    }
    bool thousands_;
};

} // namespace

NumberControl::NumberControl(const QString& name, const QString& label, const NumberSpec& spec, const QString& tooltip,
                             QWidget* parent)
    : QObject(parent), spec_(spec), value_(spec.least), label_(new QLabel(label, parent)),
      slider_(new QSlider(Qt::Horizontal, parent)), number_(new NumberBox(spec.thousands, parent)) {
    setObjectName(name + QStringLiteral(".control"));
    label_->setObjectName(name + QStringLiteral(".label"));
    slider_->setObjectName(name);
    number_->setObjectName(name + QStringLiteral(".number"));
    number_->setDecimals(spec.decimals);
    number_->setSingleStep(spec.step);
    if (spec.logarithmic) number_->setStepType(QAbstractSpinBox::AdaptiveDecimalStepType);
    if (!spec.unit.isEmpty()) number_->setSuffix((spec.thousands ? QString() : QStringLiteral(" ")) + spec.unit);
    QString hint = tooltip;
    if (spec.neutral) hint += QStringLiteral("\nDouble click: back to %1.").arg(number_text(*spec.neutral));
    for (QWidget* widget : parts()) {
        widget->setToolTip(hint);
        widget->setAccessibleName(label);
        widget->installEventFilter(this);
        guard_wheel(widget);
    }
    label_->setBuddy(slider_);
    slider_->setFocusPolicy(Qt::StrongFocus);
    slider_->setMinimumWidth(60);
    set_range(spec.least, spec.most);

    connect(slider_, &QSlider::valueChanged, this, &NumberControl::follow_slider);
    connect(slider_, &QSlider::sliderReleased, this, &NumberControl::released);
    connect(number_, &QDoubleSpinBox::valueChanged, this, &NumberControl::follow_number);
}

void NumberControl::set_range(double least, double most) {
    if (least == number_->minimum() && most == number_->maximum()) return;
    spec_.least = least;
    spec_.most = std::max(most, least);
    const QSignalBlocker quiet_slider(slider_), quiet_number(number_);
    const int positions = spec_.logarithmic ? kLogPositions : int(std::lround((spec_.most - spec_.least) / spec_.step));
    slider_->setRange(0, std::max(positions, 0));
    slider_->setPageStep(std::max(1, positions / 10));
    number_->setRange(spec_.least, spec_.most);
    show_value();
}

double NumberControl::value_at(int position) const {
    if (!spec_.logarithmic) return std::min(spec_.least + position * spec_.step, spec_.most);
    if (position <= 0) return spec_.least;
    if (position >= kLogPositions) return spec_.most;
    const double value = spec_.least * std::pow(spec_.most / spec_.least, double(position) / kLogPositions);
    const double result = rounded(value, spec_.digits);
    return std::clamp(spec_.decimals == 0 ? std::round(result) : result, spec_.least, spec_.most);
}

int NumberControl::position_of(double value) const {
    value = std::clamp(value, spec_.least, spec_.most);
    if (!spec_.logarithmic) return int(std::lround((value - spec_.least) / spec_.step));
    return int(std::lround(kLogPositions * std::log(value / spec_.least) / std::log(spec_.most / spec_.least)));
}

void NumberControl::set_value(double value) {
    if (slider_->isSliderDown() || !std::isfinite(value)) return;
    if (value == value_ && number_->value() == value) return;
    value_ = value;
    show_value();
}

void NumberControl::show_value() {
    const QSignalBlocker quiet_slider(slider_), quiet_number(number_);
    if (!slider_->isSliderDown()) slider_->setValue(position_of(value_));
    number_->setValue(value_);
}

void NumberControl::follow_slider(int position) {
    double value = value_at(position);
    if (!slider_->isSliderDown()) { // a key must not stop where several positions mean one value
        const int direction = position > position_of(value_) ? 1 : -1;
        while (value == value_ && position > slider_->minimum() && position < slider_->maximum())
            value = value_at(position += direction);
    }
    if (value != value_) {
        value_ = value;
        show_value();
        Q_EMIT changed(value_);
    }
    if (!slider_->isSliderDown() && !key_is_down_) Q_EMIT released();
}

/// By the number, or back to the neutral value: the change is complete.
void NumberControl::follow_number(double value) {
    if (value == value_) return;
    value_ = value;
    slider_->setSliderDown(false);
    show_value();
    Q_EMIT changed(value_);
    Q_EMIT released();
}

void NumberControl::set_enabled(bool enabled) {
    for (QWidget* widget : parts()) widget->setEnabled(enabled);
}

void NumberControl::set_visible(bool visible) {
    for (QWidget* widget : parts()) widget->setVisible(visible);
}

bool NumberControl::eventFilter(QObject* object, QEvent* event) {
    if (event->type() == QEvent::MouseButtonDblClick && (object == slider_ || object == label_) && spec_.neutral) {
        if (slider_->isEnabled()) follow_number(*spec_.neutral);
        return true;
    }
    if (object == slider_) {
        if (event->type() == QEvent::KeyPress) key_is_down_ = true;
        const bool key_is_up = event->type() == QEvent::KeyRelease && !static_cast<QKeyEvent*>(event)->isAutoRepeat();
        if ((key_is_up || event->type() == QEvent::FocusOut) && key_is_down_) {
            key_is_down_ = false;
            Q_EMIT released();
        }
    }
    return QObject::eventFilter(object, event);
}

} // namespace filigree::studio
