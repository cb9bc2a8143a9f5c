#include "filigree/fracture/voronoi.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <map>

namespace filigree {

namespace {

CellCorner ascending(Index a, Index b, Index c) {
    CellCorner corner = {a, b, c};
    std::sort(corner.begin(), corner.end());
    return corner;
}

/// The one of `corner` that is in `other` too and is not `face`.
Index shared_besides(const CellCorner& corner, const CellCorner& other, Index face) {
    for (const Index a : corner)
        if (a != face && std::find(other.begin(), other.end(), a) != other.end()) return a;
    return kNoIndex;
}

/// One cell, cut from the box of the six ghosts by one seed after the other.
class CellBuilder {
public:
    CellBuilder(const GridSeeds& seeds, Index cell) : seeds_(seeds), cell_(cell) {
        const Index g = seeds.count; // ghosts: +x -x +y -y +z -z
        for (int axis = 0; axis < 3; ++axis)
            for (int side = 0; side < 2; ++side) {
                const Index face = g + Index(2 * axis + side);
                const Index u = g + Index((2 * axis + 2) % 6), v = g + Index((2 * axis + 4) % 6);
                // Counter-clockwise around +axis: (u+, v+), (u-, v+), (u-, v-), (u+, v-).
                CellFace box{face,
                             {ascending(face, u, v), ascending(face, u + 1, v), ascending(face, u + 1, v + 1),
                              ascending(face, u, v + 1)}};
                if (side == 1) std::reverse(box.corners.begin(), box.corners.end());
                faces_.push_back(std::move(box));
            }
        for (const CellFace& face : faces_)
            for (const CellCorner& corner : face.corners) add_place(corner);
    }

    void cut(Index seed) {
        if (faces_.empty() || !may_cut(seed)) return;
        std::map<CellCorner, int> sign;
        bool is_cut = false;
        for (const auto& [corner, place] : places_) {
            const int s = sign_at_voronoi_vertex(seeds_, cell_, corner[0], corner[1], corner[2], seed);
            sign[corner] = s;
            is_cut |= s < 0;
        }
        if (!is_cut) return;
        std::vector<CellFace> kept;
        std::map<CellCorner, CellCorner> next; // along the new face's outline
        for (const CellFace& face : faces_) {
            CellFace rest{face.neighbour, {}};
            CellCorner enter{}, leave{};
            bool crosses = false;
            for (std::size_t k = 0; k < face.corners.size(); ++k) {
                const CellCorner &a = face.corners[k], &b = face.corners[(k + 1) % face.corners.size()];
                if (sign[a] > 0) rest.corners.push_back(a);
                if (sign[a] == sign[b]) continue;
                const CellCorner corner = ascending(face.neighbour, shared_besides(a, b, face.neighbour), seed);
                rest.corners.push_back(corner);
                (sign[a] > 0 ? leave : enter) = corner;
                crosses = true;
            }
            if (crosses) next[enter] = leave;
            if (!rest.corners.empty()) kept.push_back(std::move(rest));
        }
        if (!next.empty()) {
            CellFace added{seed, {}};
            const CellCorner first = next.begin()->first;
            CellCorner at = first;
            do {
                added.corners.push_back(at);
                at = next[at];
            } while (at != first && added.corners.size() <= next.size());
            kept.push_back(std::move(added));
        }
        faces_ = std::move(kept);
        std::map<CellCorner, Vec3d> before = std::move(places_);
        places_.clear();
        for (const CellFace& face : faces_)
            for (const CellCorner& corner : face.corners) {
                if (const auto known = before.find(corner); known != before.end())
                    places_.insert(*known);
                else
                    add_place(corner);
            }
    }

    /// Of the farthest corner from the seed.
    double radius() const {
        double square = 0;
        for (const auto& [corner, place] : places_) square = std::max(square, (place - seed_place()).squaredNorm());
        return std::sqrt(square);
    }
    VoronoiCell take() { return std::move(faces_); }

private:
    Vec3d seed_place() const { return to_double(seeds_.points[cell_]); }
    void add_place(const CellCorner& corner) {
        if (!places_.contains(corner)) places_[corner] = voronoi_vertex(seeds_, cell_, corner[0], corner[1], corner[2]);
    }
    /// False only where the seed certainly leaves every corner: D is far above what rounding can do.
    bool may_cut(Index seed) const {
        const Vec3d gradient = to_double(seeds_.gradient(cell_, seed));
        const double constant = double(seeds_.square[seed] - seeds_.square[cell_]);
        for (const auto& [corner, place] : places_) {
            const double d = constant + gradient.dot(place);
            const double terms = std::abs(constant) + gradient.cwiseAbs().dot(place.cwiseAbs());
            if (d < 1 + 1e-10 * terms) return true;
        }
        return false;
    }

    const GridSeeds& seeds_;
    Index cell_;
    std::vector<CellFace> faces_;
    std::map<CellCorner, Vec3d> places_;
};

/// Seeds in the order of their distance, sorted no further than they are asked for.
class NearestFirst {
public:
    NearestFirst(const GridSeeds& seeds, Index from) {
        const GridPoint& a = seeds.points[from];
        for (Index k = 0; k < seeds.count; ++k) {
            if (k == from) continue;
            std::int64_t square = 0;
            for (int axis = 0; axis < 3; ++axis)
                square += (seeds.points[k][axis] - a[axis]) * (seeds.points[k][axis] - a[axis]);
            order_.push_back({square, k});
        }
    }
    std::size_t size() const { return order_.size(); }
    std::pair<std::int64_t, Index> operator[](std::size_t rank) {
        if (rank >= sorted_) {
            const std::size_t until = std::min(order_.size(), std::max<std::size_t>(48, 4 * sorted_));
            const auto begin = order_.begin() + std::ptrdiff_t(sorted_);
            const auto end = order_.begin() + std::ptrdiff_t(until);
            std::nth_element(begin, end - 1, order_.end());
            std::sort(begin, end);
            sorted_ = until;
        }
        return order_[rank];
    }

private:
    std::vector<std::pair<std::int64_t, Index>> order_;
    std::size_t sorted_ = 0;
};

VoronoiCell voronoi_cell(const GridSeeds& seeds, Index cell, double heaviest, double lightest) {
    CellBuilder builder(seeds, cell);
    NearestFirst others(seeds, cell);
    // A seed at distance d cuts no nearer than (d^2 + w_i - w_m) / 2d.
    for (std::size_t rank = 0; rank < others.size(); ++rank) {
        const auto [square, seed] = others[rank];
        if (rank % 16 == 0) {
            const double d = std::sqrt(double(square));
            if (d > 0 && (double(square) - (heaviest - lightest)) / (2 * d) > 1.001 * builder.radius()) break;
        }
        builder.cut(seed);
    }
    return builder.take();
}

} // namespace

Vec3d voronoi_vertex(const GridSeeds& seeds, Index i, Index j, Index k, Index l) {
    const GridPoint a = seeds.gradient(i, j), b = seeds.gradient(i, k), c = seeds.gradient(i, l);
    const std::int64_t ra = seeds.square[i] - seeds.square[j], rb = seeds.square[i] - seeds.square[k],
                       rc = seeds.square[i] - seeds.square[l];
    const Wide d = determinant(a, b, c);
    if (d == 0) return to_double(seeds.points[i]); // not a place: seeds on a line, which only infinitesimals part
    Vec3d place;
    for (int axis = 0; axis < 3; ++axis) {
        GridPoint x = a, y = b, z = c;
        x[axis] = ra;
        y[axis] = rb;
        z[axis] = rc;
        place[axis] = ratio(determinant(x, y, z), d);
    }
    return place;
}

Result<std::vector<VoronoiCell>> voronoi_cells(const GridSeeds& seeds, const RunContext& context) {
    double heaviest = 0, lightest = 0;
    for (Index k = 0; k < seeds.count; ++k) {
        const GridPoint& s = seeds.points[k];
        const double weight = double(s[0] * s[0] + s[1] * s[1] + s[2] * s[2] - seeds.square[k]);
        heaviest = k == 0 ? weight : std::max(heaviest, weight);
        lightest = k == 0 ? weight : std::min(lightest, weight);
    }
    std::vector<VoronoiCell> cells(seeds.count);
    parallel_for(context, seeds.count, 8, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end && !context.is_cancelled(); ++k)
            cells[k] = voronoi_cell(seeds, static_cast<Index>(k), heaviest, lightest);
    });
    if (context.is_cancelled()) return cancelled_error();
    return cells;
}

} // namespace filigree
