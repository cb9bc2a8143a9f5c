// The plain sections that a file of the profile `runtime` stands for, as the runtime decodes them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace filigree {

class DecodedSections {
public:
    struct Section {
        std::uint32_t item_size;
        std::uint64_t count;
        const void* items;
    };
    using Key = std::pair<std::string, std::uint32_t>; ///< name and index
    /// A section of the file, with items of that size; none where there is none. Throws FileDamage.
    using Find = std::function<std::optional<std::string>(const std::string& name, std::uint32_t index,
                                                          std::uint32_t item_size)>;

    enum class Failure { none, damaged, newer, no_memory };
    /// file_bytes: how many the file has, which bounds what it may come to. Cost O(what it comes to).
    DecodedSections(const Find& find, std::uint64_t file_bytes);

    Failure failure() const { return failure_; }
    const std::map<Key, Section>& all() const { return sections_; }

private:
    std::map<Key, Section> sections_;
    std::vector<std::unique_ptr<std::byte[]>> memory_;
    Failure failure_ = Failure::none;
};

} // namespace filigree
