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

/// A name with a place for a number: "moved_####.ply", "moved_%04d.ply".
struct NumberedName {
    std::filesystem::path folder;
    std::string before, after; ///< around the number
    std::size_t digits = 4;    ///< at least

    std::filesystem::path file(std::size_t number) const;
};
/// None where the name has no such place.
std::optional<NumberedName> numbered_name(const std::filesystem::path& path);

/// A file name's ending in lower case, with the dot.
std::string lower_ending(const std::filesystem::path& path);

/// The rate where nothing says another, frames a second.
inline constexpr double kUnsaidRate = 60;

} // namespace filigree
