#include "filigree/io/model/decoded_sections.h"

#include "runtime/rt_code.h"

#include <cstring>
#include <new>

namespace filigree {

namespace {

struct Input {
    const DecodedSections::Find& find;
    std::vector<std::unique_ptr<std::byte[]>>& memory;
    std::map<DecodedSections::Key, std::optional<std::string>> found = {};
};

const void* section_of(void* user, const char* name, std::uint32_t index, std::uint32_t item, std::uint64_t* count) {
    Input& input = *static_cast<Input*>(user);
    const auto [at, is_new] = input.found.try_emplace({name, index});
    if (is_new) at->second = input.find(name, index, item);
    *count = at->second ? at->second->size() / item : 0;
    return at->second ? at->second->data() : nullptr;
}

void* take(void* user, std::uint64_t count, std::size_t item) {
    constexpr std::uint64_t kMost = std::uint64_t{1} << 48;
    if (count > kMost / item) return nullptr;
    std::byte* memory = new (std::nothrow) std::byte[count * item + 1];
    if (memory) static_cast<Input*>(user)->memory.emplace_back(memory);
    return memory;
}

} // namespace

DecodedSections::DecodedSections(const Find& find, std::uint64_t file_bytes) {
    Input input{find, memory_};
    const flg_code_input from{&input, section_of, take, flg_most_unpacked(file_bytes)};
    flg_plain_section* first = nullptr;
    switch (flg_read_code(&from, &first)) {
    case FLG_OK:
        break;
    case FLG_NEWER:
        failure_ = Failure::newer;
        return;
    case FLG_NO_MEMORY:
        failure_ = Failure::no_memory;
        return;
    default:
        failure_ = Failure::damaged;
        return;
    }
    for (const flg_plain_section* section = first; section; section = section->next) {
        const std::string name(section->name, strnlen(section->name, sizeof section->name));
        sections_[{name, section->index}] = {section->item, section->count, section->items};
    }
}

} // namespace filigree
