// Every closed good mesh of the corpus, molten in places: closed, manifold and oriented.
#include "matter.h"

#include "filigree/file.h"
#include "filigree/melting/composite_surface.h"
#include "filigree/physics/body.h"
#include "io/corpus.h"

namespace filigree {
namespace {

using namespace filigree_test;

/// Carries a body's matter and its mesh along, stretched and thrown about where they are new.
void melt(const Mesh& mesh, const Body& body, std::uint64_t seed) {
    Dice dice{seed};
    const Box box = bounds(mesh.positions);
    const float diagonal = float(box.diagonal());
    MatterParticles matter;
    matter.spacing = float(body.spacing());
    for (std::size_t p = 0; p < body.particle_count(); ++p) matter.positions.push_back(body.rest[p]);
    matter.volumes = body.volume;
    matter.renewal.assign(matter.positions.size(), 0);
    Mesh restored = mesh;
    restored.origin = Vec3d::Zero();
    std::vector<float> renewal(mesh.positions.size(), 0);
    for (int place = 0; place < 2; ++place) {
        const Vec3f centre =
            box.min.cast<float>() + dice.point().cwiseProduct((box.max - box.min).cast<float>().eval());
        const float radius = diagonal * (0.1f + 0.2f * dice.roll());
        const Vec3f drift = 0.1f * diagonal * (dice.point() - Vec3f::Constant(0.5f));
        const auto renewed = [&](const Vec3f& at) {
            return std::clamp(1.5f - (at - centre).norm() / radius, 0.0f, 1.0f);
        };
        for (std::size_t v = 0; v < renewal.size(); ++v) {
            const float part = renewed(mesh.positions[v]);
            renewal[v] = std::max(renewal[v], part);
            restored.positions[v] += part * drift;
        }
        for (std::size_t p = 0; p < matter.positions.size(); ++p) {
            const float part = renewed(body.rest[p]);
            matter.renewal[p] = std::max(matter.renewal[p], part);
            matter.positions[p] += part * drift;
        }
    }
    const RunContext context(1);
    const CompositeMesher mesher = CompositeMesher::create(mesh, context).value();
    const ParticleField field = make_particle_field(matter, {}, context).value();
    std::vector<std::uint8_t> dead;
    const CompositeSurface surface = mesher.make(restored, renewal, matter, {}, field, dead, context).value();
    // Vertices at one place are one, as where the mesh has a seam of texture.
    EXPECT_TRUE(CompositeMesher::create(surface.mesh, context)) << "is open or not manifold";
    EXPECT_EQ(check_mesh(surface.mesh), "");
}

TEST(CorpusMelting, IsClosedManifoldAndOriented) {
    const std::vector<CorpusRow> rows = read_corpus();
    if (rows.empty()) GTEST_SKIP() << "There is no corpus at " << corpus_folder() << ".";
    const RunContext context(1);
    std::size_t molten = 0;
    for (const CorpusRow& row : rows) {
        if (!row.file.starts_with("good/")) continue;
        const Result<MeshFile> file = read_mesh(row.path, context);
        if (!file || !CompositeMesher::create(file->mesh, context)) continue;
        SCOPED_TRACE(row.file);
        Mesh mesh = file->mesh;
        mesh.origin = Vec3d::Zero();
        BodyOptions options;
        options.cells.count = 2000;
        const Result<Body> body = make_body(mesh, {.model = MaterialModel::mpm}, options, context);
        if (!body) continue; // too thin for cells
        for (std::uint64_t seed = 1; seed <= 2; ++seed) melt(mesh, *body, seed);
        ++molten;
    }
    EXPECT_GE(molten, 8u);
}

} // namespace
} // namespace filigree
