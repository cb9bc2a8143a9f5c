#include "help_sheet.h"

#include "controls.h"

#include <QDialogButtonBox>

#include <array>

namespace filigree::studio {
namespace {

struct Group {
    const char *title, *menus; ///< the first parts of the actions' names, each with a space after it
};
constexpr std::array kGroups = {
    Group{"File", "file "},          Group{"Edit", "edit "}, Group{"Detail and deformation", "detail deform tool "},
    Group{"Body and time", "body "}, Group{"View", "view "}, Group{"Panels and help", "panel help "},
};

struct Gesture {
    const char *mouse, *does;
};
constexpr std::array kGestures = {
    Gesture{"Drag the surface", "pulls it (tool Pull), pins it (tool Pin)"},
    Gesture{"Drag beside it", "turns the view"},
    Gesture{"Right drag", "turns the view"},
    Gesture{"Middle drag", "moves the view"},
    Gesture{"Wheel", "zooms"},
    Gesture{"Double click", "shows all"},
    Gesture{"Double click a slider", "its value at rest"},
};

QString row(const QString& key, const QString& text) {
    return "<tr><td style='padding: 1px 14px 1px 0; white-space: nowrap'><b>" + key.toHtmlEscaped() +
           "</b></td><td style='padding: 1px 0'>" + text.toHtmlEscaped() + "</td></tr>";
}

} // namespace

HelpSheet::HelpSheet(const Actions& actions, QWidget* parent) : QDialog(parent) {
    setObjectName("help.sheet");
    setWindowTitle("Shortcuts and mouse");
    auto* columns = new QHBoxLayout;
    columns->setSpacing(36);
    std::array<QVBoxLayout*, 2> column = {new QVBoxLayout, new QVBoxLayout};
    for (QVBoxLayout* half : column) columns->addLayout(half);
    const auto add = [&](std::size_t half, const QString& title, const QString& rows) {
        auto* label =
            new QLabel("<h4 style='margin: 0'>" + title + "</h4><table cellspacing='0'>" + rows + "</table>", this);
        label->setObjectName("help.sheet." + title.section(' ', 0, 0).toLower());
        label->setTextFormat(Qt::RichText);
        label->setTextInteractionFlags(Qt::TextSelectableByMouse);
        column[half]->addWidget(label);
    };

    QString mouse;
    for (const Gesture& gesture : kGestures) mouse += row(gesture.mouse, gesture.does);
    add(0, "Mouse", mouse);
    for (const Group& group : kGroups) {
        QString rows;
        for (const QAction* action : actions.all()) {
            const QString menu = action->objectName().section('.', 0, 0) + ' ';
            if (action->shortcut().isEmpty() || !QString(group.menus).split(' ').contains(menu.trimmed())) continue;
            QString text = action->text().remove('&').remove(QChar(0x2026));
            if (menu == "edit " && text.startsWith("Undo")) text = "Undo"; // without the step's name
            if (menu == "edit " && text.startsWith("Redo")) text = "Redo";
            rows += row(action->shortcut().toString(QKeySequence::NativeText), text);
        }
        add(QLatin1String(group.title) == "View" || QLatin1String(group.title) == "Panels and help" ? 1 : 0,
            group.title, rows);
    }
    for (QVBoxLayout* half : column) half->addStretch(1);

    auto* page = new QWidget;
    page->setLayout(columns);
    auto* scroll = new QScrollArea(this);
    scroll->setFrameShape(QFrame::NoFrame);
    scroll->setWidget(page);
    scroll->setWidgetResizable(true);
    auto* buttons = new QDialogButtonBox(QDialogButtonBox::Close, this);
    connect(buttons, &QDialogButtonBox::rejected, this, &QDialog::reject);
    auto* layout = new QVBoxLayout(this);
    layout->addWidget(scroll);
    layout->addWidget(buttons);
    const QSize wanted = page->sizeHint() + QSize(40, 70);
    resize(wanted.boundedTo(QSize(1100, 720)));
}

} // namespace filigree::studio
