#include "filigree/melting/seam_cells.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace filigree {

namespace {

constexpr int kBandWidth = 3; // cells around what is dropped in which the mesh is cut; twice as many in each round
constexpr int kMeshReach = 3; // nodes so far from the mesh go by its sign, not by the field's
constexpr int kMostRounds = 6;
constexpr float kDeep = 0.25f; // the field's value where new matter joins an old surface it lies on, not skims it

} // namespace

SeamCells::SeamCells(const LivingMesh& mesh, const ParticleField& field, std::span<const Vec3f> renewed)
    : mesh_(mesh), renewed_(renewed) {
    make_grid(mesh, field);
    given_up_.assign(grid_.slot_count(), 0);
}

void SeamCells::make_grid(const LivingMesh& mesh, const ParticleField& field) {
    constexpr int kMargin = kBandWidth + kMeshReach;
    const BlockGrid& from = field.grid;
    std::vector<std::uint64_t> keys = from.keys();
    nodes_below_.resize(mesh.positions.size());
    for (std::size_t v = 0; v < mesh.positions.size(); ++v)
        nodes_below_[v] = from.node_below(mesh.positions[v].cast<double>());
    std::uint64_t last = ~std::uint64_t{0};
    const auto add_box = [&](const Triangle& t) {
        GridNode low, high;
        for (std::size_t a = 0; a < 3; ++a) {
            const auto [l, h] = std::minmax({nodes_below_[t[0]][a], nodes_below_[t[1]][a], nodes_below_[t[2]][a]});
            low[a] = (l - kMargin) >> 3;
            high[a] = (h + kMargin) >> 3;
        }
        for (std::int32_t z = low[2]; z <= high[2]; ++z)
            for (std::int32_t y = low[1]; y <= high[1]; ++y)
                for (std::int32_t x = low[0]; x <= high[0]; ++x) {
                    const std::uint64_t key = BlockGrid::key_of_block(x, y, z);
                    if (key == last) continue; // triangles one after the other share blocks
                    last = key;
                    if (from.block(key) == kNoIndex) keys.push_back(key);
                }
        if (keys.size() > (std::size_t{1} << 22)) {
            std::sort(keys.begin(), keys.end());
            keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
        }
    };
    for (const Triangle& t : mesh.kept) add_box(t);
    for (const Triangle& t : mesh.dying) add_box(t);
    grid_ = BlockGrid(from.cell(), from.shift(), std::move(keys));
    values_.assign(grid_.slot_count(), ParticleField::kOutside);
    for (Index b = 0; b < from.block_count(); ++b)
        std::copy_n(field.values.begin() + std::ptrdiff_t(b) * BlockGrid::kNodes, BlockGrid::kNodes,
                    values_.begin() + std::ptrdiff_t(grid_.block(from.keys()[b])) * BlockGrid::kNodes);
}

Status SeamCells::settle(const RunContext& context) {
    for (int round = 0;; ++round) {
        cuts_all_ = round == kMostRounds;
        mark_band(kBandWidth << std::min(round, kMostRounds));
        cut_band();
        find_crossings();
        sign_nodes();
        if (context.is_cancelled()) return cancelled_error();
        if (give_up_conflicts(context)) return Success{};
        if (context.is_cancelled()) return cancelled_error();
    }
}

/// Calls visit(slot) for the cells of a triangle's box.
template <class Visit>
void SeamCells::for_box(const Triangle& t, const Visit& visit) const {
    GridNode low, high;
    for (std::size_t a = 0; a < 3; ++a)
        std::tie(low[a], high[a]) = std::minmax({nodes_below_[t[0]][a], nodes_below_[t[1]][a], nodes_below_[t[2]][a]});
    for (std::int32_t z = low[2]; z <= high[2]; ++z)
        for (std::int32_t y = low[1]; y <= high[1]; ++y)
            for (std::int32_t x = low[0]; x <= high[0]; ++x) visit(grid_.slot({x, y, z}));
}

void SeamCells::mark_band(int width) {
    cells_.assign(grid_.slot_count(), 0);
    std::vector<Index> front;
    const auto mark = [&](Index slot) {
        if (slot == kNoIndex || (cells_[slot] & kBand)) return;
        cells_[slot] |= kBand;
        front.push_back(slot);
    };
    for (const Triangle& t : mesh_.dying) for_box(t, mark);
    for (Index slot = 0; slot < given_up_.size(); ++slot)
        if (given_up_[slot]) mark(slot);
    for (int ring = 0; ring < width; ++ring) {
        const std::vector<Index> last = std::exchange(front, {});
        for (const Index slot : last)
            for (int q = 0; q < 27; ++q) mark(grid_.step(slot, q % 3 - 1, q / 3 % 3 - 1, q / 9 - 1));
    }
}

void SeamCells::cut_band() {
    cut_.emplace(grid_, mesh_.positions);
    is_cut_.assign(mesh_.kept.size(), false);
    for (Index t = 0; t < mesh_.kept.size(); ++t) {
        bool is_in_band = cuts_all_;
        for_box(mesh_.kept[t], [&](Index slot) { is_in_band = is_in_band || (cells_[slot] & kBand); });
        if (!is_in_band) {
            for_box(mesh_.kept[t], [&](Index slot) { cells_[slot] |= kKept | kFar; });
            continue;
        }
        is_cut_[t] = true;
        cut_->cut(mesh_.kept[t], t);
    }
    for (Index t = 0; t < mesh_.dying.size(); ++t) cut_->cut(mesh_.dying[t], Index(mesh_.kept.size()) + t);
    for (const GridCut::Piece& piece : cut_->pieces())
        cells_[grid_.slot(piece.cell)] |= piece.source < mesh_.kept.size() ? kKept : kDropped;
    for (Index slot = 0; slot < given_up_.size(); ++slot)
        if (given_up_[slot] && (cells_[slot] & kKept)) cells_[slot] |= kDropped;
}

void SeamCells::vote(Index slot, int axis, bool leaves) {
    crossed_[slot] |= std::uint8_t(1 << axis);
    const auto count = [&](Index node, bool inside) {
        if (node != kNoIndex) votes_[node] = std::int8_t(std::clamp(votes_[node] + (inside ? 1 : -1), -100, 100));
    };
    count(slot, leaves);
    count(grid_.step(slot, axis, 1), !leaves);
}

void SeamCells::find_crossings() {
    crossed_.assign(grid_.slot_count(), 0);
    votes_.assign(grid_.slot_count(), 0);
    crossings_.clear();
    // A vertex on two planes lies on an edge of the grid. In a cell, the mesh turns around it from the piece's edge
    // that leaves the vertex on to the one that arrives.
    for (const GridCut::Piece& piece : cut_->pieces())
        for (std::size_t k = 0; k < 3; ++k) {
            const Index at = piece.corners[k], next = piece.corners[(k + 1) % 3];
            if (at < cut_->first_cut()) continue;
            for (int axis = 0; axis < 3; ++axis) {
                const int u = (axis + 1) % 3, v = (axis + 2) % 3;
                if (!cut_->is_on_plane(at, u) || !cut_->is_on_plane(at, v)) continue;
                const bool along_u = cut_->are_on_one_plane(at, next, v); // so it runs along the other axis
                if (!along_u && !cut_->are_on_one_plane(at, next, u)) continue;
                GridNode node;
                for (int a = 0; a < 3; ++a) node[std::size_t(a)] = cut_->place(at, a) >> 1;
                const Index slot = grid_.slot(node);
                const bool same_side = (piece.cell[std::size_t(u)] == node[std::size_t(u)]) ==
                                       (piece.cell[std::size_t(v)] == node[std::size_t(v)]);
                std::vector<Crossing>& here = crossings_[4 * std::uint64_t(slot) + std::uint64_t(axis)];
                if (std::any_of(here.begin(), here.end(), [&](const Crossing& c) { return c.vertex == at; })) continue;
                const float place = cut_->position(at)[axis];
                const auto above = std::find_if(here.begin(), here.end(), [&](const Crossing& c) {
                    return cut_->position(c.vertex)[axis] > place;
                });
                here.insert(above, {at, along_u == same_side});
                vote(slot, axis, along_u == same_side);
            }
        }
    for (Index t = 0; t < mesh_.kept.size(); ++t)
        if (!is_cut_[t])
            for_crossings(mesh_.kept[t], [&](Index slot, int axis, bool leaves) { vote(slot, axis, leaves); });
    // What is dead says nothing of who is inside, but where it still is it parts the two.
    for (const Triangle& t : mesh_.dead)
        for_crossings(t, [&](Index slot, int axis, bool) { crossed_[slot] |= std::uint8_t(1 << axis); });
}

/// Calls visit(slot, axis, leaves) where lines of the grid pierce a triangle of a few cells. Sides of an edge are told
/// alike for both of its triangles.
template <class Visit>
void SeamCells::for_crossings(const Triangle& t, const Visit& visit) const {
    for (int axis = 0; axis < 3; ++axis) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        const auto range = [&](int a) {
            const auto at = [&](int k) { return nodes_below_[t[std::size_t(k)]][std::size_t(a)]; };
            return std::minmax({at(0), at(1), at(2)});
        };
        const auto [u_low, u_high] = range(u);
        const auto [v_low, v_high] = range(v);
        for (std::int32_t nv = v_low + 1; nv <= v_high; ++nv)
            for (std::int32_t nu = u_low + 1; nu <= u_high; ++nu) {
                const double pu = nu * grid_.cell() + grid_.shift()[u], pv = nv * grid_.cell() + grid_.shift()[v];
                const auto is_left = [&](int from, int to) {
                    Index a = t[std::size_t(from)], b = t[std::size_t(to)];
                    const bool swapped = a > b;
                    if (swapped) std::swap(a, b);
                    const Vec3f &p = mesh_.positions[a], &q = mesh_.positions[b];
                    const double area = (double(q[u]) - double(p[u])) * (pv - double(p[v])) -
                                        (double(q[v]) - double(p[v])) * (pu - double(p[u]));
                    return (area > 0) != swapped;
                };
                const bool left = is_left(0, 1);
                if (left != is_left(1, 2) || left != is_left(2, 0)) continue;
                const Vec3d a = mesh_.positions[t[0]].cast<double>();
                const Vec3d normal =
                    (mesh_.positions[t[1]].cast<double>() - a).cross(mesh_.positions[t[2]].cast<double>() - a);
                if (normal[axis] == 0) continue;
                Vec3d at = a;
                at[u] = pu;
                at[v] = pv;
                at[axis] -= (normal[u] * (pu - a[u]) + normal[v] * (pv - a[v])) / normal[axis];
                GridNode node;
                node[std::size_t(u)] = nu;
                node[std::size_t(v)] = nv;
                node[std::size_t(axis)] = grid_.node_below(at)[std::size_t(axis)];
                const Index slot = grid_.slot(node);
                if (slot != kNoIndex) visit(slot, axis, left);
            }
    }
}

/// Near the mesh nodes are on the side that its crossings say, and others by the field; but new matter that lies on an
/// old surface joins it.
void SeamCells::sign_nodes() {
    enum Source : std::uint8_t { kNone, kMesh, kField };
    std::vector<std::uint8_t> sources(grid_.slot_count(), kNone);
    std::vector<Index> front, next;
    const auto claim = [&](Index cell, Source source) {
        for (const Index node : grid_.corners(cell)) {
            if (node == kNoIndex || sources[node] != kNone) continue;
            sources[node] = source;
            front.push_back(node);
        }
    };
    for (Index cell = 0; cell < cells_.size(); ++cell)
        if (keeps(cell)) claim(cell, kMesh);
    for (Index cell = 0; cell < cells_.size(); ++cell)
        if (cells_[cell] & kDropped) claim(cell, kField);
    const auto for_around = [&](Index node, const auto& visit) {
        for (int axis = 0; axis < 3; ++axis)
            for (const int by : {-1, 1})
                if (const Index other = grid_.step(node, axis, by); other != kNoIndex)
                    visit(other, crossed_[by < 0 ? other : node] >> axis & 1);
    };
    for (int step = 0; step < kMeshReach; ++step, std::swap(front, next)) {
        next.clear();
        for (const Index node : front)
            for_around(node, [&](Index other, bool) {
                if (sources[other] != kNone) return;
                sources[other] = sources[node];
                next.push_back(other);
            });
    }

    inside_.resize(grid_.slot_count());
    front.clear();
    std::vector<bool> is_known(grid_.slot_count(), false);
    for (Index node = 0; node < inside_.size(); ++node) {
        inside_[node] = values_[node] > 0;
        if (sources[node] != kMesh || votes_[node] == 0) continue;
        inside_[node] = votes_[node] > 0;
        is_known[node] = true;
        front.push_back(node);
    }
    for (std::size_t i = 0; i < front.size(); ++i)
        for_around(front[i], [&](Index other, bool is_crossed) {
            if (is_crossed || is_known[other] || sources[other] != kMesh) return;
            inside_[other] = inside_[front[i]];
            is_known[other] = true;
            front.push_back(other);
        });

    for (const Vec3f& at : renewed_) {
        const GridNode below = grid_.node_below(at.cast<double>());
        const Index slot = grid_.slot(below);
        for (int q = 0; q < 8 && slot != kNoIndex; ++q)
            if (const Index node = grid_.step(slot, q & 1, q >> 1 & 1, q >> 2);
                node != kNoIndex && values_[node] > kDeep)
                inside_[node] = true;
    }
}

std::array<Index, 4> SeamCells::cells_around(Index slot, int axis) const {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    std::array<Index, 4> cells;
    for (int q = 0; q < 4; ++q) {
        std::array<int, 3> by = {};
        by[std::size_t(u)] = -(q & 1);
        by[std::size_t(v)] = -(q >> 1);
        cells[std::size_t(q)] = grid_.step(slot, by[0], by[1], by[2]);
    }
    return cells;
}

bool SeamCells::touches_pieces(Index slot, int axis) const {
    const std::array<Index, 4> cells = cells_around(slot, axis);
    return std::any_of(cells.begin(), cells.end(), [&](Index cell) { return keeps(cell); });
}

std::span<const SeamCells::Crossing> SeamCells::crossings(Index slot, int axis) const {
    const auto found = crossings_.find(4 * std::uint64_t(slot) + std::uint64_t(axis));
    return found == crossings_.end() ? std::span<const Crossing>() : found->second;
}

bool SeamCells::is_in_conflict(Index slot, int axis) const {
    std::size_t kept = 0;
    for (const Index cell : cells_around(slot, axis)) kept += keeps(cell);
    if (kept == 0 || kept == 4) return false;
    bool inside = is_inside(slot);
    for (const Crossing& crossing : crossings(slot, axis)) {
        if (crossing.leaves != inside) return true;
        inside = !inside;
    }
    return inside != is_inside(grid_.step(slot, axis, 1));
}

/// Returns whether all that was given up had been cut; else another round cuts it.
bool SeamCells::give_up_conflicts(const RunContext& context) {
    std::vector<std::pair<Index, int>> edges;
    const auto add_edges = [&](Index cell) {
        for (int axis = 0; axis < 3; ++axis)
            for (int q = 0; q < 4; ++q) {
                std::array<int, 3> by = {};
                by[std::size_t((axis + 1) % 3)] = q & 1;
                by[std::size_t((axis + 2) % 3)] = q >> 1;
                if (const Index slot = grid_.step(cell, by[0], by[1], by[2]); slot != kNoIndex)
                    edges.emplace_back(slot, axis);
            }
    };
    for (Index cell = 0; cell < cells_.size(); ++cell)
        if (keeps(cell)) add_edges(cell);
    bool all_were_cut = true;
    while (!edges.empty() && !context.is_cancelled()) {
        const auto [slot, axis] = edges.back();
        edges.pop_back();
        if (!is_in_conflict(slot, axis)) continue;
        for (const Index cell : cells_around(slot, axis)) {
            if (!keeps(cell)) continue;
            given_up_[cell] = 1;
            if (cells_[cell] & kFar) { // how its neighbours fare shows when they are cut
                all_were_cut = false;
                continue;
            }
            cells_[cell] |= kDropped;
            add_edges(cell);
        }
    }
    return all_were_cut;
}

} // namespace filigree
