// The reader of pictures, PNG and JPEG: pixels as many as it says, or a sentence; ours come back the same.
#include "fuzz.h"

#include "filigree/render.h"

using namespace filigree_fuzz;

namespace filigree_fuzz {

std::vector<std::string> seeds() {
    std::vector<std::string> all;
    for (const unsigned side : {1u, 7u, 40u}) {
        Picture picture(side, side);
        for (std::size_t k = 0; k < picture.rgba.size(); ++k) picture.rgba[k] = std::uint8_t(k % 4 == 3 ? 255 : 7 * k);
        all.push_back(encode_png(picture));
        picture.rgba[3] = 90;
        all.push_back(encode_png(picture));
    }
    all.push_back("\xff\xd8\xff\xe0");
    return all;
}

} // namespace filigree_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view bytes(reinterpret_cast<const char*>(data), size);
    for (const std::size_t width : {std::size_t{16}, std::size_t{20}}) { // a PNG's size: none of gigabytes here
        if (size < 24 || bytes.substr(1, 3) != "PNG") break;
        if (data[width] != 0 || data[width + 1] != 0) return 0;
    }
    const Result<Picture> picture = decode_picture(bytes, "fuzz");
    if (!is_sound(picture)) return 0;
    require(picture->rgba.size() == std::size_t{4} * picture->width * picture->height, "there are as many pixels");
    if (picture->rgba.empty() || picture->rgba.size() > 100'000) return 0;
    const Result<Picture> again = decode_picture(encode_png(*picture), "again");
    require(again.ok() && again->rgba == picture->rgba, "a PNG of ours comes back the same");
    return 0;
}
