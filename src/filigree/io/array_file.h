// Arrays of plain numbers in a file that the same program reads again: what one task leaves for the next.
#pragma once

#include "filigree/core/types.h"
#include "filigree/io/file.h"

#include <algorithm>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace filigree {

/// Arrays to be written, one behind the other, their sizes first. They have to stay until then.
class ArrayFile {
public:
    template <class T>
    ArrayFile& add(const std::vector<T>& array) {
        arrays_.emplace_back(reinterpret_cast<const char*>(array.data()), array.size() * sizeof(T));
        return *this;
    }
    /// As write_file.
    Status write(const std::filesystem::path& path) const;

private:
    std::vector<std::string_view> arrays_;
};

/// The arrays of such a file, read in full or in part. Whoever reads knows their types. Errors of all: as of
/// FileReader; bad_file (not so many arrays or elements).
class ArrayReader {
public:
    static Result<ArrayReader> open(const std::filesystem::path& path);

    template <class T>
    std::size_t count(std::size_t array) const {
        return array + 1 < ends_.size() ? std::size_t(ends_[array + 1] - ends_[array]) / sizeof(T) : 0;
    }
    template <class T>
    Result<std::vector<T>> read(std::size_t array, std::size_t first, std::size_t number) const {
        std::vector<T> values(number);
        const std::span<char> bytes(reinterpret_cast<char*>(values.data()), number * sizeof(T));
        if (Status read = read_bytes(array, std::uint64_t{first} * sizeof(T), bytes); !read) return read.error();
        return values;
    }
    template <class T>
    Result<std::vector<T>> read(std::size_t array) const {
        return read<T>(array, 0, count<T>(array));
    }
    /// Single elements, by ascending numbers: what lies between them is read where they are near each other.
    template <class T>
    Result<std::vector<T>> pick(std::size_t array, std::span<const Index> numbers) const {
        constexpr std::size_t kBlock = 1024;
        std::vector<T> picked, block;
        picked.reserve(numbers.size());
        std::size_t begin = 0; // of the block
        for (const std::size_t number : numbers) {
            if (number >= begin + block.size()) {
                begin = number / kBlock * kBlock;
                const std::size_t there = count<T>(array);
                Result<std::vector<T>> next =
                    read<T>(array, begin, begin < there ? std::min(kBlock, there - begin) : 1);
                if (!next) return next.error();
                block = std::move(*next);
            }
            picked.push_back(block.at(number - begin));
        }
        return picked;
    }

private:
    ArrayReader(FileReader file, std::filesystem::path path) : file_(std::move(file)), path_(std::move(path)) {}
    Status read_bytes(std::size_t array, std::uint64_t offset, std::span<char> to) const;
    Error damaged() const;

    FileReader file_;
    std::filesystem::path path_;
    std::vector<std::uint64_t> ends_; ///< where the first array begins, and where each ends
};

} // namespace filigree
