// The window: viewport, panels, timeline, status bar, menus, messages.
#pragma once

#include "actions.h"
#include "theme.h"

#include <QMainWindow>

namespace filigree::studio {

class MainWindow : public QMainWindow {
    Q_OBJECT
public:
    /// Settings (layout, recent files) are kept under the application's name; `keep_settings` false: neither read nor
    /// written (tests, screenshots).
    explicit MainWindow(bool keep_settings, QWidget* parent = nullptr);
    ~MainWindow() override;

    Workbench& workbench();
    Viewport& viewport();
    Actions& actions();

    /// One of kPanels (panels/panels.h); false: there is none of that name.
    bool show_panel(const QString& name);
    /// Opens a file as the dialog would: asks first when there are unsaved changes that it would replace.
    void open_file(const QString& path);
    /// Stops what moves and asks about unsaved changes; false: the user wants to stay.
    bool may_discard();
    /// Starts work that leaves a file: the window does not close before it is there.
    void write(const std::function<void()>& start);
    /// The model is saved there, from now on by Save as well.
    void save_file(const QString& path);
    QString file_path() const;        ///< where Save writes; "" when it has to ask
    QStringList recent_files() const; ///< the latest first
    QString panel() const;            ///< the name of the one shown

    Theme theme() const;
    void set_theme(Theme theme);
    void show_help(); ///< the sheet of shortcuts

    /// In the window's message bar. action: the name of one that a button beside the sentence does; "": none.
    void show_message(const QString& sentence, bool is_error, const QString& action = {});
    void dismiss_message();
    QString message() const; ///< what stands there; "" when it is hidden

Q_SIGNALS:
    void files_changed(); ///< recent files, or the one that Save writes
    void theme_changed();
    void panel_changed();

protected:
    void closeEvent(QCloseEvent* event) override;
    void dragEnterEvent(QDragEnterEvent* event) override;
    void dropEvent(QDropEvent* event) override;
    bool eventFilter(QObject* object, QEvent* event) override;
    void changeEvent(QEvent* event) override;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace filigree::studio
