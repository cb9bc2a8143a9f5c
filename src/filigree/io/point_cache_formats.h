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
Status write_mdd(const MeshAnimation& animation, const WorldPositions& positions, const std::filesystem::path& path,
                 const RunContext& context);

/// The rate where nothing says another, frames a second.
inline constexpr double kUnsaidRate = 60;

} // namespace filigree
