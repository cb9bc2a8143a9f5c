// Every mesh of the corpus that can be read, good and bad, gets points or a sentence.
#include "filigree/file.h"
#include "filigree/sample.h"
#include "io/corpus.h"

#include <gtest/gtest.h>

using namespace filigree;
using namespace filigree_test;

TEST(InsideCorpus, EveryMeshGetsPointsOrASentence) {
    const std::vector<CorpusRow> corpus = read_corpus();
    if (corpus.empty()) GTEST_SKIP() << "no corpus";
    const RunContext context;
    constexpr std::uintmax_t kMostBytes = 20'000'000;
    std::size_t closed = 0, open = 0;
    for (const CorpusRow& row : corpus) {
        std::error_code missing;
        if (std::filesystem::file_size(row.path, missing) > kMostBytes || missing) continue;
        const Result<MeshFile> file = read_mesh(row.path, context);
        if (!file || file->mesh.vertex_count() == 0) continue;
        SCOPED_TRACE(row.file);
        const Mesh& mesh = file->mesh;
        const Box box = bounds(mesh.positions);
        const Result<Lattice> lattice = make_lattice(box, {.spacing = box.size().maxCoeff() / 20});
        if (!lattice) {
            EXPECT_FALSE(lattice.error().message.empty());
            continue;
        }
        InsideReport report;
        const Result<Occupancy> inside = sample_inside(mesh, *lattice, {}, context, &report);
        if (!inside) {
            EXPECT_EQ(inside.error().code, ErrorCode::unsuitable) << inside.error().message;
            continue;
        }
        const double share = double(inside->count()) / lattice->point_count();
        EXPECT_LE(share, 1);
        if (report.used == InsideMethod::scan) { // closed and oriented: three ways, one answer
            ++closed;
            InsideOptions rays;
            rays.method = InsideMethod::rays;
            EXPECT_EQ(sample_inside(mesh, *lattice, rays, context)->bits, inside->bits);
        } else {
            ++open;
            EXPECT_GE(report.winding.near_half, 0);
            EXPECT_LE(report.winding.near_half, 1);
        }
    }
    EXPECT_GT(closed, 5u);
    EXPECT_GT(open, 5u);
}
