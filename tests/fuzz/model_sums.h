// Checksums of changed model files, mended: or no change would get past them.
#pragma once

#include "filigree/io/model/model_sections.h"

#include <cstring>
#include <string>

namespace filigree_fuzz {

/// The file with sums that fit its sections and its table, and with its own length.
inline std::string with_sums(std::string file) {
    using namespace filigree;
    ModelHeader header;
    if (file.size() < sizeof header) return file;
    std::memcpy(&header, file.data(), sizeof header);
    header.file_size = file.size();
    const std::size_t most = (file.size() - sizeof header) / sizeof(FileSection);
    if (header.section_count > most) header.section_count = std::uint32_t(most);
    char* const table = file.data() + sizeof header;
    for (std::uint32_t k = 0; k < header.section_count; ++k) {
        FileSection section;
        std::memcpy(&section, table + k * sizeof section, sizeof section);
        if (section.item_size == 0 || section.offset > file.size() ||
            section.count > (file.size() - section.offset) / section.item_size)
            continue;
        section.hash = XXH3_64bits(file.data() + section.offset, section.count * section.item_size);
        std::memcpy(table + k * sizeof section, &section, sizeof section);
    }
    header.table_hash = XXH3_64bits(table, header.section_count * sizeof(FileSection));
    std::memcpy(file.data(), &header, sizeof header);
    return file;
}

} // namespace filigree_fuzz
