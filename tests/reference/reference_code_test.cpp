#include "cases.h"
#include "filigree/mesh.h"
#include "filigree/reference/height_law.h"
#include "filigree/reference/reference_code.h"
#include "hierarchy/stripping.h"
#include "threads.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <random>

namespace filigree {
namespace {

using filigree_test::same_bytes;

ReferenceDetail encoded(const Mesh& mesh, unsigned references = 3, unsigned max_levels = 16) {
    auto detail = encode_reference(mesh, {.references = references, .max_levels = max_levels}, kOneThread);
    EXPECT_TRUE(detail.ok()) << detail.error().message;
    return std::move(*detail);
}

std::vector<Vec3f> restored(const ReferenceDetail& detail, HeightLaw law, std::span<const Vec3f> driver,
                            const RunContext& context = kOneThread) {
    const ReferenceRestorer restorer(detail, law, context);
    std::vector<Vec3f> positions(restorer.level_vertices(detail.patches.levels).size(), Vec3f::Constant(NAN));
    restorer.restore(driver, detail.patches.levels, positions, context);
    return positions;
}

template <class Map>
std::vector<Vec3f> transformed(std::span<const Vec3f> positions, const Map& map) {
    std::vector<Vec3f> result;
    for (const Vec3f& p : positions) result.push_back(map(p));
    return result;
}

/// Largest distance as a fraction of b's diagonal.
double largest_distance(std::span<const Vec3f> a, std::span<const Vec3f> b) {
    EXPECT_EQ(a.size(), b.size());
    double largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double d = (a[i].cast<double>() - b[i].cast<double>()).norm();
        if (!(d <= largest)) largest = d; // keeps NaN
    }
    return largest / bounds(b).diagonal();
}

/// A quad of the unit square, once subdivided, and one of its five new points moved. Vertex 3 j + i is at (i, j) / 2.
Mesh one_level(std::size_t moved, const Vec3f& by) {
    Mesh mesh;
    for (unsigned v = 0; v < 9; ++v)
        mesh.positions.emplace_back(0.5f * static_cast<float>(v % 3), 0.5f * static_cast<float>(v / 3), 0.0f);
    for (const Index v : {0u, 1u, 3u, 4u}) mesh.add_face(std::array<Index, 4>{v, v + 1, v + 4, v + 3});
    mesh.positions[moved] += by;
    return mesh;
}

TEST(ReferenceCode, RecordsAreTheReportsCoordinates) {
    // The centre, over C1 = (0, 0), C2 = (1, 0), Cm = (0.5, 1): P = (0.5, 0.5) has w = 1/2, and v = 1/4 from
    // v + w/2 = 1/2. A quarter to the right adds 1/4 to v.
    const ReferenceDetail detail = encoded(one_level(4, {0.25f, 0, 0.125f}));
    ASSERT_EQ(detail.records.size(), 5u); // four edge points, then the centre
    EXPECT_TRUE(detail.loose.empty());
    EXPECT_TRUE(detail.records[4].isApprox(Vec3f(0.5f, 0.5f, 0.125f), 1e-6f)) << detail.records[4].transpose();
    // The edge points lie in the middle between C1 and C2, on their line.
    for (unsigned e = 0; e < 4; ++e) EXPECT_LT((detail.records[e] - Vec3f(0.5f, 0, 0)).norm(), 1e-6f) << e;
}

TEST(ReferenceCode, CoordinatesAreSigned) {
    // Beyond the lower edge, left of C1, below the plane.
    const ReferenceDetail detail = encoded(one_level(4, {-0.75f, -0.75f, -0.25f}));
    const Vec3f record = detail.records[4]; // w = -1/4, v + w/2 = -1/4
    EXPECT_TRUE(record.isApprox(Vec3f(-0.125f, -0.25f, -0.25f), 1e-6f)) << record.transpose();
}

TEST(ReferenceCode, FourReferencesMeasureFromTheMean) {
    const ReferenceDetail detail = encoded(one_level(4, {0.25f, -0.125f, 0.125f}), 4);
    EXPECT_TRUE(detail.records[4].isApprox(Vec3f(0.25f, -0.125f, 0.125f), 1e-6f)) << detail.records[4].transpose();
}

TEST(HeightLaw, IsBoundedWhereItHasToBe) {
    EXPECT_EQ(height_law_scale(HeightLaw::keep, 1, 100), 1);
    EXPECT_DOUBLE_EQ(height_law_scale(HeightLaw::inverse, 1, 4), 0.5);
    EXPECT_DOUBLE_EQ(height_law_scale(HeightLaw::proportional, 1, 4), 2);
    EXPECT_DOUBLE_EQ(height_law_scale(HeightLaw::volume, 1, 2), 0.5);
    for (const HeightLaw law : {HeightLaw::inverse, HeightLaw::volume}) {
        EXPECT_DOUBLE_EQ(height_law_scale(law, 1, 0), kMaxHeightScale);
        EXPECT_DOUBLE_EQ(height_law_scale(law, 1, 1e12), 1 / kMaxHeightScale);
    }
    EXPECT_EQ(height_law_scale(HeightLaw::proportional, 1, 0), 0);
    for (const HeightLaw law : {HeightLaw::keep, HeightLaw::inverse, HeightLaw::proportional, HeightLaw::volume})
        EXPECT_EQ(height_law_scale(law, 0, 5), 1); // nothing to compare with
}

/// Figure 1.1: the width of the references doubles; heights follow the law.
TEST(ReferenceCode, LawsOnAStretchedQuad) {
    const Mesh mesh = one_level(4, {0, 0, 0.125f});
    const ReferenceDetail detail = encoded(mesh);
    const auto driver = transformed(detail.rest_driver, [](const Vec3f& p) { return Vec3f(2 * p.x(), p.y(), p.z()); });
    const std::pair<HeightLaw, float> expected[] = {{HeightLaw::keep, 1.0f},
                                                    {HeightLaw::inverse, 0.5f},
                                                    {HeightLaw::proportional, std::sqrt(2.0f)},
                                                    {HeightLaw::volume, 0.5f}};
    for (const auto& [law, factor] : expected)
        for (const unsigned references : {3u, 4u, 6u}) {
            const auto positions = restored(encoded(mesh, references), law, driver);
            EXPECT_LT((positions[4] - Vec3f(1, 0.5f, factor * 0.125f)).norm(), 1e-6f)
                << height_law_name(law) << references;
        }
}

TEST(ReferenceCode, LawsAreBounded) {
    const Mesh mesh = one_level(4, {0, 0, 0.125f});
    const ReferenceDetail detail = encoded(mesh);
    const auto height = [&](HeightLaw law, float scale) {
        const auto driver = transformed(detail.rest_driver, [&](const Vec3f& p) { return Vec3f(scale * p); });
        return restored(detail, law, driver)[4].z() / 0.125f;
    };
    for (const HeightLaw law : {HeightLaw::inverse, HeightLaw::volume}) {
        EXPECT_NEAR(height(law, 1e-3f), 4, 1e-5);
        EXPECT_NEAR(height(law, 1e3f), 0.25, 1e-5);
    }
    for (const float scale : {1e-3f, 3.0f, 1e3f}) EXPECT_NEAR(height(HeightLaw::proportional, scale) / scale, 1, 1e-5);
}

TEST(ReferenceCode, RoundTrip) {
    const Mesh meshes[] = {make_wavy_cube({.resolution = 64}),   make_wavy_cube({.resolution = 24}),
                           make_wavy_sphere({.resolution = 32}), make_wavy_plane({.resolution = 48}),
                           make_bar({.resolution = 8}),          make_cylinder({.resolution = 16}),
                           make_torus({.resolution = 32}),       make_wavy_plane({.resolution = 2})};
    for (std::size_t m = 0; m < std::size(meshes); ++m)
        for (const unsigned references : {3u, 4u, 6u})
            for (const HeightLaw law :
                 {HeightLaw::keep, HeightLaw::inverse, HeightLaw::proportional, HeightLaw::volume}) {
                const ReferenceDetail detail = encoded(meshes[m], references);
                EXPECT_EQ(detail.records.size() + detail.rest_driver.size(), meshes[m].vertex_count());
                EXPECT_LE(largest_distance(restored(detail, law, detail.rest_driver), meshes[m].positions), 2e-7)
                    << m << ' ' << references << ' ' << height_law_name(law);
            }
}

TEST(ReferenceCode, RoundTripAtSixMillionPoints) {
    if (!all_cases()) GTEST_SKIP() << "large: scripts/check cases runs it";
    const Mesh mesh = make_wavy_cube({.resolution = 1024});
    const ReferenceDetail detail = encoded(mesh);
    EXPECT_EQ(detail.patches.levels, 10u);
    for (const HeightLaw law : {HeightLaw::keep, HeightLaw::inverse})
        EXPECT_LE(largest_distance(restored(detail, law, detail.rest_driver), mesh.positions), 2e-7)
            << height_law_name(law);
}

/// Points in no order: every coordinate of every level is anything, so float rounds everywhere.
Mesh rough_cube(unsigned resolution, float roughness) {
    Mesh mesh = make_wavy_cube({.resolution = resolution});
    std::mt19937 random(7);
    std::uniform_real_distribution<float> jitter(-roughness, roughness);
    for (Vec3f& p : mesh.positions) p += Vec3f(jitter(random), jitter(random), jitter(random));
    return mesh;
}

TEST(ReferenceCode, RoundTripOfRoughMeshes) {
    for (const float roughness : {0.001f, 0.01f, 0.1f, 1.0f}) {
        const Mesh mesh = rough_cube(32, roughness);
        for (const unsigned references : {3u, 4u, 6u}) {
            const ReferenceDetail detail = encoded(mesh, references);
            EXPECT_LE(largest_distance(restored(detail, HeightLaw::keep, detail.rest_driver), mesh.positions), 2e-7)
                << roughness << ' ' << references << " loose: " << detail.loose.size();
        }
    }
}

TEST(ReferenceCode, RigidMotionIsExact) {
    const Eigen::AngleAxisf turn(1.1f, Vec3f(1, 2, -0.5f).normalized());
    const auto move = [&](const Vec3f& p) { return Vec3f(turn * p + Vec3f(0.3f, -0.2f, 0.5f)); };
    for (const Mesh& mesh : {make_wavy_cube({.resolution = 64}), rough_cube(32, 0.05f)})
        for (const unsigned references : {3u, 4u, 6u})
            for (const HeightLaw law :
                 {HeightLaw::keep, HeightLaw::inverse, HeightLaw::proportional, HeightLaw::volume}) {
                const ReferenceDetail detail = encoded(mesh, references);
                EXPECT_LE(largest_distance(restored(detail, law, transformed(detail.rest_driver, move)),
                                           transformed(mesh.positions, move)),
                          1e-6);
            }
}

TEST(ReferenceCode, UniformScaleIsExactWhenProportional) {
    const Mesh mesh = make_wavy_sphere({.resolution = 64});
    const ReferenceDetail detail = encoded(mesh);
    for (const float scale : {0.01f, 0.3f, 1.7f, 50.0f}) {
        const auto grow = [&](const Vec3f& p) { return Vec3f(scale * p); };
        EXPECT_LE(largest_distance(restored(detail, HeightLaw::proportional, transformed(detail.rest_driver, grow)),
                                   transformed(mesh.positions, grow)),
                  1e-6);
    }
}

TEST(ReferenceCode, WorksAtAnySize) {
    const Mesh mesh = make_wavy_sphere({.resolution = 16});
    for (const float size : {1e-30f, 1e-12f, 1e12f, 1e30f})
        for (const HeightLaw law : {HeightLaw::keep, HeightLaw::inverse, HeightLaw::proportional, HeightLaw::volume}) {
            Mesh scaled = mesh;
            for (Vec3f& p : scaled.positions) p *= size;
            const ReferenceDetail detail = encoded(scaled);
            EXPECT_LE(largest_distance(restored(detail, law, detail.rest_driver), scaled.positions), 2e-7) << size;
        }
}

/// Drivers moved to where references span nothing: the answer is finite and stays near the driver.
TEST(ReferenceCode, NoSpikesWhenTheDriverCollapses) {
    const Mesh mesh = make_wavy_cube({.resolution = 64});
    const double diagonal = bounds(mesh.positions).diagonal();
    using Map = Vec3f (*)(const Vec3f&);
    const std::pair<const char*, Map> collapses[] = {
        {"plane", [](const Vec3f& p) { return Vec3f(p.x(), p.y(), 0); }},
        {"line", [](const Vec3f& p) { return Vec3f(p.x(), 0, 0); }},
        {"skew line", [](const Vec3f& p) { return Vec3f(0.1f * p.x(), 0.7f * p.x(), -0.3f * p.x()); }},
        {"point", [](const Vec3f&) { return Vec3f(0.1f, 0.2f, 0.3f); }},
        {"origin", [](const Vec3f&) { return Vec3f(0, 0, 0); }},
        {"mirror", [](const Vec3f& p) { return Vec3f(-p.x(), p.y(), p.z()); }},
        {"squeezed", [](const Vec3f& p) { return Vec3f(p.x(), 0.05f * p.y(), p.z()); }},
        {"small", [](const Vec3f& p) { return Vec3f(0.01f * p); }},
        {"tiny", [](const Vec3f& p) { return Vec3f(1e-30f * p); }}};
    for (const unsigned references : {3u, 4u, 6u})
        for (const HeightLaw law : {HeightLaw::keep, HeightLaw::inverse, HeightLaw::proportional, HeightLaw::volume}) {
            const ReferenceDetail detail = encoded(mesh, references);
            for (const auto& [name, map] : collapses) {
                const auto driver = transformed(detail.rest_driver, map);
                const auto positions = restored(detail, law, driver);
                const Vec3d centre = bounds(driver).centre();
                double furthest = 0;
                for (const Vec3f& p : positions) {
                    ASSERT_TRUE(p.allFinite()) << name << ' ' << height_law_name(law);
                    furthest = std::max(furthest, (p.cast<double>() - centre).norm());
                }
                // Half of it holds the driver; the waves, four times as high at most, and twice for good measure.
                EXPECT_LE(furthest, 0.5 * diagonal + 2 * 4 * 0.04 * std::sqrt(3.0))
                    << name << ' ' << height_law_name(law) << ' ' << references;
            }
        }
}

/// Meshes that are degenerate at rest still come back, and stay near a driver that moves.
TEST(ReferenceCode, DegenerateRestShapesAreLoose) {
    for (const float flat : {0.0f, 1e-4f}) {
        Mesh mesh = make_wavy_cube({.resolution = 16});
        std::mt19937 random(3);
        std::uniform_real_distribution<float> anywhere(-1, 1);
        const auto patches = find_regular_patches(mesh, 16, kOneThread);
        // All corners on a line and everything else anywhere.
        for (Vec3f& p : mesh.positions) p = Vec3f(anywhere(random), anywhere(random), anywhere(random));
        for (const auto& quad : patches->base)
            for (const Index v : quad)
                mesh.positions[v] = Vec3f(static_cast<float>(v % 5), flat * static_cast<float>(v % 3), 0);
        for (const unsigned references : {3u, 4u, 6u}) {
            const ReferenceDetail detail = encoded(mesh, references);
            EXPECT_FALSE(detail.loose.empty());
            EXPECT_LE(largest_distance(restored(detail, HeightLaw::keep, detail.rest_driver), mesh.positions), 2e-7);
            // Heights here are as large as the mesh, and so is what rounding the law's factor does to them.
            EXPECT_LE(largest_distance(restored(detail, HeightLaw::inverse, detail.rest_driver), mesh.positions), 1e-6);
            const auto open = transformed(detail.rest_driver,
                                          [](const Vec3f& p) { return Vec3f(p.x(), 1000 * p.y(), p.x() * p.x()); });
            for (const Vec3f& p : restored(detail, HeightLaw::inverse, open)) ASSERT_TRUE(p.allFinite());
        }
    }
    Mesh point = make_wavy_cube({.resolution = 8});
    for (Vec3f& p : point.positions) p = Vec3f(1, 2, 3);
    const ReferenceDetail detail = encoded(point);
    EXPECT_TRUE(same_bytes(restored(detail, HeightLaw::volume, detail.rest_driver), point.positions));
}

TEST(ReferenceCode, EveryLevelIsThere) {
    const Mesh mesh = make_wavy_sphere({.resolution = 32});
    const ReferenceDetail detail = encoded(mesh);
    const ReferenceRestorer restorer(detail, HeightLaw::keep, kOneThread);
    for (unsigned level = 0; level <= 5; ++level) {
        const std::size_t m = std::size_t{1} << level;
        const auto vertices = restorer.level_vertices(level);
        EXPECT_EQ(vertices.size(), 6 * m * m + 2);
        EXPECT_EQ(restorer.level_quads(level).size(), 6 * m * m);
        const Vec3f untouched(7, 8, 9);
        std::vector<Vec3f> positions(mesh.vertex_count(), untouched);
        restorer.restore(detail.rest_driver, level, positions, kOneThread);
        std::size_t next = 0;
        for (Index v = 0; v < positions.size(); ++v)
            if (next < vertices.size() && vertices[next] == v) {
                EXPECT_LT((positions[v] - mesh.positions[v]).norm(), 2e-7f);
                ++next;
            } else {
                EXPECT_EQ(positions[v], untouched);
            }
        for (const auto& quad : restorer.level_quads(level))
            for (const Index v : quad) EXPECT_TRUE(std::binary_search(vertices.begin(), vertices.end(), v));
    }
    EXPECT_EQ(restorer.level_quads(5).size(), mesh.face_count());
}

TEST(ReferenceCode, GridsAreWhatRestoreGives) {
    for (const Mesh& mesh :
         {make_wavy_cube({.resolution = 64}), make_wavy_plane({.resolution = 24}), make_torus({.resolution = 16}),
          rough_cube(16, 0.2f), make_wavy_cube({.resolution = 640})}) {
        const ReferenceDetail detail = encoded(mesh);
        const ReferenceRestorer restorer(detail, HeightLaw::inverse, kOneThread);
        auto driver = transformed(detail.rest_driver, [](const Vec3f& p) {
            return Vec3f(p.x() + 0.3f * p.y() * p.y(), 1.5f * p.y(), p.z() - 0.2f * p.x());
        });
        for (unsigned level = 0; level <= detail.patches.levels; ++level) {
            std::vector<Vec3f> positions(mesh.vertex_count(), Vec3f::Zero());
            restorer.restore(driver, level, positions, kOneThread);
            const std::size_t m = std::size_t{1} << level, step = detail.patches.side() / m;
            std::vector<Vec3f> grids(detail.patches.patch_count() * (m + 1) * (m + 1), Vec3f::Constant(NAN));
            restorer.restore_grids(driver, level, grids, kOneThread);
            std::size_t different = 0;
            for (std::size_t g = 0; g < grids.size(); ++g) {
                const std::size_t row = g / (m + 1);
                const Index v = detail.patches.at(row / (m + 1), g % (m + 1) * step, row % (m + 1) * step);
                different += std::memcmp(&grids[g], &positions[v], sizeof(Vec3f)) != 0;
            }
            EXPECT_EQ(different, 0u) << level;
        }
    }
}

TEST(ReferenceCode, SameBytesForAnyThreadCount) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Mesh mesh = make_wavy_cube({.resolution = 256});
    const RunContext three(3);
    const auto one_detail = encoded(mesh, 6);
    const auto three_detail = encode_reference(mesh, {.references = 6, .max_levels = 16}, three);
    ASSERT_TRUE(three_detail.ok());
    EXPECT_TRUE(same_bytes(one_detail.records, three_detail->records));
    const auto driver =
        transformed(one_detail.rest_driver, [](const Vec3f& p) { return Vec3f(2 * p.x(), p.y(), p.z()); });
    EXPECT_TRUE(same_bytes(restored(one_detail, HeightLaw::inverse, driver),
                           restored(one_detail, HeightLaw::inverse, driver, three)));
}

TEST(ReferenceCode, RefusesWhatItCannotDo) {
    EXPECT_EQ(encode_reference(make_wavy_plane({.resolution = 4}), {.references = 5}, kOneThread).error().code,
              ErrorCode::usage);
    EXPECT_EQ(encode_reference(make_wavy_plane({.resolution = 5}), {}, kOneThread).error().code, ErrorCode::unsuitable);
    const RunContext context(1);
    context.cancel();
    EXPECT_EQ(encode_reference(make_wavy_plane({.resolution = 4}), {}, context).error().code, ErrorCode::cancelled);
}

} // namespace
} // namespace filigree
