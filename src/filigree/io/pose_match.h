// Poses as other programs save them: vertices split for their normals or UVs, in another order, or turned over to
// another axis that is up.
#pragma once

#include "filigree/mesh.h"
#include "filigree/result.h"
#include "filigree/types.h"

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace filigree {

/// Which vertices of a file stand for a driver's.
struct VertexMatch {
    std::vector<Index> source; ///< of each driver vertex, the file's
    /// Vertices of the file that a split made of one: the second is to be where the first is, in every frame.
    std::vector<std::pair<Index, Index>> twins;

    /// Whether it is number by number.
    bool is_plain() const;
    /// The driver's positions of the file's, into `out`. Error: mismatch, where twins part.
    Status apply(std::span<const Vec3f> file, std::span<Vec3f> out, const std::filesystem::path& path) const;

    double tolerance = 0; ///< of places, model units
};

/// By their places at rest: every driver vertex has one of the file at its place, and every one of the file is at one's
/// place. rest, places: in one frame of reference. None where they do not fit. Cost O(V log V).
std::optional<VertexMatch> match_by_place(std::span<const Vec3f> rest, std::span<const Vec3f> places);

/// A moved driver whose vertices were split, made one vertex a place again, in the order in which places first come;
/// none unless these are as many as the driver's and joined by edges as they are. Nothing is known of its rest.
std::optional<VertexMatch> match_by_faces(const Mesh& driver, const Mesh& moved);

/// Positions of a file in which `up` is up, for a model in which the other of y and z is. origin: of the positions.
void turn_up(std::span<Vec3f> positions, const Vec3d& origin, UpAxis up);
Mat3d turn_of(UpAxis up);

/// A sentence where the first frame is the driver at rest turned by a quarter or half turn about an axis; else empty.
std::string turned_first_frame(std::span<const Vec3f> rest, std::span<const Vec3f> first, const Vec3d& origin,
                               const std::filesystem::path& path);

} // namespace filigree
