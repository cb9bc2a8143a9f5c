#include "panel.h"

#include <QAction>
#include <QFontMetrics>
#include <QGuiApplication>

namespace filigree::studio {

namespace {

void name_widget(QWidget* widget, const Setting& setting, Qt::FocusPolicy focus) {
    widget->setObjectName(setting.name);
    widget->setToolTip(setting.tooltip);
    widget->setAccessibleName(setting.label);
    widget->setFocusPolicy(focus);
}

} // namespace

Panel::Panel(const QString& name, Workbench& workbench, QWidget* parent)
    : QScrollArea(parent), workbench_(workbench), page_(new QWidget), layout_(new QVBoxLayout(page_)) {
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
    for (QWidget* widget : {static_cast<QWidget*>(this), viewport(), page_}) widget->setAutoFillBackground(false);
    const auto show = [this] { refresh(); };
    connect(&workbench_.document(), &Document::changed, this, show);
    connect(&workbench_, &Workbench::opened, this, show);
    connect(&workbench_.view(), &ViewState::changed, this, show);
    connect(&workbench_.jobs(), &Jobs::finished, this, show); // what failed: back to what is
    connect(&workbench_.playback(), &Playback::state_changed, this, show);
}

void Panel::refresh() {
    for (const auto& show : rows_) show();
}

OptionsAccess<ViewSettings> Panel::view_settings() {
    return {[this] { return workbench_.view().settings(); },
            [this](const ViewSettings& settings, const std::string&) { workbench_.view().set(settings); }};
}

void line_up(QGridLayout* rows) {
    const QFontMetrics metrics(QGuiApplication::font());
    rows->setHorizontalSpacing(8);
    rows->setColumnStretch(1, 1);
    rows->setColumnMinimumWidth(0, metrics.horizontalAdvance("Temperature"));
    rows->setColumnMinimumWidth(2, metrics.horizontalAdvance("10000 kg/m³") + 32);
}

QHBoxLayout* beside(QGridLayout* rows, std::initializer_list<QWidget*> widgets) {
    auto* line = new QHBoxLayout;
    line->setSpacing(6);
    for (QWidget* widget : widgets) line->addWidget(widget, 1);
    rows->addLayout(line, rows->rowCount(), 0, 1, 3);
    return line;
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

QGridLayout* Panel::folded_section(FoldButton* fold) {
    auto* folded = new QWidget(page_);
    folded->setObjectName(fold->objectName() + QStringLiteral(".page"));
    auto* rows = new QGridLayout(folded);
    rows->setContentsMargins(0, 0, 0, 0);
    rows->setVerticalSpacing(5);
    line_up(rows);
    layout_->insertWidget(layout_->count() - 1, fold, 0, Qt::AlignLeft);
    layout_->insertWidget(layout_->count() - 1, folded);
    folded->hide();
    connect(fold, &QToolButton::toggled, folded, &QWidget::setVisible);
    return rows;
}

NumberControl* Panel::number(QGridLayout* rows, const Setting& setting, const NumberSpec& spec) {
    auto* control = new NumberControl(setting.name, setting.label, spec, setting.tooltip, page_);
    const int row = rows->rowCount();
    rows->addWidget(control->label(), row, 0);
    rows->addWidget(control->slider(), row, 1);
    rows->addWidget(control->number(), row, 2);
    connect(control, &NumberControl::changed, this, setting.set);
    connect(control, &NumberControl::released, this, [this] { workbench_.document().end_merge(); });
    rows_.push_back([control, setting] {
        control->set_value(setting.get());
        if (setting.is_shown) control->set_visible(setting.is_shown());
        if (setting.is_able) control->set_enabled(setting.is_able());
    });
    return control;
}

QComboBox* Panel::choice(QGridLayout* rows, const Setting& setting, const QStringList& items) {
    auto* box = new QComboBox(page_);
    name_widget(box, setting, Qt::StrongFocus);
    box->addItems(items);
    guard_wheel(box);
    auto* label = new QLabel(setting.label, page_);
    label->setObjectName(setting.name + QStringLiteral(".label"));
    label->setToolTip(setting.tooltip);
    label->setBuddy(box);
    const int row = rows->rowCount();
    rows->addWidget(label, row, 0);
    rows->addWidget(box, row, 1, 1, 2);
    connect(box, &QComboBox::currentIndexChanged, this, [this, setting](int index) {
        setting.set(index);
        workbench_.document().end_merge(); // each choice is a step
    });
    rows_.push_back([box, label, setting] {
        set_silently(box, static_cast<int>(setting.get()));
        if (!setting.is_shown) return;
        box->setVisible(setting.is_shown());
        label->setVisible(setting.is_shown());
    });
    return box;
}

QCheckBox* Panel::check(const Setting& setting) {
    auto* box = new QCheckBox(setting.label, page_);
    name_widget(box, setting, Qt::TabFocus);
    connect(box, &QCheckBox::toggled, this, [this, setting](bool on) {
        setting.set(on);
        workbench_.document().end_merge();
    });
    rows_.push_back([box, setting] {
        set_silently(box, setting.get() != 0);
        if (setting.is_shown) box->setVisible(setting.is_shown());
        if (setting.is_able) box->setEnabled(setting.is_able());
    });
    return box;
}

QCheckBox* Panel::check(QGridLayout* rows, const Setting& setting) {
    QCheckBox* box = check(setting);
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

QToolButton* play_button(const QString& name, Workbench& workbench, QAction* play, QAction* pause, QWidget* parent) {
    QToolButton* button = icon_button(name, play, parent);
    const auto show = [button, &workbench, play, pause] {
        QAction* const shown = workbench.is_playing() ? pause : play;
        if (button->defaultAction() == shown) return;
        button->removeAction(button->defaultAction());
        button->setDefaultAction(shown);
    };
    QObject::connect(&workbench, &Workbench::timeline_changed, button, show);
    QObject::connect(&workbench.playback(), &Playback::state_changed, button, show);
    return button;
}

} // namespace filigree::studio
