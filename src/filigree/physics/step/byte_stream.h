// Saved states: plain values and arrays as bytes, end to end, and back. For physics and scene.
#pragma once

#include "filigree/physics/body.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <string>
#include <string_view>

namespace filigree {

class ByteWriter {
public:
    template <class T>
    void value(const T& value) {
        bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    template <class T>
    void array(std::span<const T> values) {
        value(std::uint64_t(values.size()));
        bytes_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
    }
    void vectors(const Vectors& values) {
        for (const std::vector<float>* array_of : {&values.x, &values.y, &values.z})
            array(std::span(*array_of).first(values.size()));
    }
    std::string take() { return std::move(bytes_); }

private:
    std::string bytes_;
};

/// Reads what ByteWriter wrote; after anything that does not fit, ok() is false and values are empty.
class ByteReader {
public:
    explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}
    bool ok() const { return ok_; }
    bool at_end() const { return bytes_.empty(); }
    template <class T>
    T value() {
        T value{};
        if (bytes_.size() < sizeof value) {
            ok_ = false;
            return value;
        }
        std::memcpy(&value, bytes_.data(), sizeof value);
        bytes_.remove_prefix(sizeof value);
        return value;
    }
    /// A count of things that take so many bytes each at least: never more than can follow.
    std::size_t count(std::size_t bytes_each) {
        const std::uint64_t count = value<std::uint64_t>();
        if (ok_ && count <= bytes_.size() / bytes_each) return std::size_t(count);
        ok_ = false;
        return 0;
    }
    template <class T>
    std::vector<T> array() {
        const std::size_t count = this->count(sizeof(T));
        std::vector<T> values(count);
        if (count > 0) std::memcpy(static_cast<void*>(values.data()), bytes_.data(), count * sizeof(T));
        bytes_.remove_prefix(count * sizeof(T));
        return values;
    }
    Vectors vectors(std::size_t count) {
        Vectors values(count);
        for (std::vector<float>* array_of : {&values.x, &values.y, &values.z}) {
            const std::vector<float> read = array<float>();
            if (read.size() != count) {
                ok_ = false;
                return values;
            }
            std::ranges::copy(read, array_of->begin());
        }
        return values;
    }

private:
    std::string_view bytes_;
    bool ok_ = true;
};

} // namespace filigree
