// The window: viewport, panels, timeline, status bar, menus, messages.
#pragma once

#include "actions.h"

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

    /// "model", "detail", "deform", "body", "view"; false: there is none of that name.
    bool show_panel(const QString& name);
    /// Opens a file as the dialog would: asks first when there are unsaved changes.
    void open_file(const QString& path);
    /// Asks about unsaved changes; false: the user wants to stay.
    bool may_discard();

    void show_message(const QString& sentence, bool is_error); ///< in the window's message bar
    QString message() const;                                   ///< what stands there; "" when it is hidden
    QString last_error() const;                                ///< the last error told; "" for none
    void clear_last_error();

protected:
    void closeEvent(QCloseEvent* event) override;
    void dragEnterEvent(QDragEnterEvent* event) override;
    void dropEvent(QDropEvent* event) override;

private:
    struct Content;
    std::unique_ptr<Content> content_;
};

} // namespace filigree::studio
