// Inside a mesh or not: the question about single points.
#pragma once

#include "filigree/sample/sample_inside.h"

namespace filigree {

/// The question about single points, again and again: what InsideSampler answers for the points of a lattice. scan and
/// rays count crossings (`merged`: how often the mesh goes round the point); winding counts those of the mesh closed by
/// cones, less the winding number of the cones.
class InsideTest {
public:
    /// Errors as InsideSampler. Copies what it needs of the mesh. Cost O(F log F).
    static Result<InsideTest> create(const Mesh& mesh, const InsideOptions& options, const RunContext& context);
    InsideTest(InsideTest&&) noexcept = default;
    InsideTest& operator=(InsideTest&&) noexcept = default;

    /// point: relative to the mesh's origin. Safe from many threads.
    bool contains(const Vec3d& point) const;
    /// One 0 or 1 a point. Errors: cancelled.
    Result<std::vector<std::uint8_t>> contains(std::span<const Vec3d> points, const RunContext& context) const;
    InsideMethod used() const { return used_; }
    const OutwardReport& outward() const { return outward_; } ///< what of the mesh counts as turned
    const Closure& closure() const { return closure_; }

private:
    explicit InsideTest(RayParity rays) : rays_(std::move(rays)) {}
    RayParity rays_; ///< of the mesh, with cones where it is open
    std::optional<WindingTree> cones_;
    bool by_parity_ = true;
    InsideMethod used_ = InsideMethod::rays; ///< rays or winding
    OutwardReport outward_;
    Closure closure_;
};

/// Those of the points that are inside, by rays unless the options say how. Errors: as InsideTest.
Result<std::vector<Vec3d>> points_inside(const Mesh& mesh, std::span<const Vec3d> points, InsideOptions options,
                                         const RunContext& context, InsideReport* report = nullptr);

} // namespace filigree
