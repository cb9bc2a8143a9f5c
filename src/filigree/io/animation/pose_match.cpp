#include "filigree/io/animation/pose_match.h"

#include "filigree/mesh/weld.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

namespace filigree {

namespace {

constexpr double kSamePlace = 1e-5; // of the driver's diagonal: what text and other units round

double diagonal_of(std::span<const Vec3f> points) {
    Eigen::AlignedBox3f box;
    for (const Vec3f& p : points) box.extend(p);
    return box.isEmpty() ? 0 : double(box.diagonal().norm());
}

/// Vertices by boxes of space, a tolerance wide.
class Places {
public:
    Places(std::span<const Vec3f> points, double tolerance) : points_(points), tolerance_(tolerance) {
        for (Index v = 0; v < points.size(); ++v) boxes_[box_of(points[v])].push_back(v);
    }

    /// The vertices within the tolerance, ascending.
    std::vector<Index> at(const Vec3f& p) const {
        std::vector<Index> found;
        const Box centre = box_of(p);
        for (int n = 0; n < 27; ++n) {
            const Box box = {centre[0] + n % 3 - 1, centre[1] + n / 3 % 3 - 1, centre[2] + n / 9 - 1};
            const auto entry = boxes_.find(box);
            if (entry == boxes_.end()) continue;
            for (const Index v : entry->second)
                if (double((points_[v] - p).norm()) <= tolerance_) found.push_back(v);
        }
        std::sort(found.begin(), found.end());
        return found;
    }

private:
    using Box = std::array<std::int64_t, 3>;
    Box box_of(const Vec3f& p) const {
        Box box;
        for (int k = 0; k < 3; ++k)
            box[std::size_t(k)] =
                static_cast<std::int64_t>(std::clamp(std::floor(double(p[k]) / tolerance_), -1e17, 1e17));
        return box;
    }

    std::span<const Vec3f> points_;
    double tolerance_;
    std::map<Box, std::vector<Index>> boxes_;
};

std::set<std::pair<Index, Index>> edges_of(const Mesh& mesh, std::span<const Index> vertex_of) {
    std::set<std::pair<Index, Index>> edges;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        const auto face = mesh.face(f);
        for (std::size_t k = 0; k < face.size(); ++k) {
            const Index a = vertex_of[face[k]], b = vertex_of[face[(k + 1) % face.size()]];
            if (a != b) edges.insert(std::minmax(a, b));
        }
    }
    return edges;
}

double largest_distance(std::span<const Vec3f> a, std::span<const Vec3f> b, const Vec3d& origin, const Mat3d& turn) {
    double largest = 0;
    for (std::size_t v = 0; v < a.size(); ++v)
        largest = std::max(largest, (turn * (origin + a[v].cast<double>()) - origin - b[v].cast<double>()).norm());
    return largest;
}

} // namespace

bool VertexMatch::is_plain() const {
    for (Index v = 0; v < source.size(); ++v)
        if (source[v] != v) return false;
    return twins.empty();
}

Status VertexMatch::apply(std::span<const Vec3f> file, std::span<Vec3f> out, const std::filesystem::path& path) const {
    for (const auto& [first, second] : twins)
        if (!(double((file[first] - file[second]).norm()) <= tolerance))
            return Error{ErrorCode::mismatch,
                         path.string() + ": its vertices " + std::to_string(first) + " and " + std::to_string(second) +
                             " are at one place at rest, where the driver has one vertex, and part in another frame; "
                             "save it without splitting vertices (in Blender: Shade Smooth, and no UVs)."};
    for (std::size_t v = 0; v < source.size(); ++v) out[v] = file[source[v]];
    return Success{};
}

std::optional<VertexMatch> match_by_place(std::span<const Vec3f> rest, std::span<const Vec3f> places) {
    const double tolerance = kSamePlace * diagonal_of(rest);
    if (!(tolerance > 0) || places.size() < rest.size()) return {};
    VertexMatch match{.source = std::vector<Index>(rest.size(), kNoIndex), .twins = {}, .tolerance = tolerance};
    const Places driver(rest, tolerance), file(places, tolerance);
    std::vector<bool> taken(places.size(), false);
    for (Index v = 0; v < rest.size(); ++v) {
        if (match.source[v] != kNoIndex) continue;
        const std::vector<Index> here = driver.at(rest[v]), there = file.at(rest[v]);
        if (there.empty() || here.empty()) return {};
        for (const Index f : there) taken[f] = true;
        const bool one_by_one = there.size() == here.size(); // vertices of the driver that share a place
        for (std::size_t i = 0; i < here.size(); ++i) match.source[here[i]] = there[one_by_one ? i : 0];
        if (!one_by_one)
            for (std::size_t i = 1; i < there.size(); ++i) match.twins.emplace_back(there[0], there[i]);
    }
    if (std::find(taken.begin(), taken.end(), false) != taken.end()) return {};
    return match;
}

std::optional<VertexMatch> match_by_faces(const Mesh& driver, const Mesh& moved) {
    constexpr double kShared = 0.9; // of the driver's edges; another program cuts polygons and so adds some
    const std::vector<Index> first = weld_map(moved.positions);
    VertexMatch match;
    std::vector<Index> number(first.size(), kNoIndex), own(driver.vertex_count());
    for (Index f = 0; f < first.size(); ++f) {
        if (first[f] == f) {
            number[f] = static_cast<Index>(match.source.size());
            match.source.push_back(f);
        } else {
            number[f] = number[first[f]];
        }
    }
    if (match.source.size() != driver.vertex_count()) return {};
    for (Index v = 0; v < own.size(); ++v) own[v] = v;
    const auto wanted = edges_of(driver, own), given = edges_of(moved, number);
    std::size_t shared = 0;
    for (const auto& edge : wanted) shared += given.count(edge);
    if (wanted.empty() || double(shared) < kShared * double(wanted.size())) return {};
    return match;
}

Mat3d turn_of(UpAxis up) {
    Mat3d turn;
    if (up == UpAxis::z)
        turn << 1, 0, 0, 0, 0, 1, 0, -1, 0; // z goes to y, y to -z
    else
        turn << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    return turn;
}

void turn_up(std::span<Vec3f> positions, const Vec3d& origin, UpAxis up) {
    const Mat3d turn = turn_of(up);
    for (Vec3f& p : positions) p = (turn * (origin + p.cast<double>()) - origin).cast<float>();
}

std::string turned_first_frame(std::span<const Vec3f> rest, std::span<const Vec3f> first, const Vec3d& origin,
                               const std::filesystem::path& path) {
    constexpr double kSame = 1e-3, kOther = 1e-2; // of the diagonal
    const double diagonal = diagonal_of(rest);
    if (rest.size() != first.size() || !(diagonal > 0)) return "";
    if (largest_distance(rest, first, origin, Mat3d::Identity()) <= kOther * diagonal) return "";
    for (int axis = 0; axis < 3; ++axis)
        for (int quarters = 1; quarters < 4; ++quarters) {
            Mat3d turn = Mat3d::Identity();
            const int b = (axis + 1) % 3, c = (axis + 2) % 3;
            const int cosine = quarters == 2 ? -1 : 0, sine = quarters == 2 ? 0 : quarters == 1 ? 1 : -1;
            turn(b, b) = turn(c, c) = cosine;
            turn(b, c) = -sine;
            turn(c, b) = sine;
            if (largest_distance(rest, first, origin, turn) > kSame * diagonal) continue;
            const std::string degrees = quarters == 2 ? "180" : quarters == 1 ? "90" : "-90";
            const std::string axes = {"xyz"[axis]};
            const std::string way = axis == 0 && quarters == 1
                                        ? "its up is z, and the model's is y: read it with its up axis (pose-up z)."
                                    : axis == 0 && quarters == 3
                                        ? "its up is y, and the model's is z: read it with its up axis (pose-up y)."
                                        : "turn it back where it was made.";
            return path.string() + ": its first frame is the driver turned by " + degrees + " degrees about " + axes +
                   "; " + way;
        }
    return "";
}

} // namespace filigree
