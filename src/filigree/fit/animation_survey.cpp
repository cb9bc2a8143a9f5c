#include "filigree/fit/animation_survey.h"

#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/core/parallel_sum.h"
#include "filigree/fit.h"
#include "filigree/mesh/weld.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace filigree {

namespace {

constexpr std::size_t kSurveyGrain = 16384;
constexpr std::size_t kMostPoints = 4000, kFewestPoints = 200; // that frames are compared by
constexpr std::size_t kMostKept = std::size_t{16} << 20;       // bytes of them, over all frames
constexpr std::size_t kMostEdges = 20'000;
// Half of the edges are so many times as long as at rest where the order changed: 20, or less in a coarse mesh, in
// which even an edge from anywhere to anywhere, nearly half as long as the shape is large, is not so much longer.
constexpr double kOtherOrder = 20, kLeastOtherOrder = 4, kAnywhere = 0.4;
constexpr double kTogether = 2e-6;     // of the diagonal: vertices that stay so near are one
constexpr double kSameFrame = 1e-6;    // of the diagonal: a frame this near to one chosen tells nothing new
constexpr std::size_t kMostRests = 32; // frames that may become the rest
constexpr double kLargestStretch = 5;  // logarithm: an edge without length would drown all others

using Edge = std::array<Index, 2>;

/// Some edges of the faces, evenly spread over their corners, that have a length at rest.
std::vector<Edge> some_edges(const Mesh& mesh, std::span<const Vec3f> rest) {
    const std::size_t step = mesh.corner_count() / kMostEdges + 1;
    std::vector<Edge> edges;
    std::size_t next = 0;
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        for (std::size_t c = mesh.face_offsets[f]; c < mesh.face_offsets[f + 1]; ++c) {
            if (c < next) continue;
            const std::size_t behind = c + 1 < mesh.face_offsets[f + 1] ? c + 1 : mesh.face_offsets[f];
            const Edge edge = {mesh.corners[c], mesh.corners[behind]};
            next = c + step;
            if (rest[edge[0]] != rest[edge[1]]) edges.push_back(edge);
        }
    return edges;
}

double length(const Edge& edge, std::span<const Vec3f> positions) {
    return (positions[edge[1]].cast<double>() - positions[edge[0]].cast<double>()).norm();
}

Vec3d mean_of(std::span<const Vec3f> positions, const RunContext& context) {
    Vec3d mean;
    for (int k = 0; k < 3; ++k)
        mean[k] = parallel_sum(context, positions.size(), kSurveyGrain,
                               [&](std::size_t v) { return double(positions[v][k]); }) /
                  double(std::max<std::size_t>(positions.size(), 1));
    return mean;
}

std::string frame_name(std::size_t frame) { return "Frame " + std::to_string(frame + 1); }

Status check_finite(std::span<const Vec3f> positions, std::size_t frame, const RunContext& context) {
    std::vector<std::size_t> first((positions.size() + kSurveyGrain - 1) / kSurveyGrain, positions.size());
    parallel_for(context, positions.size(), kSurveyGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v)
            if (!positions[v].allFinite()) {
                first[begin / kSurveyGrain] = v;
                return;
            }
    });
    for (const std::size_t v : first)
        if (v < positions.size())
            return Error{ErrorCode::unsuitable, frame_name(frame) + ": the position of vertex " + std::to_string(v) +
                                                    " is not a finite number; export the animation again."};
    return Success{};
}

/// Compares each frame with the rest shape by some edges, each relative to the size of the whole.
class OrderCheck {
public:
    OrderCheck(const Mesh& mesh, std::span<const Vec3f> rest, std::span<const Index> points)
        : edges_(some_edges(mesh, rest)), points_(points), size_(size(rest)) {
        for (const Edge& edge : edges_) lengths_.push_back(length(edge, rest));
        if (edges_.empty()) return;
        std::vector<double> sorted = lengths_;
        const auto middle = sorted.begin() + std::ptrdiff_t(sorted.size() / 2);
        std::ranges::nth_element(sorted, middle);
        most_ = std::clamp(kAnywhere * size_ / *middle, kLeastOtherOrder, kOtherOrder);
    }

    Status check(std::span<const Vec3f> positions, std::size_t frame) const {
        const double now = size(positions);
        if (edges_.empty() || !(now > 0) || !(size_ > 0)) return Success{};
        std::vector<double> stretches;
        for (std::size_t e = 0; e < edges_.size(); ++e) stretches.push_back(length(edges_[e], positions) / lengths_[e]);
        const auto middle = stretches.begin() + std::ptrdiff_t(stretches.size() / 2);
        std::ranges::nth_element(stretches, middle);
        if (*middle * size_ / now <= most_) return Success{};
        return Error{ErrorCode::unsuitable,
                     frame_name(frame) + ": half of its edges are more than " + std::to_string(int(most_)) +
                         " times as long as at rest, so its vertices are in another order than the mesh's; export the "
                         "animation and the mesh from the same object, with the order of vertices kept."};
    }

private:
    /// Root of the mean squared distance of some vertices from their middle.
    double size(std::span<const Vec3f> positions) const {
        Vec3d sum = Vec3d::Zero();
        for (const Index v : points_) sum += positions[v].cast<double>();
        const Vec3d middle = sum / double(points_.size());
        double squared = 0;
        for (const Index v : points_) squared += (positions[v].cast<double>() - middle).squaredNorm();
        return std::sqrt(squared / double(points_.size()));
    }

    std::vector<Edge> edges_;
    std::span<const Index> points_;
    std::vector<double> lengths_;
    double size_;
    double most_ = kOtherOrder;
};

/// Vertices at one place at rest, and which of them have stayed together so far.
class Places {
public:
    Places(std::span<const Vec3f> rest, double tolerance) : representative_(weld_map(rest)), tolerance_(tolerance) {
        std::vector<Index> group_of(rest.size(), kNoIndex);
        for (Index v = 0; v < rest.size(); ++v) {
            const Index first = representative_[v];
            if (first == v) continue;
            if (group_of[first] == kNoIndex) {
                group_of[first] = static_cast<Index>(groups_.size());
                groups_.push_back({first});
            }
            groups_[group_of[first]].push_back(v);
        }
    }

    /// Splits the groups that this frame parts: each vertex stays with the lowest one that it is near.
    void look_at(std::span<const Vec3f> positions) {
        std::vector<std::vector<Index>> split;
        const auto is_near = [&](Index v, Index first) {
            return double((positions[v] - positions[first]).norm()) <= tolerance_;
        };
        for (std::vector<Index>& group : groups_) {
            const Index first = group.front();
            if (std::ranges::all_of(group, [&](Index v) { return is_near(v, first); })) continue;
            std::vector<std::vector<Index>> parts;
            for (const Index v : group) {
                auto part = std::ranges::find_if(parts, [&](const auto& one) { return is_near(v, one.front()); });
                if (part == parts.end()) part = parts.insert(parts.end(), std::vector<Index>());
                part->push_back(v);
            }
            parted_ += parts.size() - 1;
            for (const std::vector<Index>& part : parts)
                for (const Index v : part) representative_[v] = part.front();
            group = std::move(parts.front());
            split.insert(split.end(), std::make_move_iterator(parts.begin() + 1), std::make_move_iterator(parts.end()));
        }
        groups_.insert(groups_.end(), std::make_move_iterator(split.begin()), std::make_move_iterator(split.end()));
        std::erase_if(groups_, [](const std::vector<Index>& group) { return group.size() < 2; });
    }

    std::size_t parted() const { return parted_; }
    std::vector<Index> take() { return std::move(representative_); }

private:
    std::vector<Index> representative_;
    std::vector<std::vector<Index>> groups_; ///< of two vertices or more, ascending
    double tolerance_;
    std::size_t parted_ = 0;
};

std::vector<Index> some_points(std::size_t vertices, std::size_t frames) {
    const std::size_t most =
        std::clamp(kMostKept / (sizeof(Vec3f) * std::max<std::size_t>(frames, 1)), kFewestPoints, kMostPoints);
    const std::size_t count = std::min(vertices, most);
    std::vector<Index> points;
    for (std::size_t i = 0; i < count; ++i) points.push_back(static_cast<Index>(i * vertices / count));
    return points;
}

/// Of the frames (and the rest shape, which is chosen first) those that are farthest from all chosen before them.
/// shapes: the rest shape's points, then each frame's, about their middles.
std::vector<std::size_t> farthest_frames(const std::vector<std::vector<Vec3f>>& shapes, std::size_t most,
                                         double tolerance) {
    std::vector<double> distances(shapes.size(), std::numeric_limits<double>::infinity());
    std::vector<std::size_t> chosen;
    for (std::size_t last = 0; chosen.size() < most;) {
        for (std::size_t s = 0; s < shapes.size(); ++s) {
            double squared = 0;
            for (std::size_t i = 0; i < shapes[s].size(); ++i)
                squared += double((shapes[s][i] - shapes[last][i]).squaredNorm());
            distances[s] = std::min(distances[s], squared / double(shapes[s].size()));
        }
        last = std::size_t(std::ranges::max_element(distances) - distances.begin());
        if (distances[last] <= tolerance * tolerance) break;
        chosen.push_back(last - 1);
    }
    return chosen;
}

Error no_frames() { return {ErrorCode::unsuitable, "The animation has no frames: there is nothing to fit."}; }

} // namespace

Result<AnimationSurvey> survey_animation(const MeshAnimation& animation, std::span<const Vec3f> rest,
                                         std::size_t most_farthest, const RunContext& context) {
    if (animation.frames == 0) return no_frames();
    const double diagonal = bounds(rest).diagonal();
    const std::vector<Index> points = some_points(rest.size(), animation.frames);
    const OrderCheck order(*animation.rest, rest, points);
    Places places(rest, kTogether * diagonal);
    AnimationSurvey survey;
    std::vector<std::vector<Vec3f>> shapes;
    const auto keep_shape = [&](std::span<const Vec3f> positions, const Vec3d& middle) {
        std::vector<Vec3f>& shape = shapes.emplace_back();
        for (const Index v : points) shape.push_back((positions[v].cast<double>() - middle).cast<float>());
    };
    keep_shape(rest, mean_of(rest, context));
    std::vector<Vec3f> positions(rest.size());
    for (std::size_t frame = 0; frame < animation.frames; ++frame) {
        context.report("looking at the frames", double(frame) / double(animation.frames));
        if (Status read = animation.positions(frame, positions); !read) return read.error();
        if (Status sound = check_finite(positions, frame, context); !sound) return sound.error();
        if (Status sound = order.check(positions, frame); !sound) return sound.error();
        places.look_at(positions);
        survey.middles.push_back(mean_of(positions, context));
        keep_shape(positions, survey.middles.back());
        if (context.is_cancelled()) return cancelled_error();
    }
    survey.parted = places.parted();
    survey.representative = places.take();
    survey.farthest = farthest_frames(shapes, most_farthest, kSameFrame * diagonal);
    return survey;
}

Result<std::size_t> least_stretched_frame(const MeshAnimation& animation, const RunContext& context) {
    if (std::optional<Error> error = mesh_error(*animation.rest)) return *error;
    if (animation.frames == 0) return no_frames();
    const std::size_t count = std::min(animation.frames, kMostRests);
    std::vector<Vec3f> positions(animation.rest->vertex_count());
    std::vector<Edge> edges;
    std::vector<std::vector<double>> logarithms; // of the edges' lengths
    for (std::size_t i = 0; i < count; ++i) {
        context.report("choosing the rest shape", double(i) / double(count));
        if (Status read = animation.positions(i * animation.frames / count, positions); !read) return read.error();
        if (Status sound = check_finite(positions, i * animation.frames / count, context); !sound) return sound.error();
        if (context.is_cancelled()) return cancelled_error();
        if (i == 0) edges = some_edges(*animation.rest, positions);
        std::vector<double>& of_frame = logarithms.emplace_back();
        for (const Edge& edge : edges) of_frame.push_back(math::log(std::max(length(edge, positions), 1e-30)));
    }
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t a = 0; a < count; ++a) {
        double worst = 0;
        for (std::size_t b = 0; b < count; ++b) {
            double squared = 0;
            for (std::size_t e = 0; e < edges.size(); ++e) {
                const double stretch =
                    std::clamp(logarithms[b][e] - logarithms[a][e], -kLargestStretch, kLargestStretch);
                squared += stretch * stretch;
            }
            worst = std::max(worst, squared);
        }
        if (worst < least) {
            least = worst;
            best = a;
        }
    }
    return best * animation.frames / count;
}

} // namespace filigree
