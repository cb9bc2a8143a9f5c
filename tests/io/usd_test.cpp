// USD text, read back by a reader that knows only the grammar of what is asked for.
#include "filigree/io/file.h"
#include "filigree/io/point_cache.h"
#include "filigree/mesh.h"
#include "threads.h"

#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>

namespace filigree {
namespace {

/// The numbers of the first "[...]" after `label`, whatever brackets and commas stand between them.
std::vector<float> numbers_after(const std::string& text, const std::string& label) {
    std::size_t at = text.find(label);
    EXPECT_NE(at, std::string::npos) << label;
    if (at == std::string::npos) return {};
    at = text.find('[', at + label.size());
    const std::size_t end = text.find(']', at);
    std::vector<float> numbers;
    while (++at < end) {
        if (std::string_view("(), ").find(text[at]) != std::string_view::npos) continue;
        char* after = nullptr;
        numbers.push_back(std::strtof(text.c_str() + at, &after));
        at = std::size_t(after - text.c_str()) - 1;
    }
    return numbers;
}

std::vector<float> flat(std::span<const Vec3f> vectors) {
    std::vector<float> numbers;
    for (const Vec3f& v : vectors) numbers.insert(numbers.end(), v.data(), v.data() + 3);
    return numbers;
}

/// A sheet of two quads with UVs of its corners and a colour a vertex.
Mesh make_sheet() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0.1f}};
    for (const std::array<Index, 4>& quad : {std::array<Index, 4>{0, 1, 4, 3}, {1, 2, 5, 4}}) mesh.add_face(quad);
    mesh.uvs.values = {{0, 0}, {0.5f, 0}, {1, 1}};
    mesh.uvs.corners = {0, 1, 2, 0, 1, 1, 2, 0};
    mesh.colors.assign(6, Vec4f(1, 0.5f, 0, 1));
    return mesh;
}

TEST(Usd, HoldsEveryFrameToTheBit) {
    const Mesh mesh = make_sheet();
    const auto moved = [&](std::size_t frame) {
        std::vector<Vec3f> positions = mesh.positions;
        for (Vec3f& p : positions) p = 1.1f * p + Vec3f(0.1f, -1e-7f, 3e5f) * float(frame);
        return positions;
    };
    const MeshAnimation animation{&mesh, 3, 24, [&](std::size_t frame, std::span<Vec3f> out) -> Status {
                                      const std::vector<Vec3f> positions = moved(frame);
                                      std::copy(positions.begin(), positions.end(), out.begin());
                                      return Success{};
                                  }};
    const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "filigree_usd_test.usda";
    ASSERT_TRUE(write_animation(animation, path, kAllThreads).ok());
    const std::string text = read_file(path).value();
    std::filesystem::remove(path);

    EXPECT_TRUE(text.starts_with("#usda 1.0\n"));
    EXPECT_EQ(std::count(text.begin(), text.end(), '{'), std::count(text.begin(), text.end(), '}'));
    EXPECT_NE(text.find("timeCodesPerSecond = 24\n"), std::string::npos);
    EXPECT_NE(text.find("endTimeCode = 2\n"), std::string::npos);
    EXPECT_EQ(numbers_after(text, "faceVertexCounts = "), (std::vector<float>{4, 4}));
    EXPECT_EQ(numbers_after(text, "faceVertexIndices = "), (std::vector<float>{0, 1, 4, 3, 1, 2, 5, 4}));
    EXPECT_EQ(numbers_after(text, "primvars:st = "), (std::vector<float>{0, 0, 0.5f, 0, 1, 1}));
    EXPECT_EQ(numbers_after(text, "primvars:st:indices = "), (std::vector<float>{0, 1, 2, 0, 1, 1, 2, 0}));
    const std::string points = text.substr(text.find("points.timeSamples"), text.find("extent.timeSamples"));
    const std::string extents = text.substr(text.find("extent.timeSamples"));
    for (std::size_t frame = 0; frame < 3; ++frame) {
        const std::string label = std::to_string(frame) + ": ";
        EXPECT_EQ(numbers_after(points, "\n        " + label), flat(moved(frame)));
        const Box box = bounds(moved(frame));
        const std::vector<Vec3f> corners = {box.min.cast<float>(), box.max.cast<float>()};
        EXPECT_EQ(numbers_after(extents, "\n        " + label), flat(corners));
    }
    const std::vector<float> colors = numbers_after(text, "primvars:displayColor = ");
    ASSERT_GE(colors.size(), 3u);
    EXPECT_FLOAT_EQ(colors[0], 1);
    EXPECT_NEAR(colors[1], 0.21404, 1e-5); // sRGB 0.5, linear
    EXPECT_FLOAT_EQ(colors[2], 0);
}

TEST(Usd, FarFromTheOriginNoDigitIsLost) {
    Mesh mesh = make_sheet();
    mesh.origin = {4e6, -0.1, 5e5 + 1.0 / 3};
    const std::string placed = "    double3 xformOp:translate = (4e+06, -0.1, 500000.3333333333)\n"
                               "    uniform token[] xformOpOrder = [\"xformOp:translate\"]\n";
    const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "filigree_usd_far.usda";
    const MeshAnimation still{&mesh, 1, 24, [&](std::size_t, std::span<Vec3f> out) -> Status {
                                  std::copy(mesh.positions.begin(), mesh.positions.end(), out.begin());
                                  return Success{};
                              }};
    const auto said = write_animation(still, path, kAllThreads);
    ASSERT_TRUE(said.ok());
    EXPECT_TRUE(said->empty());
    std::string text = read_file(path).value();
    EXPECT_NE(text.find(placed), std::string::npos);
    EXPECT_EQ(numbers_after(text, "points.timeSamples = {\n        0: "), flat(mesh.positions));

    const auto moment = [&](std::size_t frame) -> Result<MeshMoment> {
        MeshMoment now{mesh, {}};
        if (frame == 1) now.mesh.origin.x() += 2; // its own is another
        return now;
    };
    std::vector<std::string> warnings;
    ASSERT_TRUE(write_usda_moments({2, 24, moment}, path, warnings, kAllThreads).ok());
    text = read_file(path).value();
    std::filesystem::remove(path);
    EXPECT_NE(text.find(placed), std::string::npos);
    std::vector<Vec3f> later = mesh.positions;
    for (Vec3f& p : later) p.x() += 2;
    const std::string points = text.substr(text.find("points.timeSamples"));
    EXPECT_EQ(numbers_after(points, "\n        0: "), flat(mesh.positions));
    EXPECT_EQ(numbers_after(points, "\n        1: "), flat(later));
}

TEST(Usd, FacesMayChangeInTime) {
    const auto moment = [](std::size_t frame) -> Result<MeshMoment> {
        MeshMoment now;
        now.mesh = make_sheet();
        now.mesh.scalars = {{"origin", {0, 1, 2, 3, 4, -1}}};
        if (frame == 1) { // one quad less
            now.mesh.corners.resize(4);
            now.mesh.face_offsets.pop_back();
        }
        for (Vec3f& p : now.mesh.positions) p.z() += float(frame);
        now.velocities.assign(6, Vec3f(0, 0, float(frame) - 24));
        return now;
    };
    const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "filigree_usd_moments.usda";
    std::vector<std::string> warnings;
    ASSERT_TRUE(write_usda_moments({2, 24, moment}, path, warnings, kAllThreads).ok());
    const std::string text = read_file(path).value();
    EXPECT_EQ(std::count(text.begin(), text.end(), '{'), std::count(text.begin(), text.end(), '}'));
    const auto sample = [&](const std::string& attribute, std::size_t frame) {
        const std::string part = text.substr(text.find(attribute + ".timeSamples"));
        return numbers_after(part, "\n        " + std::to_string(frame) + ": ");
    };
    for (std::size_t frame = 0; frame < 2; ++frame) {
        EXPECT_EQ(sample("points", frame), flat(moment(frame)->mesh.positions));
        EXPECT_EQ(sample("velocities", frame), flat(moment(frame)->velocities));
        EXPECT_EQ(sample("primvars:origin", frame), (std::vector<float>{0, 1, 2, 3, 4, -1}));
        EXPECT_EQ(sample("normals", frame).size(), 18u);
        EXPECT_EQ(sample("primvars:displayColor", frame).size(), 18u);
    }
    EXPECT_EQ(sample("faceVertexCounts", 0), (std::vector<float>{4, 4}));
    EXPECT_EQ(sample("faceVertexCounts", 1), (std::vector<float>{4}));
    EXPECT_EQ(sample("faceVertexIndices", 1), (std::vector<float>{0, 1, 4, 3}));

    // Whole or not at all, and nothing beside it.
    const auto fails = [&](std::size_t frames, const std::function<Result<MeshMoment>(std::size_t)>& given) {
        return write_usda_moments({frames, 24, given}, path, warnings, kAllThreads).error().code;
    };
    EXPECT_EQ(fails(0, moment), ErrorCode::unsuitable);
    EXPECT_EQ(fails(3,
                    [&](std::size_t frame) {
                        auto now = moment(frame);
                        if (frame == 2) now->velocities.clear();
                        return now;
                    }),
              ErrorCode::unsuitable);
    EXPECT_EQ(fails(3,
                    [&](std::size_t frame) {
                        return frame < 2 ? moment(frame) : Result<MeshMoment>(Error{ErrorCode::cancelled, "Stop."});
                    }),
              ErrorCode::cancelled);
    EXPECT_EQ(read_file(path).value(), text);
    std::filesystem::remove(path);
    for (const auto& entry : std::filesystem::directory_iterator(testing::TempDir()))
        EXPECT_FALSE(entry.path().filename().string().starts_with(".filigree-")) << entry.path();
}

} // namespace
} // namespace filigree
