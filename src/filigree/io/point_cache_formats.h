// What the readers and writers behind point_cache.h tell each other.
#pragma once

#include "filigree/io/point_cache.h"

#include <cstdint>

namespace filigree {

/// World positions in a file; `rest` of the animation is not set. They are finite. frames_per_second: the rate of a
/// file that does not say one, and instead of what an MDD says. The number of points must be as said.
Result<MeshAnimation> open_pc2(const std::filesystem::path& path, std::size_t points,
                               std::optional<double> frames_per_second);
Result<MeshAnimation> open_mdd(const std::filesystem::path& path, std::size_t points,
                               std::optional<double> frames_per_second);

Result<FrameSource<Pose>> open_numbered(const std::filesystem::path& path, std::size_t points, const Vec3d& origin,
                                        const PoseFileOptions& options, const RunContext& context);
Result<FrameSource<Pose>> open_gltf_poses(const std::filesystem::path& path, std::size_t points, const Vec3d& origin,
                                          const PoseFileOptions& options, const RunContext& context);

// Writers of one format; the animation's positions are as the file is to hold them.
Status write_pc2(const MeshAnimation& animation, const std::filesystem::path& path, const RunContext& context);
inline constexpr std::uint64_t kPc2HeaderBytes = 32;
/// The first bytes of a PC2, frames behind them. Errors: unsupported (more than its 32-bit numbers hold).
Result<std::string> pc2_header(std::size_t frames, std::size_t points, const std::filesystem::path& path);
/// Writes bytes somewhere in a file.
using WriteAt = std::function<Status(std::uint64_t offset, std::string_view bytes)>;
/// write_animation_chunk, whatever makes the frames: fill writes those from first to last - 1 into the file.
Result<ChunkReport>
write_shared_pc2(std::size_t frames, std::size_t points, const std::filesystem::path& path, const WorkChunk& chunk,
                 const std::function<Status(std::size_t first, std::size_t last, const WriteAt& write_at)>& fill);
Status write_mdd(const MeshAnimation& animation, const std::filesystem::path& path, const RunContext& context);

/// Adds the origin, checks, and keeps account of the digits that 32 bits lose. origin: of the mesh, or zero where the
/// format has a place for it. animation must outlive it.
class CheckedFrames {
public:
    CheckedFrames(const MeshAnimation& animation, std::filesystem::path path, const Vec3d& origin)
        : animation_(animation), path_(std::move(path)), origin_(origin) {}

    Status fetch(std::size_t frame, std::span<Vec3f> positions);
    /// The animation whose positions `fetch` writes. This must outlive it.
    MeshAnimation animation();
    void warn(std::vector<std::string>& warnings) const;

private:
    const MeshAnimation& animation_;
    std::filesystem::path path_;
    Vec3d origin_;
    double lost_ = 0;
};

/// The rate where nothing says another, frames a second.
inline constexpr double kUnsaidRate = 60;

} // namespace filigree
