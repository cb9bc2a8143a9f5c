// Inside or not by the parity of crossings from an eye: the report's way (2.2), made exact.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"
#include "filigree/sample/exact_sign.h"

#include <memory>
#include <optional>

namespace filigree {

/// Counts how often the segment from an eye to a point crosses the mesh. For each triangle the plane and side tests of
/// the report's eq. 2.2 to 2.6 are made as exact signs; the point counts as moved by (e, e^2, e^3), so a hit on an edge
/// or a vertex counts once where the ray pierces and an even number of times where it grazes, without a list of cases.
/// The same answer as scan_inside for every eye. A wide tree over the triangles; queries from many threads are safe.
class RayParity {
public:
    /// eye: not on the surface; unset: far outside the box, in no special place. An eye inside is noticed, and all
    /// answers turned round. Copies what it needs. Cost O(F log F).
    /// Errors: unsuitable (the eye lies on the surface, or is not within the range of exact_sign.h; no triangles),
    /// cancelled.
    static Result<RayParity> create(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                    const std::optional<Vec3d>& eye, const RunContext& context);
    RayParity(RayParity&&) noexcept;
    RayParity& operator=(RayParity&&) noexcept;
    ~RayParity();

    using Count = RayReport;
    /// Points outside the mesh's box, and those that are no numbers, are outside without a count. Adds to `count`.
    bool contains(const Vec3d& point, Count* count = nullptr) const { return crossings(point, count).is_odd; }

    struct Crossings {
        bool is_odd = false;      ///< inside by parity
        std::int64_t winding = 0; ///< how often the triangles, closed and facing one way, go round the point
    };
    /// The same, with the winding number: a whole number, and scan_winding's for every eye.
    Crossings crossings(const Vec3d& point, Count* count = nullptr) const;
    /// One 0 or 1 a point; merged: by winding numbers of 1 and more. Errors: cancelled.
    Result<std::vector<std::uint8_t>> contains(std::span<const Vec3d> points, const RunContext& context,
                                               Count* count = nullptr, bool merged = false) const;
    const Vec3d& eye() const;

private:
    struct Content;
    explicit RayParity(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

} // namespace filigree
