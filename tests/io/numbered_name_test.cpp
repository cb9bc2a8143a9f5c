#include "filigree/io/system/numbered_name.h"

#include <gtest/gtest.h>

using namespace filigree;

namespace {

/// The file of number 7, or "" where the path is no numbered name.
std::string seventh(const std::string& path) {
    const auto name = numbered_name(path);
    return name ? name->file(7).generic_string() : "";
}

std::string seventh_printf(const std::string& path) {
    const auto name = printf_numbered_name(path);
    return name ? name->file(7).generic_string() : "";
}

} // namespace

TEST(NumberedName, HasOnePlaceForTheNumber) {
    EXPECT_EQ(seventh("a/moved_####.ply"), "a/moved_0007.ply");
    EXPECT_EQ(seventh("#.ply"), "7.ply");
    EXPECT_EQ(seventh("a#b##.ply"), "a#b07.ply"); // the last run
    EXPECT_EQ(seventh("moved_%04d.ply"), "moved_0007.ply");
    EXPECT_EQ(seventh("moved_%3d.ply"), "moved_007.ply");
    EXPECT_EQ(seventh("50%/moved_%d.ply"), "50%/moved_7.ply");
    for (const char* const plain : {"", "a.ply", "a%s.ply", "a%.ply", "a%04.ply", "%d/a.ply", "##/a.ply", "a%99d.ply"})
        EXPECT_EQ(seventh(plain), "") << plain;
    EXPECT_EQ(numbered_name("a_##.ply")->file(12345), "a_12345.ply");
}

TEST(NumberedName, PrintfNamesAreStrict) {
    EXPECT_EQ(seventh_printf("f#%02d.png"), "f#07.png");
    EXPECT_EQ(seventh_printf("%/f%d.png"), "%/f7.png");
    for (const char* const plain : {"f##.png", "f%d%d.png", "f%4d.png", "f%0d.png", "f%00d.png", "f%012d.png", "%"})
        EXPECT_EQ(seventh_printf(plain), "") << plain;
}

TEST(NumberedName, FindsTheNumberInAFilesName) {
    const NumberedName name = *numbered_name("x/a_####.ply");
    EXPECT_EQ(name.number_of("a_0012.ply"), 12u);
    EXPECT_EQ(name.number_of("a_12.ply"), 12u);
    for (const char* const other :
         {"a_.ply", "a_12.obj", "b_12.ply", "a_1x.ply", "a_-1.ply", "a_.pl", "a_99999999999999999999.ply"})
        EXPECT_FALSE(name.number_of(other)) << other;
}
