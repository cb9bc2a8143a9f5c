// Readers of poses and point caches: whatever the bytes, frames of as many points as were asked for, or a sentence.
#include "fuzz.h"
#include "temporary.h"

#include "filigree/io/animation/point_cache.h"
#include "filigree/mesh.h"

#include <algorithm>

using namespace filigree_fuzz;

namespace {

constexpr const char* kNames[] = {".pc2", ".mdd", ".glb", ".fil", ".usda"};

} // namespace

namespace filigree_fuzz {

/// The first byte is the format that the name says, the second how many points are asked for.
std::vector<std::string> seeds() {
    std::vector<std::string> all;
    const Mesh mesh = make_wavy_sphere({.resolution = 2});
    MeshAnimation animation;
    animation.rest = &mesh;
    animation.frames = 3;
    animation.frames_per_second = 24;
    animation.positions = [&](std::size_t, std::span<Vec3f> positions) -> Status {
        std::ranges::copy(mesh.positions, positions.begin());
        return Success{};
    };
    for (const int k : {0, 1, 2, 4}) {
        const TemporaryFile file(kNames[std::size_t(k)]);
        if (write_animation(animation, file.path(), kContext))
            all.push_back(std::string({char(k), char(mesh.vertex_count())}) + file.bytes());
    }
    return all;
}

} // namespace filigree_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Bytes bytes(data, size);
    const TemporaryFile file(kNames[bytes.byte() % std::size(kNames)]);
    const std::size_t points = bytes.byte();
    file.write(bytes.rest());
    const Result<FrameSource<Pose>> poses = open_poses(file.path(), points, Vec3d::Zero(), {}, kContext);
    if (!is_sound(poses)) return 0;
    for (std::size_t frame = 0; frame < std::min<std::size_t>(poses->frames, 3); ++frame) {
        const Result<Pose> pose = poses->frame(frame);
        if (is_sound(pose)) require(pose->positions.size() == points, "a pose has as many points as were asked for");
    }
    return 0;
}
