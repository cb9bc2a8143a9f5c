#include "io/corpus.h"

#include "filigree/file.h"
#include "filigree/mesh.h"
#include "io/welded.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

using namespace filigree;
using namespace filigree_test;

namespace {

bool is_of_formats(const CorpusRow& row, std::initializer_list<const char*> endings) {
    std::string ending = row.path.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(), [](char c) { return c < 'a' ? char(c | 32) : c; });
    return std::find(endings.begin(), endings.end(), ending) != endings.end();
}

bool is_gltf(const CorpusRow& row) { return is_of_formats(row, {".gltf", ".glb"}); }

bool is_ours(const CorpusRow& row) { return is_of_formats(row, {".obj", ".ply", ".stl", ".off"}) || is_gltf(row); }

/// The manifest counts every face statement; those with fewer than three corners are left out, with a warning.
const std::set<std::string> kHasShortFaces = {"bad/trimesh/notenoughindices.obj", "bad/assimp/malformed2.obj"};

/// The manifest counts places before nodes have carried the parts to theirs, where fewer of them touch.
const std::set<std::string> kCountedUnplaced = {"bad/trimesh/mode5.gltf"};

/// Accepted with a warning where the manifest wants none: the mesh is right, and we say what of the file is not in it.
const std::map<std::string, std::string> kWarnsMore = {
    {"bad/trimesh/whitespace.off", "faces have a colour"},
    {"bad/gen/ply_double_int_props.ply", "face property 'q'"},
};

/// "accept", "accept with warning" or "clear error". What is wrong with the surface (not with the file) is told by
/// the topology report, so a defect there counts as a warning.
std::string outcome(const Result<MeshFile>& file, const Mesh& mesh, const RunContext& context) {
    if (!file.ok()) return "clear error";
    if (!file->warnings.empty()) return "accept with warning";
    const TopologyReport report = analyse_topology(mesh, context);
    const bool clean = report.is_manifold() && report.is_oriented() && report.degenerate_faces.count == 0 &&
                       report.duplicate_faces.count == 0 && report.duplicate_vertices.count == 0;
    return clean ? "accept" : "accept, with defects";
}

std::string sizes(const Mesh& mesh) {
    std::size_t triangles = 0, quads = 0, others = 0;
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        ++(mesh.face_size(f) == 3 ? triangles : mesh.face_size(f) == 4 ? quads : others);
    return std::to_string(triangles) + "/" + std::to_string(quads) + "/" + std::to_string(others);
}

} // namespace

TEST(Corpus, EveryFileIsReadOrRefusedAsExpected) {
    const std::vector<CorpusRow> rows = read_corpus();
    if (rows.empty()) GTEST_SKIP() << "no corpus at " << corpus_folder();
    const RunContext context;
    std::size_t tried = 0;
    for (const CorpusRow& row : rows) {
        if (!is_ours(row)) continue;
        SCOPED_TRACE(row.file + " (" + row.what + ")");
        ++tried;
        const Result<MeshFile> file = read_mesh(row.path, context);
        const Mesh mesh = !file.ok() ? Mesh() : is_gltf(row) ? welded(file->mesh) : file->mesh;
        const std::string got = outcome(file, mesh, context);
        const bool expected = got == "accept, with defects"
                                  ? row.expects("accept") || row.expects("accept with warning")
                                  : row.expects(got);
        if (const auto more = kWarnsMore.find(row.file); more != kWarnsMore.end()) {
            ASSERT_TRUE(file.ok());
            ASSERT_EQ(file->warnings.size(), 1u);
            EXPECT_NE(file->warnings.front().find(more->second), std::string::npos) << file->warnings.front();
        } else
            EXPECT_TRUE(expected) << "expected " << row.expected << ", got " << got << " "
                                  << (file.ok() ? (file->warnings.empty() ? "" : file->warnings.front())
                                                : file.error().message);
        if (!file.ok()) {
            EXPECT_NE(file.error().message.find(row.path.filename().string()), std::string::npos)
                << file.error().message;
            EXPECT_TRUE(file.error().message.ends_with(".")) << file.error().message;
            continue;
        }
        EXPECT_EQ(check_mesh(file->mesh), "");
        if (!row.vertices.empty() && !kCountedUnplaced.contains(row.file)) {
            EXPECT_EQ(std::to_string(mesh.vertex_count()), row.vertices);
        }
        if (!row.faces.empty() && !kHasShortFaces.contains(row.file)) {
            EXPECT_EQ(std::to_string(mesh.face_count()), row.faces);
        }
        if (!row.sizes.empty()) {
            EXPECT_EQ(sizes(mesh), row.sizes);
        }
    }
    EXPECT_GT(tried, 200u);
}
