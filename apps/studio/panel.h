// A panel is a list of rows: each shows a setting and changes it, as one step that can be undone.
#pragma once

#include "controls.h"
#include "number_control.h"
#include "words.h"
#include "workbench.h"

#include <QCheckBox>
#include <QGridLayout>
#include <QScrollArea>
#include <QVBoxLayout>

#include <functional>

namespace filigree::studio {

/// A setting as a number in the unit that is shown. Choices count their items from 0; a switch is on when it is not 0.
struct Setting {
    QString name; ///< of the widget
    QString label, tooltip;
    std::function<double()> get;
    std::function<void(double)> set;
    std::function<bool()> is_shown = {}, is_able = {}; ///< unset: always
};

/// A field of some options as such a number.
template <class Options>
struct Field {
    std::function<double(const Options&)> get;
    std::function<void(Options&, double)> set;
};
/// scale: of the number shown; 100 for per cent.
template <class Options, class Value>
Field<Options> field(Value Options::*member, double scale = 1) {
    return {[=](const Options& options) { return static_cast<double>(options.*member) * scale; },
            [=](Options& options, double number) {
                if constexpr (std::is_enum_v<Value>)
                    options.*member = static_cast<Value>(static_cast<int>(number));
                else
                    options.*member = static_cast<Value>(number / scale);
            }};
}

/// Options that are read and written as a whole, such as a body's: where settings for their fields come from.
template <class Options>
struct OptionsAccess {
    std::function<Options()> get;
    std::function<void(const Options&, const std::string& merge)> set; ///< merge: as Document::change

    using Condition = std::function<bool(const Options&)>;
    Setting setting(const QString& name, const QString& label, const QString& tooltip, const Field<Options>& field,
                    const Condition& is_shown = {}, const Condition& is_able = {}) const {
        const auto of_options = [get = get](const Condition& condition) -> std::function<bool()> {
            if (!condition) return {};
            return [get, condition] { return condition(get()); };
        };
        return {name,
                label,
                tooltip,
                [get = get, field] { return field.get(get()); },
                [access = *this, field, merge = name.toStdString()](double number) {
                    Options options = access.get();
                    field.set(options, number);
                    access.set(options, merge);
                },
                of_options(is_shown),
                of_options(is_able)};
    }
};

/// Gives the columns of all sections the same places.
void line_up(QGridLayout* rows);
/// Widgets side by side over all three columns, equally wide.
QHBoxLayout* beside(QGridLayout* rows, std::initializer_list<QWidget*> widgets);

/// A column of sections in a scroll area. Rows have three columns: label, slider, number.
class Panel : public QScrollArea {
    Q_OBJECT
public:
    Panel(const QString& name, Workbench& workbench, QWidget* parent = nullptr);

protected:
    /// Shows the settings as they are: called whenever document, view, body or the work in the background has changed.
    virtual void refresh();

    QGridLayout* section(const QString& title); ///< "" for one without a heading
    /// Rows that are unfolded by a button.
    QGridLayout* folded_section(FoldButton* fold);

    NumberControl* number(QGridLayout* rows, const Setting& setting, const NumberSpec& spec);
    QComboBox* choice(QGridLayout* rows, const Setting& setting, const QStringList& items);
    QCheckBox* check(const Setting& setting); ///< to be put somewhere
    QCheckBox* check(QGridLayout* rows, const Setting& setting);
    /// Over the whole width; wraps.
    Text* text(QGridLayout* rows, const QString& name, Tone tone = Tone::plain);

    /// Of the view, which has no steps to undo.
    OptionsAccess<ViewSettings> view_settings();

    Workbench& workbench() const { return workbench_; }
    const State& state() const { return workbench_.state(); }
    QWidget* page() const { return page_; }

private:
    Workbench& workbench_;
    QWidget* page_;
    QVBoxLayout* layout_;
    std::vector<std::function<void()>> rows_; ///< each shows its setting
};

/// Play while nothing plays, else pause.
QToolButton* play_button(const QString& name, Workbench& workbench, QAction* play, QAction* pause, QWidget* parent);

} // namespace filigree::studio
