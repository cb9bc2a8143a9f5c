#include "file_dialogs.h"

#include "workbench.h"

#include <QFileDialog>
#include <QFileInfo>
#include <QMessageBox>
#include <QPushButton>

namespace filigree::studio {

namespace {

/// "bend.obj" becomes "bend_%04d.obj": a file a frame.
QString numbered(const QString& path) {
    const QFileInfo file(path);
    if (file.fileName().contains('%')) return path;
    const QString name =
        file.completeBaseName() + QStringLiteral("_%04d") + (file.suffix().isEmpty() ? QString() : '.' + file.suffix());
    return file.path() == QStringLiteral(".") && !path.startsWith('.') ? name : file.path() + '/' + name;
}

} // namespace

void FileDialogs::ask(const FileQuestion& question, std::function<void(const QString&)> use) {
    auto* dialog = new QFileDialog(&window_, question.title, folder_);
    dialog->setObjectName(question.name + QStringLiteral(".dialog"));
    dialog->setAttribute(Qt::WA_DeleteOnClose);
    dialog->setNameFilters(question.filters);
    if (question.suffix.isEmpty()) {
        dialog->setFileMode(QFileDialog::ExistingFile);
    } else {
        dialog->setAcceptMode(QFileDialog::AcceptSave);
        dialog->setDefaultSuffix(question.suffix);
        dialog->selectFile(question.proposal);
    }
    QObject::connect(dialog, &QFileDialog::fileSelected, &window_, [this, use = std::move(use)](const QString& path) {
        folder_ = QFileInfo(path).absolutePath();
        use(path);
    });
    dialog->open();
}

void FileDialogs::ask_to_replace(const QString& path, std::size_t count, std::function<void(const std::string&)> use) {
    const std::string pattern = numbered(path).toStdString();
    const std::vector<std::string> existing = existing_outputs(pattern, std::max<std::size_t>(1, count));
    if (existing.empty()) return use(pattern);
    const QString first = QFileInfo(QString::fromStdString(existing.front())).fileName();
    auto* box =
        new QMessageBox(QMessageBox::Question, "Files are there already",
                        first + " is there already. Replace it and those after it?", QMessageBox::Cancel, &window_);
    box->setObjectName("file.replace");
    box->setAttribute(Qt::WA_DeleteOnClose);
    QPushButton* replace = box->addButton("Replace", QMessageBox::AcceptRole);
    replace->setObjectName("file.replace.yes");
    QObject::connect(replace, &QPushButton::clicked, &window_, [pattern, use = std::move(use)] { use(pattern); });
    box->open();
}

} // namespace filigree::studio
