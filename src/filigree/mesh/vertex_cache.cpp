#include "filigree/mesh/vertex_cache.h"

#include <algorithm>
#include <meshoptimizer.h>

namespace filigree {

void order_for_vertex_cache(std::span<Triangle> triangles, std::size_t vertex_count) {
    constexpr unsigned kCacheSize = 32; // vertices
    if (triangles.empty()) return;
    const std::vector<Triangle> before(triangles.begin(), triangles.end());
    meshopt_optimizeVertexCacheFifo(triangles.front().data(), before.front().data(), 3 * before.size(), vertex_count,
                                    kCacheSize);
}

} // namespace filigree
