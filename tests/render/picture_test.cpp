#include "filigree/render.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <random>

#include <unistd.h>

using namespace filigree;

namespace {

std::string from_hex(std::string_view digits) {
    std::string bytes;
    for (std::size_t i = 0; i < digits.size(); i += 2)
        bytes += static_cast<char>(std::stoi(std::string(digits.substr(i, 2)), nullptr, 16));
    return bytes;
}

// Small files of the kinds that occur. Their colours are mostly A = 200 100 50 and B = 0 255 10.
const std::string kGrey4 =
    from_hex("89504e470d0a1a0a0000000d4948445200000002000000020400000000922dbff90000000c4944415478da63e067f801"
             "00012901085bef32620000000049454e44ae426082");
const std::string kGreyAlpha =
    from_hex("89504e470d0a1a0a0000000d49484452000000020000000108040000005e2bb7010000000d4944415478da63b0f97f82"
             "010005820204288f005a0000000049454e44ae426082");
const std::string kPalette =
    from_hex("89504e470d0a1a0a0000000d494844520000000200000002010300000048789f6700000006504c5445c8643200ff0a1d"
             "bdd0dd0000000274524e53ff80080fb36a0000000c4944415478da637060680000014400c10487cffa0000000049454e"
             "44ae426082");
const std::string kRgb16 =
    from_hex("89504e470d0a1a0a0000000d49484452000000020000000110020000002bd0349e000000154944415478da6338712225"
             "c5c88881e1ff7f2e2e00237604cfaf03cd190000000049454e44ae426082");
const std::string kInterlaced =
    from_hex("89504e470d0a1a0a0000000d49484452000000020000000208020000018ad3aae5000000134944415478da63389162c4"
             "c0f09f0b84814c00242704cfe5726e880000000049454e44ae426082");
const std::string kGreyJpeg =
    from_hex("ffd8ffe000104a46494600010100000100010000ffdb0043000302020302020303030304030304050805050404050a07"
             "0706080c0a0c0c0b0a0b0b0d0e12100d0e110e0b0b1016101113141515150c0f171816141812141514ffc0000b080008"
             "000801011100ffc40014000100000000000000000000000000000003ffc4001410010000000000000000000000000000"
             "0000ffda0008010100003f00777fffd9");
const std::string kProgressiveJpeg =
    from_hex("ffd8ffe000104a46494600010100000100010000ffdb0043000302020302020303030304030304050805050404050a07"
             "0706080c0a0c0c0b0a0b0b0d0e12100d0e110e0b0b1016101113141515150c0f171816141812141514ffdb0043010304"
             "0405040509050509140d0b0d141414141414141414141414141414141414141414141414141414141414141414141414"
             "1414141414141414141414141414ffc20011080008000803011100021101031101ffc400140001000000000000000000"
             "00000000000003ffc4001501010100000000000000000000000000000607ffda000c0301000210031000000110f48fff"
             "c40014100100000000000000000000000000000000ffda00080101000105027fffc40014110100000000000000000000"
             "000000000000ffda0008010301013f017fffc40014110100000000000000000000000000000000ffda0008010201013f"
             "017fffc40014100100000000000000000000000000000000ffda0008010100063f027fffc40014100100000000000000"
             "000000000000000000ffda0008010100013f217fffda000c030100020003000000109fffc40014110100000000000000"
             "000000000000000000ffda0008010301013f107fffc40014110100000000000000000000000000000000ffda00080102"
             "01013f107fffc40014100100000000000000000000000000000000ffda0008010100013f107fffd9");
const std::string kCmykJpeg =
    from_hex("ffd8ffee000e41646f626500640000000002ffdb0043000302020302020303030304030304050805050404050a070706"
             "080c0a0c0c0b0a0b0b0d0e12100d0e110e0b0b1016101113141515150c0f171816141812141514ffdb00430103040405"
             "040509050509140d0b0d1414141414141414141414141414141414141414141414141414141414141414141414141414"
             "141414141414141414141414ffc20014080008000804011100021101031101041100ffc4001500010100000000000000"
             "000000000000000607ffc40014010100000000000000000000000000000007ffda000e04010002100310040000000128"
             "8c4760ffc40014100100000000000000000000000000000000ffda00080101000105027fffc400141101000000000000"
             "00000000000000000000ffda00080102010105027fffc40014110100000000000000000000000000000000ffda000801"
             "03010105027fffc40014100100000000000000000000000000000000ffda00080104000105027fffc400141001000000"
             "00000000000000000000000000ffda0008010100063f027fffc40014110100000000000000000000000000000000ffda"
             "0008010201063f027fffc40014110100000000000000000000000000000000ffda0008010301063f027fffc400141001"
             "00000000000000000000000000000000ffda0008010400063f027fffc400141001000000000000000000000000000000"
             "00ffda0008010100013f217fffc40014110100000000000000000000000000000000ffda0008010201013f217fffc400"
             "14110100000000000000000000000000000000ffda0008010301013f217fffc400141001000000000000000000000000"
             "00000000ffda0008010400013f217fffda000e040100020003000400000010cfffc40014100100000000000000000000"
             "000000000000ffda0008010100013f107fffc40014110100000000000000000000000000000000ffda0008010201013f"
             "107fffc40014110100000000000000000000000000000000ffda0008010301013f107fffc40014100100000000000000"
             "000000000000000000ffda0008010400013f107fffd9");

Picture noise(unsigned width, unsigned height, bool opaque) {
    Picture picture(width, height);
    std::mt19937 random(7);
    for (std::size_t i = 0; i < picture.rgba.size(); ++i)
        picture.rgba[i] = opaque && i % 4 == 3 ? 255 : static_cast<std::uint8_t>(random());
    return picture;
}

std::vector<std::uint8_t> pixels_of(const std::string& bytes) {
    const Result<Picture> picture = decode_picture(bytes, "picture");
    EXPECT_TRUE(picture.ok()) << picture.error().message;
    return picture.ok() ? picture->rgba : std::vector<std::uint8_t>();
}

void expect_near(const std::string& bytes, const std::array<int, 4>& color) {
    const std::vector<std::uint8_t> pixels = pixels_of(bytes);
    ASSERT_EQ(pixels.size(), 4u * 8 * 8);
    for (std::size_t i = 0; i < pixels.size(); ++i) ASSERT_NEAR(pixels[i], color[i % 4], i % 4 == 3 ? 0 : 3) << i;
}

void expect_damaged(const std::string& bytes) {
    const Result<Picture> picture = decode_picture(bytes, "cow.png");
    ASSERT_FALSE(picture.ok()) << bytes.size() << " bytes";
    EXPECT_EQ(picture.error().code, ErrorCode::bad_file);
    EXPECT_TRUE(picture.error().message.starts_with("cow.png: ")) << picture.error().message;
}

unsigned png_color_type(const std::string& png) { return static_cast<unsigned char>(png.at(25)); }

} // namespace

TEST(Picture, PngComesBackPixelForPixel) {
    for (const bool opaque : {false, true})
        for (const auto& [width, height] : {std::pair{1u, 1u}, {7u, 5u}, {64u, 33u}, {1u, 300u}}) {
            const Picture picture = noise(width, height, opaque);
            const Result<Picture> back = decode_picture(encode_png(picture), "noise");
            ASSERT_TRUE(back.ok()) << back.error().message;
            EXPECT_EQ(back->width, width);
            EXPECT_EQ(back->height, height);
            EXPECT_EQ(back->rgba, picture.rgba);
        }
}

TEST(Picture, PngIsRgbWhereAllIsOpaqueAndTheSameBytesEveryTime) {
    EXPECT_EQ(png_color_type(encode_png(noise(9, 9, true))), 2u);
    EXPECT_EQ(png_color_type(encode_png(noise(9, 9, false))), 6u);
    Picture almost = noise(9, 9, true);
    almost.pixel(8, 8)[3] = 254;
    EXPECT_EQ(png_color_type(encode_png(almost)), 6u);
    EXPECT_EQ(encode_png(noise(40, 40, true)), encode_png(noise(40, 40, true)));
    EXPECT_EQ(encode_png(Picture()), ""); // no PNG has no pixels
}

TEST(Picture, ReadsPngOfEveryKind) {
    using Pixels = std::vector<std::uint8_t>;
    const Pixels a = {200, 100, 50, 255}, b = {0, 255, 10, 255};
    const auto joined = [](std::initializer_list<Pixels> parts) {
        Pixels all;
        for (const Pixels& part : parts) all.insert(all.end(), part.begin(), part.end());
        return all;
    };
    EXPECT_EQ(pixels_of(kGrey4), (Pixels{0, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255, 255, 136, 136, 136, 255}));
    EXPECT_EQ(pixels_of(kGreyAlpha), (Pixels{60, 60, 60, 255, 200, 200, 200, 0}));
    EXPECT_EQ(pixels_of(kPalette), joined({a, {0, 255, 10, 128}, {0, 255, 10, 128}, a}));
    EXPECT_EQ(pixels_of(kRgb16), joined({a, b}));
    EXPECT_EQ(pixels_of(kInterlaced), joined({a, b, b, a}));
}

TEST(Picture, ReadsJpegOfEveryKind) {
    expect_near(kGreyJpeg, {131, 131, 131, 255});
    expect_near(kProgressiveJpeg, {200, 100, 50, 255});
    expect_near(kCmykJpeg, {200, 100, 50, 255});
}

TEST(Picture, EveryTruncationIsDamage) {
    const std::string png = encode_png(noise(5, 4, false));
    for (const std::string& whole : {png, kPalette, kInterlaced, kGreyJpeg, kProgressiveJpeg})
        for (std::size_t size = 0; size < whole.size(); ++size) expect_damaged(whole.substr(0, size));
    EXPECT_EQ(pixels_of(png + "something behind the end").size(), 80u);
}

TEST(Picture, FlippedBytesNeverCrash) {
    std::mt19937 random(3);
    for (const std::string& whole :
         {encode_png(noise(9, 9, false)), kPalette, kInterlaced, kProgressiveJpeg, kCmykJpeg})
        for (int i = 0; i < 2000; ++i) {
            std::string bytes = whole;
            for (int k = 0; k < 3; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
            const Result<Picture> picture = decode_picture(bytes, "flipped");
            if (picture.ok()) {
                EXPECT_EQ(picture->rgba.size(), std::size_t{4} * picture->width * picture->height);
            }
        }
}

TEST(Picture, OtherContentIsUnsupported) {
    for (const char* const text : {"GIF89a", "RIFF....WEBP", "v 0 0 0\n", "x"}) {
        const Result<Picture> picture = decode_picture(text, "cow.tga");
        ASSERT_FALSE(picture.ok());
        EXPECT_EQ(picture.error().code, ErrorCode::unsupported);
        EXPECT_TRUE(picture.error().message.starts_with("cow.tga: ")) << picture.error().message;
    }
}

TEST(Picture, ClaimsOfManyPixelsAreNotBelieved) {
    std::string jpeg = kGreyJpeg;
    const std::size_t size = jpeg.find("\xff\xc0") + 5;
    jpeg.replace(size, 4, "\x20\x00\x20\x00", 4); // 8192 x 8192 in 160 bytes
    expect_damaged(jpeg);
    jpeg.replace(size, 4, "\xff\x00\xff\x00", 4);
    const Result<Picture> huge = decode_picture(jpeg, "huge.jpg");
    ASSERT_FALSE(huge.ok());
    EXPECT_EQ(huge.error().code, ErrorCode::out_of_memory);
    EXPECT_NE(huge.error().message.find("65280 x 65280"), std::string::npos) << huge.error().message;
}

TEST(Picture, FilesAreReadAndMissingOnesSaid) {
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("filigree-picture-" + std::to_string(::getpid()) + ".png");
    std::ofstream(path, std::ios::binary) << kInterlaced;
    const Result<Picture> picture = read_picture(path);
    std::filesystem::remove(path);
    ASSERT_TRUE(picture.ok()) << picture.error().message;
    EXPECT_EQ(picture->width, 2u);
    const Result<Picture> missing = read_picture(path);
    ASSERT_FALSE(missing.ok());
    EXPECT_EQ(missing.error().code, ErrorCode::not_found);
}

TEST(PictureDistance, IsTheRootMeanSquare) {
    const Picture a = noise(6, 6, false);
    EXPECT_EQ(picture_distance(a, a), 0);
    Picture b = a;
    for (std::uint8_t& channel : b.rgba)
        channel = static_cast<std::uint8_t>(channel < 128 ? channel + 10 : channel - 10);
    EXPECT_DOUBLE_EQ(picture_distance(a, b), 10);
    Picture c = a;
    c.rgba[5] = static_cast<std::uint8_t>(a.rgba[5] ^ 128);
    EXPECT_DOUBLE_EQ(picture_distance(a, c), 128 / std::sqrt(144.0));
    EXPECT_EQ(picture_distance(a, Picture(6, 5)), std::numeric_limits<double>::infinity());
    EXPECT_EQ(picture_distance(Picture(), Picture()), 0);
}
