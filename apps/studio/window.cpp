#include "window.h"

#include <QApplication>
#include <QCloseEvent>
#include <QDockWidget>
#include <QDragEnterEvent>
#include <QDropEvent>
#include <QMimeData>

namespace filigree::studio {

struct MainWindow::Content {
    bool keep_settings = false;
    std::unique_ptr<Workbench> workbench;
    Viewport* viewport = nullptr;
    std::unique_ptr<Actions> actions;
    QString message;
};

MainWindow::MainWindow(bool keep_settings, QWidget* parent) : QMainWindow(parent), content_(new Content) {
    content_->keep_settings = keep_settings;
    content_->workbench = std::make_unique<Workbench>();
    content_->viewport = new Viewport(*content_->workbench, this);
    content_->actions = std::make_unique<Actions>(*content_->workbench, *content_->viewport, *this);
    setCentralWidget(content_->viewport);
    auto* column = new QDockWidget(this);
    column->setObjectName("column");
    addDockWidget(Qt::RightDockWidgetArea, column);
    resize(1280, 800);
}

MainWindow::~MainWindow() {
    delete takeCentralWidget(); // before the workbench that it draws
}

Workbench& MainWindow::workbench() { return *content_->workbench; }
Viewport& MainWindow::viewport() { return *content_->viewport; }
Actions& MainWindow::actions() { return *content_->actions; }

bool MainWindow::show_panel(const QString&) { return false; }
void MainWindow::open_file(const QString& path) { content_->workbench->open(path.toStdString()); }
bool MainWindow::may_discard() { return true; }
void MainWindow::show_message(const QString& sentence, bool) { content_->message = sentence; }
QString MainWindow::message() const { return content_->message; }

void MainWindow::closeEvent(QCloseEvent* event) { QMainWindow::closeEvent(event); }
void MainWindow::dragEnterEvent(QDragEnterEvent* event) { QMainWindow::dragEnterEvent(event); }
void MainWindow::dropEvent(QDropEvent* event) { QMainWindow::dropEvent(event); }

} // namespace filigree::studio
