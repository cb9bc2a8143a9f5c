// Signed distance from a mesh, on a grid: what bodies collide with.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/mesh/mesh.h"
#include "filigree/sample/outward.h"

namespace filigree {

/// Distances at the points of a regular grid around a mesh, negative inside, trilinear in between.
class DistanceField {
public:
    struct Sample {
        float distance; ///< m, negative inside
        Vec3f normal;   ///< unit, outward: the direction in which the distance grows
    };

    /// Of a mesh with coordinates times `scale`, relative to the mesh's origin; `spacing` in m (0: a 64th of the
    /// longest side). Inside is told as by InsideMethod::automatic, overlaps merged. outward: what of the mesh counts
    /// as turned. Errors: as InsideTest; unsuitable (more than 2^27 points), cancelled.
    static Result<DistanceField> create(const Mesh& mesh, double scale, double spacing, const RunContext& context,
                                        OutwardReport* outward = nullptr);

    /// Outside the grid a lower bound: the distance to the grid, or what the border's distance leaves of it.
    Sample at(const Vec3f& point) const;
    float distance(const Vec3f& point) const; ///< that of at(point), to rounding, and sooner
    const Box& box() const { return box_; }   ///< of the grid
    /// Leaves what is also inside of another field's body, to `radius` around its surface: the larger distance of both.
    void cut(const DistanceField& other, float radius);

private:
    Box box_;
    Vec3f corner_;
    float spacing_ = 0;
    std::array<std::size_t, 3> counts_ = {};
    std::vector<float> distances_;
};

} // namespace filigree
