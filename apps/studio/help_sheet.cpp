#include "panels/panels.h"

#include "actions.h"
#include "controls.h"
#include "tools/tool.h"

#include <QBoxLayout>
#include <QDialog>
#include <QDialogButtonBox>
#include <QPainter>
#include <QPushButton>
#include <QScrollArea>

#include <array>
#include <utility>
#include <vector>

namespace filigree::studio {
namespace {

struct Group {
    const char *title, *menus; ///< the first parts of the actions' names, a space in between
    std::size_t column;
};
constexpr std::array kGroups = {
    Group{"File", "file", 0},
    Group{"Edit", "edit", 0},
    Group{"Detail and deformation", "quads detail deform fracture fit flesh tool", 1},
    Group{"Body and time", "body", 1},
    Group{"Panels and help", "panel help", 1},
    Group{"View", "view", 2},
};

/// The mouse's whatever the tool.
constexpr std::array kGestures = {
    Gesture{"Drag a knob", "deforms as the sliders do"},
    Gesture{"Drag beside it", "turns the view; so does a right drag"},
    Gesture{"Middle drag", "moves the view; so does Shift+drag"},
    Gesture{"Middle drag, Blender's mouse", "turns it; Shift: moves, Ctrl: zooms"},
    Gesture{"Wheel", "zooms where the mouse is"},
    Gesture{"Double click", "looks at that point; beside: shows all"},
    Gesture{"Double click a slider", "its value at rest"},
};

QString row(const QString& key, const QString& text) {
    return "<tr><td style='padding: 1px 14px 1px 0; white-space: nowrap'><b>" + key.toHtmlEscaped() +
           "</b></td><td style='padding: 1px 0'>" + text.toHtmlEscaped() + "</td></tr>";
}

class HelpSheet : public QDialog {
public:
    HelpSheet(const Actions& actions, QWidget* parent) : QDialog(parent) {
        setObjectName("help.sheet");
        setWindowTitle("Shortcuts and mouse");
        auto* columns = new QHBoxLayout;
        columns->setSpacing(32);
        std::array<QVBoxLayout*, 3> column = {new QVBoxLayout, new QVBoxLayout, new QVBoxLayout};
        for (QVBoxLayout* one : column) {
            one->setSpacing(16);
            columns->addLayout(one);
        }
        const auto add = [&](std::size_t place, const QString& title, const QString& rows) {
            auto* label =
                new QLabel("<h4 style='margin: 0'>" + title + "</h4><table cellspacing='0'>" + rows + "</table>", this);
            label->setObjectName("help.sheet." + title.section(' ', 0, 0).toLower());
            label->setTextFormat(Qt::RichText);
            label->setTextInteractionFlags(Qt::TextSelectableByMouse);
            label->setSizePolicy(QSizePolicy::Preferred, QSizePolicy::Fixed);
            column[place]->addWidget(label);
        };

        QString mouse;
        for (const ToolEntry* const tool : kTools)
            for (const Gesture& gesture : tool->gestures)
                mouse += row(QString(tool->text).remove('&') + ": " + gesture.mouse, gesture.does);
        for (const Gesture& gesture : kGestures) mouse += row(gesture.mouse, gesture.does);
        add(0, "Mouse", mouse);
        for (const Group& group : kGroups) {
            std::vector<std::pair<QString, QStringList>> keys; // a key that two actions share is one row: Play, Pause
            for (const QAction* action : actions.all()) {
                const QString menu = action->objectName().section('.', 0, 0) + ' ';
                if (action->shortcut().isEmpty() || !QString(group.menus).split(' ').contains(menu.trimmed())) continue;
                QString text = action->text().remove('&').remove(QChar(0x2026));
                if (menu == "edit " && text.startsWith("Undo")) text = "Undo"; // without the step's name
                if (menu == "edit " && text.startsWith("Redo")) text = "Redo";
                const QString key = action->shortcut().toString(QKeySequence::NativeText);
                if (keys.empty() || keys.back().first != key) keys.push_back({key, {}});
                keys.back().second.append(text);
            }
            QString rows;
            for (const auto& [key, texts] : keys) rows += row(key, texts.join(", "));
            add(group.column, group.title, rows);
        }
        for (QVBoxLayout* one : column) one->addStretch(1);

        auto* page = new QWidget;
        page->setLayout(columns);
        auto* scroll = new QScrollArea(this);
        scroll->setFrameShape(QFrame::NoFrame);
        scroll->setWidget(page);
        scroll->setWidgetResizable(true);
        auto* buttons = new QDialogButtonBox(QDialogButtonBox::Close, this);
        buttons->button(QDialogButtonBox::Close)->setIcon(QIcon());
        connect(buttons, &QDialogButtonBox::rejected, this, &QDialog::reject);
        auto* layout = new QVBoxLayout(this);
        layout->addWidget(scroll);
        layout->addWidget(buttons);
        const QSize wanted = page->sizeHint() + QSize(40, 70);
        resize(wanted.boundedTo(QSize(1100, 720)));
    }

private:
    /// A border, for displays without a window manager.
    void paintEvent(QPaintEvent* event) override {
        QDialog::paintEvent(event);
        QPainter painter(this);
        painter.setPen(palette().color(QPalette::Mid));
        painter.drawRect(rect().adjusted(0, 0, -1, -1));
    }
};

} // namespace

QDialog* make_help_sheet(const Actions& actions, QWidget* parent) { return new HelpSheet(actions, parent); }

} // namespace filigree::studio
