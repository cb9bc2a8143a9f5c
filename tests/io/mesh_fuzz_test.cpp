// Damaged files: whatever happens to the bytes, reading ends soon, with a right mesh or with a sentence.
#include "filigree/file.h"
#include "filigree/io/file.h"
#include "io/corpus.h"
#include "io/sample_meshes.h"

#include <gtest/gtest.h>

#include <chrono>
#include <random>

using namespace filigree;
using namespace filigree_test;

namespace {

constexpr int kMutationsOfOurs = 5000, kMutationsOfCorpus = 60;
constexpr std::size_t kLargestSeed = 8192;  // bytes
constexpr std::chrono::seconds kLongest{2}; // a read of so few bytes takes milliseconds

/// One to four small damages: bits, bytes, numbers, pieces cut, doubled or moved.
std::string mutate(std::string bytes, std::mt19937& random) {
    static const std::string kTokens[] = {
        "-1", "0", "4294967296",         "99999999999999999999", "nan",  "1e999",   "-",  "/", "\\\n", "\n",
        "\r", "#", std::string(1, '\0'), "\xff\xff\xff\xff",     "list", "element", "f ", "v "};
    const auto below = [&](std::size_t n) { return n == 0 ? 0 : random() % n; };
    for (std::size_t damages = 1 + below(4); damages > 0; --damages) {
        const std::size_t at = below(bytes.size()), length = below(std::min<std::size_t>(bytes.size() - at, 40) + 1);
        switch (below(6)) {
        case 0:
            if (!bytes.empty()) bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
            break;
        case 1:
            if (!bytes.empty()) bytes[at] = static_cast<char>(random());
            break;
        case 2:
            bytes.insert(at, kTokens[below(std::size(kTokens))]);
            break;
        case 3:
            bytes.erase(at, length);
            break;
        case 4:
            bytes.insert(below(bytes.size()), bytes.substr(at, length));
            break;
        default:
            bytes.resize(at);
            break;
        }
    }
    return bytes;
}

void expect_right_or_refused(const std::string& bytes, const std::string& name) {
    const auto start = std::chrono::steady_clock::now();
    const Result<MeshFile> file = read_mesh(bytes, name, RunContext(1));
    ASSERT_LT(std::chrono::steady_clock::now() - start, kLongest) << name;
    if (file.ok()) {
        ASSERT_EQ(check_mesh(file->mesh), "") << name;
        std::string again;
        ASSERT_TRUE(write_mesh(file->mesh, MeshFormat::obj, again, {}, RunContext()).ok());
        const Result<MeshFile> back = read_mesh(again, "again.obj", RunContext(1));
        ASSERT_TRUE(back.ok()) << name << ": " << back.error().message;
        ASSERT_EQ(back->mesh.corners, file->mesh.corners) << name;
    } else {
        ASSERT_TRUE(file.error().message.ends_with(".")) << file.error().message;
        ASSERT_LT(file.error().message.size(), 400u);
    }
}

} // namespace

TEST(MeshFuzz, DamagedFilesOfOurWriters) {
    const std::pair<const char*, std::pair<MeshFormat, WriteMeshOptions>> kinds[] = {
        {"a.obj", {MeshFormat::obj, {}}},
        {"a.ply", {MeshFormat::ply, {}}},
        {"a.ply", {MeshFormat::ply, {.big_endian = true}}},
        {"a.ply", {MeshFormat::ply, {.ascii = true}}},
        {"a.stl", {MeshFormat::stl, {}}},
        {"a.stl", {MeshFormat::stl, {.ascii = true}}},
        {"a.off", {MeshFormat::off, {}}},
        {"a.glb", {MeshFormat::gltf, {}}},
    };
    std::mt19937 random(1);
    for (const auto& [name, kind] : kinds) {
        std::vector<std::string> seeds;
        for (const Mesh& mesh :
             {make_plain_mesh(), make_vertex_attribute_mesh(), make_corner_attribute_mesh(), make_far_mesh()})
            ASSERT_TRUE(write_mesh(mesh, kind.first, seeds.emplace_back(), kind.second, RunContext()).ok());
        for (int i = 0; i < kMutationsOfOurs; ++i)
            ASSERT_NO_FATAL_FAILURE(
                expect_right_or_refused(mutate(seeds[static_cast<std::size_t>(i) % seeds.size()], random), name));
    }
}

TEST(MeshFuzz, EveryCutOfASmallFile) {
    for (const MeshFormat format :
         {MeshFormat::obj, MeshFormat::ply, MeshFormat::stl, MeshFormat::off, MeshFormat::gltf}) {
        std::string bytes;
        ASSERT_TRUE(write_mesh(make_vertex_attribute_mesh(), format, bytes, {}, RunContext()).ok());
        for (std::size_t size = 0; size < bytes.size(); ++size)
            ASSERT_NO_FATAL_FAILURE(expect_right_or_refused(bytes.substr(0, size), "standard input"));
    }
}

TEST(MeshFuzz, DamagedFilesOfTheCorpus) {
    const std::vector<CorpusRow> rows = read_corpus();
    if (rows.empty()) GTEST_SKIP() << "no corpus at " << corpus_folder();
    std::mt19937 random(2);
    for (const CorpusRow& row : rows) {
        const Result<std::string> bytes = read_file(row.path);
        if (!bytes.ok() || bytes->size() > kLargestSeed) continue;
        for (int i = 0; i < kMutationsOfCorpus; ++i)
            ASSERT_NO_FATAL_FAILURE(expect_right_or_refused(mutate(*bytes, random), row.path.filename().string()));
    }
}
