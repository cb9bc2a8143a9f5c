#include "filigree/io/array_file.h"

namespace filigree {

namespace {

std::span<char> bytes_of_sizes(std::vector<std::uint64_t>& numbers) {
    return {reinterpret_cast<char*>(numbers.data()), numbers.size() * sizeof(std::uint64_t)};
}

} // namespace

Status ArrayFile::write(const std::filesystem::path& path) const {
    std::vector<std::uint64_t> sizes{arrays_.size()};
    for (const std::string_view array : arrays_) sizes.push_back(array.size());
    const std::span<char> table = bytes_of_sizes(sizes);
    std::vector<std::string_view> pieces{std::string_view(table.data(), table.size())};
    for (const std::string_view array : arrays_)
        if (!array.empty()) pieces.push_back(array);
    return write_file(path, pieces);
}

Result<ArrayReader> ArrayReader::open(const std::filesystem::path& path) {
    Result<FileReader> file = FileReader::open(path);
    if (!file) return file.error();
    ArrayReader reader(std::move(*file), path);
    std::vector<std::uint64_t> sizes(1);
    if (Status read = reader.file_.read(0, bytes_of_sizes(sizes)); !read) return read.error();
    const std::uint64_t whole = reader.file_.size();
    if (sizes[0] >= whole / sizeof(std::uint64_t)) return reader.damaged();
    sizes.resize(sizes[0]);
    if (Status read = reader.file_.read(sizeof(std::uint64_t), bytes_of_sizes(sizes)); !read) return read.error();
    reader.ends_.push_back((1 + sizes.size()) * sizeof(std::uint64_t));
    for (const std::uint64_t size : sizes) {
        if (size > whole - reader.ends_.back()) return reader.damaged();
        reader.ends_.push_back(reader.ends_.back() + size);
    }
    return reader;
}

Status ArrayReader::read_bytes(std::size_t array, std::uint64_t offset, std::span<char> to) const {
    if (array + 1 >= ends_.size()) return damaged();
    const std::uint64_t size = ends_[array + 1] - ends_[array];
    if (offset > size || to.size() > size - offset) return damaged();
    return file_.read(ends_[array] + offset, to);
}

Error ArrayReader::damaged() const {
    return {ErrorCode::bad_file, path_.string() + ": is damaged; delete its folder and begin again."};
}

} // namespace filigree
