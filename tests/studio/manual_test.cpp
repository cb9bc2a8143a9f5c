// The tables of docs/studio.md are those of the program.
#include "coloring.h"
#include "tools/tool.h"

#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

namespace filigree::studio {
namespace {

std::string text_of(const std::string& path) {
    std::stringstream text;
    text << std::ifstream(std::string(FILIGREE_ROOT) + path).rdbuf();
    return text.str();
}

/// The rows of the table that begins with such a line.
std::vector<std::string> table_in_manual(const std::string& head) {
    static const std::string manual = text_of("/docs/studio.md");
    std::istringstream lines(manual.substr(std::min(manual.find(head), manual.size())));
    std::vector<std::string> rows;
    std::string line;
    std::getline(lines, line); // the head
    std::getline(lines, line);
    while (std::getline(lines, line) && line.starts_with('|')) rows.push_back(line);
    return rows;
}

std::string row_of(QString text, const char* keys, const char* tip) {
    return "| " + text.remove('&').toStdString() + " | " + keys + " | " + tip + " |";
}

TEST(Manual, HasTheTools) {
    std::vector<std::string> rows;
    for (const ToolEntry* const tool : kTools) rows.push_back(row_of(tool->text, tool->keys, tool->tip));
    EXPECT_EQ(table_in_manual("| tool | key |"), rows);
}

TEST(Manual, HasTheColourings) {
    std::vector<std::string> rows;
    for (const Coloring* const one : colorings()) rows.push_back(row_of(one->choice, one->keys, one->tip));
    EXPECT_EQ(table_in_manual("| colours | key |"), rows);
}

} // namespace
} // namespace filigree::studio
