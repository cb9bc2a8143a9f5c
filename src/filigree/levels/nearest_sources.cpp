#include "filigree/levels/nearest_sources.h"

#include <algorithm>

namespace filigree {

std::vector<Index> nearest_sources(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                   const IndexLists& around, const std::vector<bool>& is_source) {
    std::vector<Index> source(positions.size(), kNoIndex);
    std::vector<float> distance(positions.size(), std::numeric_limits<float>::infinity());
    double length = 0;
    for (const Triangle& t : triangles) length += double((positions[t[1]] - positions[t[0]]).norm());
    const float width = static_cast<float>(length / double(std::max<std::size_t>(triangles.size(), 1)));
    if (!(width > 0)) return source;

    constexpr float kLastBucket = 65535; // paths of more mean edges than this share one bucket
    std::vector<std::vector<Index>> buckets(1);
    for (Index v = 0; v < positions.size(); ++v)
        if (is_source[v]) {
            distance[v] = 0;
            source[v] = v;
            buckets[0].push_back(v);
        }
    std::vector<Index> current;
    std::vector<float> spread_at(positions.size(), -1); // the distance a vertex last passed on
    for (std::size_t b = 0; b < buckets.size(); ++b)
        while (!buckets[b].empty()) {
            current.clear();
            current.swap(buckets[b]);
            for (Index v : current) {
                const float d = distance[v];
                if (static_cast<std::size_t>(std::min(d / width, kLastBucket)) != b) continue; // came closer since
                if (spread_at[v] == d) continue;                                               // twice in the bucket
                spread_at[v] = d;
                for (Index t : around[v])
                    for (Index w : triangles[t]) {
                        if (d >= distance[w]) continue; // most neighbours, without a look at where they are
                        const float through = d + (positions[w] - positions[v]).norm();
                        if (!(through < distance[w])) continue;
                        distance[w] = through;
                        source[w] = source[v];
                        const auto bucket = static_cast<std::size_t>(std::min(through / width, kLastBucket));
                        if (bucket >= buckets.size()) buckets.resize(bucket + 1);
                        buckets[bucket].push_back(w);
                    }
            }
        }
    return source;
}

} // namespace filigree
