#include "filigree/core/color.h"
#include "filigree/types.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(Color, IsReadAsSixHexDigits) {
    EXPECT_EQ(parse_color("#ff0080"), Vec3f(1, 0, 128 / 255.0f));
    EXPECT_EQ(parse_color("#000000"), Vec3f(0, 0, 0));
    for (const char* wrong : {"", "#", "ff0080", "#ff008", "#ff00801", "#ff00g0", "#-f0080", "# f0080"})
        EXPECT_FALSE(parse_color(wrong)) << wrong;
}

TEST(View, FrontAndUpAreAtRightAnglesInEveryWorld) {
    for (const UpAxis up : {UpAxis::x, UpAxis::y, UpAxis::z}) {
        EXPECT_EQ(up_vector(up), Vec3d::Unit(static_cast<int>(up)));
        EXPECT_EQ(view_direction(View::top, up), up_vector(up));
        EXPECT_EQ(view_direction(View::front, up).dot(up_vector(up)), 0);
        EXPECT_NEAR(view_direction(View::iso, up).norm(), 1, 1e-15);
    }
    EXPECT_EQ(view_direction(View::front, UpAxis::y), Vec3d(0, 0, 1));
    EXPECT_EQ(view_direction(View::front, UpAxis::z), Vec3d(0, -1, 0)); // looks along +y
}

} // namespace
} // namespace filigree
