// Damaged glTF: whatever happens to its bytes and numbers, reading and evaluating end, with a mesh or with a sentence.
#include "filigree/io/gltf/gltf.h"
#include "filigree/io/system/file.h"
#include "io/corpus.h"
#include "io/gltf_text.h"

#include <gtest/gtest.h>

#include <cctype>
#include <cstdlib>
#include <random>

using namespace filigree;
using namespace filigree_test;

namespace {

/// More in a long run: FILIGREE_FUZZ_TIMES=100.
int times(int usual) {
    const char* const more = std::getenv("FILIGREE_FUZZ_TIMES");
    return usual * (more ? std::max(1, std::atoi(more)) : 1);
}

/// A skinned, morphed, animated scene with a sparse accessor, and everything else that is evaluated.
std::string everything(bool container) {
    GltfText file;
    file.add({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}, "VEC3");
    file.add({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
    file.add<std::uint8_t>({0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, 5121, "VEC4");
    file.add<std::uint16_t>({65535, 0, 0, 0, 32768, 32767, 0, 0, 65535, 0, 0, 0, 65535, 0, 0, 0}, 5123, "VEC4",
                            "\"normalized\":true");
    file.add({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, "MAT4");
    file.add_indices({0, 1, 2, 2, 1, 3});
    file.add({0, 0.5f, 1}, "SCALAR");
    file.add<std::int16_t>({0, 0, 0, 32767, 0, 0, 32767, 0, 0, 0, 0, 32767}, 5122, "VEC4", "\"normalized\":true");
    file.add({0, 1, 0.5f}, "SCALAR");
    file.add(std::vector<float>(27, 0.5f), "VEC3");
    const std::size_t which = file.add_view<std::uint16_t>({1, 3}), values = file.add_view<float>({0, 0, 1, 0, 0, 2});
    file.add_accessor("", 5126, 4, "VEC3",
                      R"("sparse":{"count":2,"indices":{"bufferView":)" + std::to_string(which) +
                          R"(,"componentType":5123},"values":{"bufferView":)" + std::to_string(values) + "}}");
    file.add({0, 0, 1, 0, 0, 1, 1, 1}, "VEC2");
    const std::string rest = R"("scene":0,"scenes":[{"nodes":[0,1]}],"nodes":[{"name":"a","mesh":0,"skin":0},
        {"children":[2,3],"translation":[0,0,1]},{"rotation":[0,0,0,1]},{"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}],
        "skins":[{"joints":[1,2],"inverseBindMatrices":4}],"materials":[{"pbrMetallicRoughness":{"baseColorFactor":[1,0.5,0,1]}}],
        "meshes":[{"weights":[0.5],"primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"JOINTS_0":2,"WEIGHTS_0":3,"TEXCOORD_0":11},
        "indices":5,"material":0,"mode":4,"targets":[{"POSITION":10}]}],"extras":{"filigree":{"vertices":4}}}],
        "animations":[{"samplers":[{"input":6,"output":7},{"input":6,"output":8,"interpolation":"STEP"},
        {"input":6,"output":9,"interpolation":"CUBICSPLINE"}],"channels":[{"sampler":0,"target":{"node":2,"path":"rotation"}},
        {"sampler":1,"target":{"node":0,"path":"weights"}},{"sampler":2,"target":{"node":1,"path":"translation"}}]}])";
    return container ? file.glb(rest) : file.text(rest);
}

/// Puts something else in the place of one of the numbers in the JSON.
std::string replace_number(const std::string& bytes, std::mt19937& random) {
    static const std::string kHostile[] = {"-1",
                                           "0",
                                           "1",
                                           "2",
                                           "3",
                                           "7",
                                           "255",
                                           "65535",
                                           "2147483647",
                                           "4294967295",
                                           "4294967296",
                                           "18446744073709551615",
                                           "9223372036854775807",
                                           "1e300",
                                           "-1e300",
                                           "0.5",
                                           "null",
                                           "true",
                                           "[]",
                                           "{}",
                                           "\"\"",
                                           "[0,0,0,0]",
                                           "1e-320"};
    std::vector<std::pair<std::size_t, std::size_t>> numbers;
    bool in_string = false;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        if (bytes[i] == '"') in_string = !in_string;
        if (in_string || !std::isdigit(static_cast<unsigned char>(bytes[i]))) continue;
        std::size_t end = i;
        while (end < bytes.size() && (std::isdigit(static_cast<unsigned char>(bytes[end])) || bytes[end] == '.')) ++end;
        numbers.emplace_back(i, end - i);
        i = end - 1;
    }
    if (numbers.empty()) return bytes;
    const auto [at, length] = numbers[random() % numbers.size()];
    std::string changed = bytes;
    return changed.replace(at, length, kHostile[random() % std::size(kHostile)]);
}

std::string damage(std::string bytes, std::mt19937& random) {
    for (std::size_t damages = 1 + random() % 3; damages > 0 && !bytes.empty(); --damages) {
        const std::size_t at = random() % bytes.size(),
                          length = random() % std::min<std::size_t>(bytes.size() - at, 40);
        switch (random() % 5) {
        case 0:
            bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
            break;
        case 1:
            bytes[at] = static_cast<char>(random());
            break;
        case 2:
            bytes.erase(at, length);
            break;
        case 3:
            bytes.insert(at, bytes.substr(random() % bytes.size(), length));
            break;
        default:
            bytes.resize(at);
            break;
        }
    }
    return bytes;
}

/// Reads and plays. Returns whether it could be read.
bool read_and_play(const std::string& bytes) {
    const RunContext context(1);
    const Result<GltfScene> scene = GltfScene::read(bytes, "standard input", context);
    if (!scene) {
        EXPECT_TRUE(scene.error().message.ends_with(".")) << scene.error().message;
        EXPECT_LT(scene.error().message.size(), 400u);
        return false;
    }
    EXPECT_EQ(check_mesh(scene->mesh()), "");
    for (std::size_t a = 0; a < std::min<std::size_t>(scene->animations().size(), 2); ++a)
        for (const double seconds : {0.0, 0.3, scene->animations()[a].last_key}) {
            const Result<Mesh> mesh = scene->mesh_at(a, seconds, context);
            if (mesh)
                EXPECT_EQ(check_mesh(*mesh), "");
            else
                EXPECT_TRUE(mesh.error().message.ends_with(".")) << mesh.error().message;
        }
    return true;
}

} // namespace

TEST(GltfFuzz, TheUndamagedSceneIsRead) {
    EXPECT_TRUE(read_and_play(everything(false)));
    EXPECT_TRUE(read_and_play(everything(true)));
}

TEST(GltfFuzz, HostileNumbers) {
    std::mt19937 random(7);
    const std::string text = everything(false);
    int read = 0;
    for (int i = 0; i < times(4000); ++i) {
        std::string bytes = replace_number(text, random);
        if (random() % 2 == 0) bytes = replace_number(bytes, random);
        read += read_and_play(bytes);
    }
    EXPECT_GT(read, 100); // not everything is refused
}

TEST(GltfFuzz, DamagedBytes) {
    std::mt19937 random(8);
    const std::string seeds[] = {everything(false), everything(true)};
    for (int i = 0; i < times(4000); ++i) read_and_play(damage(seeds[i % 2], random));
}

TEST(GltfFuzz, DamagedBuffers) {
    std::mt19937 random(9);
    const std::string seed = everything(true);
    const std::size_t data = seed.find(std::string_view("BIN\0", 4)) + 4;
    for (int i = 0; i < times(2000); ++i) {
        std::string bytes = seed;
        for (int k = 0; k < 4; ++k) bytes[data + random() % (bytes.size() - data)] = static_cast<char>(random());
        read_and_play(bytes);
    }
}

TEST(GltfFuzz, EveryCut) {
    const std::string seed = everything(true);
    for (std::size_t size = 0; size < seed.size(); ++size) ASSERT_FALSE(read_and_play(seed.substr(0, size))) << size;
}

TEST(GltfFuzz, DamagedFilesOfTheCorpus) {
    constexpr std::size_t kLargestSeed = 8192;
    std::mt19937 random(10);
    std::size_t tried = 0;
    for (const CorpusRow& row : read_corpus()) {
        const std::string ending = row.path.extension().string();
        const Result<std::string> bytes = read_file(row.path);
        if ((ending != ".gltf" && ending != ".glb") || !bytes || bytes->size() > kLargestSeed) continue;
        ++tried;
        for (int i = 0; i < times(20); ++i)
            read_and_play(i % 2 ? replace_number(*bytes, random) : damage(*bytes, random));
    }
    if (tried == 0) GTEST_SKIP() << "no corpus at " << corpus_folder();
}
