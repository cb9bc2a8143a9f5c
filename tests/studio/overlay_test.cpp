// What stands over the picture is all there, however small the picture is.
#include "overlay.h"

#include <gtest/gtest.h>

namespace filigree::studio {
namespace {

OverlayContent axes() {
    OverlayContent content;
    content.shows_triad = true;
    content.triad = {QPointF(1, 0), QPointF(0, -1), QPointF(-0.5, 0.5)};
    return content;
}

QImage painted(const OverlayContent& content, const QSize& size) {
    Overlay overlay(nullptr);
    overlay.resize(size);
    overlay.set(content);
    QImage image(size, QImage::Format_ARGB32_Premultiplied);
    image.fill(Qt::transparent);
    overlay.render(&image, {}, {}, {});
    return image;
}

bool is_clear(const QImage& image, const QRect& within) {
    for (int y = within.top(); y <= within.bottom(); ++y)
        for (int x = within.left(); x <= within.right(); ++x)
            if (qAlpha(image.pixel(x, y)) > 0) return false;
    return true;
}

TEST(Overlay, LegendAndWarningLeaveTheMarginsAndTheAxesFree) {
    for (const int width : {280, 330, 500, 900}) {
        SCOPED_TRACE(width);
        const QSize size(width, 420);
        OverlayContent content = axes();
        content.legend = OverlayContent::Legend{
            "Distance from the full deformation", "% of the diagonal", ColorMap::sequential, {0, 0.01f}, 100, false};
        content.warning = "The pose is more curved than the driver can follow: the mesh is off by about 0.49 % of the "
                          "diagonal. Choose a larger driver (Detail, Size).";
        const QImage image = painted(content, size);
        EXPECT_TRUE(is_clear(image, {0, 0, 12, size.height()})) << "something is cut off";
        EXPECT_TRUE(is_clear(image, {width - 12, 0, 12, size.height()}));
        const QRect corner(12, size.height() - 84, 74, 72);
        EXPECT_EQ(image.copy(corner), painted(axes(), size).copy(corner)) << "something lies over the axes";

        OverlayContent without_warning = content;
        without_warning.warning.clear();
        const QImage legend = painted(without_warning, size);
        bool is_covered = false;
        for (int y = 0; y < size.height(); ++y)
            for (int x = 0; x < width; ++x)
                is_covered |= qAlpha(legend.pixel(x, y)) > 0 && legend.pixel(x, y) != image.pixel(x, y);
        EXPECT_FALSE(is_covered) << "the warning lies over the legend";
    }
}

} // namespace
} // namespace filigree::studio
