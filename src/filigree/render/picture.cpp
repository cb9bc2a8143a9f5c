#include "filigree/io/system/file.h"
#include "filigree/render.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <new>

#include <png.h>
#include <turbojpeg.h>

namespace filigree {

namespace {

constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1a\n";
constexpr std::string_view kJpegSignature = "\xff\xd8\xff";
constexpr std::uint64_t kMostPixels = std::uint64_t{1} << 28;
// More pixels than a byte can stand for: deflate packs at most 1032 to 1 with 8 pixels a byte, and JPEG spends no less
// than a bit on a block of 64. What claims more is damaged, and is not worth its gigabyte.
constexpr std::uint64_t kMostPixelsPerByte = 8 * 1032;

class PictureDecoder {
public:
    PictureDecoder(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

    Result<Picture> decode() const {
        if (bytes_.empty()) return damaged("it is empty");
        if (starts_like(kPngSignature)) return decode_png();
        if (starts_like(kJpegSignature)) return decode_jpeg();
        return Error{ErrorCode::unsupported, name_ + ": is neither PNG nor JPEG; convert it to one of them."};
    }

private:
    /// Also when the file is cut off inside the signature.
    bool starts_like(std::string_view signature) const {
        return bytes_.substr(0, signature.size()) == signature.substr(0, bytes_.size());
    }

    Error damaged(const std::string& cause) const {
        return {ErrorCode::bad_file, name_ + ": the picture is damaged: " + cause + "; export or copy it again."};
    }

    Result<Picture> allocate(std::uint64_t width, std::uint64_t height) const {
        const std::string size = std::to_string(width) + " x " + std::to_string(height);
        if (width * height > kMostPixels)
            return Error{ErrorCode::out_of_memory,
                         name_ + ": the picture has " + size + " pixels, more than we take (2^28); make it smaller."};
        if (width == 0 || height == 0 || width * height > kMostPixelsPerByte * bytes_.size())
            return damaged("it claims " + size + " pixels");
        return Picture(static_cast<unsigned>(width), static_cast<unsigned>(height));
    }

    /// libpng is content when all pixels are there; a whole file has its end as well.
    bool png_has_its_end() const {
        for (std::size_t at = kPngSignature.size(); at + 12 <= bytes_.size();) { // length, name, content, checksum
            std::uint64_t length = 0;
            for (std::size_t i = 0; i < 4; ++i) length = length << 8 | static_cast<std::uint8_t>(bytes_[at + i]);
            if (length > bytes_.size() - at - 12) return false;
            if (bytes_.substr(at + 4, 4) == "IEND") return true;
            at += 12 + length;
        }
        return false;
    }

    Result<Picture> decode_png() const {
        if (!png_has_its_end()) return damaged("it is cut off");
        png_image image{};
        image.version = PNG_IMAGE_VERSION;
        const std::unique_ptr<png_image, decltype(&png_image_free)> guard(&image, png_image_free);
        if (!png_image_begin_read_from_memory(&image, bytes_.data(), bytes_.size())) return damaged(image.message);
        image.format = PNG_FORMAT_RGBA;
        image.flags |= PNG_IMAGE_FLAG_16BIT_sRGB; // 16 bits that say nothing of their gamma are rarely linear
        Result<Picture> picture = allocate(image.width, image.height);
        if (picture && !png_image_finish_read(&image, nullptr, picture->rgba.data(), 0, nullptr))
            return damaged(image.message);
        return picture;
    }

    Error jpeg_error(tjhandle decoder) const {
        const std::string cause = tjGetErrorStr2(decoder);
        if (cause.find("nsupported") == std::string::npos) return damaged("the JPEG decoder says '" + cause + "'");
        return {ErrorCode::unsupported,
                name_ + ": is a JPEG of a rare kind ('" + cause + "'); export it as a plain JPEG or a PNG."};
    }

    /// Whether a decoder's complaint leaves every pixel as it was meant. Some cameras write stray bytes between
    /// segments.
    static bool is_harmless(tjhandle decoder) {
        return tjGetErrorCode(decoder) == TJERR_WARNING && std::strstr(tjGetErrorStr2(decoder), "extraneous bytes");
    }

    Result<Picture> decode_jpeg() const {
        const std::unique_ptr<void, decltype(&tjDestroy)> decoder(tjInitDecompress(), tjDestroy);
        if (!decoder) throw std::bad_alloc();
        const auto* const data = reinterpret_cast<const unsigned char*>(bytes_.data());
        // On Windows this number has 32 bits. A longer file is then read as one that is cut off, and refused if it is.
        const auto size = static_cast<unsigned long>(
            std::min<std::uint64_t>(bytes_.size(), std::numeric_limits<unsigned long>::max()));
        int width = 0, height = 0, subsampling = 0, color_space = 0;
        if (tjDecompressHeader3(decoder.get(), data, size, &width, &height, &subsampling, &color_space) != 0 &&
            !is_harmless(decoder.get()))
            return jpeg_error(decoder.get());
        Result<Picture> picture = allocate(static_cast<unsigned>(width), static_cast<unsigned>(height));
        if (!picture) return picture;
        const bool is_cmyk = color_space == TJCS_CMYK || color_space == TJCS_YCCK;
        if (tjDecompress2(decoder.get(), data, size, picture->rgba.data(), width, 0, height,
                          is_cmyk ? TJPF_CMYK : TJPF_RGBA, TJFLAG_LIMITSCANS | TJFLAG_ACCURATEDCT) != 0 &&
            !is_harmless(decoder.get()))
            return jpeg_error(decoder.get());
        if (is_cmyk) cmyk_to_rgba(*picture);
        return picture;
    }

    /// As Adobe's programs write it: each channel is the light that its ink lets through.
    static void cmyk_to_rgba(Picture& picture) {
        for (std::size_t i = 0; i < picture.rgba.size(); i += 4) {
            const unsigned black = picture.rgba[i + 3];
            for (std::size_t k = 0; k < 3; ++k)
                picture.rgba[i + k] = static_cast<std::uint8_t>((picture.rgba[i + k] * black + 127) / 255);
            picture.rgba[i + 3] = 255;
        }
    }

    std::string_view bytes_;
    const std::string& name_;
};

bool is_opaque(const Picture& picture) {
    for (std::size_t i = 3; i < picture.rgba.size(); i += 4)
        if (picture.rgba[i] != 255) return false;
    return true;
}

std::vector<std::uint8_t> without_alpha(const Picture& picture) {
    std::vector<std::uint8_t> rgb(picture.rgba.size() / 4 * 3);
    for (std::size_t from = 0, to = 0; to < rgb.size(); from += 4, to += 3)
        std::memcpy(&rgb[to], &picture.rgba[from], 3);
    return rgb;
}

} // namespace

Result<Picture> decode_picture(std::string_view bytes, const std::string& name) {
    try {
        return PictureDecoder(bytes, name).decode();
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, name + ": the picture does not fit into memory."};
    }
}

Result<Picture> read_picture(const std::filesystem::path& path) {
    const Result<std::string> bytes = read_file(path);
    if (!bytes) return bytes.error();
    return decode_picture(*bytes, path.string());
}

std::string encode_png(const Picture& picture) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = picture.width;
    image.height = picture.height;
    const bool opaque = is_opaque(picture);
    image.format = opaque ? PNG_FORMAT_RGB : PNG_FORMAT_RGBA;
    const std::vector<std::uint8_t> rgb = opaque ? without_alpha(picture) : std::vector<std::uint8_t>();
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    std::string bytes(size, '\0');
    const void* const pixels = opaque ? rgb.data() : picture.rgba.data();
    if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels, 0, nullptr)) return {};
    bytes.resize(size);
    return bytes;
}

std::string encode_jpeg(const Picture& picture) {
    if (picture.rgba.empty()) return {};
    Picture opaque = picture;
    for (std::size_t i = 0; i < opaque.rgba.size(); i += 4) {
        const unsigned alpha = opaque.rgba[i + 3];
        for (std::size_t k = 0; k < 3; ++k)
            opaque.rgba[i + k] =
                static_cast<std::uint8_t>((opaque.rgba[i + k] * alpha + 255 * (255 - alpha) + 127) / 255);
    }
    const std::unique_ptr<void, decltype(&tjDestroy)> encoder(tjInitCompress(), tjDestroy);
    if (!encoder) throw std::bad_alloc();
    unsigned char* at = nullptr;
    unsigned long size = 0;
    const int failed = tjCompress2(encoder.get(), opaque.rgba.data(), static_cast<int>(picture.width), 0,
                                   static_cast<int>(picture.height), TJPF_RGBX, &at, &size, TJSAMP_444, 90, 0);
    const std::unique_ptr<unsigned char, decltype(&tjFree)> guard(at, tjFree);
    return failed ? std::string() : std::string(reinterpret_cast<const char*>(at), size);
}

double picture_distance(const Picture& a, const Picture& b) {
    if (a.width != b.width || a.height != b.height) return std::numeric_limits<double>::infinity();
    if (a.rgba.empty()) return 0;
    double sum = 0;
    for (std::size_t i = 0; i < a.rgba.size(); ++i) {
        const double difference = static_cast<double>(a.rgba[i]) - static_cast<double>(b.rgba[i]);
        sum += difference * difference;
    }
    return std::sqrt(sum / static_cast<double>(a.rgba.size()));
}

} // namespace filigree
