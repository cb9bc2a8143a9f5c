#include "filigree/sample.h"
#include "filigree/sample/closure.h"

#include "bodies.h"
#include "filigree/mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

namespace filigree::outward_test {
namespace {

/// A box of n quads along each edge; faces look outwards.
Mesh box(const Vec3f& low, const Vec3f& high, int n, bool inwards = false) {
    Mesh cube = make_wavy_cube({.resolution = unsigned(n), .amplitude = 0});
    const Box whole = bounds(cube.positions);
    for (Vec3f& p : cube.positions) {
        const Vec3f at = ((p.cast<double>() - whole.min).array() / whole.size().array()).matrix().cast<float>();
        p = low + at.cwiseProduct(high - low);
    }
    if (inwards)
        for (std::size_t f = 0; f < cube.face_count(); ++f)
            std::reverse(cube.corners.begin() + cube.face_offsets[f], cube.corners.begin() + cube.face_offsets[f + 1]);
    return cube;
}

void add(Mesh& to, const Mesh& other) {
    const Index shift = Index(to.vertex_count());
    to.positions.insert(to.positions.end(), other.positions.begin(), other.positions.end());
    for (std::size_t f = 0; f < other.face_count(); ++f) {
        std::vector<Index> face;
        for (const Index v : other.face(f)) face.push_back(v + shift);
        to.add_face(face);
    }
}

Mesh cube(float half, bool inwards = false) { return box(Vec3f::Constant(-half), Vec3f::Constant(half), 4, inwards); }

/// Layers of a block, neighbours sharing one sheet: edges of three faces at their borders.
Mesh layers(int count, int n) {
    Mesh mesh;
    std::map<std::array<int, 3>, Index> ids;
    const auto id = [&](int i, int j, int k) {
        const auto [at, is_new] = ids.try_emplace({i, j, k}, Index(mesh.positions.size()));
        if (is_new) mesh.positions.push_back(Vec3f(float(i), float(j), float(k)) / float(n));
        return at->second;
    };
    const auto quad = [&](Index a, Index b, Index c, Index d) { mesh.add_face(std::array<Index, 4>{a, b, c, d}); };
    for (int l = 0; l <= count; ++l)
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j)
                if (l == count)
                    quad(id(i, j, l), id(i + 1, j, l), id(i + 1, j + 1, l), id(i, j + 1, l));
                else
                    quad(id(i, j + 1, l), id(i + 1, j + 1, l), id(i + 1, j, l), id(i, j, l));
    for (int l = 0; l < count; ++l)
        for (int i = 0; i < n; ++i) {
            quad(id(i, 0, l), id(i + 1, 0, l), id(i + 1, 0, l + 1), id(i, 0, l + 1));
            quad(id(n, i, l), id(n, i + 1, l), id(n, i + 1, l + 1), id(n, i, l + 1));
            quad(id(n - i, n, l), id(n - i - 1, n, l), id(n - i - 1, n, l + 1), id(n - i, n, l + 1));
            quad(id(0, n - i, l), id(0, n - i - 1, l), id(0, n - i - 1, l + 1), id(0, n - i, l + 1));
        }
    return mesh;
}

/// The volume that is inside, by whatever the options say.
double sampled(const Mesh& mesh, InsideOptions options = {}) {
    constexpr double kStep = 1.0 / 16;
    const Lattice lattice = make_lattice(bounds(mesh.positions), {.spacing = kStep}).value();
    const Occupancy inside = sample_inside(mesh, lattice, options, kAllThreads).value();
    const InsideTest test = InsideTest::create(mesh, options, kAllThreads).value();
    std::size_t differ = 0;
    const auto [nx, ny, nz] = lattice.counts();
    for (std::size_t k = 0; k < nz; ++k)
        for (std::size_t j = 0; j < ny; ++j)
            for (std::size_t i = 0; i < nx; ++i)
                differ += inside.contains(i, j, k) != test.contains(lattice.point(i, j, k));
    EXPECT_EQ(differ, 0u); // single points get the lattice's answers
    return double(inside.count()) * kStep * kStep * kStep;
}

/// The same by every method that can, and both ways with overlaps.
void expect_volume(const Mesh& mesh, double volume) {
    for (const InsideMethod method :
         {InsideMethod::automatic, InsideMethod::scan, InsideMethod::rays, InsideMethod::winding})
        for (const Overlap overlap : {Overlap::parity, Overlap::merged}) {
            SCOPED_TRACE(int(method) * 10 + int(overlap));
            EXPECT_NEAR(sampled(mesh, {.method = method, .overlap = overlap}), volume, 0.02 * volume);
        }
    EXPECT_NEAR(inside_volume(mesh, kAllThreads)->volume.value(), volume, 1e-4 * volume);
}

OutwardReport report_of(const Mesh& mesh) { return weld_triangles(mesh, kAllThreads)->outward; }

TEST(Outward, InsideOutIsTurned) {
    expect_volume(cube(1, true), 8);
    EXPECT_EQ(report_of(cube(1, true)).inward_parts, 1u);
    EXPECT_NE(outward_sentence(report_of(cube(1, true))).find("inwards"), std::string::npos);
    EXPECT_TRUE(report_of(cube(1)).is_as_it_was());
    EXPECT_EQ(outward_sentence(report_of(cube(1))), "");
}

TEST(Outward, PartsWithinOthersAreInTurnHollowAndMatter) {
    for (unsigned bits = 0; bits < 8; ++bits) { // whichever look inwards
        Mesh mesh = cube(1, bits & 1);
        add(mesh, cube(0.5, bits & 2));
        SCOPED_TRACE(bits);
        expect_volume(mesh, 7);
        add(mesh, cube(0.25, bits & 4));
        expect_volume(mesh, 7.125);
    }
    Mesh right = cube(1);
    add(right, cube(0.5, true));
    EXPECT_TRUE(report_of(right).is_as_it_was());
    Mesh wrong = cube(1);
    add(wrong, cube(0.5));
    EXPECT_EQ(report_of(wrong).cavities, 1u);
    EXPECT_EQ(report_of(wrong).inward_parts, 0u);
}

TEST(Outward, PartsThatCrossOrTouchLieBesideEachOther) {
    Mesh crossing = box({0, 0, 0}, {1, 1, 1}, 4, true);
    add(crossing, box({0.5, 0.25, 0.25}, {1.5, 0.75, 0.75}, 4, true));
    EXPECT_NEAR(sampled(crossing, {.overlap = Overlap::merged}), 1.125, 0.02);
    EXPECT_NEAR(sampled(crossing, {.overlap = Overlap::parity}), 1, 0.02);
    EXPECT_NEAR(sampled(crossing, {.method = InsideMethod::rays, .overlap = Overlap::merged}), 1.125, 0.02);
    Mesh touching; // the same sheet twice, edges of four faces
    for (int k = 0; k < 5; ++k)
        add(touching, box({0, 0, 0.25f * float(k)}, {1, 1, 0.25f * float(k + 1)}, 4, k % 2 == 1));
    expect_volume(touching, 1.25);
    EXPECT_GT(report_of(touching).inner_faces, 0u);
    Mesh right, wrong; // solids that look one way are left as they are, or turned as a whole
    for (int k = 0; k < 3; ++k) {
        add(right, box({0, 0, 0.5f * float(k)}, {1, 1, 0.5f * float(k + 1)}, 4));
        add(wrong, box({0, 0, 0.5f * float(k)}, {1, 1, 0.5f * float(k + 1)}, 4, true));
    }
    expect_volume(right, 1.5);
    EXPECT_TRUE(report_of(right).is_as_it_was());
    expect_volume(wrong, 1.5);
    EXPECT_EQ(report_of(wrong).inward_parts, 1u);
    EXPECT_EQ(report_of(wrong).inner_faces, 0u);
    Mesh notch = box({0, 0, 0}, {3, 1, 1}, 1), beside = box({1, 1, 0}, {2, 2, 1}, 1); // coarse: share no whole face
    add(notch, beside);
    expect_volume(notch, 4);
}

TEST(Outward, LayersThatShareSheetsAreWhole) {
    for (const bool inwards : {false, true}) {
        Mesh mesh = layers(5, 4);
        if (inwards)
            for (std::size_t f = 0; f < mesh.face_count(); f += 2) // at random, nearly
                std::reverse(mesh.corners.begin() + mesh.face_offsets[f],
                             mesh.corners.begin() + mesh.face_offsets[f + 1]);
        expect_volume(mesh, 1.25);
        const WeldedTriangles welded = weld_triangles(mesh, kAllThreads).value();
        EXPECT_TRUE(welded.closure.is_closed());
        EXPECT_TRUE(welded.closure.is_oriented());
        EXPECT_EQ(welded.outward.inner_faces, 2u * 4 * 16); // four sheets
    }
}

TEST(Outward, FacesThatAreThereTwiceCountOnce) {
    Mesh doubled = cube(1), both_sides = cube(1), one_more = cube(1);
    const Mesh again = cube(1), back = cube(1, true);
    add(doubled, again);
    add(both_sides, back);
    const std::vector<Index> face(again.face(7).begin(), again.face(7).end());
    one_more.add_face(face);
    expect_volume(doubled, 8);
    expect_volume(both_sides, 8);
    expect_volume(one_more, 8);
}

TEST(Outward, TurnedFacesAreTurnedBack) {
    std::mt19937 random(1);
    Mesh mesh = cube(1);
    add(mesh, cube(0.5));
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        if (random() % 8 == 0)
            std::reverse(mesh.corners.begin() + mesh.face_offsets[f], mesh.corners.begin() + mesh.face_offsets[f + 1]);
    expect_volume(mesh, 7);
    EXPECT_GT(report_of(mesh).turned_faces, 0u);
}

TEST(Outward, OpenMeshesLookOutwardsTooWhereTheyEncloseSomething) {
    for (const bool inwards : {false, true}) {
        Mesh open = without_faces(cube(1, inwards), 5 * 16); // a side is missing
        EXPECT_NEAR(sampled(open), 8, 0.5);
        EXPECT_EQ(report_of(open).inward_parts, inwards ? 1u : 0u);
        Mesh layered = layers(5, 4);
        layered.corners.erase(layered.corners.begin(), layered.corners.begin() + 4); // a hole in the ground
        layered.face_offsets.pop_back();
        EXPECT_NEAR(sampled(layered), 1.25, 0.05);
    }
    Mesh apart = cube(1, true); // no face hangs together with another
    Mesh soup;
    for (std::size_t f = 0; f < apart.face_count(); ++f) {
        std::vector<Index> face;
        Vec3f middle = Vec3f::Zero();
        for (const Index v : apart.face(f)) middle += 0.25f * apart.positions[v];
        for (const Index v : apart.face(f)) {
            face.push_back(Index(soup.positions.size()));
            soup.positions.push_back(middle + 0.999f * (apart.positions[v] - middle));
        }
        soup.add_face(face);
    }
    EXPECT_NEAR(sampled(soup), 8, 0.3);
    Mesh sheet = make_wavy_plane({.resolution = 8, .amplitude = 0.1});
    EXPECT_TRUE(report_of(sheet).is_as_it_was());
    for (std::size_t f = 0; f < sheet.face_count(); ++f)
        std::reverse(sheet.corners.begin() + sheet.face_offsets[f], sheet.corners.begin() + sheet.face_offsets[f + 1]);
    EXPECT_TRUE(report_of(sheet).is_as_it_was()); // a sheet has no inside to look away from
}

TEST(Outward, MergedHoldsForEveryPattern) {
    Mesh mesh = box({0, 0, 0}, {1, 1, 1}, 4);
    add(mesh, box({0.5, 0, 0}, {1.5, 1, 1}, 4));
    const Lattice lattice = lattice_over(mesh, 0.05);
    for (const Pattern pattern : {Pattern::jitter, Pattern::poisson}) {
        const auto points = spread_inside(mesh, lattice, pattern, {.overlap = Overlap::merged}, kAllThreads).value();
        std::size_t within = 0, unmoved = 0;
        for (const Vec3d& p : points) {
            const bool is_within = p.x() > 0.5 && p.x() < 1;
            within += is_within;
            const Vec3d at = (p - lattice.point(0, 0, 0)) / 0.05;
            unmoved += is_within && (at - Vec3d(at.array().round())).norm() < 1e-9;
        }
        EXPECT_NEAR(double(within) / double(points.size()), 1.0 / 3, 0.03);
        EXPECT_LT(unmoved, within / 100);
    }
}

TEST(Outward, TheOrderOfPartsAndThreadsDoNotMatter) {
    Mesh one = cube(0.25), two = cube(1, true);
    add(one, cube(0.5));
    add(one, cube(1, true));
    add(two, cube(0.5));
    add(two, cube(0.25));
    const Lattice lattice = lattice_over(one, 0.11);
    EXPECT_EQ(sample_inside(one, lattice, {}, RunContext(1)).value().bits,
              sample_inside(two, lattice, {}, RunContext(2)).value().bits);
}

} // namespace
} // namespace filigree::outward_test
