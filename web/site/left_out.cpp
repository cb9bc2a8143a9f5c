// What stands in for parts of the library that the standing page does not have: files, characters in motion, what
// melts.
#include "filigree/flesh.h"
#include "filigree/flesh/skin_map.h"
#include "filigree/io/gltf/gltf_document.h"
#include "filigree/io/mesh/mesh_formats.h"
#include "filigree/io/system/file.h"
#include "filigree/skin.h"
#include "web/live/serial.h"

#include <algorithm>

namespace filigree {

namespace {
Error absent(const std::string& what) { return {ErrorCode::unsupported, what + ": the page does not have this."}; }
} // namespace

std::string sentence_of(const void* thrown, std::string_view type) {
    if (type == "N8filigree4gltf6DamageE") return "The file: " + static_cast<const gltf::Damage*>(thrown)->what;
    return type.find("nlohmann") == type.npos ? "" : "The file is damaged: its JSON cannot be read.";
}

// Nothing is read but what the visitor gave, and nothing is written.
Result<std::string> read_file(const std::filesystem::path& path) {
    return Error{ErrorCode::not_found, path.string() + " lies in a file of its own, which the page does not see."};
}
Status write_file(const std::filesystem::path& path, std::span<const std::string_view>) {
    return absent(path.string());
}

struct FileReader::OpenFile {
    std::string_view bytes;
};
FileReader::FileReader(std::string_view bytes) : file_(std::make_unique<OpenFile>(bytes)) {}
FileReader::FileReader(std::unique_ptr<OpenFile> file) : file_(std::move(file)) {}
FileReader::FileReader(FileReader&&) noexcept = default;
FileReader& FileReader::operator=(FileReader&&) noexcept = default;
FileReader::~FileReader() = default;
Result<FileReader> FileReader::open(const std::filesystem::path& path) { return absent(path.string()); }
std::uint64_t FileReader::size() const { return file_->bytes.size(); }
Status FileReader::read(std::uint64_t offset, std::span<char> to) const {
    if (offset + to.size() > file_->bytes.size()) return absent("a part of a file");
    std::ranges::copy(file_->bytes.substr(offset, to.size()), to.begin());
    return Success{};
}
Result<std::string> FileReader::read_all() const { return std::string(file_->bytes); }
std::filesystem::path path_of(std::string_view utf8) { return std::string(utf8); }

// No scene of this page has them.
Result<WriteNotes> write_glb(const Mesh&, const WriteMeshOptions&, std::string&, const RunContext&) {
    return absent("writing GLB");
}
Material flesh_material() { return {}; }
Result<Flesh> Flesh::create(SkinnedMesh, const FleshOptions&, std::span<const std::size_t>, const RunContext&) {
    return absent("flesh");
}
Result<SkinnedMesh> read_character(const std::filesystem::path& path, const CharacterOptions&, const RunContext&) {
    return absent(path.string());
}
Result<std::vector<float>> skin_map(const SkinnedMesh&, std::string_view from) { return absent(std::string(from)); }

} // namespace filigree

extern "C" int __cxa_thread_atexit(void (*)(void*), void*, void*) { return 0; } // the one thread does not end
// Of the compiler's own 128-bit arithmetic, which was built to look after its stack.
extern "C" unsigned long __stack_chk_guard = 0xc0ffee;
extern "C" [[noreturn]] void __stack_chk_fail() { __builtin_trap(); }
