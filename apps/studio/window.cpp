#include "window.h"

#include "controls.h"
#include "icons.h"
#include "message_bar.h"
#include "motion_file.h"
#include "panels/panels.h"
#include "tools/tool.h"
#include "words.h"

#include <QApplication>
#include <QBoxLayout>
#include <QCloseEvent>
#include <QDragEnterEvent>
#include <QDropEvent>
#include <QFileDialog>
#include <QFileInfo>
#include <QKeyEvent>
#include <QMenuBar>
#include <QMessageBox>
#include <QMimeData>
#include <QPointer>
#include <QProgressDialog>
#include <QSettings>
#include <QSplitter>
#include <QStackedWidget>
#include <QTabBar>
#include <QTimer>
#include <QToolBar>

#include <array>

namespace filigree::studio {
namespace {

constexpr qsizetype kRecentFiles = 10;
constexpr int kColumnWidth = 356; // device-independent pixels, at the start

/// Whether a widget needs a key for itself that is a shortcut of the window as well.
bool keeps_key(const QWidget* widget, int key) {
    const bool arrows = key == Qt::Key_Left || key == Qt::Key_Right || key == Qt::Key_Up || key == Qt::Key_Down;
    const bool jumps = key == Qt::Key_Home || key == Qt::Key_End || key == Qt::Key_PageUp || key == Qt::Key_PageDown;
    if (qobject_cast<const QAbstractSlider*>(widget) || qobject_cast<const QAbstractSpinBox*>(widget))
        return arrows || jumps;
    if (qobject_cast<const QComboBox*>(widget)) return arrows || jumps || key == Qt::Key_Space;
    if (qobject_cast<const QTabBar*>(widget)) return arrows || key == Qt::Key_Home || key == Qt::Key_End;
    if (qobject_cast<const QAbstractButton*>(widget)) return key == Qt::Key_Space;
    return false;
}

/// Shows the body's advanced settings while it is checked.
QAbstractButton* advanced_fold(const MainWindow& window) { return window.findChild<QAbstractButton*>("body.advanced"); }

} // namespace

struct MainWindow::Impl {
    bool keep_settings = false;
    std::unique_ptr<Workbench> workbench;
    Viewport* viewport = nullptr;
    std::unique_ptr<Actions> actions;
    MessageBar* messages = nullptr;
    QSplitter* splitter = nullptr;
    QTabBar* tabs = nullptr;
    QStackedWidget* panels = nullptr;
    QMenu* recent_menu = nullptr;
    QPointer<QDialog> help;
    Theme theme = Theme::system;
    QStringList recent;
    QString file_path;
    bool is_writing = false;            ///< files that were asked for are still to come
    QPointer<QProgressDialog> farewell; ///< the window is to close once they are there

    void add_menus(MainWindow& window) {
        recent_menu = new QMenu("Open &recent", &window);
        recent_menu->setObjectName("file.open_recent");
        for (const ActionMenu& menu : actions->menus()) {
            QMenu* shown = window.menuBar()->addMenu(menu.title);
            shown->setObjectName(menu.name);
            for (QAction* action : menu.actions) {
                if (!action)
                    shown->addSeparator();
                else
                    shown->addAction(action);
                if (action == actions->find("file.open")) shown->addMenu(recent_menu);
            }
        }
    }

    void add_toolbar(MainWindow& window) {
        auto* bar = new QToolBar("Tools", &window);
        bar->setObjectName("toolbar");
        bar->setMovable(false);
        bar->setFloatable(false);
        bar->setIconSize(QSize(20, 20));
        QStringList names;
        for (const ToolEntry* const tool : kTools) names << QStringLiteral("tool.") + tool->name;
        for (const QString& name : names << ""
                                         << "view.show_all"
                                         << ""
                                         << "edit.undo"
                                         << "edit.redo") {
            QAction* const action = actions->find(name);
            if (!action) {
                bar->addSeparator();
                continue;
            }
            bar->addAction(action);
            auto* button = qobject_cast<QToolButton*>(bar->widgetForAction(action));
            button->setObjectName("toolbar." + name);
            button->setFocusPolicy(Qt::TabFocus);
            button->setAccessibleName(action->text().remove('&'));
        }
        window.addToolBar(Qt::LeftToolBarArea, bar);
    }

    QWidget* make_middle(MainWindow& window) {
        auto* middle = new QWidget(&window);
        middle->setObjectName("middle");
        auto* picture = new QWidget(middle);
        picture->setObjectName("picture");
        auto* over = new QVBoxLayout(picture);
        over->setContentsMargins(0, 0, 0, 0);
        over->addWidget(viewport);
        messages = new MessageBar(picture);
        connect(messages, &MessageBar::covers, viewport, &Viewport::set_covered);
        auto* column = new QVBoxLayout(middle);
        column->setContentsMargins(0, 0, 0, 0);
        column->setSpacing(0);
        column->addWidget(picture, 1);
        column->addWidget(make_timeline(*workbench, *actions, middle));
        return middle;
    }

    QWidget* make_column(MainWindow& window) {
        auto* column = new QWidget(&window);
        column->setObjectName("column");
        tabs = new QTabBar(column);
        tabs->setObjectName("panels");
        tabs->setAccessibleName("Panels");
        tabs->setExpanding(true);
        tabs->setDrawBase(true);
        tabs->setUsesScrollButtons(false);
        tabs->setFocusPolicy(Qt::TabFocus);
        panels = new QStackedWidget(column);
        panels->setObjectName("panels.pages");
        const std::array<std::pair<QWidget*, const char*>, kPanels.size()> pages = {{
            {make_model_panel(*workbench, *actions, recent_menu), "The mesh: open, shapes, defects, save"},
            {make_quads_panel(*workbench, *actions), "Regular quads of any mesh, in patches"},
            {make_detail_panel(*workbench), "Levels, the driver and how detail is stored"},
            {make_deform_panel(*workbench, *actions), "Pull by hand or deform by numbers"},
            {make_body_panel(*workbench, *actions), "A body that falls, bounces and can be pulled"},
            {make_fracture_panel(*workbench, *actions), "Where the mesh breaks, and how hard that is"},
            {make_fit_panel(*workbench, *actions), "A small model that follows any animation"},
            {make_flesh_panel(*workbench, *actions), "Soft matter that a skeleton moves"},
            {make_view_panel(*workbench, *viewport, window), "How the mesh is shown"},
        }};
        for (std::size_t k = 0; k < pages.size(); ++k) {
            panels->addWidget(pages[k].first);
            tabs->addTab(title_of(kPanels[k]));
            tabs->setTabToolTip(int(k), QLatin1String(pages[k].second) + QStringLiteral(" (Ctrl+%1)").arg(k + 1));
        }
        connect(tabs, &QTabBar::currentChanged, &window, [this, &window](int index) {
            panels->setCurrentIndex(index);
            Q_EMIT window.panel_changed();
        });
        auto* layout = new QVBoxLayout(column);
        layout->setContentsMargins(0, 0, 0, 0);
        layout->setSpacing(0);
        layout->addWidget(make_overview(*workbench, *actions, column));
        layout->addWidget(tabs);
        layout->addWidget(panels, 1);
        column->setMinimumWidth(std::max(290, tabs->sizeHint().width())); // no tab is cut off
        return column;
    }

    void follow_files(MainWindow& window) {
        connect(workbench.get(), &Workbench::opened, &window, [this, &window] {
            const auto& source = workbench->state().source;
            const QString path = source ? QString::fromStdString(source->path) : QString();
            file_path = path.endsWith(".fil", Qt::CaseInsensitive) ? path : QString();
            if (!path.isEmpty()) add_recent(window, path);
            show_title(window);
            Q_EMIT window.files_changed();
        });
        connect(&workbench->document(), &Document::changed, &window, [this, &window] { show_title(window); });
        connect(&workbench->document().undo_stack(), &QUndoStack::cleanChanged, &window,
                [&window](bool clean) { window.setWindowModified(!clean); });
        connect(workbench.get(), &Workbench::saved, &window, [this, &window](const std::string& path) {
            file_path = QString::fromStdString(path);
            add_recent(window, file_path);
            show_title(window);
            Q_EMIT window.files_changed();
        });
        connect(&workbench->jobs(), &Jobs::failed, &window, [this] { // the window stays, to tell of it
            if (farewell) std::exchange(farewell, {})->deleteLater();
        });
        connect(&workbench->jobs(), &Jobs::finished, &window, [this, &window] {
            if (workbench->jobs().is_busy()) return;
            is_writing = false;
            if (!farewell) return;
            std::exchange(farewell, {})->deleteLater();
            QTimer::singleShot(0, &window, &QWidget::close);
        });
    }

    void wait_for_files(MainWindow& window) {
        if (farewell) return;
        auto* dialog = new QProgressDialog(&window);
        farewell = dialog;
        dialog->setObjectName("farewell");
        dialog->setWindowTitle("Filigree");
        dialog->setWindowModality(Qt::WindowModal);
        dialog->setMinimumDuration(0);
        dialog->setRange(0, 1000);
        dialog->setAutoClose(false);
        dialog->setAutoReset(false);
        dialog->setCancelButtonText("Close without it");
        const auto show = [this, dialog] {
            dialog->setLabelText(workbench->jobs().title() + QStringLiteral(" – the window closes when it is done."));
            dialog->setValue(int(1000 * workbench->jobs().fraction()));
        };
        show();
        connect(&workbench->jobs(), &Jobs::progressed, dialog, show);
        connect(&workbench->jobs(), &Jobs::started, dialog, show);
        connect(dialog, &QProgressDialog::canceled, &window, [this] { workbench->jobs().cancel(); });
        dialog->show();
    }

    void show_title(MainWindow& window) {
        const auto& source = workbench->state().source;
        const QString name = !file_path.isEmpty() ? QFileInfo(file_path).fileName()
                             : source             ? QString::fromStdString(source->name)
                                                  : QString();
        window.setWindowTitle(name.isEmpty() ? QStringLiteral("Filigree") : name + QStringLiteral("[*] – Filigree"));
        window.setWindowModified(workbench->document().is_modified());
    }

    void add_recent(MainWindow& window, const QString& path) {
        const QString whole = QFileInfo(path).absoluteFilePath();
        recent.removeAll(whole);
        recent.prepend(whole);
        if (recent.size() > kRecentFiles) recent.resize(kRecentFiles);
        if (keep_settings) QSettings().setValue("files/recent", recent);
        show_recent(window);
    }

    void show_recent(MainWindow& window) {
        recent_menu->clear();
        recent_menu->setEnabled(!recent.isEmpty());
        for (const QString& path : recent) {
            QAction* action = recent_menu->addAction(QFileInfo(path).fileName().replace('&', "&&"));
            action->setToolTip(path);
            action->setStatusTip(path);
            connect(action, &QAction::triggered, &window, [&window, path] { window.open_file(path); });
        }
        recent_menu->setToolTipsVisible(true);
    }

    /// The document is in the file, as far as a model file holds it, and was not changed meanwhile.
    bool save_now(MainWindow& window, const QString& path) {
        bool is_written = false;
        const auto heard = connect(workbench.get(), &Workbench::saved, &window, [&] { is_written = true; });
        const std::uint64_t id = workbench->document().state_id();
        window.save_file(path);
        workbench->jobs().wait_until_idle();
        disconnect(heard);
        return is_written && workbench->document().state_id() == id;
    }

    void read_settings(MainWindow& window) {
        const QSettings settings;
        recent = settings.value("files/recent").toStringList();
        window.restoreGeometry(settings.value("window/geometry").toByteArray());
        splitter->restoreState(settings.value("window/splitter").toByteArray());
        window.show_panel(settings.value("window/panel", "model").toString());
        workbench->view().edit([&](ViewSettings& view) {
            view.blender_mouse = settings.value("view/blender_mouse", false).toBool();
            view.follow = settings.value("view/follow", false).toBool();
        });
        advanced_fold(window)->setChecked(settings.value("window/advanced", false).toBool());
    }

    void write_settings(const MainWindow& window) {
        QSettings settings;
        settings.setValue("window/geometry", window.saveGeometry());
        settings.setValue("window/splitter", splitter->saveState());
        settings.setValue("window/panel", window.panel());
        settings.setValue("window/advanced", advanced_fold(window)->isChecked());
        settings.setValue("window/theme", int(theme));
        settings.setValue("view/blender_mouse", workbench->view().settings().blender_mouse);
        settings.setValue("view/follow", workbench->view().settings().follow);
    }
};

MainWindow::MainWindow(bool keep_settings, QWidget* parent) : QMainWindow(parent), impl_(new Impl) {
    Impl& content = *impl_;
    content.keep_settings = keep_settings;
    if (keep_settings)
        content.theme = static_cast<Theme>(std::clamp(QSettings().value("window/theme", 0).toInt(), 0, 2));
    apply_theme(content.theme);
    setObjectName("window");
    setWindowIcon(icon(Icon::logo));
    setAcceptDrops(true);
    setContextMenuPolicy(Qt::NoContextMenu); // no menu that takes the toolbar away

    content.workbench = std::make_unique<Workbench>();
    content.viewport = new Viewport(*content.workbench);
    content.viewport->setObjectName("viewport");
    content.actions = std::make_unique<Actions>(*content.workbench, *content.viewport, *this);
    content.add_menus(*this);
    content.add_toolbar(*this);
    content.splitter = new QSplitter(Qt::Horizontal, this);
    content.splitter->setObjectName("splitter");
    content.splitter->setChildrenCollapsible(false);
    content.splitter->setHandleWidth(3);
    content.splitter->addWidget(content.make_middle(*this));
    content.splitter->addWidget(content.make_column(*this));
    content.splitter->setStretchFactor(0, 1);
    content.splitter->setStretchFactor(1, 0);
    setCentralWidget(content.splitter);
    setStatusBar(make_status_bar(*content.workbench, *content.viewport, *content.actions, this));
    content.follow_files(*this);

    connect(content.workbench.get(), &Workbench::told, this, &MainWindow::show_message);
    connect(content.workbench.get(), &Workbench::withdrawn, this, [this](const QString& sentence) {
        if (message() == sentence) dismiss_message();
    });
    connect(this, &MainWindow::panel_changed, this, [this] {
        workbench().view().edit([this](ViewSettings& settings) { settings.gizmos = panel() == "deform"; });
    });
    resize(1280, 800);
    content.splitter->setSizes({1280 - kColumnWidth, kColumnWidth});
    if (keep_settings) content.read_settings(*this);
    content.show_recent(*this);
    content.show_title(*this);
    qApp->installEventFilter(this);
    Q_EMIT panel_changed();
    content.viewport->setFocus();
}

MainWindow::~MainWindow() {
    qApp->removeEventFilter(this);
    impl_->workbench->disconnect(this);
    delete impl_->help.data();
    delete takeCentralWidget(); // all that looks at the workbench goes before it
    setStatusBar(nullptr);
}

Workbench& MainWindow::workbench() { return *impl_->workbench; }
Viewport& MainWindow::viewport() { return *impl_->viewport; }
Actions& MainWindow::actions() { return *impl_->actions; }

bool MainWindow::show_panel(const QString& name) {
    for (std::size_t k = 0; k < kPanels.size(); ++k)
        if (name == QLatin1String(kPanels[k])) {
            impl_->tabs->setCurrentIndex(int(k));
            return true;
        }
    return false;
}

QString MainWindow::panel() const {
    return impl_->tabs ? QLatin1String(kPanels[std::size_t(impl_->tabs->currentIndex())]) : QString();
}

// Files

QString MainWindow::file_path() const { return impl_->file_path; }
QStringList MainWindow::recent_files() const { return impl_->recent; }

void MainWindow::open_file(const QString& path) {
    const bool replaces = !is_point_cache(path.toStdString()); // a cache moves the mesh there is
    if (!replaces || may_discard()) impl_->workbench->open(path.toStdString());
}

void MainWindow::save_file(const QString& path) {
    write([&] { impl_->workbench->save_model(path.toStdString()); });
}

void MainWindow::write(const std::function<void()>& start) {
    start();
    impl_->is_writing = impl_->workbench->jobs().is_busy();
}

bool MainWindow::may_discard() {
    impl_->workbench->pause(); // what was recorded so far is a change as well
    if (!impl_->workbench->document().is_modified()) return true;
    QMessageBox box(this);
    box.setObjectName("unsaved");
    box.setWindowTitle("Unsaved changes");
    box.setIcon(QMessageBox::Question);
    const auto& source = impl_->workbench->state().source;
    box.setText(QStringLiteral("Save the changes of %1 first?")
                    .arg(source ? QString::fromStdString(source->name) : QStringLiteral("the model")));
    QString explanation = "Without saving they are lost.";
    if (const auto left_out = impl_->workbench->left_out_of_model(); !left_out.empty())
        explanation += " A model file (.fil) is written without " + listed(left_out) + '.';
    box.setInformativeText(explanation);
    box.setStandardButtons(QMessageBox::Save | QMessageBox::Discard | QMessageBox::Cancel);
    box.setDefaultButton(QMessageBox::Save);
    const int answer = box.exec();
    if (answer == QMessageBox::Discard) return true;
    if (answer != QMessageBox::Save) return false;
    QString path = impl_->file_path;
    if (path.isEmpty()) {
        QFileDialog dialog(this, "Save the model");
        dialog.setObjectName("unsaved.save");
        dialog.setAcceptMode(QFileDialog::AcceptSave);
        dialog.setNameFilters({"Filigree models (*.fil)"});
        dialog.setDefaultSuffix("fil");
        if (dialog.exec() != QDialog::Accepted) return false;
        path = dialog.selectedFiles().value(0);
    }
    return impl_->save_now(*this, path);
}

void MainWindow::closeEvent(QCloseEvent* event) {
    if (impl_->is_writing) {
        impl_->wait_for_files(*this);
        return event->ignore();
    }
    if (!may_discard()) return event->ignore();
    impl_->workbench->jobs().cancel();
    if (impl_->keep_settings) impl_->write_settings(*this);
    event->accept();
}

void MainWindow::dragEnterEvent(QDragEnterEvent* event) {
    const QList<QUrl> urls = event->mimeData()->urls();
    if (urls.size() == 1 && urls[0].isLocalFile()) event->acceptProposedAction();
}

void MainWindow::dropEvent(QDropEvent* event) {
    const QString path = event->mimeData()->urls().value(0).toLocalFile();
    if (path.isEmpty()) return;
    event->acceptProposedAction();
    // the program that the file came from waits for us to return, and we may have to ask first
    QTimer::singleShot(0, this, [this, path] { open_file(path); });
}

// Messages, theme, layout

void MainWindow::show_message(const QString& sentence, bool is_error, const QString& action) {
    impl_->messages->show_message(sentence, is_error, impl_->actions->find(action));
}

void MainWindow::dismiss_message() { impl_->messages->hide(); }

QString MainWindow::message() const { return impl_->messages->message(); }

Theme MainWindow::theme() const { return impl_->theme; }

void MainWindow::set_theme(Theme theme) {
    impl_->theme = theme;
    apply_theme(theme);
    if (impl_->keep_settings) QSettings().setValue("window/theme", int(theme));
    Q_EMIT theme_changed();
}

void MainWindow::show_help() {
    if (!impl_->help) impl_->help = make_help_sheet(*impl_->actions, this);
    impl_->help->setAttribute(Qt::WA_DeleteOnClose);
    impl_->help->show();
    impl_->help->raise();
}

void MainWindow::changeEvent(QEvent* event) {
    QMainWindow::changeEvent(event);
    if (event->type() == QEvent::ThemeChange && impl_->theme == Theme::system) apply_theme(Theme::system);
}

bool MainWindow::eventFilter(QObject* object, QEvent* event) {
    if (event->type() == QEvent::ShortcutOverride) {
        const auto* widget = qobject_cast<QWidget*>(object);
        const auto* key = static_cast<QKeyEvent*>(event);
        const bool plain = !(key->modifiers() & (Qt::ControlModifier | Qt::AltModifier | Qt::MetaModifier));
        if (widget && widget->window() == this && plain && keeps_key(widget, key->key())) {
            event->accept();
            return true;
        }
    }
    return QMainWindow::eventFilter(object, event);
}

} // namespace filigree::studio
