// Numbers and names in the sentences of the window.
#pragma once

#include <QString>

#include <cstddef>
#include <string>

namespace filigree::studio {

QString with_commas(std::size_t number); ///< 12,345
/// "1 vertex", "12,345 vertices".
QString counted(std::size_t number, const QString& one, const QString& many);
/// The last part of a path.
QString file_name(const std::string& path);
/// The sentence, with the file in front unless it is named in it.
std::string about_file(const std::string& path, const std::string& sentence);
/// What a built-in shape is called: "Wavy cube".
QString shape_title(const std::string& name);

} // namespace filigree::studio
