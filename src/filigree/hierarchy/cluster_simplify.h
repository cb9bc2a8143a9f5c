// The first levels of large meshes: many clusters simplified at the same time, whose borders move every round.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/hierarchy/bind.h"
#include "filigree/hierarchy/simplify.h"

#include <optional>

namespace filigree {

/// Takes a mesh down level by level. Where a cluster touches others its vertices stay, for this round; the lattice that
/// the clusters are cut by is another one each time. Parts of fewer than kSmallPart vertices stay as they are, as
/// clusters would take them away.
class ClusterSimplifier {
public:
    static constexpr std::size_t kSmallPart = 1'000;

    /// positions: of all vertices, of which later triangles use fewer and fewer.
    explicit ClusterSimplifier(std::span<const Vec3f> positions) : positions_(positions) {}

    /// One level of about `target` vertices, of triangles over welded vertices. max_error: model units, as of
    /// Simplified::error. None: clusters do not get there (small parts, fans of thousands of triangles, all in one
    /// place), and one piece has to. Cost O(F). Same bytes for any number of threads. Cancelled: none.
    std::optional<Simplified> simplify(std::span<const Triangle> triangles, std::size_t target, double max_error,
                                       const RunContext& context);

    /// What was removed; empty before the first round.
    RemovedVertices take_removed() { return std::move(removed_); }

private:
    std::span<const Vec3f> positions_;
    RemovedVertices removed_;
    std::uint8_t round_ = 0;
};

} // namespace filigree
