#include "filigree/file.h"

#include <gtest/gtest.h>

using namespace filigree;

namespace {

Result<MeshFile> read(const std::string& text) { return read_mesh(text, "cow.off", RunContext(1)); }

const std::string kSquare = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

} // namespace

TEST(Off, HeadersComeInManyForms) {
    for (const std::string header : {"OFF\n4 1 0\n", "OFF 4 1 0\n", "OFF4 1 0\n", "# c\nOFF # c\n\n4 1 4 # c\n",
                                     "4 1 0\n", "OFF\n4 1\n", "OFF\n4 1\n0\n", "OFF\n4 1 # c\n# c\n 4 # c\n"}) {
        const auto file = read(header + kSquare + "4 0 1 2 3\n");
        ASSERT_TRUE(file.ok()) << header << file.error().message;
        EXPECT_EQ(file->mesh.corners, (std::vector<Index>{0, 1, 2, 3}));
        EXPECT_TRUE(file->warnings.empty());
    }
}

TEST(Off, VerticesMayHaveColorsAndMore) {
    const auto file = read(
        "STCNOFF\n3 1 0\n0 0 0 0 0 1 255 0 51 255 0.5 1\n1 0 0 0 0 1 0 0 0 0 0 0\n0 1 0 0 0 1 0 0 0 0 0 0\n3 0 1 2\n");
    ASSERT_TRUE(file.ok()) << file.error().message;
    EXPECT_EQ(file->mesh.normals.values[0], Vec3f(0, 0, 1));
    EXPECT_EQ(file->mesh.colors[0], Vec4f(1, 0, 0.2f, 1));
    EXPECT_EQ(file->mesh.uvs.values[0], Vec2f(0.5f, 1));
}

TEST(Off, WhatHasNoPlaceIsCounted) {
    const auto file = read("OFF\n4 3 0\n" + kSquare + "4 0 1 2 3 0.1 0.2 0.3\n2 0 1\n3 0 1 2 7\n");
    EXPECT_EQ(file->mesh.face_count(), 2u);
    EXPECT_EQ(file->warnings.size(), 2u);
}

TEST(Off, ErrorsNameTheLine) {
    const std::vector<std::pair<std::string, std::string>> cases = {
        {"OFF\n-4 1 0\n" + kSquare, "cow.off:2:"},
        {"OFF\n4 999999999999 0\n" + kSquare, "more than the file can hold"},
        {"OFF\n4 1 0\n" + kSquare + "4 0 1 2 4\n", "cow.off:7:"},
        {"OFF\n4 1 0\n" + kSquare + "4 0 1 2 -1\n", "vertex -1"},
        {"OFF\n4 1 0\n" + kSquare + "4 0 1 2", "cut off"},
        {"OFF\n4 1 0\n0 0 0\n1 0\n", "cut off"},
        {"OFF\n4 1 0\n0 0 0\n1 0 zero\n", "cow.off:4:"},
        {"OFF\n4 1 0\n0 0 0\n1 0 nan\n1 1 1\n1 1 1\n", "cow.off:4:"},
        {"OFF\n1 0 0\n0,5 0 0\n", "point"},
        {"4OFF\n1 0 0\n0 0 0 0\n", "dimension"},
        {"OFF BINARY\n", "binary"},
    };
    for (const auto& [text, part] : cases) {
        const auto file = read(text);
        ASSERT_FALSE(file.ok()) << text;
        EXPECT_NE(file.error().message.find(part), std::string::npos) << file.error().message << " for " << part;
    }
}
