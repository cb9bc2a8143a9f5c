// Generalised winding numbers of points [Jacobson et al. 2013]: how often triangles go round a point, open or not.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"

#include <memory>

namespace filigree {

/// Winding numbers of points by a tree of dipoles [Barill et al. 2018]; exact sums near by.
class WindingTree {
public:
    /// accuracy: largest error of a winding number, about, from 0.0001 to 0.1 (measured: a third of it). Copies what it
    /// needs. Without triangles all winding numbers are 0. Cost O(F log F), 1 us a triangle. Errors: cancelled.
    static Result<WindingTree> create(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                      double accuracy, const RunContext& context);
    WindingTree(WindingTree&&) noexcept;
    WindingTree& operator=(WindingTree&&) noexcept;
    ~WindingTree();

    /// Of point + (e, e^2, e^3) where it lies on a triangle, as everywhere in `sample`.
    double winding(const Vec3d& point) const;
    /// Errors: cancelled.
    Result<std::vector<float>> winding(std::span<const Vec3d> points, const RunContext& context) const;

    struct NumberAndDistance {
        double number;
        double distance; ///< no triangle is nearer than this, in half sizes
    };
    NumberAndDistance winding_and_distance(const Vec3d& point) const;
    /// One over half the longest side of the triangles' box, 1 / model units; 1 where they have no extent.
    double inverse_half_size() const;

private:
    struct Content;
    explicit WindingTree(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

} // namespace filigree
