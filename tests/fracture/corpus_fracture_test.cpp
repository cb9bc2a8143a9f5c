#include "cases.h"
#include "filigree/file.h"
#include "filigree/fracture.h"
#include "io/corpus.h"

#include <gtest/gtest.h>

using namespace filigree;
using namespace filigree_test;

TEST(CorpusFracture, EveryReadableMeshBecomesPiecesOrIsRefused) {
    const std::vector<CorpusRow> rows = read_corpus();
    if (rows.empty()) GTEST_SKIP() << "no corpus at " << corpus_folder();
    const RunContext context;
    std::size_t broken = 0;
    for (const CorpusRow& row : rows) {
        SCOPED_TRACE(row.file + " (" + row.what + ")");
        const Result<MeshFile> file = read_mesh(row.path, context);
        if (!file.ok() || (!all_cases() && file->mesh.face_count() > 20'000)) continue;
        const Result<FractureCells> cells = make_fracture_cells(file->mesh, {.pieces = 12}, context);
        const Result<FracturedMesh> pieces =
            cells ? fracture(file->mesh, *cells, {}, context) : Result<FracturedMesh>(cells.error());
        if (!pieces) {
            EXPECT_EQ(pieces.error().code, ErrorCode::unsuitable) << pieces.error().message;
            continue;
        }
        ++broken;
        EXPECT_GT(pieces->pieces, 0u);
        EXPECT_EQ(pieces->report.open_edges, 0u);
        EXPECT_EQ(pieces->report.fan_facets, 0u);
        EXPECT_EQ(check_mesh(pieces->mesh), "");
    }
    EXPECT_GT(broken, 80u);
}
