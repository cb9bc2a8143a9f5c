// Pictures: pixels, and the PNG and JPEG files they are kept in.
#pragma once

#include "filigree/core/result.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace filigree {

/// Pixels by rows from the top left: four bytes each, sRGB and straight alpha.
struct Picture {
    unsigned width = 0, height = 0;
    std::vector<std::uint8_t> rgba; ///< 4 * width * height

    Picture() = default;
    Picture(unsigned w, unsigned h) : width(w), height(h), rgba(std::size_t{4} * w * h) {}

    std::uint8_t* pixel(unsigned x, unsigned y) { return rgba.data() + 4 * (std::size_t{width} * y + x); }
    const std::uint8_t* pixel(unsigned x, unsigned y) const { return rgba.data() + 4 * (std::size_t{width} * y + x); }
};

/// Decodes a PNG (of any kind, to 8 bits) or a JPEG, told by the content; `name` stands in messages.
/// Errors: bad_file (damaged), unsupported (neither), out_of_memory (more than 2^28 pixels are refused unread).
Result<Picture> decode_picture(std::string_view bytes, const std::string& name);
/// The same from a file. Errors: not_found as well.
Result<Picture> read_picture(const std::filesystem::path& path);

/// The bytes of a PNG file: RGB where every pixel is opaque, else RGBA. The same picture gives the same bytes; none
/// when there are no pixels.
std::string encode_png(const Picture& picture);

/// How far two pictures of one size are from each other: root mean square over all channels, 0 to 255; infinite when
/// their sizes differ.
double picture_distance(const Picture& a, const Picture& b);

} // namespace filigree
