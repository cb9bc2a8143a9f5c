// What a rigid body touches others with: its surface points in a tree, and its distance field. Private to the layer.
#pragma once

#include "filigree/physics/body.h"

#include <algorithm>
#include <span>
#include <vector>

namespace filigree {

/// In the axes of the body at rest. Does not change while the body moves.
class RigidShape {
public:
    explicit RigidShape(const Body& body); ///< body: outlives this

    const Body& body() const { return body_; }
    bool has_field() const { return body_.field != nullptr; }
    /// m outside of the surface, below 0 inside, and the normal.
    DistanceField::Sample surface(const Vec3f& at) const {
        DistanceField::Sample sample = body_.field->at(at);
        sample.distance -= body_.field_radius;
        return sample;
    }
    /// The same. entry: the normal where a point came in, or zero: past the middle of a thin part it goes back.
    DistanceField::Sample surface(const Vec3f& at, const Vec3f& entry) const;
    /// How far along `way` (m) a point goes that starts outside until it touches, 0 to 1; above 1: it does not.
    float first_touch(const Vec3f& from, const Vec3f& way) const;

    const Vec3f& centre() const { return centre_; } ///< of the box of all that may touch
    const Vec3f& half() const { return half_; }     ///< of its sides

    float distance(const Vec3f& at) const { return body_.field->distance(at) - body_.field_radius; } ///< of surface
    bool is_outside_box(const Vec3f& at, float reach) const { ///< further than reach from it
        return (((at - centre_).cwiseAbs() - half_).array() > reach).any();
    }

    /// Calls visit(number, point, at) for the surface points that lie nearer than `reach` (m) to another shape.
    /// to_other: where a point lies in the other's axes; at: that.
    template <class Map, class Visit>
    void each_near(const RigidShape& other, const Map& to_other, float reach, const Visit& visit) const {
        for (std::size_t n = 0; n < nodes_.size();) {
            const Node& node = nodes_[n];
            const Vec3f centre = to_other(node.centre);
            if (other.is_outside_box(centre, reach + node.radius) ||
                other.distance(centre) > reach + kSteepest * node.radius) {
                n = node.next;
                continue;
            }
            if (node.next != ++n) continue;
            for (Index k = node.first; k < node.last; ++k) {
                const Vec3f at = to_other(points_[k]);
                if (!other.is_outside_box(at, reach) && other.distance(at) < reach) visit(numbers_[k], points_[k], at);
            }
        }
    }

private:
    static constexpr float kSteepest = 1.1f; ///< a field's distances on a grid grow hardly faster than this
    struct Node {                            ///< after it come those below it
        Vec3f centre;
        float radius;
        Index first, last; ///< of the points
        Index next;        ///< the node after all that are below this one
    };
    void add_node(Index first, Index last);

    const Body& body_;
    Vec3f centre_ = Vec3f::Zero(), half_ = Vec3f::Zero();
    std::vector<Vec3f> points_;
    std::vector<Index> numbers_; ///< of the points, among the body's surface points
    std::vector<Node> nodes_;
};

} // namespace filigree
