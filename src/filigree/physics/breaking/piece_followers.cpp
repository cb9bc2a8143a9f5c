#include "filigree/physics/breaking/piece_followers.h"

#include "filigree/physics/body/embedding.h"
#include "filigree/physics/body/make_cells.h"
#include <algorithm>
#include <unordered_map>

namespace filigree {

namespace {

constexpr int kBridgeReach = 3; ///< corners along each axis to where both pieces have a copy

/// The piece's copies, by corner of the whole.
class CopiesOfPiece {
public:
    CopiesOfPiece(const BrokenBody& body, Index piece) : body_(body), piece_(piece) {
        const std::vector<Index>& corners = body.corners_of_whole[piece];
        for (Index c = 0; c < corners.size(); ++c) {
            own_.emplace(corners[c], c);
            at_.emplace(key(body.whole->cells.corners[corners[c]]), corners[c]);
        }
    }
    Index find(Index corner) const {
        const auto found = own_.find(corner);
        return found == own_.end() ? kNoIndex : found->second;
    }
    Index number(Index corner, Index piece) const {
        for (Index copy = body_.copy_offsets[corner]; copy < body_.copy_offsets[corner + 1]; ++copy)
            if (body_.copies[copy].piece == piece) return copy;
        return kNoIndex;
    }

    PieceFollower::Source source(Index corner, std::vector<PieceFollower::Bridge>& bridges) const {
        PieceFollower::Source source;
        source.own = find(corner);
        source.is_copy = source.own != kNoIndex;
        if (source.is_copy) return source;
        struct Step {
            int squared;
            Index corner;
        };
        std::vector<Step> near;
        const auto& at = body_.whole->cells.corners[corner];
        for (int k = -kBridgeReach; k <= kBridgeReach; ++k)
            for (int j = -kBridgeReach; j <= kBridgeReach; ++j)
                for (int i = -kBridgeReach; i <= kBridgeReach; ++i) {
                    const auto found =
                        at_.find(key({std::uint16_t(at[0] + i), std::uint16_t(at[1] + j), std::uint16_t(at[2] + k)}));
                    if (found != at_.end()) near.push_back({i * i + j * j + k * k, found->second});
                }
        std::ranges::sort(near, {}, [](const Step& step) { return std::pair(step.squared, step.corner); });
        source.own = near.empty() ? nearest(corner) : find(near.front().corner);
        source.first_bridge = Index(bridges.size());
        for (Index there = body_.copy_offsets[corner]; there < body_.copy_offsets[corner + 1]; ++there)
            for (const Step& step : near) {
                const Index other = number(step.corner, body_.copies[there].piece);
                if (other == kNoIndex) continue;
                bridges.push_back({number(step.corner, piece_), other, there});
                break;
            }
        source.last_bridge = Index(bridges.size());
        return source;
    }

private:
    static std::uint64_t key(const Cells::LatticeIndex& at) {
        return std::uint64_t{at[0]} | std::uint64_t{at[1]} << 16 | std::uint64_t{at[2]} << 32;
    }
    /// Of the piece's corners, far away.
    Index nearest(Index corner) const {
        const std::vector<Index>& corners = body_.corners_of_whole[piece_];
        const Vectors& rest = body_.whole->rest;
        Index best = 0;
        for (Index c = 0; c < corners.size(); ++c)
            if ((rest[corners[c]] - rest[corner]).squaredNorm() < (rest[corners[best]] - rest[corner]).squaredNorm())
                best = c;
        return best;
    }

    const BrokenBody& body_;
    Index piece_;
    std::unordered_map<Index, Index> own_;
    std::unordered_map<std::uint64_t, Index> at_;
};

} // namespace

std::vector<PieceFollower> make_followers(const BrokenBody& body, const Embedding& in_whole,
                                          std::span<const Index> pieces) {
    std::vector<PieceFollower> followers(body.pieces.size());
    for (Index p = 0; p < pieces.size(); ++p) followers[pieces[p]].points.push_back(p);
    for (Index piece = 0; piece < followers.size(); ++piece) {
        PieceFollower& follower = followers[piece];
        follower.piece = piece;
        if (follower.points.empty()) continue;
        const CopiesOfPiece copies(body, piece);
        std::unordered_map<Index, Index> numbers; // of the whole's corners, here
        std::vector<Vec3f> rest;
        for (const Index p : follower.points) {
            follower.embedding.rest.push_back(in_whole.rest[p]);
            for (Index n = in_whole.offsets[p]; n < in_whole.offsets[p + 1]; ++n) {
                const Index corner = in_whole.particles[n];
                const auto [found, is_new] = numbers.try_emplace(corner, Index(rest.size()));
                if (is_new) {
                    rest.push_back(body.whole->rest[corner]);
                    follower.sources.push_back(copies.source(corner, follower.bridges));
                }
                follower.embedding.particles.push_back(found->second);
                follower.embedding.weights.push_back(in_whole.weights[n]);
            }
            follower.embedding.offsets.push_back(Index(follower.embedding.particles.size()));
        }
        follower.rest = Vectors(rest.size());
        for (std::size_t c = 0; c < rest.size(); ++c) follower.rest.set(c, rest[c]);
    }
    std::erase_if(followers, [](const PieceFollower& follower) { return follower.points.empty(); });
    return followers;
}

void move_followers(std::span<const PieceFollower> followers, const Cracks& cracks, std::span<const BodyState> bodies,
                    std::span<Vec3f> points, std::span<Mat3f> gradients, const RunContext& context) {
    const std::vector<CornerCopy>& copies = cracks.body().copies;
    const std::vector<std::vector<Mat3f>> all = cracks.gradients(bodies, context);
    for (const PieceFollower& follower : followers) {
        const BodyState& own = bodies[cracks.first_piece() + follower.piece];
        Vectors positions(follower.sources.size());
        std::vector<Mat3f> corner_gradients(follower.sources.size());
        for (std::size_t c = 0; c < follower.sources.size(); ++c) {
            const PieceFollower::Source& source = follower.sources[c];
            const Mat3f& gradient = all[follower.piece][source.own];
            positions.set(c, own.positions[source.own]);
            corner_gradients[c] = gradient;
            if (source.is_copy) continue;
            positions.add(c, gradient * (follower.rest[c] - own.body->rest[source.own]));
            for (Index b = source.first_bridge; b < source.last_bridge; ++b) {
                const PieceFollower::Bridge& bridge = follower.bridges[b];
                if (!cracks.are_tied(bridge.own, bridge.other)) continue;
                const CornerCopy& there = copies[bridge.there];
                positions.set(c, bodies[cracks.first_piece() + there.piece].positions[there.corner]);
                corner_gradients[c] = all[there.piece][there.corner];
                break;
            }
        }
        std::vector<Vec3f> moved(follower.points.size());
        std::vector<Mat3f> turned(gradients.empty() ? 0 : moved.size());
        move_embedded(follower.embedding, follower.rest, positions, corner_gradients, moved, turned, context);
        for (std::size_t p = 0; p < moved.size(); ++p) {
            points[follower.points[p]] = moved[p];
            if (!gradients.empty()) gradients[follower.points[p]] = turned[p];
        }
    }
}

} // namespace filigree
