// Our detail code: each vertex hangs on one driver cell (a triangle of the driver; where the driver has no faces, a
// single vertex named three times) and follows its gradients.
//
// Driver vertex i rests at c_i and goes to c_i' with gradient A_i; a vertex p hangs at m = sum b_i c_i. The Hermite
// blend
//     p' = sum b_i [c_i' + 1/2 (A_i + A_p)(p - c_i)],  A_p = sum b_i A_i
// is linear-blend skinning of a shifted rest point:
//     q = p - m / 2,  t_i = c_i' - A_i c_i / 2,  p' = sum b_i t_i + (sum b_i A_i) q
// Affine deformations are exact; for curved ones the error is of second order in |p - m|, the detail's own height.
#pragma once

#include "filigree/strip.h"

#include "filigree/blend/bind.h"
#include "filigree/context.h"

#include <array>
#include <cstdint>
#include <memory>

struct flg_transform; // runtime/rt_kernel.h

namespace filigree {

namespace blend_kernel {
struct Records;
} // namespace blend_kernel

/// Sorts bonds, one a vertex of the mesh, into records. Cost O(V).
BlendDetail encode_blend(std::vector<Triangle> cells, const Binding& binding);

/// How space is deformed around each vertex of the mesh: A_p above. driver_gradients: one a driver vertex. Cost O(V).
std::vector<Mat3f> vertex_gradients(const BlendDetail& detail, std::span<const Mat3f> driver_gradients);

/// Restores chosen vertices, and normals, from positions and gradients, again and again.
class BlendRestorer {
public:
    /// One thing to restore: a vertex's position into `slot`, and with `normals` its rest normal into the same slot.
    struct Item {
        Index vertex, slot;
    };
    /// positions: the mesh's at rest. items: what to restore. normals: empty or the unit rest normal of each item.
    /// Cost O(V), most of it on all threads; same bytes for any number of them.
    BlendRestorer(const BlendDetail& detail, std::span<const Vec3f> positions, std::span<const Index> driver,
                  std::span<const Item> items, std::span<const Vec3f> normals, const RunContext& context);
    ~BlendRestorer();
    BlendRestorer(BlendRestorer&&) noexcept;
    BlendRestorer& operator=(BlendRestorer&&) noexcept;

    /// The slot of each record, in record order: what a vertex buffer in record order is indexed through.
    std::span<const Index> slots() const;

    /// driver_positions, gradients: one a driver vertex. out_positions, out_normals: empty (not wanted) or one an item;
    /// by slot when in_order, else in record order, which is faster. Same bytes for any thread count.
    void restore(std::span<const Vec3f> driver_positions, std::span<const Mat3f> gradients,
                 std::span<Vec3f> out_positions, std::span<Vec3f> out_normals, bool in_order,
                 const RunContext& context) const;

    /// What restore hands to the kernel, for kernels elsewhere (the GPU's): everything that stays, what a pose gives
    /// (one a driver vertex), and the power of two that restored positions are multiplied with.
    const blend_kernel::Records& records() const;
    std::vector<flg_transform> transforms(std::span<const Vec3f> driver_positions, std::span<const Mat3f> gradients,
                                          const RunContext& context) const;
    float output_scale() const;

private:
    struct Content;
    std::unique_ptr<Content> content_;
};

} // namespace filigree
