// Vertices with very many faces: caps of cylinders, fans of CAD programs, and files that are made to take for ever.
// Walking all faces of such a vertex for each of them takes minutes to hours here, past the tests' time.
#include "cases.h"
#include "filigree/coding/closed_map.h"
#include "filigree/coding/lossless_numbers.h"
#include "filigree/coding/mesh_code.h"
#include "sanitized.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <set>

namespace filigree {
namespace {

const std::size_t kSpokes = kSanitized ? 100'000 : 400'000;

/// A hub in the middle of an open or closed ring; the last vertex, or the first.
Mesh fan_mesh(std::size_t spokes, bool hub_is_first) {
    Mesh mesh;
    for (std::size_t k = 0; k < spokes; ++k) {
        const double angle = 2 * std::numbers::pi * double(k) / double(spokes);
        mesh.positions.emplace_back(float(std::cos(angle)), float(std::sin(angle)), 0.1f * float(std::sin(7 * angle)));
    }
    mesh.positions.insert(hub_is_first ? mesh.positions.begin() : mesh.positions.end(), Vec3f(0, 0, 1));
    const Index hub = hub_is_first ? 0 : Index(spokes), first = hub_is_first ? 1 : 0;
    for (Index k = 0; k < spokes; ++k)
        mesh.add_face(std::array<Index, 3>{hub, Index(first + k), Index(first + (k + 1) % spokes)});
    return mesh;
}

Mesh with_uvs(Mesh mesh, bool each_corner_its_own) {
    for (std::size_t c = 0; c < mesh.corner_count(); ++c) {
        const std::size_t face = c / 3, value = each_corner_its_own ? c : mesh.corners[c];
        mesh.uvs.corners.push_back(Index(value));
        if (each_corner_its_own) mesh.uvs.values.emplace_back(float(face % 601) / 600, float(face / 601 % 601) / 600);
    }
    if (!each_corner_its_own)
        for (const Vec3f& p : mesh.positions) mesh.uvs.values.emplace_back(p.x(), p.y());
    return mesh;
}

/// As it was before there was a shortcut, and as the header says it.
std::vector<Expectation> plain_expectations(const Mesh& mesh, std::size_t block) {
    std::vector<Expectation> expected(mesh.vertex_count());
    const auto at = [&](std::size_t f, std::size_t k) { return mesh.face(f)[k % mesh.face_size(f)]; };
    const auto across = [&](Index from, Index to) {
        for (std::size_t f = 0; f < mesh.face_count(); ++f)
            for (std::size_t k = 0; k < 3 && mesh.face_size(f) == 3; ++k)
                if (at(f, k) == from && at(f, k + 1) == to) return at(f, k + 2);
        return kNoIndex;
    };
    for (Index v = 0; v < expected.size(); ++v)
        for (std::size_t f = 0; f < mesh.face_count(); ++f)
            for (std::size_t k = 0; k < mesh.face_size(f); ++k) {
                Expectation& best = expected[v];
                if (at(f, k) != v || best.across != kNoIndex) continue;
                const auto is_known = [&](Index u) { return u < v && u / block == v / block; };
                const Index to = at(f, k + 1), from = at(f, k + mesh.face_size(f) - 1);
                if (is_known(to) && (best.near == kNoIndex || to > best.near)) best.near = to;
                if (is_known(from) && (best.near == kNoIndex || from > best.near)) best.near = from;
                if (!is_known(to) || !is_known(from) || mesh.face_size(f) > 4) continue;
                const Index behind = mesh.face_size(f) == 4 ? at(f, k + 2) : across(from, to);
                if (is_known(behind)) best = {from, to, behind};
            }
    return expected;
}

TEST(Hubs, ParallelogramsAreThoseOfTheDefinition) {
    std::mt19937 random(7);
    for (int round = 0; round < 60; ++round) {
        Mesh mesh; // faces of any kind over few vertices, so that some have many; with faces that repeat vertices
        mesh.positions.assign(40, Vec3f::Zero());
        const auto any = [&] { return Index(random() % 3 ? random() % 40 : random() % 3); };
        for (int f = 0; f < 120; ++f) {
            std::vector<Index> face(3 + random() % 3);
            for (Index& v : face) v = any();
            mesh.add_face(face);
        }
        for (const std::size_t block : {std::size_t{7}, std::size_t{kNoIndex}}) {
            const std::vector<Expectation> found = vertex_expectations(mesh.face_offsets, mesh.corners, 40, block),
                                           wanted = plain_expectations(mesh, block);
            ASSERT_EQ(found.size(), wanted.size());
            for (std::size_t v = 0; v < found.size(); ++v)
                EXPECT_TRUE(found[v].near == wanted[v].near && found[v].across == wanted[v].across &&
                            found[v].behind == wanted[v].behind)
                    << "round " << round << ", vertex " << v;
        }
    }
}

TEST(Hubs, ParallelogramsOfAFanAreFoundInTime) {
    for (const bool hub_is_first : {true, false}) {
        const Mesh fan = fan_mesh(2 * kSpokes, hub_is_first);
        const std::vector<Expectation> expected =
            vertex_expectations(fan.face_offsets, fan.corners, fan.vertex_count(), kNoIndex);
        std::size_t over = 0;
        for (const Expectation& e : expected) over += e.behind != kNoIndex;
        EXPECT_EQ(over > 0, hub_is_first);
    }
    Mesh cap; // one face of very many corners
    std::vector<Index> all(kSpokes);
    for (Index v = 0; v < all.size(); ++v) all[v] = v;
    cap.add_face(all);
    EXPECT_EQ(vertex_expectations(cap.face_offsets, cap.corners, kSpokes, kNoIndex)[5].near, 4u);
}

TEST(Hubs, FansArePackedInTime) {
    for (const bool hub_is_first : {true, false})
        for (const bool each_corner_its_own : {true, false})
            for (const bool levels : {false, true}) {
                const Mesh fan = with_uvs(fan_mesh(levels ? kSpokes / 4 : kSpokes, hub_is_first), each_corner_its_own);
                const PackedMesh coded =
                    pack_mesh(fan, {.keep_order = true, .levels = levels}, nullptr, kAllThreads).value();
                const Mesh back = unpack_mesh(coded, kAllThreads).value();
                EXPECT_EQ(back.corners, fan.corners);
                ASSERT_EQ(back.uvs.corners.size(), fan.uvs.corners.size());
                double furthest = 0;
                for (std::size_t c = 0; c < back.uvs.corners.size(); ++c)
                    furthest = std::max(
                        furthest,
                        double((back.uvs.values[back.uvs.corners[c]] - fan.uvs.values[fan.uvs.corners[c]]).norm()));
                EXPECT_LT(furthest, 1e-3) << "levels " << levels << ", own corners " << each_corner_its_own;
            }
}

TEST(Hubs, TrianglesAtOneEdgeArePairedInTimeAndInOrder) {
    std::vector<Triangle> book; // pages that all run the same way along an edge, then as many the other way
    const auto pages = Index(kSpokes);
    for (Index k = 0; k < pages; ++k) book.push_back({0, 1, 2 + k});
    const auto one_way = map_of(book, std::vector<bool>(2 + pages, false));
    EXPECT_EQ(one_way.opposite[0], kNoIndex);
    for (Index k = 0; k < pages; ++k) book.push_back({1, 0, 2 + k});
    const ClosedMap both = map_of(book, std::vector<bool>(2 + pages, false));
    for (Index k = 0; k < pages; ++k) ASSERT_EQ(both.opposite[3 * k], 3 * (pages + k));
    const ClosedMap mixed =
        map_of({{0, 1, 2}, {1, 0, 3}, {1, 0, 4}, {0, 1, 5}, {0, 1, 6}}, std::vector<bool>(7, false));
    EXPECT_EQ(mixed.opposite[0], 3u);
    EXPECT_EQ(mixed.opposite[6], 9u);
    EXPECT_EQ(mixed.opposite[12], kNoIndex);
}

} // namespace
} // namespace filigree
