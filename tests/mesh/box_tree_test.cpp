#include "filigree/mesh/box_tree.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

using namespace filigree;

namespace {

float squared_distance(const FloatBox& box, const Vec3f& point) {
    return (box.low - point).cwiseMax(point - box.high).cwiseMax(0).squaredNorm();
}

std::vector<FloatBox> random_boxes(std::size_t count, bool on_a_grid) {
    std::mt19937 random(unsigned(count) + 1);
    const auto coordinate = [&] { return on_a_grid ? float(random() % 4) : float(random() % 100000) / 25000; };
    std::vector<FloatBox> boxes(count);
    for (FloatBox& box : boxes) {
        const Vec3f p(coordinate(), coordinate(), coordinate()), q(coordinate(), coordinate(), coordinate());
        box = {p.cwiseMin(q), p.cwiseMax(q)};
        if (!on_a_grid) box.high = box.low + 0.02f * (box.high - box.low);
    }
    return boxes;
}

} // namespace

TEST(BoxTree, FindsEveryBoxWithinTheRadiusOnce) {
    for (const std::size_t count : {0u, 1u, 2u, 5u, 9u, 300u, 20000u})
        for (const bool on_a_grid : {false, true}) {
            const std::vector<FloatBox> boxes = random_boxes(count, on_a_grid);
            const BoxTree tree(boxes, RunContext());
            for (int i = 0; i < 20; ++i) {
                const Vec3f point(float(i % 5), float(i % 3), 0.3f * float(i));
                const float radius = 0.25f * float(i % 4);
                std::multiset<std::uint32_t> found, expected;
                tree.visit_near(point, radius * radius, [&](std::uint32_t item) {
                    found.insert(item);
                    return radius * radius;
                });
                for (std::uint32_t b = 0; b < count; ++b)
                    if (squared_distance(boxes[b], point) <= radius * radius) expected.insert(b);
                EXPECT_EQ(found, expected) << count << " boxes, point " << i;
            }
        }
}

TEST(BoxTree, ARadiusThatShrinksLeavesTheNearest) {
    const std::vector<FloatBox> boxes = random_boxes(5000, false);
    const BoxTree tree(boxes, RunContext());
    std::size_t visited = 0;
    for (int i = 0; i < 200; ++i) {
        const Vec3f point(0.02f * float(i), 1.7f, 2.2f);
        float nearest = 100, least = 100;
        tree.visit_near(point, nearest, [&](std::uint32_t item) {
            ++visited;
            return nearest = std::min(nearest, squared_distance(boxes[item], point));
        });
        for (const FloatBox& box : boxes) least = std::min(least, squared_distance(box, point));
        EXPECT_EQ(nearest, least);
    }
    EXPECT_LT(visited, 200u * 40);
}

TEST(BoxTree, ManyBoxesAtOnePlace) { // no split parts them
    const std::vector<FloatBox> boxes(30000, FloatBox{Vec3f::Ones(), Vec3f::Ones()});
    const BoxTree tree(boxes, RunContext());
    std::size_t found = 0;
    tree.visit_near(Vec3f::Zero(), 3.0f, [&](std::uint32_t) { return ++found, 3.0f; });
    EXPECT_EQ(found, boxes.size());
}

TEST(BoxTree, BoxesThatHalveAndHalve) { // the deepest tree that splits by surface could make
    std::vector<FloatBox> boxes;
    for (int i = 0; i < 3000; ++i) {
        const float at = std::ldexp(1.0f, -(i % 120));
        boxes.push_back({Vec3f::Constant(at), Vec3f::Constant(1.5f * at)});
    }
    const BoxTree tree(boxes, RunContext());
    std::size_t found = 0;
    tree.visit_near(Vec3f::Zero(), 1e6f, [&](std::uint32_t) { return ++found, 1e6f; });
    EXPECT_EQ(found, boxes.size());
}
