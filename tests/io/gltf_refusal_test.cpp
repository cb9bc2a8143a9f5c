// glTF that is wrong, hostile, or asks for what we do not have: refused with a sentence, and nothing read from
// elsewhere.
#include "filigree/file.h"
#include "filigree/io/file.h"
#include "filigree/io/gltf.h"
#include "io/gltf_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include <sys/stat.h>
#include <unistd.h>

namespace gltf_refusal_test {

using namespace filigree;
using namespace filigree_test;

namespace {

namespace fs = std::filesystem;

const std::string kTriangleMesh = R"("nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}])";

Error error_of(const std::string& bytes) {
    const Result<MeshFile> file = read_mesh(bytes, "a.gltf", RunContext(1));
    EXPECT_FALSE(file.ok()) << bytes.substr(0, 400);
    return file.ok() ? Error{} : file.error();
}

void expect_refused(const std::string& bytes, const std::string& sentence, ErrorCode code = ErrorCode::bad_file) {
    const Error error = error_of(bytes);
    EXPECT_EQ(error.code, code) << error.message;
    EXPECT_NE(error.message.find(sentence), std::string::npos) << error.message;
    EXPECT_TRUE(error.message.starts_with("a.gltf: ")) << error.message;
    EXPECT_TRUE(error.message.ends_with(".")) << error.message;
}

GltfText triangle() {
    GltfText file;
    file.add(kTriangle, "VEC3");
    return file;
}

/// A folder of its own that is gone afterwards, with a file outside of it.
class GltfFolder : public testing::Test {
protected:
    void SetUp() override {
        std::string name = (fs::temp_directory_path() / "filigree-gltf-XXXXXX").string();
        ASSERT_NE(mkdtemp(name.data()), nullptr);
        top_ = name;
        folder_ = top_ / "scene";
        fs::create_directories(folder_ / "parts");
        bytes_ = triangle().data();
        write(top_ / "secret.bin", bytes_);
        write(folder_ / "parts/my buffer.bin", bytes_);
    }
    void TearDown() override { fs::remove_all(top_); }

    static void write(const fs::path& path, const std::string& bytes) {
        std::ofstream(path, std::ios::binary) << bytes;
    }
    Result<MeshFile> read_with_uri(const std::string& uri) {
        write(folder_ / "a.gltf", triangle().with_buffer("\"uri\":\"" + uri + "\",", kTriangleMesh));
        return read_mesh(folder_ / "a.gltf", RunContext(1));
    }
    void expect_no_way(const std::string& uri, const std::string& sentence) {
        const Result<MeshFile> file = read_with_uri(uri);
        ASSERT_FALSE(file.ok()) << uri;
        EXPECT_NE(file.error().message.find(sentence), std::string::npos) << file.error().message;
        EXPECT_NE(file.error().message.find("buffers[0].uri: "), std::string::npos) << file.error().message;
    }

    fs::path top_, folder_;
    std::string bytes_;
};

} // namespace

TEST_F(GltfFolder, BuffersLieInTheFolderAndBelowIt) {
    for (const char* uri : {"parts/my%20buffer.bin", "parts/my buffer.bin", "./parts/my%20buffer.bin"}) {
        const Result<MeshFile> file = read_with_uri(uri);
        ASSERT_TRUE(file.ok()) << file.error().message;
        EXPECT_EQ(file->mesh.vertex_count(), 3u);
    }
    fs::create_symlink("my buffer.bin", folder_ / "parts/link.bin");
    EXPECT_TRUE(read_with_uri("parts/link.bin").ok());
}

TEST_F(GltfFolder, NothingElsewhereIsRead) {
    expect_no_way("../secret.bin", "leads out of its folder");
    expect_no_way("parts/../../secret.bin", "leads out of its folder");
    expect_no_way("%2e%2e/secret.bin", "leads out of its folder");
    expect_no_way((top_ / "secret.bin").string(), "is an absolute path");
    expect_no_way("file://" + (top_ / "secret.bin").string(), "is not a relative path");
    expect_no_way("http://example.com/a.bin", "is not a relative path");
    expect_no_way("C:/a.bin", "is not a relative path");
    expect_no_way("parts\\\\my buffer.bin", "has a backslash");
    expect_no_way("parts/my buffer.bin\\u0000.png", "has a zero byte");
    expect_no_way("parts/my%20buffer.bin%00", "has a zero byte");
    expect_no_way("", "is empty");
    expect_no_way("none.bin", "there is no file 'none.bin'");
    expect_no_way("parts", "is not a file");
    expect_no_way("a.gltf", "is the glTF file itself");
    expect_no_way("data:application/octet-stream,abc", "is data that is not in base64");
    expect_no_way("data:application/octet-stream;base64,AA!A", "is not of base64");
}

TEST_F(GltfFolder, LinksThatLeadOutAreNotFollowed) {
    fs::create_symlink(top_ / "secret.bin", folder_ / "link.bin");
    expect_no_way("link.bin", "is a link that leads out of its folder");
    fs::create_directory_symlink(top_, folder_ / "door");
    expect_no_way("door/secret.bin", "is a link that leads out of its folder");
}

TEST_F(GltfFolder, PipesAndDevicesAreNotWaitedFor) {
    ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);
    expect_no_way("pipe", "is not a file");
    fs::create_symlink("/dev/zero", folder_ / "zero");
    expect_no_way("zero", "leads out of its folder");
}

TEST_F(GltfFolder, ABufferThatIsCutOff) {
    write(folder_ / "short.bin", bytes_.substr(0, 20));
    const Result<MeshFile> file = read_with_uri("short.bin");
    ASSERT_FALSE(file.ok());
    EXPECT_NE(file.error().message.find("buffers[0].byteLength: is 36, but there are 20 bytes"), std::string::npos)
        << file.error().message;
}

TEST(GltfRefusal, EverySizeIsHeldAgainstTheBytes) {
    const auto with_accessor = [](const std::string& accessor, const std::string& view) {
        return R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":36,"uri":"data:;base64,)" +
               base64(triangle().data()) + R"("}],"bufferViews":[)" + view + R"(],"accessors":[)" + accessor + "]," +
               kTriangleMesh + "}";
    };
    const std::string view = R"({"buffer":0,"byteLength":36})";
    const std::string vec3 = R"({"bufferView":0,"componentType":5126,"type":"VEC3","count":)";
    ASSERT_TRUE(read_mesh(with_accessor(vec3 + "3}", view), "a.gltf", RunContext(1)).ok());
    expect_refused(with_accessor(vec3 + "4}", view), "accessors[0].count: promises 4 elements");
    expect_refused(with_accessor(vec3 + "18446744073709551615}", view), "promises 18446744073709551615");
    expect_refused(with_accessor(vec3 + "1e300}", view), "accessors[0].count: is not a number of 0, 1, 2");
    expect_refused(with_accessor(vec3 + "1e999}", view), "number that is too large");
    expect_refused(with_accessor(vec3 + "-3}", view), "accessors[0].count: is not a number of 0, 1, 2");
    expect_refused(with_accessor(vec3 + "0}", view), "accessors[0].count: is 0");
    expect_refused(with_accessor(vec3 + "3,\"byteOffset\":4}", view), "from byte 4");
    expect_refused(with_accessor(vec3 + "3,\"byteOffset\":18446744073709551604}", view),
                   "from byte 18446744073709551604");
    expect_refused(with_accessor(vec3 + "3}", R"({"buffer":0,"byteLength":37})"),
                   "bufferViews[0]: reaches to byte 0 + 37");
    expect_refused(with_accessor(vec3 + "3}", R"({"buffer":0,"byteLength":36,"byteOffset":18446744073709551612})"),
                   "bufferViews[0]");
    expect_refused(with_accessor(vec3 + "3}", R"({"buffer":0,"byteLength":36,"byteStride":4})"), "a stride of 4");
    expect_refused(with_accessor(vec3 + "3}", R"({"buffer":0,"byteLength":36,"byteStride":18446744073709551615})"),
                   "promises 3 elements");
    expect_refused(with_accessor(vec3 + "3}", R"({"buffer":1,"byteLength":36})"),
                   "bufferViews[0].buffer: refers to number 1");
    expect_refused(with_accessor(R"({"componentType":5126,"type":"VEC3","count":2147483647})", view),
                   "more than the file can mean");
    const auto sparse = [&](const std::string& count, const std::string& more) {
        return with_accessor(vec3 + R"(3,"sparse":{"count":)" + count +
                                 R"(,"indices":{"bufferView":0,"componentType":5121)" + more +
                                 R"(},"values":{"bufferView":0}}})",
                             view);
    };
    expect_refused(sparse("4", ""), "sparse.count: is 4, more than the accessor's 3");
    expect_refused(sparse("2", ""), "sparse.indices: do not ascend"); // the buffer begins with zeros
    expect_refused(sparse("1", ",\"byteOffset\":15"), "sparse.indices: refer to element 63 of 3");
    expect_refused(sparse("1", ",\"byteOffset\":36"), "fewer than the 1 elements");
}

TEST(GltfRefusal, AFileMayNotRepeatItsPartsWithoutEnd) {
    GltfText file;
    file.add(std::vector<float>(3 * 30000, 1.0f), "VEC3");
    std::string nodes;
    for (int n = 0; n < 1000; ++n) nodes += n > 0 ? R"(,{"mesh":0})" : R"({"mesh":0})";
    expect_refused(file.text("\"nodes\":[" + nodes + R"(],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}])"),
                   "repeats the file's parts to more than 16777216 elements", ErrorCode::unsupported);
}

TEST(GltfRefusal, NodesAreATree) {
    const auto with_nodes = [](const std::string& nodes) {
        return triangle().text(R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)" + nodes);
    };
    expect_refused(with_nodes(R"("nodes":[{"mesh":0,"children":[1]},{"children":[0]}])"),
                   "nodes[0]: is among its own descendants");
    expect_refused(with_nodes(R"("nodes":[{"mesh":0,"children":[0]}])"),
                   "nodes[0].children[0]: node 0 is its own child");
    expect_refused(with_nodes(R"("nodes":[{"children":[2]},{"children":[2]},{"mesh":0}])"),
                   "node 2 is a child of two nodes");
    expect_refused(with_nodes(R"("nodes":[{"children":[1]},{"mesh":0}],"scenes":[{"nodes":[1]}])"),
                   "scenes[0].nodes[0]: node 1 is a child of another");
    expect_refused(with_nodes(R"("nodes":[{"mesh":0}],"scenes":[{"nodes":[0,0]}])"), "node 0 comes twice");
    expect_refused(with_nodes(R"("nodes":[{"mesh":1}])"), "nodes[0].mesh: refers to number 1");
    expect_refused(with_nodes(R"("nodes":[{"mesh":0,"scale":[1e39,1e39,1e39]}])"), "32-bit float");
}

TEST(GltfRefusal, DeepNodesNeedNoStack) {
    constexpr int kDepth = 200000;
    std::string nodes;
    for (int n = 0; n < kDepth; ++n) nodes += R"({"translation":[0,0,1],"children":[)" + std::to_string(n + 1) + "]},";
    const Result<MeshFile> file =
        read_mesh(triangle().text(R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[)" + nodes +
                                  R"({"mesh":0}])"),
                  "a.gltf", RunContext(1));
    ASSERT_TRUE(file.ok()) << file.error().message;
    EXPECT_EQ(file->mesh.world_position(0).z(), kDepth);
}

TEST(GltfRefusal, DeepJsonNeedsNoStack) {
    expect_refused("{\"a\":" + std::string(1000000, '['), "nested deeper than 256 brackets");
    expect_refused("{\"a\":" + std::string(200, '[') + std::string(200, ']') + "}", "has no \"asset\"");
}

TEST(GltfRefusal, Containers) {
    const std::string glb = triangle().glb(kTriangleMesh);
    ASSERT_TRUE(read_mesh(glb, "a.gltf", RunContext(1)).ok());
    expect_refused(glb.substr(0, 8), "cut off in its header");
    expect_refused(glb.substr(0, glb.size() - 4), "it is cut off");
    std::string old = glb;
    old[4] = 1;
    expect_refused(old, "GLB of version 1", ErrorCode::unsupported);
    std::string long_chunk = glb;
    long_chunk[15] = '\x7f';
    expect_refused(long_chunk, "chunk 0 says that it has");
    expect_refused(R"({"asset":{"version":"2.0"},)", "JSON is damaged at byte");
    expect_refused(R"({"asset":{"version":"1.0"}})", "glTF 2.0 is read", ErrorCode::unsupported);
    expect_refused(R"({"asset":{"version":"2.0"}})", "has no mesh in its scene");
    expect_refused(
        triangle().text(R"("nodes":[{"mesh":0}],"meshes":[{"primitives":[{"mode":1,"attributes":{"POSITION":0}}]}])"),
        "has nothing but lines in its scene");
}

TEST(GltfRefusal, CompressedDataSaysHowToUnpackIt) {
    const std::string required = R"("extensionsRequired":[")";
    for (const std::string name : {"KHR_draco_mesh_compression", "EXT_meshopt_compression"})
        expect_refused(triangle().text(required + name + "\"]," + kTriangleMesh), "gltf-transform copy",
                       ErrorCode::unsupported);
    expect_refused(triangle().text(required + "ACME_magic\"]," + kTriangleMesh), "'ACME_magic' is not known",
                   ErrorCode::unsupported);

    // only used: what stands beside it is read
    const std::string draco =
        R"("extensionsUsed":["KHR_draco_mesh_compression"],"nodes":[{"mesh":0}],"meshes":[{"primitives":[
        {"attributes":{"POSITION":0},"extensions":{"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0}}}}]}])";
    EXPECT_TRUE(read_mesh(triangle().text(draco), "a.gltf", RunContext(1)).ok());
    GltfText bare;
    bare.add_accessor("", 5126, 3, "VEC3");
    bare.add_view(kTriangle);
    expect_refused(bare.text(draco), "is compressed with Draco", ErrorCode::unsupported);
    expect_refused(
        triangle().with_buffer(R"("extensions":{"EXT_meshopt_compression":{"fallback":true}},)", kTriangleMesh),
        "buffers[0]: is compressed (EXT_meshopt_compression)", ErrorCode::unsupported);
}

TEST(GltfRefusal, SkinsAndMorphTargets) {
    const auto skinned = [](const std::string& weights, const std::string& skin) {
        GltfText file = triangle();
        file.add<std::uint8_t>({0, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0}, 5121, "VEC4");
        file.add({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
        file.add({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2}, "MAT4");
        return file.text(R"("nodes":[{"mesh":0,"skin":0},{}],"skins":[)" + skin +
                         R"(],"meshes":[{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":1)" + weights + "}}]}]");
    };
    expect_refused(skinned(R"(,"WEIGHTS_0":2)", R"({"joints":[1]})"), "has weights for joint 3 of a skin that has 1");
    expect_refused(skinned("", R"({"joints":[1]})"), "JOINTS_0: has no weights beside it");
    expect_refused(skinned(R"(,"WEIGHTS_0":2)", R"({"joints":[2]})"), "skins[0].joints[0]: refers to number 2");
    expect_refused(skinned(R"(,"WEIGHTS_0":2)", R"({"joints":[]})"), "skins[0].joints: has no joints");
    expect_refused(skinned(R"(,"WEIGHTS_0":2)", R"({"joints":[1],"inverseBindMatrices":3})"),
                   "matrix 0 is not finite or has a last row");
    expect_refused(skinned(R"(,"WEIGHTS_0":2)", R"({"joints":[1,0],"inverseBindMatrices":3})"),
                   "has 1 matrices for 2 joints");
    expect_refused(
        triangle().text(
            R"("nodes":[{"mesh":0}],"meshes":[{"weights":[1,2],"primitives":[{"attributes":{"POSITION":0},"targets":[{"POSITION":0}]}]}])"),
        "meshes[0]: has 1 morph targets and 2 weights");
}

TEST(GltfRefusal, MatricesOfJointsThatMoveNothingMayBeDamaged) {
    const std::vector<float> damaged = {0, 0, 0, 0, 1e20f, 2, 0, 7, 0, 0, NAN, 0, 0, 0, 0, 2};
    const std::vector<float> identity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const auto skinned = [&](const std::vector<float>& first, const std::vector<float>& second) {
        std::vector<float> matrices = first;
        matrices.insert(matrices.end(), second.begin(), second.end());
        GltfText file = triangle();
        file.add<std::uint8_t>({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, 5121, "VEC4"); // all by joint 1
        file.add({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
        file.add(matrices, "MAT4");
        return file.text(R"("nodes":[{"mesh":0,"skin":0},{},{}],"skins":[{"joints":[1,2],"inverseBindMatrices":3}],
                          "meshes":[{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":1,"WEIGHTS_0":2}}]}])");
    };
    const auto file = read_mesh(skinned(damaged, identity), "a.gltf", RunContext(1));
    ASSERT_TRUE(file.ok()) << file.error().message;
    ASSERT_EQ(file->warnings.size(), 1u);
    EXPECT_EQ(file->warnings[0],
              "skins[0].inverseBindMatrices: 1 matrix is damaged, of a joint that moves no vertex; left out.");
    const auto plain = read_mesh(skinned(identity, identity), "a.gltf", RunContext(1));
    EXPECT_TRUE(plain->warnings.empty());
    EXPECT_EQ(file->mesh.positions, plain->mesh.positions);
    expect_refused(skinned(identity, damaged), "matrix 1 is not finite or has a last row");
}

TEST(GltfRefusal, Animations) {
    const auto animated = [](const std::vector<float>& times, const std::vector<float>& values, const std::string& type,
                             const std::string& path, const std::string& node = "") {
        GltfText file = triangle();
        file.add(times, "SCALAR");
        file.add(values, type);
        return file.text(R"("nodes":[{"mesh":0)" + node +
                         R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"animations":[
            {"samplers":[{"input":1,"output":2}],"channels":[{"sampler":0,"target":{"node":0,"path":")" +
                         path + R"("}}]}])");
    };
    const std::vector<float> two(6, 1.0f);
    ASSERT_TRUE(read_mesh(animated({0, 1}, two, "VEC3", "scale"), "a.gltf", RunContext(1)).ok());
    expect_refused(animated({1, 1}, two, "VEC3", "scale"), "accessors[1]: key 1 is not after the one before");
    expect_refused(animated({0, NAN}, two, "VEC3", "scale"), "accessors[1]: key 1 is at no finite time");
    expect_refused(animated({0, 1, 2}, two, "VEC3", "scale"), "samplers[0].output: has 2 elements for 3 keys");
    expect_refused(animated({0, 1}, two, "VEC3", "rotation"), "accessors[2].type: is 'VEC3'");
    expect_refused(animated({0, 1}, two, "VEC3", "color"), "target.path: is 'color'");
    expect_refused(animated({0, 1}, {1, 1}, "SCALAR", "weights"), "no morph targets");
    expect_refused(animated({0, 1}, two, "VEC3", "scale", R"(,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1])"),
                   "moves a node that has a matrix");
}

TEST(GltfRefusal, OtherJsonTypes) {
    expect_refused(triangle().text(R"("nodes":{"mesh":0})"), "nodes: is not an array");
    expect_refused(triangle().text(R"("nodes":[3])"), "nodes[0]: is not an object");
    expect_refused(triangle().text(R"("nodes":[{"mesh":"0"}])"), "nodes[0].mesh: is not a number");
    expect_refused(triangle().text(R"("nodes":[{"mesh":0,"scale":[1,2]}],"meshes":[{}])"),
                   "nodes[0].scale: has 2 numbers");
    expect_refused(triangle().text(R"("nodes":[{"mesh":0}],"meshes":[{"primitives":[]}])"),
                   "meshes[0].primitives: has no primitives");
}

} // namespace gltf_refusal_test
