// Surfaces of bodies that melt: closed, manifold and oriented whatever melts, and the mesh itself where nothing does.
#include "cases.h"
#include "matter.h"

#include "filigree/melting/composite_surface.h"
#include "filigree/mesh.h"

#include <cmath>

namespace filigree {
namespace {

using namespace filigree_test;

/// A body some of which is new matter.
struct MeltingBody {
    Mesh rest, restored;
    std::vector<float> renewal;
    MatterParticles matter;

    explicit MeltingBody(Mesh mesh) : rest(std::move(mesh)), restored(rest), renewal(rest.positions.size(), 0) {}

    Result<CompositeSurface> surface(unsigned threads = 1, std::span<const Vec4f> colors = {},
                                     const ParticleFieldOptions& options = {}) const {
        const RunContext context(threads);
        const CompositeMesher mesher = CompositeMesher::create(rest, context).value();
        std::vector<std::uint8_t> dead;
        return mesher.make(restored, renewal, matter, colors, make_particle_field(matter, options, context).value(),
                           dead, context);
    }
};

MeltingBody melting_ball() {
    MeltingBody body(make_wavy_sphere({.resolution = 40, .amplitude = 0.02}));
    body.matter = ball(0.5f, 0.3f);
    body.matter.renewal.assign(body.matter.positions.size(), 0);
    return body;
}

float above(const Vec3f& at, float height) { return std::clamp((at[2] - height) / 0.1f, 0.0f, 1.0f); }

/// Matter above a height is new, and has sunk.
void melt_above(MeltingBody& body, float height) {
    for (std::size_t v = 0; v < body.renewal.size(); ++v) {
        body.renewal[v] = above(body.rest.positions[v], height);
        body.restored.positions[v][2] -= 0.1f * body.renewal[v];
    }
    for (std::size_t p = 0; p < body.matter.positions.size(); ++p) {
        body.matter.renewal[p] = above(body.matter.positions[p], height);
        body.matter.positions[p][2] -= 0.1f * body.matter.renewal[p];
    }
}

TEST(CompositeSurface, NothingNewIsTheMeshItself) {
    const MeltingBody body = melting_ball();
    const CompositeSurface surface = body.surface().value();
    EXPECT_EQ(surface.mesh.positions, body.restored.positions);
    EXPECT_EQ(surface.mesh.corners, body.restored.corners);
    EXPECT_EQ(surface.matter_triangles, 0u);
}

TEST(CompositeSurface, OldVerticesStayAndComeFirst) {
    MeltingBody body = melting_ball();
    melt_above(body, 0.1f);
    const CompositeSurface surface = body.surface().value();
    checked_volume(surface.mesh);
    ASSERT_EQ(surface.origin.size(), surface.mesh.positions.size());
    std::size_t kept = 0, last = 0;
    for (std::size_t v = 0; v < surface.origin.size(); ++v) {
        const Index from = surface.origin[v];
        if (from == kNoIndex) continue;
        EXPECT_EQ(kept, v) << "a new vertex before an old one";
        EXPECT_TRUE(kept == 0 || from > last);
        last = from;
        ++kept;
        if (body.renewal[from] > CompositeMesher::kFadeBegin) continue;
        EXPECT_EQ(surface.mesh.positions[v], body.restored.positions[from]);
    }
    // All that is far from new matter is kept: below the height by half a spacing's seam.
    std::vector<bool> lives(body.rest.positions.size(), false);
    for (const Index from : surface.origin)
        if (from != kNoIndex) lives[from] = true;
    for (std::size_t v = 0; v < lives.size(); ++v)
        EXPECT_TRUE(lives[v] || body.rest.positions[v][2] > 0.1f - 2 * kSpacing) << v;
    EXPECT_GT(surface.matter_triangles, 500u);
}

TEST(CompositeSurface, ClosedManifoldAndOrientedWhateverMelts) {
    for (std::uint64_t seed = 1; seed <= (all_cases() ? 100u : 50u); ++seed) {
        SCOPED_TRACE(seed);
        Dice dice{seed};
        const unsigned resolution = 4 + unsigned(40 * dice.roll());
        MeltingBody body(dice.roll() < 0.5f ? make_wavy_cube({.resolution = resolution, .amplitude = 0.02})
                                            : make_torus({.resolution = resolution, .amplitude = 0.02}));
        const bool is_cube = body.rest.face_count() == 6 * std::size_t(resolution) * resolution;
        body.matter = matter_where(
            [&](const Vec3f& at) {
                if (is_cube) return at.cwiseAbs().maxCoeff() < 0.5f;
                return std::hypot(at.head<2>().norm() - 0.5f / 1.3f, at[2]) < 0.15f / 1.3f;
            },
            Vec3f::Constant(0.5f), dice.roll(), seed);
        body.matter.renewal.assign(body.matter.positions.size(), 0);
        // A few places from which matter is new, and goes astray.
        for (int place = 0; place < 3; ++place) {
            const Vec3f centre = dice.point() - Vec3f::Constant(0.5f);
            const float radius = 0.1f + 0.4f * dice.roll();
            const Vec3f drift = 0.4f * (dice.point() - Vec3f::Constant(0.5f));
            const float astray = dice.roll() * dice.roll();
            const auto renewed = [&](const Vec3f& at) {
                return std::clamp(1.5f - (at - centre).norm() / radius, 0.0f, 1.0f);
            };
            for (std::size_t v = 0; v < body.renewal.size(); ++v) {
                const float part = renewed(body.rest.positions[v]);
                body.renewal[v] = std::max(body.renewal[v], part);
                body.restored.positions[v] += part * (drift + astray * (dice.point() - Vec3f::Constant(0.5f)));
            }
            for (std::size_t p = 0; p < body.matter.positions.size(); ++p) {
                const float part = renewed(body.matter.positions[p]);
                body.matter.renewal[p] = std::max(body.matter.renewal[p], part);
                body.matter.positions[p] += part * drift;
            }
        }
        checked_volume(body.surface().value().mesh);
    }
}

/// Pieces of faces have UVs between those of their corners: the same at a vertex for every face around it, where the
/// mesh's own are, and all along the seam.
TEST(CompositeSurface, UvsGoOnUpToTheSeam) {
    for (const bool per_vertex : {true, false}) {
        MeltingBody body = melting_ball();
        for (const Vec3f& at : body.rest.positions) body.rest.uvs.values.push_back(at.head<2>());
        if (!per_vertex) body.rest.uvs.corners = body.rest.corners;
        body.rest.materials.names = {"skin"};
        body.rest.materials.of_face.assign(body.rest.face_count(), 0);
        body.restored = body.rest;
        melt_above(body, 0.1f);
        const CompositeSurface surface = body.surface().value();
        const Mesh& mesh = surface.mesh;
        EXPECT_EQ(check_mesh(mesh), "");
        ASSERT_EQ(mesh.uvs.corners.size(), mesh.corner_count());
        std::vector<Index> uv_of(mesh.vertex_count(), kNoIndex);
        std::size_t pieces = 0;
        double apart = 0;
        for (std::size_t f = 0; f < mesh.face_count(); ++f)
            for (Index c = mesh.face_offsets[f]; c < mesh.face_offsets[f + 1]; ++c) {
                const Index uv = mesh.uvs.corners[c], v = mesh.corners[c];
                ASSERT_EQ(uv == kNoIndex, mesh.materials.of_face[f] == kNoIndex) << "face " << f;
                if (uv == kNoIndex) continue;
                if (uv_of[v] == kNoIndex) uv_of[v] = uv;
                EXPECT_EQ(uv_of[v], uv) << "vertex " << v;
                if (surface.origin[v] != kNoIndex) {
                    EXPECT_EQ(mesh.uvs.values[uv], Vec2f(body.rest.positions[surface.origin[v]].head<2>()));
                    continue;
                }
                ++pieces;
                apart += double((mesh.uvs.values[uv] - mesh.positions[v].head<2>()).norm());
            }
        EXPECT_GT(pieces, 500u);
        EXPECT_LT(apart / double(pieces), 0.2 * double(kSpacing)); // they fade a little along the surface
    }
}

/// Where the grid lies must not show: its shift by half a cell moves the surface by little.
TEST(CompositeSurface, AnotherGridGivesTheSameSurface) {
    MeltingBody body = melting_ball();
    melt_above(body, 0.1f);
    const double cell = 0.8 * double(kSpacing);
    const Mesh one = body.surface(1, {}, {.shift = {0.37, 0.41, 0.29}}).value().mesh;
    const CompositeSurface other = body.surface(1, {}, {.shift = {0.87, 0.91, 0.79}}).value();
    const std::vector<float> distances = distances_to_surface(other.mesh, one, RunContext(1)).value();
    double kept = 0, seam = 0, matter = 0;
    std::size_t kept_count = 0, seam_count = 0, matter_count = 0;
    for (std::size_t v = 0; v < distances.size(); ++v) {
        const double squared = std::pow(double(distances[v]) / cell, 2);
        const bool is_near_seam = std::abs(other.mesh.positions[v][2] - 0.1f) < 2 * kSpacing;
        double& sum = other.origin[v] != kNoIndex ? kept : is_near_seam ? seam : matter;
        sum += squared;
        ++(other.origin[v] != kNoIndex ? kept_count : is_near_seam ? seam_count : matter_count);
    }
    EXPECT_LT(std::sqrt(kept / double(kept_count)), 0.03);
    EXPECT_LT(std::sqrt(seam / double(seam_count)), 0.11);
    EXPECT_LT(std::sqrt(matter / double(matter_count)), 0.15);
    RecordProperty("kept", std::to_string(std::sqrt(kept / double(kept_count))));
    RecordProperty("seam", std::to_string(std::sqrt(seam / double(seam_count))));
    RecordProperty("matter", std::to_string(std::sqrt(matter / double(matter_count))));
}

TEST(CompositeSurface, TwoMelt) {
    MeltingBody body(make_ball({-0.22, 0, 0}, 0.3));
    const Mesh other = make_ball({0.22, 0, 0}, 0.3);
    const Index first = Index(body.rest.positions.size());
    for (const Vec3f& at : other.positions) body.rest.positions.push_back(at);
    for (std::size_t f = 0; f < other.face_count(); ++f) {
        std::vector<Index> face(other.face(f).begin(), other.face(f).end());
        for (Index& v : face) v += first;
        body.rest.add_face(face);
    }
    body.rest.normals = {};
    body.restored = body.rest;
    body.matter = matter_where(
        [](const Vec3f& at) { return (Vec3f(std::abs(at[0]), at[1], at[2]) - Vec3f(0.22f, 0, 0)).norm() < 0.3f; },
        {0.6f, 0.4f, 0.4f}, 0.3f);
    const auto renewed = [](const Vec3f& at) { return std::clamp(2 - std::abs(at[0]) / 0.06f, 0.0f, 1.0f); };
    body.renewal.clear();
    for (const Vec3f& at : body.rest.positions) body.renewal.push_back(renewed(at));
    for (const Vec3f& at : body.matter.positions) body.matter.renewal.push_back(renewed(at));
    const CompositeSurface surface = body.surface().value();
    checked_volume(surface.mesh);
    EXPECT_EQ(analyse_topology(surface.mesh, RunContext(1)).components, 1u);
    EXPECT_GT(surface.kept_triangles, body.rest.face_count() / 2);
}

TEST(CompositeSurface, SameBytesForAnyThreads) {
    MeltingBody body = melting_ball();
    melt_above(body, 0.1f);
    std::vector<Vec4f> colors;
    for (const Vec3f& at : body.matter.positions) colors.emplace_back(at[0] + 0.5f, at[1] + 0.5f, 0.5f, 1);
    const CompositeSurface one = body.surface(1, colors).value(), two = body.surface(2, colors).value();
    EXPECT_EQ(one.mesh.positions, two.mesh.positions);
    EXPECT_EQ(one.mesh.corners, two.mesh.corners);
    EXPECT_EQ(one.mesh.colors, two.mesh.colors);
    EXPECT_EQ(one.mesh.normals.values, two.mesh.normals.values);
}

TEST(CompositeSurface, OpenMeshesGetASentence) {
    const Result<CompositeMesher> mesher = CompositeMesher::create(make_wavy_plane({.resolution = 8}), RunContext(1));
    ASSERT_FALSE(mesher);
    EXPECT_EQ(mesher.error().code, ErrorCode::unsuitable);
}

} // namespace
} // namespace filigree
