#include "controls.h"

#include "icons.h"
#include "theme.h"

#include <QEvent>
#include <QGuiApplication>
#include <QHelpEvent>
#include <QPainter>
#include <QSignalBlocker>
#include <QStyleOptionToolButton>
#include <QStylePainter>
#include <QToolTip>

#include <algorithm>

namespace filigree::studio {
namespace {

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

} // namespace

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

void guard_wheel(QWidget* widget) { widget->installEventFilter(new WheelGuard(widget)); }

void set_silently(QComboBox* box, int index) {
    const QSignalBlocker quiet(box);
    box->setCurrentIndex(index);
}

void set_silently(QAbstractButton* button, bool checked) {
    const QSignalBlocker quiet(button);
    button->setChecked(checked);
}

} // namespace filigree::studio
