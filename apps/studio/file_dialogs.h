// Asking for files without stopping the window.
#pragma once

#include <QString>
#include <QStringList>

#include <functional>

class QWidget;

namespace filigree::studio {

struct FileQuestion {
    QString name, title; ///< the dialog's object is "NAME.dialog"
    QStringList filters;
    QString suffix = {};   ///< to save under; "": a file to open is asked for
    QString proposal = {}; ///< its name
};

class FileDialogs {
public:
    explicit FileDialogs(QWidget& window) : window_(window) {}
    /// `use` is called with the path, unless the user changes their mind.
    void ask(const FileQuestion& question, std::function<void(const QString&)> use);
    /// Calls `use` with a pattern for files by number ("bend_%04d.obj" for "bend.obj"); asks first when files of the
    /// first `count` numbers are there, which the dialog could not see.
    void ask_to_replace(const QString& path, std::size_t count, std::function<void(const std::string&)> use);

private:
    QWidget& window_;
    QString folder_; ///< of the last file
};

} // namespace filigree::studio
