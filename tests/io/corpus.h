// The corpus of real and damaged meshes beside the repository, and its manifest.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace filigree_test {

struct CorpusRow {
    std::filesystem::path path;
    std::string file, what;
    std::string vertices, faces, sizes; ///< numbers as text, or empty where the manifest does not say; sizes: "12/0/0"
    std::string expected;               ///< "accept | clear error"

    bool expects(const std::string& outcome) const {
        std::istringstream words(expected);
        for (std::string word; std::getline(words, word, '|');) {
            const std::size_t first = word.find_first_not_of(' '), last = word.find_last_not_of(' ');
            if (first != std::string::npos && word.substr(first, last - first + 1) == outcome) return true;
        }
        return false;
    }
};

inline std::filesystem::path corpus_folder() {
    const char* const folder = std::getenv("FILIGREE_CORPUS");
    return folder ? std::filesystem::path(folder) : std::filesystem::path(FILIGREE_ROOT) / "../shared/corpus";
}

/// All rows; empty when there is no corpus.
inline std::vector<CorpusRow> read_corpus() {
    std::ifstream manifest(corpus_folder() / "MANIFEST.tsv");
    std::vector<std::vector<std::string>> table;
    for (std::string line; std::getline(manifest, line);) {
        std::istringstream cells(line);
        auto& row = table.emplace_back();
        for (std::string cell; std::getline(cells, cell, '\t');) row.push_back(cell);
    }
    std::vector<CorpusRow> rows;
    for (std::size_t r = 1; r < table.size(); ++r) {
        const auto cell = [&](const std::string& column) {
            for (std::size_t c = 0; c < table[0].size() && c < table[r].size(); ++c)
                if (table[0][c] == column) return table[r][c];
            return std::string();
        };
        rows.push_back({corpus_folder() / cell("file"), cell("file"), cell("class"), cell("vertices"), cell("faces"),
                        cell("tri/quad/ngon"), cell("expected")});
    }
    return rows;
}

} // namespace filigree_test
