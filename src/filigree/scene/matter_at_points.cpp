#include "filigree/scene/matter_at_points.h"

#include "filigree/melting/search_boxes.h"

#include <algorithm>
#include <limits>

namespace filigree {

namespace {

/// Finds the particles around a place.
class ParticlesNear {
public:
    ParticlesNear(const std::vector<Vec3f>& positions, double spacing)
        : positions_(positions), width_(1.5 * spacing), boxes_(positions, width_) {}

    /// The four nearest, farther ones with less share; fewer where there are no more.
    void find(const Vec3f& at, std::array<Index, 4>& particles, std::array<float, 4>& shares) const {
        std::array<std::pair<float, Index>, 4> nearest;
        nearest.fill({std::numeric_limits<float>::infinity(), kNoIndex});
        const Vec3d scaled = (at.cast<double>() / width_).array().floor();
        // A ring of boxes more than where the first was found, as a nearer one may be there.
        for (int ring = 0, last = kMostRings; ring <= last; ++ring) {
            for_ring(scaled, ring, [&](Index particle) {
                const std::pair<float, Index> found = {(positions_[particle] - at).squaredNorm(), particle};
                if (!(found < nearest.back())) return;
                nearest.back() = found;
                std::sort(nearest.begin(), nearest.end());
            });
            if (last == kMostRings && nearest[0].second != kNoIndex) last = std::min(ring + 1, kMostRings - 1);
        }
        const float softening = float(0.01 * width_ * width_);
        float sum = 0;
        for (std::size_t k = 0; k < 4; ++k) {
            particles[k] = nearest[k].second == kNoIndex ? 0 : nearest[k].second;
            shares[k] = nearest[k].second == kNoIndex ? 0 : 1 / (nearest[k].first + softening);
            sum += shares[k];
        }
        for (float& share : shares) share = sum > 0 ? share / sum : 0;
    }

private:
    static constexpr int kMostRings = 40; ///< of boxes; a vertex so far from all matter counts as old

    template <class Visit>
    void for_ring(const Vec3d& middle, int ring, const Visit& visit) const {
        for (int z = -ring; z <= ring; ++z)
            for (int y = -ring; y <= ring; ++y) {
                const bool is_whole_row = std::abs(z) == ring || std::abs(y) == ring;
                for (int x = -ring; x <= ring; x += is_whole_row || ring == 0 ? 1 : 2 * ring) {
                    const Index box = boxes_.lookup.block(BlockGrid::key_of_block(
                        std::int32_t(middle[0]) + x, std::int32_t(middle[1]) + y, std::int32_t(middle[2]) + z));
                    if (box == kNoIndex) continue;
                    for (std::size_t i = boxes_.starts[box]; i < boxes_.starts[box + 1]; ++i)
                        visit(boxes_.entries[i].particle);
                }
            }
    }

    const std::vector<Vec3f>& positions_;
    double width_;
    SearchBoxes boxes_;
};

} // namespace

MatterAtPoints::MatterAtPoints(std::span<const Vec3f> points, const std::vector<Vec3f>& particles, double spacing,
                               const RunContext& context)
    : near_(points.size()) {
    const ParticlesNear lookup(particles, spacing);
    parallel_for(context, points.size(), 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) lookup.find(points[i], near_[i].particles, near_[i].shares);
    });
}

std::vector<Vec4f> matter_colors(const Mesh& mesh, const std::vector<Vec3f>& points, std::span<const Vec3f> particles,
                                 double spacing, const RunContext& context) {
    std::vector<Vec4f> colors;
    if (mesh.colors.empty()) return colors;
    const MatterAtPoints vertices(particles, points, spacing, context);
    for (std::size_t p = 0; p < particles.size(); ++p)
        colors.push_back(vertices.at<Vec4f>(p, mesh.colors, Vec4f::Ones()));
    return colors;
}

} // namespace filigree
