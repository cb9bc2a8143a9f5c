#include "filigree/fracture/cell_parts.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/mesh/edges.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <unordered_map>

namespace filigree {

namespace {

/// Numbers for pairs of a vertex and something that it belongs to; the first owner of a vertex has the vertex's own.
class OwnedVertices {
public:
    explicit OwnedVertices(Index vertices) : owner_(vertices, kNoIndex), count_(vertices) {}

    Index number(Index vertex, Index owner) {
        if (owner_[vertex] == kNoIndex) owner_[vertex] = owner;
        if (owner_[vertex] == owner) return vertex;
        const auto [known, is_new] = others_.try_emplace(std::uint64_t(vertex) << 32 | owner, count_);
        if (is_new) ++count_;
        return known->second;
    }
    Index count() const { return count_; }

private:
    std::vector<Index> owner_;
    std::unordered_map<std::uint64_t, Index> others_;
    Index count_;
};

/// Parts of cells that hang together, and which of them become pieces.
class Parts {
public:
    Parts(const CutSurface& cut, std::vector<CellTriangle>& triangles, bool is_sheet) : is_sheet_(is_sheet) {
        find(cut, triangles);
        measure(cut, triangles);
        if (!is_sheet_) find_cavities();
    }

    std::size_t count() const { return size_.size(); }
    /// Parts too small, and shells around cavities, become one with others.
    PartPieces pieces(double smallest) const {
        PartPieces result;
        DisjointSets sets(count());
        std::map<Index, Index> largest_of_cell;
        for (Index p = 0; p < count(); ++p) {
            Index& largest = largest_of_cell.try_emplace(cell_[p], p).first->second;
            if (size_[p] > size_[largest]) largest = p;
        }
        for (const auto& [shell, around] : cavities_)
            if (sets.join(shell, around)) ++result.joined;
        std::vector<double> size(count(), 0);
        double total = 0;
        for (Index p = 0; p < count(); ++p) {
            size[sets.root(p)] += size_[p];
            total += size_[p];
        }
        const double least = smallest * total / double(largest_of_cell.size());
        std::vector<std::map<Index, double>> shared(count());
        for (const auto& [pair, area] : shared_area_) {
            shared[sets.root(pair.first)][sets.root(pair.second)] += area;
            shared[sets.root(pair.second)][sets.root(pair.first)] += area;
        }
        std::vector<Index> order;
        for (Index p = 0; p < count(); ++p)
            if (sets.root(p) == p) order.push_back(p);
        std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return size[a] < size[b]; });
        for (const Index start : order) {
            const Index p = sets.root(start);
            if (size[p] >= least) continue;
            Index best = kNoIndex;
            double most = 0;
            for (const auto& [other, area] : shared[p]) {
                const Index root = sets.root(other);
                if (root != p && area > most) {
                    most = area;
                    best = root;
                }
            }
            if (best == kNoIndex) continue;
            sets.join(p, best);
            ++result.joined;
            const Index root = sets.root(p), gone = root == p ? best : p;
            size[root] += size[gone];
            for (const auto& [other, area] : shared[gone]) shared[root][other] += area;
        }
        std::vector<Index> piece(count(), kNoIndex);
        Index pieces = 0;
        for (Index p = 0; p < count(); ++p)
            if (sets.root(p) == p) piece[p] = pieces++;
        for (Index p = 0; p < count(); ++p) piece[p] = piece[sets.root(p)];
        result.cells = largest_of_cell.size();
        result.islands = pieces > result.cells ? pieces - result.cells : 0;
        result.piece = std::move(piece);
        return result;
    }
    /// The same, where each cell is one piece.
    PartPieces cell_numbers() const { return {cell_, cells(), 0, count() - cells()}; }

private:
    std::size_t cells() const {
        std::vector<Index> cells = cell_;
        std::sort(cells.begin(), cells.end());
        return static_cast<std::size_t>(std::unique(cells.begin(), cells.end()) - cells.begin());
    }

    void find(const CutSurface& cut, std::vector<CellTriangle>& triangles) {
        OwnedVertices owned(cut.vertices.count());
        for (const CellTriangle& t : triangles)
            for (const Index v : t.vertices) owned.number(v, t.cell);
        DisjointSets sets(owned.count());
        for (const CellTriangle& t : triangles) {
            const Index a = owned.number(t.vertices[0], t.cell);
            sets.join(a, owned.number(t.vertices[1], t.cell));
            sets.join(a, owned.number(t.vertices[2], t.cell));
        }
        std::vector<Index> part(owned.count(), kNoIndex);
        for (CellTriangle& t : triangles) {
            Index& of_root = part[sets.root(owned.number(t.vertices[0], t.cell))];
            if (of_root == kNoIndex) {
                of_root = static_cast<Index>(cell_.size());
                cell_.push_back(t.cell);
            }
            t.part = of_root;
        }
    }

    void measure(const CutSurface& cut, const std::vector<CellTriangle>& triangles) {
        size_.assign(cell_.size(), 0);
        box_.assign(cell_.size(), {});
        is_cut_.assign(cell_.size(), false);
        const Vec3d middle = cut.box.centre();
        const CellTriangle* first_side = nullptr; // of a triangle of a crack; the second follows
        for (const CellTriangle& t : triangles) {
            const auto at = [&](std::size_t k) -> Vec3d {
                return cut.vertices.position(t.vertices[k]).cast<double>() - middle;
            };
            const Vec3d a = at(0), cross = (at(1) - a).cross(at(2) - a);
            const bool is_virtual = t.facet == kNoIndex && cut.triangles[t.uncut].source == kNoIndex;
            if (!is_sheet_)
                size_[t.part] += a.dot(cross) / 6;
            else if (t.facet == kNoIndex && !is_virtual)
                size_[t.part] += 0.5 * cross.norm();
            for (std::size_t k = 0; k < 3; ++k) box_[t.part].extend(at(k));
            if (t.facet == kNoIndex) continue;
            is_cut_[t.part] = true;
            if (!first_side) {
                first_side = &t;
                continue;
            }
            if (first_side->cell != t.cell) shared_area_[std::minmax(first_side->part, t.part)] += 0.5 * cross.norm();
            first_side = nullptr;
        }
    }

    /// Which parts are shells around cavities, and what is around them. Other parts of negative volume are inside out:
    /// they are matter too.
    void find_cavities() {
        if (std::accumulate(size_.begin(), size_.end(), 0.0) < 0)
            for (double& size : size_) size = -size;
        std::map<Index, std::vector<Index>> solid; // of each cell
        for (Index p = 0; p < count(); ++p)
            if (size_[p] > 0) solid[cell_[p]].push_back(p);
        for (Index p = 0; p < count(); ++p) {
            if (size_[p] > 0) continue;
            Index around = kNoIndex;
            if (const auto others = solid.find(cell_[p]); !is_cut_[p] && others != solid.end())
                for (const Index other : others->second) {
                    const bool holds = (box_[other].min.array() <= box_[p].min.array()).all() &&
                                       (box_[other].max.array() >= box_[p].max.array()).all();
                    if (holds && (around == kNoIndex || size_[other] < size_[around])) around = other;
                }
            if (around == kNoIndex)
                size_[p] = -size_[p];
            else
                cavities_.emplace_back(p, around);
        }
    }

    bool is_sheet_;
    std::vector<Index> cell_;  ///< of each part
    std::vector<double> size_; ///< volume; of sheets, area
    std::vector<Box> box_;
    std::vector<bool> is_cut_; ///< by a crack
    std::vector<std::pair<Index, Index>> cavities_;
    std::map<std::pair<Index, Index>, double> shared_area_;
};

} // namespace

std::vector<CellTriangle> cell_triangles(const CutSurface& cut, const CrackSurfaces& facets,
                                         const FractureCells& cells) {
    std::vector<CellTriangle> all;
    all.reserve(cut.triangles.size() + 2 * facets.triangles.size() + 2 * cut.polygons.size());
    std::size_t polygon = 0;
    for (Index k = 0; k < cut.triangles.size(); ++k) {
        if (cut.cell_of_triangle[k] != kNoIndex) {
            all.push_back({cut.triangles[k].vertices, cells.piece_of(cut.cell_of_triangle[k]), kNoIndex, k, kNoIndex});
            continue;
        }
        for (; polygon < cut.polygons.size() && cut.polygons[polygon].triangle == k; ++polygon) {
            const CutPolygon& p = cut.polygons[polygon];
            const std::span<const Index> v(cut.polygon_vertices.data() + p.first, p.count);
            for (std::size_t c = 2; c < v.size(); ++c)
                if (v[0] != v[c - 1] && v[c - 1] != v[c] && v[c] != v[0])
                    all.push_back({{v[0], v[c - 1], v[c]}, cells.piece_of(p.cell), kNoIndex, k, kNoIndex});
        }
    }
    for (Index f = 0; f < facets.facets.size(); ++f) {
        const CrackSurface& facet = facets.facets[f];
        for (Index k = 0; k < facet.count; ++k) {
            const Triangle& t = facets.triangles[facet.first + k];
            all.push_back({t, cells.piece_of(facet.i), kNoIndex, kNoIndex, f});
            all.push_back({{t[0], t[2], t[1]}, cells.piece_of(facet.j), kNoIndex, kNoIndex, f});
        }
    }
    return all;
}

PartPieces find_pieces(const CutSurface& cut, std::vector<CellTriangle>& triangles, std::optional<double> smallest,
                       bool is_sheet) {
    const Parts parts(cut, triangles, is_sheet);
    return smallest ? parts.pieces(*smallest) : parts.cell_numbers();
}

std::size_t count_open_edges(const CutSurface& cut, std::span<const CellTriangle> triangles,
                             std::span<const Index> piece_of_part) {
    OwnedVertices owned(cut.vertices.count());
    std::vector<Triangle> named;
    named.reserve(triangles.size());
    for (const CellTriangle& t : triangles) {
        const Index piece = piece_of_part[t.part];
        named.push_back({owned.number(t.vertices[0], piece), owned.number(t.vertices[1], piece),
                         owned.number(t.vertices[2], piece)});
    }
    std::size_t open = 0;
    for (const std::span<const Index> edge : edges_of(named, owned.count())) open += edge_balance(named, edge) != 0;
    return open;
}

} // namespace filigree
