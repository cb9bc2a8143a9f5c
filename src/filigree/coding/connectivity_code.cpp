#include "filigree/coding/connectivity_code.h"

#include <algorithm>
#include <array>

namespace filigree {

namespace {

// Contexts. A vertex's degree goes with what is left at the pivot and at its neighbour.
constexpr unsigned kMore = 0, kFirstDegree = 1, kWhere = 2, kSplit = 3, kHole = 4, kDegree = 5;
constexpr unsigned kPivotClasses = 4, kNeighbourClasses = 7;
static_assert(kDegree + kPivotClasses * kNeighbourClasses <= kConnectivityContexts);

// A symbol of a degree's context: 0 joins a vertex that is there already, others are degrees, the last one all larger.
constexpr std::uint32_t kJoin = 0, kLargeDegree = 63;

/// A vertex on the border between what is known and what is not. The unknown lies left of the edge to the next node.
struct Node {
    Index vertex, previous, next;
    Index known;        ///< half-edge of the known triangle behind the edge to the next node
    std::uint32_t free; ///< edges at the vertex that are not known yet, on this side
    bool is_alive = true;
};

/// Walks over a map triangle by triangle. `Guide` says what comes next: it looks into a map and writes, or it reads.
template <class Guide>
class Walk {
public:
    Walk(Guide& guide, std::size_t most_triangles) : guide_(guide), most_triangles_(most_triangles) {}

    bool run() {
        while (guide_.has_more())
            if (!begin_part() || !fill_part()) return false;
        map.opposite.resize(3 * map.triangles.size());
        return !guide_.is_damaged();
    }

    ClosedMap map;

private:
    Index add_vertex(bool closes_hole) {
        map.closes_hole.push_back(closes_hole);
        return static_cast<Index>(map.closes_hole.size() - 1);
    }

    /// The half-edge from a to b is its first.
    Index add_triangle(Index a, Index b, Index c) {
        const std::size_t first = 3 * map.triangles.size();
        map.triangles.push_back({a, b, c});
        if (first == map.opposite.size()) map.opposite.resize(2 * first + 3 * kFirstTriangles, kNoIndex);
        return static_cast<Index>(first);
    }
    void glue(Index a, Index b) {
        map.opposite[a] = b;
        map.opposite[b] = a;
    }

    Index add_node(Index vertex, Index known, std::uint32_t free) {
        nodes_.push_back({vertex, 0, 0, known, free});
        const auto node = static_cast<Index>(nodes_.size() - 1);
        guide_.border(node, known);
        return node;
    }
    void set_known(Index node, Index half_edge) {
        nodes_[node].known = half_edge;
        guide_.border(node, half_edge);
    }
    void link(Index node, Index next) {
        nodes_[node].next = next;
        nodes_[next].previous = node;
    }
    void put_in_turn(Index node) { turns_[std::min<std::size_t>(nodes_[node].free, kTurns - 1)].push_back(node); }
    /// False: the data have an edge too many there.
    bool take_edge(Index node) {
        if (nodes_[node].free == 0) return false;
        --nodes_[node].free;
        put_in_turn(node);
        return true;
    }

    bool begin_part() {
        guide_.begin_part();
        std::array<Index, 3> v{};
        std::array<std::uint32_t, 3> degree{};
        for (std::size_t k = 0; k < 3; ++k) {
            degree[k] = guide_.first_degree(k);
            if (degree[k] < 2) return false;
            v[k] = add_vertex(guide_.is_hole());
        }
        if (map.triangles.size() >= most_triangles_) return false;
        const Index t = add_triangle(v[0], v[1], v[2]);
        guide_.triangle(kNoIndex);
        std::array<Index, 3> node{};
        for (std::size_t k = 0; k < 3; ++k) // from each corner to the one before: what is unknown lies left
            node[k] = add_node(v[k], t + Index(k + 2) % 3, degree[k] - 2);
        for (std::size_t k = 0; k < 3; ++k) link(node[k], node[(k + 2) % 3]);
        for (const Index n : node) put_in_turn(n);
        return true;
    }

    /// The node with the fewest free edges, of those the one that changed last.
    Index next_pivot() {
        for (std::size_t turn = 0; turn < kTurns; ++turn)
            while (!turns_[turn].empty()) {
                const Index node = turns_[turn].back();
                turns_[turn].pop_back();
                if (nodes_[node].is_alive && std::min<std::size_t>(nodes_[node].free, kTurns - 1) == turn) return node;
            }
        return kNoIndex;
    }

    bool fill_part() {
        for (Index p = next_pivot(); p != kNoIndex; p = next_pivot()) {
            if (map.triangles.size() >= most_triangles_ || guide_.is_damaged()) return false;
            if (!(nodes_[p].free == 0 ? close(p) : extend(p))) return false;
        }
        return true;
    }

    /// The last triangle at a vertex: between its neighbours on the border.
    bool close(Index p) {
        const Index q = nodes_[p].previous, n = nodes_[p].next;
        if (q == n || q == p) return false;
        const Index t = add_triangle(nodes_[q].vertex, nodes_[p].vertex, nodes_[n].vertex);
        guide_.triangle(nodes_[q].known);
        glue(t, nodes_[q].known);
        glue(t + 1, nodes_[p].known);
        nodes_[p].is_alive = false;
        if (nodes_[n].next == q && nodes_[q].free == 0 && nodes_[n].free == 0) { // the last triangle of all
            glue(t + 2, nodes_[n].known);
            nodes_[q].is_alive = nodes_[n].is_alive = false;
            return true;
        }
        link(q, n);
        set_known(q, t + 2);
        return take_edge(q) && take_edge(n);
    }

    /// The next triangle at a vertex, left of the edge to the next node.
    bool extend(Index p) {
        const Index n = nodes_[p].next;
        if (n == p) return false;
        const unsigned context = kDegree + std::min(nodes_[p].free - 1, kPivotClasses - 1) * kNeighbourClasses +
                                 std::min(nodes_[n].free, kNeighbourClasses - 1);
        const std::uint32_t degree = guide_.degree(context, nodes_[p].known);
        Index x, out, in; // the third corner; its nodes towards and from
        if (degree != kJoin) {
            if (degree < 2) return false;
            const Index vertex = add_vertex(guide_.is_hole());
            x = add_third(p, n, vertex);
            out = in = add_node(vertex, x + 1, degree - 2);
            put_in_turn(out);
        } else {
            const Index t = guide_.join(nodes_.size());
            if (t >= nodes_.size() || !nodes_[t].is_alive || t == p || t == n || nodes_[t].free < 2) return false;
            const std::uint32_t left = guide_.split(nodes_[t].free - 2);
            if (left > nodes_[t].free - 2) return false;
            x = add_third(p, n, nodes_[t].vertex);
            out = t;
            in = add_node(nodes_[t].vertex, x + 1, nodes_[t].free - 2 - left);
            link(nodes_[t].previous, in);
            nodes_[t].free = left;
            put_in_turn(out);
            put_in_turn(in);
        }
        link(p, out);
        set_known(p, x + 2);
        link(in, n);
        return take_edge(p) && take_edge(n);
    }
    Index add_third(Index p, Index n, Index vertex) {
        const Index t = add_triangle(nodes_[p].vertex, nodes_[n].vertex, vertex);
        guide_.triangle(nodes_[p].known);
        glue(t, nodes_[p].known);
        return t;
    }

    static constexpr std::size_t kTurns = 8, kFirstTriangles = 64;
    Guide& guide_;
    std::size_t most_triangles_;
    std::vector<Node> nodes_;
    std::array<std::vector<Index>, kTurns> turns_;
};

/// Looks into a map, and writes what comes next.
class Writer {
public:
    Writer(const ClosedMap& map, SymbolWriter& out)
        : map_(map), out_(out), number_(map.vertex_count(), kNoIndex), degree_(map.vertex_count(), 0),
          is_done_(map.triangles.size(), false), node_(map.opposite.size(), kNoIndex) {
        for (const Triangle& t : map.triangles)
            for (const Index v : t) ++degree_[v];
    }

    std::vector<Index> vertices, half_edges; ///< in the order of the walk

    bool is_damaged() const { return false; }
    bool has_more() {
        while (next_ < is_done_.size() && is_done_[next_]) ++next_;
        out_.symbol(kMore, next_ < is_done_.size());
        return next_ < is_done_.size();
    }
    void begin_part() { current_ = static_cast<Index>(3 * next_); }
    std::uint32_t first_degree(std::size_t corner) {
        const Index v = map_.triangles[next_][corner];
        out_.number(kFirstDegree, degree_[v]);
        visit(v);
        return degree_[v];
    }
    bool is_hole() {
        const bool closes = map_.closes_hole[vertices.back()];
        out_.symbol(kHole, closes);
        return closes;
    }
    /// A triangle behind a known half-edge of the walk's map, or the part's first.
    void triangle(Index known) {
        const Index half_edge = known == kNoIndex ? current_ : behind(known);
        is_done_[half_edge / 3] = true;
        half_edges.push_back(half_edge);
    }
    /// The border runs along a known half-edge now.
    void border(Index node, Index known) { node_[behind(known)] = node; }

    std::uint32_t degree(unsigned context, Index known) {
        current_ = behind(known);
        const Index third = map_.origin(previous_half_edge(current_));
        if (number_[third] != kNoIndex) {
            out_.symbol(context, kJoin);
            return kJoin;
        }
        visit(third);
        const std::uint32_t degree = degree_[third];
        out_.symbol(context, std::min(degree, kLargeDegree));
        if (degree >= kLargeDegree) out_.number(kFirstDegree, degree - kLargeDegree);
        return degree;
    }
    /// The node at the third corner that has this triangle on its unknown side.
    Index join(std::size_t nodes) {
        left_ = 0;
        Index h = map_.turn_clockwise(previous_half_edge(current_));
        for (; is_inside(h); h = map_.turn_clockwise(h)) ++left_;
        out_.number(kWhere, static_cast<std::uint32_t>(nodes - 1 - node_[h]));
        return node_[h];
    }
    std::uint32_t split(std::uint32_t) {
        out_.number(kSplit, left_);
        return left_;
    }

private:
    /// In the map, the half-edge that is opposite of one that the walk knows.
    Index behind(Index known) const {
        const Index first = half_edges[known / 3];
        Index half_edge = first;
        for (Index k = 0; k < known % 3; ++k) half_edge = next_half_edge(half_edge);
        return map_.opposite[half_edge];
    }
    /// Whether neither side of an edge is known. What lies right of the border's edges is known.
    bool is_inside(Index half_edge) const { return !is_done_[map_.opposite[half_edge] / 3]; }
    void visit(Index vertex) {
        number_[vertex] = static_cast<Index>(vertices.size());
        vertices.push_back(vertex);
    }

    const ClosedMap& map_;
    SymbolWriter& out_;
    std::vector<Index> number_;
    std::vector<std::uint32_t> degree_;
    std::vector<bool> is_done_;
    std::vector<Index> node_; ///< of half-edges of the map along the border
    std::size_t next_ = 0;
    Index current_ = 0;
    std::uint32_t left_ = 0;
};

class Reader {
public:
    explicit Reader(SymbolReader& in) : in_(in) {}

    bool is_damaged() const { return in_.is_damaged(); }
    bool has_more() { return in_.symbol(kMore) != 0 && !in_.is_damaged(); }
    void begin_part() {}
    std::uint32_t first_degree(std::size_t) { return in_.number(kFirstDegree); }
    bool is_hole() { return in_.symbol(kHole) != 0; }
    void triangle(Index) {}
    void border(Index, Index) {}
    std::uint32_t degree(unsigned context, Index) {
        const std::uint32_t degree = in_.symbol(context);
        return degree < kLargeDegree ? degree : kLargeDegree + std::min(in_.number(kFirstDegree), kNoIndex / 2);
    }
    Index join(std::size_t nodes) { return static_cast<Index>(nodes - 1 - in_.number(kWhere)); }
    std::uint32_t split(std::uint32_t) { return in_.number(kSplit); }

private:
    SymbolReader& in_;
};

} // namespace

WalkedMap encode_connectivity(const ClosedMap& map, SymbolWriter& out) {
    Writer writer(map, out);
    Walk<Writer> walk(writer, map.triangles.size());
    walk.run();
    return {std::move(walk.map), std::move(writer.vertices), std::move(writer.half_edges)};
}

std::optional<WalkedMap> decode_connectivity(SymbolReader& in, std::size_t most_triangles) {
    Reader reader(in);
    Walk<Reader> walk(reader, most_triangles);
    if (!walk.run()) return std::nullopt;
    return WalkedMap{std::move(walk.map), {}, {}};
}

} // namespace filigree
