// Texts and buttons of the window. All named, all with tooltips.
#pragma once

#include <QComboBox>
#include <QLabel>
#include <QPushButton>
#include <QToolButton>

namespace filigree::studio {

enum class Tone { plain, quiet, good, bad };

/// Text in a colour that follows the theme.
class Text : public QLabel {
    Q_OBJECT
public:
    explicit Text(const QString& name, Tone tone = Tone::plain, QWidget* parent = nullptr);
    void set_tone(Tone tone);

protected:
    void changeEvent(QEvent* event) override;

private:
    void color();
    Tone tone_;
};

/// One line that is shortened where there is no room for it; the tooltip has all of it then. Never widens its window.
class ElidedText : public Text {
    Q_OBJECT
public:
    explicit ElidedText(const QString& name, Qt::TextElideMode mode, Tone tone = Tone::plain,
                        QWidget* parent = nullptr);
    bool is_elided() const;
    QSize sizeHint() const override; ///< all of the text
    QSize minimumSizeHint() const override;

protected:
    bool event(QEvent* event) override;
    void paintEvent(QPaintEvent* event) override;

private:
    Qt::TextElideMode mode_;
};

/// A button that does what an action does, with its icon, text, state and tooltip, under a name of its own.
class ActionButton : public QPushButton {
    Q_OBJECT
public:
    /// `text`: "" for the action's own.
    ActionButton(const QString& name, QAction* action, const QString& text = {}, QWidget* parent = nullptr);
    void set_icon_alone(bool alone); ///< where there is no room for the text

private:
    void follow();
    QAction* action_;
    QString text_;
    bool is_icon_alone_ = false;
};

/// Shows or hides what belongs under it; says so by toggled().
class FoldButton : public QToolButton {
    Q_OBJECT
public:
    FoldButton(const QString& name, const QString& text, const QString& tooltip, QWidget* parent = nullptr);

protected:
    void paintEvent(QPaintEvent* event) override;
};

/// An action as a small button with an icon alone.
QToolButton* icon_button(const QString& name, QAction* action, QWidget* parent = nullptr);

/// Turning the wheel over it scrolls the panel and changes nothing, unless it was clicked before.
void guard_wheel(QWidget* widget);

/// Sets without telling anybody: what a panel does when the document has changed.
void set_silently(QComboBox* box, int index);
void set_silently(QAbstractButton* button, bool checked);

} // namespace filigree::studio
