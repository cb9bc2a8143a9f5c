// Numbers and names in the sentences of the window.
#pragma once

#include <QString>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace filigree::studio {

QString number_text(double value, int digits = 3); ///< significant digits, as short as they go: "0.0042", "1.2e-05"
QString with_commas(std::size_t number);           ///< 12,345
/// "1 vertex", "12,345 vertices".
QString counted(std::size_t number, const QString& one, const QString& many);
/// "512 bytes", "12.3 kB", "1.86 MB".
QString size_text(std::uintmax_t bytes);
/// The last part of a path.
QString file_name(const std::string& path);
/// The sentence, with the file in front unless it is named in it.
std::string about_file(const std::string& path, const std::string& sentence);
/// "a", "a and b", "a, b and c".
QString listed(const std::vector<QString>& things);
/// Rows of cells (rich text) over the whole width: the first of a row at the left, the others at the right.
QString rich_table(const std::vector<std::vector<QString>>& rows);
/// What a shape, material or panel is called, from its name: "wavy-cube" is "Wavy cube".
QString title_of(const std::string& name);

} // namespace filigree::studio
