// What stands behind a PLY file's header: numbers as text or binary, and rows of them as a table.
#pragma once

#include "filigree/io/mesh/ply_header.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace filigree::ply {

static_assert(std::endian::native == std::endian::little, "little-endian files are copied as they are");

template <class T>
T load(const char* p, bool swap) {
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), p, sizeof(T));
    if (swap) std::reverse(bytes.begin(), bytes.end());
    return std::bit_cast<T>(bytes);
}

/// Calls f(T{}) with the C++ type of `type`.
template <class F>
auto with_type(Type type, const F& f) {
    switch (type) {
    case Type::int8:
        return f(std::int8_t{});
    case Type::uint8:
        return f(std::uint8_t{});
    case Type::int16:
        return f(std::int16_t{});
    case Type::uint16:
        return f(std::uint16_t{});
    case Type::int32:
        return f(std::int32_t{});
    case Type::uint32:
        return f(std::uint32_t{});
    case Type::float32:
        return f(float{});
    case Type::float64:
        break;
    }
    return f(double{});
}

/// The numbers of a text body, one after the other.
class AsciiNumbers {
public:
    AsciiNumbers(const MeshSource& source, const TextScanner& text) : source_(source), text_(text) {}

    /// Why the next number cannot be read, or "".
    std::string read(Type type, double& x) {
        text_.skip_space();
        if (text_.at_end()) return "the file ends here; it is cut off";
        if (!text_.number(x)) return "expected a number, found " + in_quotes(text_.word());
        if (type != Type::float32 && type != Type::float64) {
            const bool fits = with_type(type, [&](auto t) {
                using Limits = std::numeric_limits<decltype(t)>;
                return x >= static_cast<double>(Limits::lowest()) && x <= static_cast<double>(Limits::max());
            });
            if (!fits) return "a number does not fit the type of its property";
        }
        return "";
    }
    std::size_t bytes_left() const { return text_.bytes_left(); }
    /// Of these, from the next number on.
    std::size_t bytes_after_space() {
        text_.skip_space();
        return bytes_left();
    }
    std::size_t offset() const { return text_.offset(); }
    Error error(const std::string& row, const std::string& cause) const {
        return source_.error_at_line(text_.line(), row + ": " + cause + ".");
    }

private:
    const MeshSource& source_;
    TextScanner text_;
};

/// The numbers of a binary body.
class BinaryNumbers {
public:
    BinaryNumbers(const MeshSource& source, std::size_t offset, bool swap)
        : source_(source), offset_(offset), swap_(swap) {}

    std::string read(Type type, double& x) {
        if (bytes_left() < size_of(type)) return "the file ends here; it is cut off";
        x = with_type(type, [&](auto t) { return static_cast<double>(load<decltype(t)>(data(), swap_)); });
        offset_ += size_of(type);
        return "";
    }
    std::size_t bytes_left() const { return source_.bytes.size() - offset_; }
    std::size_t bytes_after_space() const { return bytes_left(); }
    std::size_t offset() const { return offset_; }
    const char* data() const { return source_.bytes.data() + offset_; }
    bool swap() const { return swap_; }
    void skip(std::size_t bytes) { offset_ += bytes; }
    Error error(const std::string& row, const std::string& cause) const {
        return source_.error(row + " at byte " + std::to_string(offset_) + ": " + cause + ".");
    }

private:
    const MeshSource& source_;
    std::size_t offset_;
    bool swap_;
};

/// The rows of an element without its lists: numbers at a fixed distance from each other.
struct Table {
    struct Column {
        std::size_t offset;
        Type type;
    };
    const char* data = nullptr;
    std::size_t rows = 0, row_bytes = 0;
    bool swap = false;
    std::vector<Column> columns; ///< of each property; of a list, nothing that counts
    std::vector<double> numbers; ///< what `data` points to when the file's bytes are not a table

    /// Calls set(row, value) for a column; one switch on the type a column, not a value.
    template <class F>
    void for_each(std::size_t column, const F& set) const {
        if (rows == 0) return;
        with_type(columns[column].type, [&](auto t) {
            const char* p = data + columns[column].offset;
            for (std::size_t row = 0; row < rows; ++row, p += row_bytes) set(row, load<decltype(t)>(p, swap));
        });
    }
};

} // namespace filigree::ply
