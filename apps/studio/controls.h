// What panels are made of: rows of label, slider and number; choices, switches and buttons. All named, all with
// tooltips.
#pragma once

#include "words.h"

#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QGridLayout>
#include <QLabel>
#include <QPushButton>
#include <QScrollArea>
#include <QSlider>
#include <QToolButton>
#include <QVBoxLayout>

#include <functional>
#include <optional>

namespace filigree::studio {

QString number_text(double value, int digits = 3); ///< significant digits, as short as they go: "0.0042", "1.2e-05"

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
    double value_at(int position) const;
    int position_of(double value) const;
    void follow_slider(int position);
    void follow_number(double value);
    void show_value();
    void reset();

    NumberSpec spec_;
    double value_ = 0;
    bool key_is_down_ = false;
    QLabel* label_;
    QSlider* slider_;
    QDoubleSpinBox* number_;
};

/// Gives the columns of all sections the same places.
void line_up(QGridLayout* rows);

/// A column of sections in a scroll area. Rows have three columns: label, slider, number.
class Panel : public QScrollArea {
    Q_OBJECT
public:
    explicit Panel(const QString& name, QWidget* parent = nullptr);

protected:
    QGridLayout* section(const QString& title); ///< "" for one without a heading

    NumberControl* number(QGridLayout* rows, const QString& name, const QString& label, const NumberSpec& spec,
                          const QString& tooltip);
    QComboBox* choice(QGridLayout* rows, const QString& name, const QString& label, const QStringList& items,
                      const QString& tooltip);
    QCheckBox* check(QGridLayout* rows, const QString& name, const QString& text, const QString& tooltip);
    /// Over the whole width; wraps.
    Text* text(QGridLayout* rows, const QString& name, Tone tone = Tone::plain);
    /// Widgets side by side over the whole width, equally wide.
    QHBoxLayout* beside(QGridLayout* rows, std::initializer_list<QWidget*> widgets);
    QPushButton* button(const QString& name, const QString& text, const QString& tooltip);

    static QLabel* label_of(const QWidget* control); ///< the one whose buddy it is
    /// Shows or hides a control and its label.
    static void show_row(QWidget* control, bool shown);

    QWidget* page() const { return page_; }
    QVBoxLayout* layout_of_page() const { return layout_; }

private:
    QWidget* page_;
    QVBoxLayout* layout_;
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

/// Sets without telling anybody: what a panel does when the document has changed.
void set_silently(QComboBox* box, int index);
void set_silently(QAbstractButton* button, bool checked);

} // namespace filigree::studio
