// Small glTF files put together by hand: numbers become accessors over one buffer, everything else is JSON.
#pragma once

#include "filigree/types.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace filigree_test {

inline const std::vector<float> kTriangle = {0, 0, 0, 1, 0, 0, 0, 1, 0};

template <class Vector>
void expect_near(const Vector& a, const filigree::Vec3d& b, double tolerance = 1e-6) {
    EXPECT_LE((a.template cast<double>() - b).norm(), tolerance) << a.transpose() << " and " << b.transpose();
}

inline std::string base64(std::string_view bytes) {
    static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const auto byte = [&](std::size_t k) {
            return k < bytes.size() ? static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[k])) : 0u;
        };
        const std::uint32_t bits = byte(i) << 16 | byte(i + 1) << 8 | byte(i + 2);
        for (int shift = 18; shift >= 0; shift -= 6) text += kDigits[bits >> shift & 63];
        if (i + 2 >= bytes.size()) text.back() = '=';
        if (i + 1 >= bytes.size()) text[text.size() - 2] = '=';
    }
    return text;
}

class GltfText {
public:
    /// Adds the numbers as a view and an accessor of such elements; `more` is further JSON of the accessor.
    template <class T>
    std::size_t add(const std::vector<T>& numbers, int component, const std::string& type,
                    const std::string& more = "") {
        const std::size_t width = type == "SCALAR" ? 1
                                  : type == "MAT4" ? 16
                                                   : static_cast<std::size_t>(type.back() - '0');
        return add_accessor("\"bufferView\":" + std::to_string(add_view(numbers)) + ",", component,
                            numbers.size() / width, type, more);
    }
    std::size_t add(const std::vector<float>& numbers, const std::string& type, const std::string& more = "") {
        return add(numbers, 5126, type, more);
    }
    std::size_t add_indices(const std::vector<std::uint16_t>& indices) { return add(indices, 5123, "SCALAR"); }
    /// `view`: "" for zeros.
    std::size_t add_accessor(const std::string& view, int component, std::size_t count, const std::string& type,
                             const std::string& more = "") {
        accessors_ += std::string(accessors_.empty() ? "" : ",") + "{" + view +
                      "\"componentType\":" + std::to_string(component) + ",\"count\":" + std::to_string(count) +
                      ",\"type\":\"" + type + "\"" + (more.empty() ? "" : "," + more) + "}";
        return accessor_count_++;
    }
    template <class T>
    std::size_t add_view(const std::vector<T>& values, const std::string& more = "") {
        const std::size_t bytes = values.size() * sizeof(T);
        views_ += std::string(views_.empty() ? "" : ",") +
                  "{\"buffer\":0,\"byteOffset\":" + std::to_string(data_.size()) +
                  ",\"byteLength\":" + std::to_string(bytes) + (more.empty() ? "" : "," + more) + "}";
        data_.append(reinterpret_cast<const char*>(values.data()), bytes);
        data_.resize((data_.size() + 3) / 4 * 4);
        return view_count_++;
    }

    const std::string& data() const { return data_; }
    /// The document with `rest` after the arrays that this class makes.
    std::string text(const std::string& rest) const {
        return with_buffer("\"uri\":\"data:application/octet-stream;base64," + base64(data_) + "\",", rest);
    }
    std::string with_buffer(const std::string& uri, const std::string& rest) const {
        return "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{" + uri +
               "\"byteLength\":" + std::to_string(data_.size()) + "}],\"bufferViews\":[" + views_ +
               "],\"accessors\":[" + accessors_ + "]" + (rest.empty() ? "" : "," + rest) + "}";
    }
    std::string glb(const std::string& rest) const {
        std::string json = with_buffer("", rest);
        json.resize((json.size() + 3) / 4 * 4, ' ');
        const auto word = [](std::size_t n) {
            const auto value = static_cast<std::uint32_t>(n);
            return std::string(reinterpret_cast<const char*>(&value), 4);
        };
        return "glTF" + word(2) + word(28 + json.size() + data_.size()) + word(json.size()) + "JSON" + json +
               word(data_.size()) + std::string("BIN\0", 4) + data_;
    }

private:
    std::string data_, views_, accessors_;
    std::size_t view_count_ = 0, accessor_count_ = 0;
};

} // namespace filigree_test
