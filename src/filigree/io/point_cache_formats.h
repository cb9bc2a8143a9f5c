// What the readers and writers behind point_cache.h tell each other.
#pragma once

#include "filigree/io/point_cache.h"

#include <cstdint>

namespace filigree {

/// World positions in a file, fetched by frame.
struct PointSource {
    std::size_t frames = 0;
    double frames_per_second = 60;
    /// Writes a frame's positions, one a point, as the file has them. They are finite.
    std::function<Status(std::size_t frame, std::span<Vec3f> positions)> positions;
};

/// frames_per_second: as in PoseFileOptions. The number of points must be as said.
Result<PointSource> open_pc2(const std::filesystem::path& path, std::size_t points,
                             std::optional<double> frames_per_second);
Result<PointSource> open_mdd(const std::filesystem::path& path, std::size_t points,
                             std::optional<double> frames_per_second);

Result<PoseStream> open_numbered(const std::filesystem::path& path, std::size_t points, const Vec3d& origin,
                                 const PoseFileOptions& options, const RunContext& context);
Result<PoseStream> open_gltf_poses(const std::filesystem::path& path, std::size_t points, const Vec3d& origin,
                                   const PoseFileOptions& options, const RunContext& context);

/// Writes a frame's positions in the world. Errors: also unsuitable, where one is not finite.
using WorldPositions = std::function<Status(std::size_t frame, std::span<Vec3f> positions)>;

Status write_pc2(const MeshAnimation& animation, const WorldPositions& positions, const std::filesystem::path& path,
                 const RunContext& context);
/// The first bytes of a PC2, frames behind them. Errors: unsuitable (more than its 32-bit numbers hold).
Result<std::string> pc2_header(const MeshAnimation& animation, const std::filesystem::path& path);
Status write_mdd(const MeshAnimation& animation, const WorldPositions& positions, const std::filesystem::path& path,
                 const RunContext& context);

/// Adds the origin, checks, and keeps account of the digits that 32 bits lose. animation must outlive it.
class WorldFrames {
public:
    WorldFrames(const MeshAnimation& animation, std::filesystem::path path)
        : animation_(animation), path_(std::move(path)) {}

    Status fetch(std::size_t frame, std::span<Vec3f> positions);
    void warn(std::vector<std::string>& warnings) const;

private:
    const MeshAnimation& animation_;
    std::filesystem::path path_;
    double lost_ = 0;
};

/// The rate where nothing says another, frames a second.
inline constexpr double kUnsaidRate = 60;

} // namespace filigree
