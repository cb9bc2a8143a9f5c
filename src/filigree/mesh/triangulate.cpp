// Based on:
//   [Meisters 1975] (ear clipping). Corners that lie on one another (the bridge to a hole) do not block an ear, so
//   outlines with bridged holes work too.
#include "filigree/mesh.h"

#include "filigree/mesh/edges.h"
#include "filigree/mesh/normals.h"

#include <algorithm>

namespace filigree {
namespace {

constexpr std::size_t kTestsPerCorner = 1024;     // point-in-ear tests a face may spend, times its corners
constexpr std::size_t kFacesBetweenLooks = 65536; // at the cancel flag

/// The two triangles of a quad as positions in the face, cut from corner 0 to 2 or from 1 to 3.
using Halves = std::array<std::array<Index, 3>, 2>;
constexpr Halves kCut02 = {{{0, 1, 2}, {0, 2, 3}}};
constexpr Halves kCut13 = {{{0, 1, 3}, {1, 2, 3}}};

const Halves& cut_quad(std::span<const Vec3f> positions, std::span<const Index> face) {
    std::array<Vec3d, 4> p;
    for (std::size_t i = 0; i < 4; ++i) p[i] = positions[face[i]].cast<double>();
    const Vec3d d02 = p[2] - p[0], d13 = p[3] - p[1];
    const Vec3d normal = d02.cross(d13);
    // how far the worse half of a cut faces the quad's normal
    const auto facing = [&](const Halves& halves) {
        double worst = std::numeric_limits<double>::infinity();
        for (const auto& [a, b, c] : halves) worst = std::min(worst, (p[b] - p[a]).cross(p[c] - p[a]).dot(normal));
        return worst;
    };
    const double facing02 = facing(kCut02), facing13 = facing(kCut13);
    if (facing02 > 0 && facing13 > 0) return d13.squaredNorm() < d02.squaredNorm() ? kCut13 : kCut02;
    return facing13 > facing02 ? kCut13 : kCut02;
}

/// One outline in the plane, as a ring of corners that loses an ear at a time.
class EarClipper {
public:
    EarClipper(std::span<const Vec3f> positions, std::span<const Index> face, const Vec3d& normal) : face_(face) {
        // dropping the normal's largest coordinate keeps the others exact; (axis + 1, axis + 2) keeps the orientation
        Eigen::Index axis;
        normal.cwiseAbs().maxCoeff(&axis);
        const Eigen::Index u = (axis + 1) % 3, v = (axis + 2) % 3;
        const double sign = normal[axis] < 0 ? -1 : 1;
        const std::size_t n = face.size();
        points_.reserve(n);
        for (const Index vertex : face)
            points_.emplace_back(sign * double(positions[vertex][u]), double(positions[vertex][v]));
        for (std::size_t i = 0; i < n; ++i) {
            next_.push_back(static_cast<Index>((i + 1) % n));
            previous_.push_back(static_cast<Index>((i + n - 1) % n));
        }
        for (Index i = 0; i < n; ++i) {
            blocks_.push_back(turn(previous_[i], i, next_[i]) <= 0);
            if (blocks_[i]) blockers_.push_back(i);
        }
        tests_left_ = kTestsPerCorner * n;
    }

    /// Appends the outline's triangles to `out`; fewer when cancelled.
    void clip(std::vector<Triangle>& out, const RunContext& context) {
        Index corner = 0, left = static_cast<Index>(face_.size()), since_last_ear = 0;
        bool flat_ears = false; // corners without an area are taken only when nothing better is left
        while (left > 3 && tests_left_ > 0) {
            if (context.is_cancelled()) return;
            if (is_ear(corner, flat_ears)) {
                out.push_back({face_[previous_[corner]], face_[corner], face_[next_[corner]]});
                remove(corner);
                --left;
                since_last_ear = 0;
                flat_ears = false;
                corner = next_[next_[corner]]; // not the neighbour: ears side by side make slivers
            } else {
                corner = next_[corner];
                if (++since_last_ear < left) continue;
                if (flat_ears) break;
                flat_ears = true;
                since_last_ear = 0;
            }
        }
        for (Index b = next_[corner]; next_[b] != corner; b = next_[b])
            out.push_back({face_[corner], face_[b], face_[next_[b]]});
    }

private:
    using Point = Eigen::Vector2d;

    /// Twice the signed area of (a, b, c): positive for a turn to the left.
    double turn(Index a, Index b, Index c) const { return turn(points_[a], points_[b], points_[c]); }
    static double turn(const Point& a, const Point& b, const Point& c) {
        return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
    }

    bool is_ear(Index corner, bool flat_ears) {
        const Point &a = points_[previous_[corner]], &b = points_[corner], &c = points_[next_[corner]];
        const double area = turn(a, b, c);
        if (area < 0 || (area == 0 && !flat_ears)) return false;
        if (area == 0) return true;
        tests_left_ -= std::min(tests_left_, blockers_.size());
        // only corners that are not convex can be the first to enter a triangle
        for (const Index i : blockers_) {
            const Point& p = points_[i];
            if (!blocks_[i] || p == a || p == b || p == c) continue;
            if (turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0) return false;
        }
        return true;
    }

    void remove(Index corner) {
        const Index before = previous_[corner], after = next_[corner];
        next_[before] = after;
        previous_[after] = before;
        blocks_[corner] = false;
        for (const Index i : {before, after}) blocks_[i] = blocks_[i] && turn(previous_[i], i, next_[i]) <= 0;
    }

    std::span<const Index> face_;
    std::vector<Point> points_;
    std::vector<Index> next_, previous_;
    std::vector<Index> blockers_; ///< corners that were reflex or flat at first
    std::vector<bool> blocks_;    ///< a corner: whether it is so still, and in the ring
    std::size_t tests_left_;
};

void triangulate_polygon(std::span<const Vec3f> positions, std::span<const Index> face, std::vector<Triangle>& out,
                         const RunContext& context) {
    const Vec3d normal = doubled_area_vector(positions, face);
    if (normal.isZero(0)) {
        for (std::size_t i = 2; i < face.size(); ++i) out.push_back({face[0], face[i - 1], face[i]});
    } else {
        EarClipper(positions, face, normal).clip(out, context);
    }
}

} // namespace

std::optional<Error> too_many_triangles(std::size_t count) {
    if (count <= kMostListedTriangles) return std::nullopt;
    return Error{ErrorCode::unsuitable, "The mesh has more triangles than 32-bit indices can list (" +
                                            std::to_string(kMostListedTriangles) + "); split it into parts."};
}

Triangulation triangulate(const Mesh& mesh) {
    return triangulate(mesh, RunContext(1)).value(); // nobody else has the context, so nobody cancels
}

Result<Triangulation> triangulate(const Mesh& mesh, const RunContext& context) {
    Triangulation result;
    const std::size_t count = mesh.corner_count() - 2 * mesh.face_count();
    if (std::optional<Error> error = too_many_triangles(count)) return *error;
    result.triangles.reserve(count);
    result.source_face.reserve(count);
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        if (f % kFacesBetweenLooks == 0 && context.is_cancelled()) return cancelled_error();
        const std::span<const Index> face = mesh.face(f);
        if (face.size() == 3) {
            result.triangles.push_back({face[0], face[1], face[2]});
        } else if (face.size() == 4) {
            for (const auto& [a, b, c] : cut_quad(mesh.positions, face))
                result.triangles.push_back({face[a], face[b], face[c]});
        } else {
            triangulate_polygon(mesh.positions, face, result.triangles, context);
        }
        result.source_face.resize(result.triangles.size(), static_cast<Index>(f));
    }
    if (context.is_cancelled()) return cancelled_error(); // perhaps in the midst of a face
    return result;
}

} // namespace filigree
