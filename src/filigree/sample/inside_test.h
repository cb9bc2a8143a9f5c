// Inside a mesh or not: the question about single points.
#pragma once

#include "filigree/sample/sample_inside.h"

namespace filigree {

/// The question about single points, again and again. scan is answered by rays, which agree with it.
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
    InsideMethod used() const { return rays_ ? InsideMethod::rays : InsideMethod::winding; }

private:
    InsideTest() = default;
    std::optional<RayParity> rays_; ///< one of the two
    std::optional<WindingTree> winding_;
};

/// Those of the points that are inside, by rays unless the options say how. Errors: as InsideTest.
Result<std::vector<Vec3d>> points_inside(const Mesh& mesh, std::span<const Vec3d> points, InsideOptions options,
                                         const RunContext& context, InsideReport* report = nullptr);

} // namespace filigree
