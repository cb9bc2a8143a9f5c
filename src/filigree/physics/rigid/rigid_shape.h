// What a rigid body touches others with: its surface points in a tree, and its distance field. Private to the layer.
#pragma once

#include "filigree/core/bits.h"
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
            const Block& block = blocks_[node.block];
            const std::uint64_t inside = block.in_box(to_other, other.centre_, other.half_.array() + reach);
            for_each_bit(inside, [&](int k) {
                const Vec3f at = to_other(block.point(k));
                if (other.distance(at) < reach) visit(block.numbers[k], block.point(k), at);
            });
        }
    }

private:
    static constexpr float kSteepest = 1.1f; ///< a field's distances on a grid grow hardly faster than this
    static constexpr std::size_t kBlock = 16;
    struct Block { ///< points of a leaf, then points that are nowhere
        float x[kBlock], y[kBlock], z[kBlock];
        Index numbers[kBlock]; ///< among the body's surface points
        Vec3f point(int k) const { return {x[k], y[k], z[k]}; }
        template <class Map>
        std::uint64_t in_box(const Map& map, const Vec3f& centre, const Vec3f& half) const {
            const Mat3f& m = map.turn();
            const Vec3f from = map.shift() - centre;
            return bits_where<kBlock>([&](std::size_t k) __attribute__((always_inline)) {
                const float u = m(0, 0) * x[k] + m(0, 1) * y[k] + m(0, 2) * z[k] + from.x();
                const float v = m(1, 0) * x[k] + m(1, 1) * y[k] + m(1, 2) * z[k] + from.y();
                const float w = m(2, 0) * x[k] + m(2, 1) * y[k] + m(2, 2) * z[k] + from.z();
                return bool((std::abs(u) <= half.x()) & (std::abs(v) <= half.y()) & (std::abs(w) <= half.z()));
            });
        }
    };
    struct Node { ///< after it come those below it
        Vec3f centre;
        float radius;
        Index block; ///< of a leaf
        Index next;  ///< the node after all that are below this one
    };
    void add_node(std::span<Index> numbers);

    const Body& body_;
    Vec3f centre_ = Vec3f::Zero(), half_ = Vec3f::Zero();
    std::vector<Node> nodes_;
    std::vector<Block> blocks_;
};

} // namespace filigree
