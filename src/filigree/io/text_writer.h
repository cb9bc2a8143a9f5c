// Text of numbers, the shortest that reads back to the same, in every locale.
#pragma once

#include "filigree/types.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

namespace filigree {

/// Appends text to `bytes` through a small buffer of its own; what is in it is appended by the destructor, which never
/// fails: `bytes` always has room for it. Nobody else appends to `bytes` meanwhile.
class TextWriter {
public:
    explicit TextWriter(std::string& bytes) : bytes_(bytes) { keep_room(); }
    ~TextWriter() { append_buffer(); }
    TextWriter(const TextWriter&) = delete;
    TextWriter& operator=(const TextWriter&) = delete;

    TextWriter& text(std::string_view s) {
        if (s.size() > kLongestNumber) {
            flush();
            bytes_ += s;
            keep_room();
            return *this;
        }
        make_room();
        std::memcpy(buffer_.data() + used_, s.data(), s.size());
        used_ += s.size();
        return *this;
    }

    /// The shortest decimal that reads back to the same number.
    template <class T>
    TextWriter& number(T x) {
        // the one float (all were tried) whose shortest decimal becomes a neighbour when read as double, then rounded
        constexpr float kRoundsTwice = 0x1.5c87fap-84f;
        if constexpr (std::is_same_v<T, float>)
            if (x == kRoundsTwice || x == -kRoundsTwice) return number(static_cast<double>(x));
        make_room();
        char* const first = buffer_.data() + used_;
        used_ += static_cast<std::size_t>(std::to_chars(first, first + kLongestNumber, x).ptr - first);
        return *this;
    }

    /// A name on one line: line ends, other control characters and a backslash at the end become '_'.
    TextWriter& name(std::string_view s);

    /// origin + offset with as few decimals as give the same offset when they are read and the origin taken off.
    TextWriter& coordinate(double origin, float offset) {
        return origin == 0 ? number(offset) : far_coordinate(origin, offset);
    }

    /// The three coordinates of a position, between blanks.
    TextWriter& position(const Vec3d& origin, const Vec3f& p) {
        return coordinate(origin.x(), p.x())
            .text(" ")
            .coordinate(origin.y(), p.y())
            .text(" ")
            .coordinate(origin.z(), p.z());
    }

    void flush() {
        append_buffer();
        keep_room();
    }

private:
    static constexpr std::size_t kLongestNumber = 128; // a double in fixed notation, of float's range

    void append_buffer() noexcept {
        bytes_.append(buffer_.data(), used_);
        used_ = 0;
    }
    void keep_room() { // by a factor, as append would
        if (bytes_.capacity() - bytes_.size() < buffer_.size())
            bytes_.reserve(std::max(bytes_.size() + buffer_.size(), 2 * bytes_.capacity()));
    }
    void make_room() {
        if (used_ + kLongestNumber > buffer_.size()) flush();
    }
    TextWriter& far_coordinate(double origin, float offset);

    std::string& bytes_;
    std::array<char, 1 << 14> buffer_;
    std::size_t used_ = 0;
};

} // namespace filigree
