#include "filigree/remesh/surface_map.h"

#include "filigree/remesh/base_triangles.h"
#include "prepared.h"

namespace filigree {
namespace {

using namespace filigree_test;

double cross(const Vec2d& a, const Vec2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Changes of a map, each tried at a random place and made when the header allows it.
class RandomChanges {
public:
    RandomChanges(SurfaceMap& map, unsigned seed) : map_(map), random_(seed) {}

    std::size_t collapses = 0, flips = 0, relocations = 0, splits = 0;
    double least_area = 1e-4; ///< in the plane, of the triangles that changes leave

    void make(std::size_t tries, unsigned share_of_splits) {
        for (std::size_t i = 0; i < tries; ++i) {
            const auto kind = random_() % 100;
            if (kind < share_of_splits)
                split();
            else if (kind < 50)
                collapse();
            else if (kind < 75)
                relocate();
            else
                flip();
        }
    }

    void collapse() {
        const Index u = any_vertex();
        if (map_.kind(u) == VertexKind::corner || map_.valence(u) > 20) return;
        map_.star(u, star_);
        if (!map_.flatten(star_)) return;
        const std::size_t target = map_.kind(u) == VertexKind::inside ? random_() % star_.ring.size()
                                   : random_() % 2                    ? star_.curve_a
                                                                      : star_.curve_b;
        if (!may_collapse(target)) return;
        map_.collapse(star_, target);
        ++collapses;
    }

    void relocate() {
        const Index u = any_vertex();
        if (map_.kind(u) == VertexKind::corner) return;
        map_.star(u, star_);
        if (!map_.flatten(star_)) return;
        Vec2f place(float(fraction() - 0.5), float(fraction() - 0.5));
        if (map_.kind(u) == VertexKind::curve) {
            place.x() = fraction() < 0.5 ? 0.5f * star_.flat[star_.curve_a].x() : 0.5f * star_.flat[star_.curve_b].x();
            place.y() = 0;
        }
        for (std::size_t i = 0; i < star_.triangle_count(); ++i)
            if (doubled_area(place, star_.flat[i], star_.flat[star_.next(i)]) < least_area) return;
        const TrianglePoint promised = map_.locate(star_, place);
        map_.relocate(star_, place);
        EXPECT_EQ(map_.position(u), map_.original_position(promised));
        ++relocations;
    }

    void flip() {
        const Index h = any_half_edge();
        if (map_.is_feature(h)) return;
        const Index g = map_.twin(h), c = map_.from(previous_half_edge(h)), d = map_.from(previous_half_edge(g));
        if (c == d || map_.are_neighbours(c, d)) return;
        for (const Index half : {h, g})
            if (map_.kind(map_.from(half)) == VertexKind::inside ? map_.valence(map_.from(half)) <= 3
                                                                 : map_.sector_size(half) <= 1)
                return;
        const SurfaceMap::Unfolded flat = map_.unfold(h);
        const double least = 1e-3 * flat.to.squaredNorm();
        if (doubled_area(flat.above, Vec2f::Zero(), flat.below) < least ||
            doubled_area(flat.below, flat.to, flat.above) < least)
            return;
        map_.flip(h);
        ++flips;
    }

    void split() {
        const Index h = any_half_edge();
        const bool on_curve = map_.is_feature(h);
        const Index before = static_cast<Index>(map_.vertex_count());
        const Index middle = map_.split(h, random_() % 2 ? 0.5 : 0.25);
        EXPECT_EQ(middle, before);
        EXPECT_EQ(map_.kind(middle), on_curve ? VertexKind::curve : VertexKind::inside);
        ++splits;
    }

private:
    double fraction() { return double(random_() % 10'000) / 10'000; }

    Index any_vertex() {
        for (;;)
            if (const auto v = Index(random_() % map_.vertex_count()); !map_.is_vertex_removed(v)) return v;
    }
    Index any_half_edge() {
        for (;;)
            if (const auto h = Index(random_() % (3 * map_.slot_count())); !map_.is_removed(h / 3)) return h;
    }
    static double doubled_area(const Vec2f& a, const Vec2f& b, const Vec2f& c) {
        return cross((b - a).cast<double>(), (c - a).cast<double>());
    }

    std::set<Index> neighbours(Index v) const {
        Star star;
        map_.star(v, star);
        return {star.ring.begin(), star.ring.end()};
    }

    bool may_collapse(std::size_t target) const {
        const std::size_t n = star_.ring.size();
        const Index v = star_.ring[target];
        const bool at_end = star_.open && (target == 0 || target + 1 == n);
        const std::set<Index> of_v = neighbours(v);
        const auto shared = std::ranges::count_if(star_.ring, [&](Index w) { return of_v.contains(w); });
        if (shared != (at_end ? 1 : 2)) return false;
        for (std::size_t i = 0; i < star_.triangle_count(); ++i) {
            const std::size_t j = star_.next(i);
            if (i == target || j == target) {
                const Index w = star_.ring[i == target ? j : i];
                for (const Index h : {star_.half_edges[i], next_half_edge(star_.half_edges[i]),
                                      previous_half_edge(star_.half_edges[i])})
                    if (map_.from(h) == w && map_.kind(w) != VertexKind::inside && map_.sector_size(h) <= 2)
                        return false;
                if (map_.kind(w) == VertexKind::inside && map_.valence(w) <= 3) return false;
            } else if (doubled_area(star_.flat[target], star_.flat[i], star_.flat[j]) < least_area) {
                return false;
            }
        }
        return true;
    }

    SurfaceMap& map_;
    std::mt19937 random_;
    Star star_;
};

/// The area that a fine sampling of all slots has on the original, and the originals that it hits.
struct Image {
    double area = 0;
    std::set<Index> hit;
};

Image image_of(const SurfaceMap& map, int n) {
    Image image;
    for (Index s = 0; s < map.slot_count(); ++s) {
        if (map.is_removed(s)) continue;
        const auto place = [&](int i, int j) {
            const TrianglePoint traced = map.trace({s, Vec3d(n - i - j, i, j) / n});
            image.hit.insert(traced.triangle);
            return map.original_position(traced);
        };
        for (int i = 0; i < n; ++i)
            for (int j = 0; i + j < n; ++j) {
                const Vec3d a = place(i, j), b = place(i + 1, j), c = place(i, j + 1);
                image.area += 0.5 * (b - a).cross(c - a).norm();
                if (i + j + 2 > n) continue;
                const Vec3d d = place(i + 1, j + 1);
                image.area += 0.5 * (b - d).cross(c - d).norm();
            }
    }
    return image;
}

double covered_by(const SurfaceMap& map) {
    double area = 0;
    for (Index s = 0; s < map.slot_count(); ++s)
        if (!map.is_removed(s)) area += map.covered_area(s);
    return area;
}

TEST(SurfaceMap, BeginsAsTheIdentity) {
    for (const Mesh& mesh : {bumpy_torus(), ridged_sheet(), plain_cube(), machined_part()}) {
        const Prepared on(mesh);
        const SurfaceMap map = on.map();
        expect_sound(map, on);
        EXPECT_EQ(map.record_count(), 0u);
        EXPECT_EQ(map.triangle_count(), on.surface.triangles.size());
        for (Index s = 0; s < map.slot_count(); ++s) {
            const TrianglePoint point{s, {0.2, 0.3, 0.5}}, traced = map.trace(point);
            EXPECT_EQ(traced.triangle, s);
            EXPECT_EQ(traced.barycentric, point.barycentric);
        }
    }
}

TEST(SurfaceMap, KnowsWhatMayMove) {
    const Prepared cube(plain_cube());
    const SurfaceMap map = cube.map();
    for (Index v = 0; v < 8; ++v) EXPECT_EQ(map.kind(v), VertexKind::corner);
    const Prepared sheet(ridged_sheet(8));
    const SurfaceMap on_sheet = sheet.map();
    std::map<VertexKind, int> kinds;
    for (Index v = 0; v < on_sheet.vertex_count(); ++v) ++kinds[on_sheet.kind(v)];
    EXPECT_EQ(kinds[VertexKind::corner], 6); // four of the square, two where the ridge ends
    EXPECT_EQ(kinds[VertexKind::curve], 4 * 7 - 2 + 7);
    EXPECT_EQ(kinds[VertexKind::inside], 49 - 7);
}

TEST(SurfaceMap, AnyLegalChangesKeepASoundSurfaceAndAContinuousMap) {
    for (unsigned seed = 1; seed <= 3; ++seed)
        for (const Mesh& mesh : {bumpy_torus(), ridged_sheet(), machined_part()}) {
            const Prepared on(mesh);
            SurfaceMap map = on.map();
            RandomChanges changes(map, seed);
            for (const unsigned share_of_splits : {5u, 20u, 0u}) {
                changes.make(3000, share_of_splits);
                ASSERT_NO_FATAL_FAILURE(expect_sound(map, on));
                ASSERT_NO_FATAL_FAILURE(expect_continuous(map, on));
                EXPECT_NEAR(covered_by(map), area_of(on.surface), 1e-9 * area_of(on.surface));
            }
            EXPECT_GT(changes.collapses, 300u);
            EXPECT_GT(changes.flips, 200u);
            EXPECT_GT(changes.relocations, 100u);
            EXPECT_GT(changes.splits, 500u);
        }
}

TEST(SurfaceMap, ReachesEveryPlaceOnce) {
    for (const Mesh& mesh : {bumpy_torus(), ridged_sheet()}) {
        const Prepared on(mesh);
        SurfaceMap map = on.map();
        RandomChanges changes(map, 7);
        changes.least_area = 0.1; // samples of what is distorted say little
        changes.make(200, 10);
        for (int i = 0; i < 3000; ++i) changes.collapse();
        EXPECT_LT(double(map.triangle_count()), 0.6 * double(on.surface.triangles.size()));
        const Image image = image_of(map, 112);
        EXPECT_EQ(image.hit.size(), on.surface.triangles.size());                 // onto
        EXPECT_NEAR(image.area, area_of(on.surface), 0.02 * area_of(on.surface)); // and nowhere twice
    }
}

TEST(SurfaceMap, OfAScanMadeCoarse) {
    const std::filesystem::path file = corpus_file("good/koala_100k.obj");
    if (file.empty()) GTEST_SKIP() << "no corpus";
    const Prepared on(read_mesh(file, kOneThread)->mesh, 1000);
    SurfaceMap map = on.map();
    ASSERT_TRUE(make_base_triangles(map, {.triangles = 2000}, kOneThread).ok());
    ASSERT_NO_FATAL_FAILURE(expect_sound(map, on));
    EXPECT_NEAR(image_of(map, 16).area, area_of(on.surface), 0.05 * area_of(on.surface));
    RandomChanges(map, 1).make(4000, 10);
    ASSERT_NO_FATAL_FAILURE(expect_sound(map, on));
    ASSERT_NO_FATAL_FAILURE(expect_continuous(map, on));
    EXPECT_NEAR(covered_by(map), area_of(on.surface), 1e-9 * area_of(on.surface));
}

TEST(SurfaceMap, OfAPlaneStaysTheIdentityUnderFlips) {
    const Prepared on(make_wavy_plane({.resolution = 12, .amplitude = 0}));
    SurfaceMap map = on.map();
    RandomChanges changes(map, 5);
    for (int i = 0; i < 5000; ++i) changes.flip();
    EXPECT_GT(changes.flips, 500u);
    for (Index s = 0; s < map.slot_count(); ++s) {
        Vec3d flat = Vec3d::Zero();
        for (const Index v : map.triangle(s)) flat += map.position(v) / 3;
        EXPECT_LT((map.original_position(map.trace({s, Vec3d::Constant(1.0 / 3)})) - flat).norm(), 1e-6) << s;
    }
}

} // namespace
} // namespace filigree
