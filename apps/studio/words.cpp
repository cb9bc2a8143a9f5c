#include "words.h"

#include "filigree/file.h"

#include <QLocale>

#include <filesystem>

namespace filigree::studio {

QString number_text(double value, int digits) { return QString::number(value, 'g', digits); }

QString with_commas(std::size_t number) { return QLocale(QLocale::English).toString(qulonglong(number)); }

QString counted(std::size_t number, const QString& one, const QString& many) {
    return with_commas(number) + ' ' + (number == 1 ? one : many);
}

QString listed(const std::vector<QString>& things) {
    QString text;
    for (std::size_t k = 0; k < things.size(); ++k)
        text += (k == 0 ? "" : k + 1 == things.size() ? " and " : ", ") + things[k];
    return text;
}

QString rich_table(const std::vector<std::vector<QString>>& rows) {
    QString text = QStringLiteral("<table width='100%' cellspacing='0' cellpadding='1'>");
    for (const std::vector<QString>& row : rows) {
        text += "<tr>";
        for (std::size_t k = 0; k < row.size(); ++k)
            text += (k == 0 ? "<td align='left'>" : "<td align='right'>") + row[k] + "</td>";
        text += "</tr>";
    }
    return text + "</table>";
}

QString size_text(std::uintmax_t bytes) {
    if (bytes < 1000) return counted(std::size_t(bytes), "byte", "bytes");
    double size = double(bytes);
    const char* unit = "";
    for (const char* const larger : {"kB", "MB", "GB"}) {
        if (size < 1000) break;
        size /= 1000;
        unit = larger;
    }
    return number_text(size) + ' ' + unit;
}

QString file_name(const std::string& path) { return QString::fromStdString(path_of(path).filename().string()); }

std::string about_file(const std::string& path, const std::string& sentence) {
    const std::string name = path_of(path).filename().string();
    return name.empty() || sentence.find(name) != std::string::npos ? sentence : name + ": " + sentence;
}

QString title_of(const std::string& name) {
    QString title = QString::fromStdString(name).replace('-', ' ');
    if (!title.isEmpty()) title[0] = title[0].toUpper();
    return title;
}

} // namespace filigree::studio
