#include "controls.h"

#include "icons.h"
#include "theme.h"

#include <QEvent>
#include <QFontMetrics>
#include <QGuiApplication>
#include <QHelpEvent>
#include <QKeyEvent>
#include <QLineEdit>
#include <QLocale>
#include <QPainter>
#include <QSignalBlocker>
#include <QStyleOptionToolButton>
#include <QStylePainter>
#include <QToolTip>

#include <algorithm>
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

/// So that turning the wheel over a panel scrolls it and changes nothing.
class WheelGuard : public QObject {
public:
    using QObject::QObject;
    bool eventFilter(QObject* object, QEvent* event) override {
        if (event->type() != QEvent::Wheel || static_cast<QWidget*>(object)->hasFocus()) return false;
        event->ignore();
        return true;
    }
};

void guard_wheel(QWidget* widget) { widget->installEventFilter(new WheelGuard(widget)); }

} // namespace

QString number_text(double value, int digits) { return QString::number(value, 'g', digits); }

Text::Text(const QString& name, Tone tone, QWidget* parent) : QLabel(parent), tone_(tone) {
    setObjectName(name);
    color();
}

void Text::set_tone(Tone tone) {
    if (tone == tone_) return;
    tone_ = tone;
    color();
}

void Text::changeEvent(QEvent* event) {
    QLabel::changeEvent(event);
    if (event->type() == QEvent::PaletteChange) color();
}

void Text::color() {
    const QPalette application = QGuiApplication::palette();
    QColor color = application.color(QPalette::WindowText);
    if (tone_ == Tone::quiet) color = quiet_color(application);
    if (tone_ == Tone::good) color = good_color(application);
    if (tone_ == Tone::bad) color = bad_color(application);
    if (palette().color(QPalette::Active, QPalette::WindowText) == color) return;
    QPalette own;
    if (tone_ != Tone::plain) {
        own.setColor(QPalette::Active, QPalette::WindowText, color);
        own.setColor(QPalette::Inactive, QPalette::WindowText, color);
    }
    setPalette(own);
}

ElidedText::ElidedText(const QString& name, Qt::TextElideMode mode, Tone tone, QWidget* parent)
    : Text(name, tone, parent), mode_(mode) {
    setTextFormat(Qt::PlainText);
}

bool ElidedText::is_elided() const { return fontMetrics().horizontalAdvance(text()) > contentsRect().width(); }

QSize ElidedText::sizeHint() const {
    const QMargins margins = contentsMargins();
    const int slack = fontMetrics().averageCharWidth(); // a text that just fits is not to be shortened
    return {fontMetrics().horizontalAdvance(text()) + slack + margins.left() + margins.right(),
            Text::sizeHint().height()};
}

QSize ElidedText::minimumSizeHint() const {
    const int least = fontMetrics().averageCharWidth() * int(std::min(qsizetype(6), text().size()));
    const QMargins margins = contentsMargins();
    return {least + margins.left() + margins.right(), Text::minimumSizeHint().height()};
}

bool ElidedText::event(QEvent* event) {
    if (event->type() == QEvent::ToolTip && is_elided()) {
        const QString whole = toolTip().isEmpty() || toolTip() == text() ? text() : text() + '\n' + toolTip();
        QToolTip::showText(static_cast<QHelpEvent*>(event)->globalPos(), whole, this);
        return true;
    }
    return Text::event(event);
}

void ElidedText::paintEvent(QPaintEvent*) {
    QPainter painter(this);
    const QRect room = contentsRect();
    const QString shown = is_elided() ? fontMetrics().elidedText(text(), mode_, room.width()) : text();
    style()->drawItemText(&painter, room, int(QStyle::visualAlignment(layoutDirection(), alignment())), palette(),
                          isEnabled(), shown, foregroundRole());
}

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
    for (QWidget* widget : std::initializer_list<QWidget*>{label_, slider_, number_}) {
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

void NumberControl::follow_number(double value) {
    if (value == value_) return;
    value_ = value;
    show_value();
    Q_EMIT changed(value_);
    Q_EMIT released();
}

void NumberControl::reset() {
    if (!spec_.neutral || !slider_->isEnabled() || value_ == *spec_.neutral) return;
    value_ = *spec_.neutral;
    slider_->setSliderDown(false);
    show_value();
    Q_EMIT changed(value_);
    Q_EMIT released();
}

void NumberControl::set_enabled(bool enabled) {
    for (QWidget* widget : std::initializer_list<QWidget*>{label_, slider_, number_}) widget->setEnabled(enabled);
}

void NumberControl::set_visible(bool visible) {
    for (QWidget* widget : std::initializer_list<QWidget*>{label_, slider_, number_}) widget->setVisible(visible);
}

bool NumberControl::eventFilter(QObject* object, QEvent* event) {
    if (event->type() == QEvent::MouseButtonDblClick && (object == slider_ || object == label_) && spec_.neutral) {
        reset();
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

Panel::Panel(const QString& name, QWidget* parent)
    : QScrollArea(parent), page_(new QWidget), layout_(new QVBoxLayout(page_)) {
    setObjectName(name);
    page_->setObjectName(name + QStringLiteral(".page"));
    setFrameShape(QFrame::NoFrame);
    setWidgetResizable(true);
    setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
    setFocusPolicy(Qt::NoFocus);
    layout_->setContentsMargins(12, 10, 12, 12);
    layout_->setSpacing(6);
    layout_->addStretch(1);
    setWidget(page_);
    setAutoFillBackground(false);
    viewport()->setAutoFillBackground(false);
    page_->setAutoFillBackground(false);
}

void line_up(QGridLayout* rows) {
    const QFontMetrics metrics(QGuiApplication::font());
    rows->setHorizontalSpacing(8);
    rows->setColumnStretch(1, 1);
    rows->setColumnMinimumWidth(0, metrics.horizontalAdvance("Temperature"));
    rows->setColumnMinimumWidth(2, metrics.horizontalAdvance("10000 kg/m³") + 32);
}

QGridLayout* Panel::section(const QString& title) {
    auto* rows = new QGridLayout;
    rows->setVerticalSpacing(5);
    line_up(rows);
    if (!title.isEmpty()) {
        auto* heading = new QLabel(title, page_);
        heading->setObjectName(objectName() + QStringLiteral(".heading.") + title.toLower().replace(' ', '_'));
        QFont font = heading->font();
        font.setBold(true);
        heading->setFont(font);
        heading->setContentsMargins(0, layout_->count() > 1 ? 10 : 0, 0, 2);
        layout_->insertWidget(layout_->count() - 1, heading);
    }
    layout_->insertLayout(layout_->count() - 1, rows);
    return rows;
}

NumberControl* Panel::number(QGridLayout* rows, const QString& name, const QString& label, const NumberSpec& spec,
                             const QString& tooltip) {
    auto* control = new NumberControl(name, label, spec, tooltip, page_);
    const int row = rows->rowCount();
    rows->addWidget(control->label(), row, 0);
    rows->addWidget(control->slider(), row, 1);
    rows->addWidget(control->number(), row, 2);
    return control;
}

QComboBox* Panel::choice(QGridLayout* rows, const QString& name, const QString& label, const QStringList& items,
                         const QString& tooltip) {
    auto* box = new QComboBox(page_);
    box->setObjectName(name);
    box->addItems(items);
    box->setToolTip(tooltip);
    box->setAccessibleName(label);
    box->setFocusPolicy(Qt::StrongFocus);
    guard_wheel(box);
    auto* text = new QLabel(label, page_);
    text->setObjectName(name + QStringLiteral(".label"));
    text->setToolTip(tooltip);
    text->setBuddy(box);
    const int row = rows->rowCount();
    rows->addWidget(text, row, 0);
    rows->addWidget(box, row, 1, 1, 2);
    return box;
}

QCheckBox* Panel::check(QGridLayout* rows, const QString& name, const QString& text, const QString& tooltip) {
    auto* box = new QCheckBox(text, page_);
    box->setObjectName(name);
    box->setToolTip(tooltip);
    box->setAccessibleName(text);
    box->setFocusPolicy(Qt::TabFocus);
    rows->addWidget(box, rows->rowCount(), 0, 1, 3);
    return box;
}

Text* Panel::text(QGridLayout* rows, const QString& name, Tone tone) {
    auto* label = new Text(name, tone, page_);
    label->setWordWrap(true);
    label->setTextInteractionFlags(Qt::TextSelectableByMouse);
    label->setFocusPolicy(Qt::NoFocus);
    rows->addWidget(label, rows->rowCount(), 0, 1, 3);
    return label;
}

QHBoxLayout* Panel::beside(QGridLayout* rows, std::initializer_list<QWidget*> widgets) {
    auto* line = new QHBoxLayout;
    line->setSpacing(6);
    for (QWidget* widget : widgets) line->addWidget(widget, 1);
    rows->addLayout(line, rows->rowCount(), 0, 1, 3);
    return line;
}

QPushButton* Panel::button(const QString& name, const QString& text, const QString& tooltip) {
    auto* result = new QPushButton(text, page_);
    result->setObjectName(name);
    result->setToolTip(tooltip);
    result->setAccessibleName(text);
    result->setFocusPolicy(Qt::TabFocus);
    return result;
}

QLabel* Panel::label_of(const QWidget* control) {
    for (QLabel* label : control->parentWidget()->findChildren<QLabel*>())
        if (label->buddy() == control) return label;
    return nullptr;
}

void Panel::show_row(QWidget* control, bool shown) {
    control->setVisible(shown);
    if (QLabel* label = label_of(control)) label->setVisible(shown);
}

ActionButton::ActionButton(const QString& name, QAction* action, const QString& text, QWidget* parent)
    : QPushButton(parent), action_(action), text_(text) {
    setObjectName(name);
    setFocusPolicy(Qt::TabFocus);
    connect(action, &QAction::changed, this, &ActionButton::follow);
    connect(this, &QPushButton::clicked, action, &QAction::trigger);
    follow();
}

void ActionButton::set_icon_alone(bool alone) {
    is_icon_alone_ = alone;
    follow();
}

void ActionButton::follow() {
    QString text = text_.isEmpty() ? action_->text().remove('&') : text_;
    setText(is_icon_alone_ ? QString() : text);
    setAccessibleName(text.remove(QChar(0x2026)));
    setIcon(action_->icon());
    setToolTip(action_->toolTip());
    setEnabled(action_->isEnabled());
    setCheckable(action_->isCheckable());
    set_silently(this, action_->isChecked());
}

FoldButton::FoldButton(const QString& name, const QString& text, const QString& tooltip, QWidget* parent)
    : QToolButton(parent) {
    setObjectName(name);
    setText(text);
    setToolTip(tooltip);
    setAccessibleName(text);
    setCheckable(true);
    setAutoRaise(true);
    setToolButtonStyle(Qt::ToolButtonTextBesideIcon);
    setIcon(studio::icon(Icon::folded));
    setFocusPolicy(Qt::TabFocus);
    QFont bold = font();
    bold.setBold(true);
    setFont(bold);
    connect(this, &QToolButton::toggled, this,
            [this](bool unfolded) { setIcon(studio::icon(unfolded ? Icon::unfolded : Icon::folded)); });
}

void FoldButton::paintEvent(QPaintEvent*) {
    QStylePainter painter(this);
    QStyleOptionToolButton option;
    initStyleOption(&option);
    option.state &= ~(QStyle::State_On | QStyle::State_Sunken | QStyle::State_MouseOver); // the arrow says it all
    option.rect.setLeft(-4);
    option.rect.setWidth(sizeHint().width());
    painter.drawControl(QStyle::CE_ToolButtonLabel, option);
    if (!hasFocus()) return;
    QStyleOptionFocusRect focus;
    focus.initFrom(this);
    painter.drawPrimitive(QStyle::PE_FrameFocusRect, focus);
}

QToolButton* icon_button(const QString& name, QAction* action, QWidget* parent) {
    auto* result = new QToolButton(parent);
    result->setDefaultAction(action);
    result->setObjectName(name);
    result->setAutoRaise(true);
    result->setToolButtonStyle(Qt::ToolButtonIconOnly);
    result->setAccessibleName(action->text().remove('&'));
    result->setFocusPolicy(Qt::TabFocus);
    return result;
}

void set_silently(QComboBox* box, int index) {
    const QSignalBlocker quiet(box);
    box->setCurrentIndex(index);
}

void set_silently(QAbstractButton* button, bool checked) {
    const QSignalBlocker quiet(button);
    button->setChecked(checked);
}

} // namespace filigree::studio
