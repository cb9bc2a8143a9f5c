// After Molino, Bao and Fedkiw, A virtual node algorithm for changing mesh topology during simulation, 2004: corners
// have copies by the matter around them. Here each cell is of one part, so that a lattice index still names one cell.
#include "filigree/physics/body/separate_parts.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/core/parallel_for.h"
#include "filigree/physics/body/joined_parts.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/body/sample_blocks.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <map>
#include <tuple>

namespace filigree {

namespace {

using LatticeIndex = Cells::LatticeIndex;
using Bits = std::uint64_t; ///< of the 4^3 cubes of a cell: x + 4 y + 16 z

constexpr int kSide = int(Cells::kHomesAlong);
static_assert(Cells::kHomesAlong == kSamplesAlong && kSide * kSide * kSide == 64);

Bits bit_at(int x, int y, int z) { return Bits{1} << (x + kSide * (y + kSide * z)); }

/// The bits and those beside them, corners included.
Bits grown(Bits bits) {
    constexpr Bits kFirstX = 0x1111111111111111, kFirstY = 0x000f000f000f000f;
    bits |= ((bits & ~(kFirstX << 3)) << 1) | ((bits & ~kFirstX) >> 1);
    bits |= ((bits & ~(kFirstY << 12)) << 4) | ((bits & ~kFirstY) >> 4);
    return bits | (bits << 16) | (bits >> 16);
}

/// What hangs together of a cell's samples; the largest first.
std::vector<Bits> pieces_of(Bits samples) {
    std::vector<Bits> pieces;
    while (samples != 0) {
        Bits piece = samples & (~samples + 1);
        for (Bits next = grown(piece) & samples; next != piece; next = grown(piece) & samples) piece = next;
        pieces.push_back(piece);
        samples &= ~piece;
    }
    std::ranges::stable_sort(pieces, std::greater{}, [](Bits bits) { return std::popcount(bits); });
    return pieces;
}

class PartSeparator {
public:
    PartSeparator(const Occupancy& samples, Cells& cells, const RunContext& context)
        : samples_(samples), cells_(cells), context_(context), gaps_(cells.corners.size(), 0),
          is_at_gap_(cells.corners.size(), 0), first_piece_(cells.cells.size(), kNoIndex) {}

    Result<JoinedParts> run() {
        find_gaps();
        if (context_.is_cancelled()) return cancelled_error();
        find_components();
        find_homes();
        find_dropped();
        find_groups();
        find_owners();
        const JoinedParts left = joined_still();
        rebuild();
        return left;
    }

private:
    struct Piece {
        Index cell;
        Bits samples;
        Index home = kNoIndex; ///< a cell that counts for it; kNoIndex: its own
    };

    int contains(int x, int y, int z) const {
        const auto& counts = samples_.counts;
        return x >= 0 && y >= 0 && z >= 0 && x < int(counts[0]) && y < int(counts[1]) && z < int(counts[2]) &&
               samples_.contains(std::size_t(x), std::size_t(y), std::size_t(z));
    }
    Bits samples_in(const LatticeIndex& cell) const {
        Bits bits = 0;
        for (int z = 0; z < kSide; ++z)
            for (int y = 0; y < kSide; ++y)
                for (int x = 0; x < kSide; ++x)
                    if (contains(kSide * cell[0] + x, kSide * cell[1] + y, kSide * cell[2] + z))
                        bits |= bit_at(x, y, z);
        return bits;
    }

    Index corner_at(int i, int j, int k) const {
        if (std::min({i, j, k}) < 0 || std::max({i, j, k}) > 65535) return kNoIndex;
        const LatticeIndex at = {std::uint16_t(i), std::uint16_t(j), std::uint16_t(k)};
        const auto found = std::ranges::lower_bound(cells_.corners, at, comes_before);
        return found != cells_.corners.end() && *found == at ? Index(found - cells_.corners.begin()) : kNoIndex;
    }
    /// The cell in which a corner is number 7 - octant.
    Index cell_around(Index corner, int octant) const {
        const LatticeIndex& at = cells_.corners[corner];
        return cells_.find_cell(at[0] - 1 + (octant & 1), at[1] - 1 + (octant >> 1 & 1), at[2] - 1 + (octant >> 2));
    }

    /// Makes the pieces of a cell when first asked for: Piece numbers of it.
    std::span<const Piece> pieces(Index cell) {
        if (first_piece_[cell] == kNoIndex) {
            first_piece_[cell] = Index(pieces_.size());
            const std::vector<Bits> found = pieces_of(samples_in(cells_.cells[cell]));
            piece_counts_[cell] = Index(found.size());
            for (const Bits bits : found) pieces_.push_back({cell, bits});
        }
        return std::span(pieces_).subspan(first_piece_[cell], piece_counts_[cell]);
    }

    /// Whether samples of two pieces lie beside each other.
    bool touch(Index one, Index other) {
        if (one > other) std::swap(one, other);
        const auto [known, is_new] = touches_.try_emplace({one, other}, false);
        if (!is_new) return known->second;
        const LatticeIndex &from = cells_.cells[pieces_[one].cell], &to = cells_.cells[pieces_[other].cell];
        for (Bits left = pieces_[one].samples; left != 0; left &= left - 1) {
            const int n = std::countr_zero(left);
            const std::array<int, 3> at = {n % kSide + kSide * (int(from[0]) - int(to[0])),
                                           n / kSide % kSide + kSide * (int(from[1]) - int(to[1])),
                                           n / kSide / kSide + kSide * (int(from[2]) - int(to[2]))};
            for (int k = 0; k < 27; ++k) {
                const int x = at[0] + k % 3 - 1, y = at[1] + k / 3 % 3 - 1, z = at[2] + k / 9 - 1;
                if (std::min({x, y, z}) < 0 || std::max({x, y, z}) >= kSide) continue;
                if (pieces_[other].samples & bit_at(x, y, z)) return known->second = true;
            }
        }
        return false;
    }

    /// The pieces in the cells around a corner, in sets that hang together there.
    struct Around {
        std::vector<Index> pieces, sets; ///< the set of each: the first number among `pieces`
    };
    Around around(Index corner) {
        Around found;
        for (int octant = 0; octant < 8; ++octant)
            if (const Index cell = cell_around(corner, octant); cell != kNoIndex)
                for (std::size_t k = 0; k < pieces(cell).size(); ++k)
                    found.pieces.push_back(first_piece_[cell] + Index(k));
        DisjointSets sets(found.pieces.size());
        for (Index a = 0; a < found.pieces.size(); ++a)
            for (Index b = a + 1; b < found.pieces.size(); ++b)
                if (pieces_[found.pieces[a]].cell != pieces_[found.pieces[b]].cell &&
                    touch(found.pieces[a], found.pieces[b]))
                    sets.join(a, b);
        for (Index a = 0; a < found.pieces.size(); ++a) found.sets.push_back(sets.root(a));
        return found;
    }

    /// Corners in whose cells two parts lie: those at gaps and deep creases, and from there on.
    void find_gaps() {
        const GapFinder finder(samples_);
        parallel_for(context_, gaps_.size(), 256, [&](std::size_t begin, std::size_t end) {
            for (std::size_t c = begin; c < end && !context_.is_cancelled(); ++c) {
                gaps_[c] = std::uint8_t(finder.gap(cells_.corners[c]));
                is_at_gap_[c] = gaps_[c] > 0 || finder.parts_near(cells_.corners[c]);
            }
        });
        for (Index c = 0; c < gaps_.size(); ++c)
            if (is_at_gap_[c]) at_gaps_.push_back(c);
        for (std::size_t next = 0; next < at_gaps_.size(); ++next) { // grows
            const LatticeIndex at = cells_.corners[at_gaps_[next]];
            for (int n = 0; n < 27; ++n) {
                const Index corner = corner_at(at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1);
                if (corner == kNoIndex || is_at_gap_[corner]) continue;
                const Around found = around(corner);
                if (std::ranges::none_of(found.sets, [](Index set) { return set != 0; })) continue;
                is_at_gap_[corner] = 1;
                at_gaps_.push_back(corner);
            }
        }
        std::ranges::sort(at_gaps_);
    }

    /// What hangs together at all gaps, to know flecks by: these stay in their cells.
    void find_components() {
        for (const Index corner : at_gaps_) around_.push_back(around(corner));
        DisjointSets sets(pieces_.size());
        for (const Around& found : around_)
            for (Index a = 0; a < found.pieces.size(); ++a) sets.join(found.pieces[a], found.pieces[found.sets[a]]);
        std::vector<int> samples(pieces_.size());
        for (Index p = 0; p < pieces_.size(); ++p) samples[sets.root(p)] += std::popcount(pieces_[p].samples);
        for (Index p = 0; p < pieces_.size(); ++p) is_fleck_.push_back(samples[sets.root(p)] < kLeastPart);
    }

    bool is_main(Index piece) const { return first_piece_[pieces_[piece].cell] == piece; }

    /// Where a cell's smaller pieces count: in a cell around the same corner whose main piece hangs together with it.
    void find_homes() {
        std::vector<int> most(pieces_.size(), 0);
        for (const Around& found : around_)
            for (Index a = 0; a < found.pieces.size(); ++a) {
                Piece& piece = pieces_[found.pieces[a]];
                if (is_main(found.pieces[a]) || is_fleck_[found.pieces[a]]) continue;
                const Index main =
                    Index(std::ranges::find(found.pieces, first_piece_[piece.cell]) - found.pieces.begin());
                if (found.sets[a] == found.sets[main]) continue; // hangs together with its own cell there
                for (Index b = 0; b < found.pieces.size(); ++b) {
                    if (found.sets[b] != found.sets[a] || !is_main(found.pieces[b])) continue;
                    const Index home = pieces_[found.pieces[b]].cell;
                    const int rank =
                        64 * (3 - steps_between(piece.cell, home)) + std::popcount(pieces_[found.pieces[b]].samples);
                    if (rank <= most[found.pieces[a]]) continue;
                    most[found.pieces[a]] = rank;
                    piece.home = home;
                }
            }
    }
    int steps_between(Index one, Index other) const {
        int steps = 0;
        for (int axis = 0; axis < 3; ++axis)
            steps += std::abs(int(cells_.cells[one][axis]) - int(cells_.cells[other][axis]));
        return steps;
    }

    /// The sets of main pieces around a corner at a gap; flecks are of the largest.
    std::map<Index, Index> sets_of_cells(const Around& found) const {
        std::map<Index, int> samples;
        for (Index a = 0; a < found.pieces.size(); ++a)
            samples[found.sets[a]] += std::popcount(pieces_[found.pieces[a]].samples);
        Index largest = 0;
        for (const auto& [set, count] : samples)
            if (count > samples[largest]) largest = set;
        std::map<Index, Index> sets; // of cells
        for (Index a = 0; a < found.pieces.size(); ++a)
            if (is_main(found.pieces[a]))
                sets[pieces_[found.pieces[a]].cell] = is_fleck_[found.pieces[a]] ? largest : found.sets[a];
        return sets;
    }
    static bool differ(const std::map<Index, Index>& sets) {
        return std::ranges::any_of(sets, [&](const auto& set) { return set.second != sets.begin()->second; });
    }

    /// Cells without samples where parts come apart: they would hold the parts together.
    void find_dropped() {
        is_dropped_.assign(cells_.cells.size(), 0);
        is_parted_.assign(cells_.cells.size(), 0);
        for (std::size_t n = 0; n < at_gaps_.size(); ++n) {
            sets_.push_back(sets_of_cells(around_[n]));
            if (!differ(sets_.back())) continue;
            for (int octant = 0; octant < 8; ++octant)
                if (const Index cell = cell_around(at_gaps_[n], octant); cell != kNoIndex) {
                    is_parted_[cell] = 1;
                    if (pieces(cell).empty()) is_dropped_[cell] = 1;
                }
        }
    }

    /// Which copy of a corner each cell has: a number below the corner's count of copies.
    void find_groups() {
        copies_.assign(cells_.corners.size(), 1);
        for (std::size_t n = 0; n < at_gaps_.size(); ++n) {
            if (!differ(sets_[n])) continue;
            std::vector<Index> known; // sets, by copy
            for (int octant = 0; octant < 8; ++octant) {
                const Index cell = cell_around(at_gaps_[n], octant);
                if (cell == kNoIndex || is_dropped_[cell]) continue;
                const Index set = sets_[n].at(cell);
                const auto found = std::ranges::find(known, set);
                copy_of_[{cell, 7 - octant}] = Index(found - known.begin());
                if (found == known.end()) known.push_back(set);
            }
            copies_[at_gaps_[n]] = Index(known.size());
        }
    }

    /// Of the cubes of cells where parts come apart: the cells that count for points in them.
    void find_owners() {
        for (Index cell = 0; cell < cells_.cells.size(); ++cell)
            if (is_parted_[cell]) find_owners(cell);
    }
    struct Sample {
        std::array<int, 3> at;
        Index owner;
    };
    void find_owners(Index cell) {
        const LatticeIndex at = cells_.cells[cell];
        std::vector<Sample> samples;
        for (int n = 0; n < 27; ++n) {
            const std::array<int, 3> step = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
            const Index beside = cells_.find_cell(at[0] + step[0], at[1] + step[1], at[2] + step[2]);
            if (beside == kNoIndex) continue;
            for (const Piece& piece : pieces(beside))
                for (Bits left = piece.samples; left != 0; left &= left - 1) {
                    const int bit = std::countr_zero(left);
                    samples.push_back({{bit % kSide + kSide * step[0], bit / kSide % kSide + kSide * step[1],
                                        bit / kSide / kSide + kSide * step[2]},
                                       piece.home == kNoIndex ? piece.cell : piece.home});
                }
        }
        if (samples.empty()) return;
        std::map<Index, Bits> owned;
        for (int bit = 0; bit < 64; ++bit) {
            const std::array<int, 3> place = {bit % kSide, bit / kSide % kSide, bit / kSide / kSide};
            int least = std::numeric_limits<int>::max();
            Index owner = kNoIndex;
            for (const Sample& sample : samples) {
                int squares = 0;
                for (int axis = 0; axis < 3; ++axis)
                    squares += (sample.at[axis] - place[axis]) * (sample.at[axis] - place[axis]);
                if (squares >= least) continue;
                least = squares;
                owner = sample.owner;
            }
            if (owner != cell && (is_dropped_[cell] || !share_corner(cell, owner) || least == 0))
                owned[owner] |= Bits{1} << bit;
        }
        for (const auto& [owner, bits] : owned) homes_.push_back({at, bits, owner});
        if (!is_dropped_[cell] || owned.empty()) return;
        const auto largest =
            std::ranges::max_element(owned, {}, [](const auto& entry) { return std::popcount(entry.second); });
        heir_[cell] = largest->first;
    }
    /// Of cells that stay.
    bool share_corner(Index one, Index other) const {
        for (int a = 0; a < 8; ++a)
            for (int b = 0; b < 8; ++b)
                if (cells_.cell_corners[one][a] == cells_.cell_corners[other][b] && copy(one, a) == copy(other, b))
                    return true;
        return false;
    }
    Index copy(Index cell, int corner) const {
        const auto found = copy_of_.find({cell, corner});
        return found == copy_of_.end() ? 0 : found->second;
    }

    JoinedParts joined_still() const {
        std::vector<std::uint8_t> left(gaps_.size(), 0);
        for (std::size_t n = 0; n < at_gaps_.size(); ++n)
            if (holds_two(n)) left[at_gaps_[n]] = gaps_[at_gaps_[n]];
        return joined_parts_of(left, cells_);
    }
    /// Whether a cell around a corner moves with two parts there.
    bool holds_two(std::size_t n) const {
        if (copies_[at_gaps_[n]] == 1 && differ(sets_[n])) return true;
        const Around& found = around_[n];
        for (Index a = 0; a < found.pieces.size(); ++a) {
            const Piece& piece = pieces_[found.pieces[a]];
            if (is_main(found.pieces[a]) || is_fleck_[found.pieces[a]] || piece.home != kNoIndex) continue;
            const auto main = std::ranges::find(found.pieces, first_piece_[piece.cell]) - found.pieces.begin();
            if (found.sets[a] != found.sets[std::size_t(main)]) return true;
        }
        return false;
    }

    void move_matter() {
        for (const Piece& piece : pieces_) {
            if (piece.home == kNoIndex || is_dropped_[piece.home]) continue;
            int all = 0;
            for (const Piece& other : pieces(piece.cell)) all += std::popcount(other.samples);
            const float moved = std::min(cells_.fraction[piece.cell] * float(std::popcount(piece.samples)) / float(all),
                                         cells_.fraction[piece.cell] - Cells::kLeastFraction);
            if (!(moved > 0)) continue;
            cells_.fraction[piece.cell] -= moved;
            cells_.fraction[piece.home] += moved;
        }
        for (const auto& [dropped, heir] : heir_) cells_.fraction[heir] += cells_.fraction[dropped];
    }

    void rebuild() {
        if (std::ranges::all_of(copies_, [](Index copies) { return copies == 1; })) return;
        move_matter();
        std::vector<Index> kept; // old numbers
        std::vector<Index> number(cells_.cells.size(), kNoIndex);
        std::vector<LatticeIndex> indices;
        for (Index cell = 0; cell < cells_.cells.size(); ++cell) {
            if (is_dropped_[cell]) continue;
            number[cell] = Index(kept.size());
            kept.push_back(cell);
            indices.push_back(cells_.cells[cell]);
        }
        Cells made = lattice_cells(std::move(indices), cells_.spacing, cells_.origin);
        for (Index cell = 0; cell < kept.size(); ++cell) {
            made.fraction[cell] = cells_.fraction[kept[cell]];
            made.centroid[cell] = cells_.centroid[kept[cell]];
        }
        // Copies of a corner come one after the other.
        std::vector<Index> first(made.corners.size());
        std::vector<LatticeIndex> corners;
        for (Index c = 0; c < made.corners.size(); ++c) {
            first[c] = Index(corners.size());
            const Index old = corner_at(made.corners[c][0], made.corners[c][1], made.corners[c][2]);
            corners.insert(corners.end(), copies_[old], made.corners[c]);
        }
        for (Index cell = 0; cell < kept.size(); ++cell)
            for (int n = 0; n < 8; ++n)
                made.cell_corners[cell][n] = first[made.cell_corners[cell][n]] + copy(kept[cell], n);
        made.corners = std::move(corners);
        made.runs.clear();
        for (Cells::Home home : homes_)
            if (home.cell = number[home.cell]; home.cell != kNoIndex) made.homes.push_back(home);
        std::ranges::stable_sort(made.homes, comes_before, &Cells::Home::at);
        cells_ = std::move(made);
    }

    static bool comes_before(const LatticeIndex& a, const LatticeIndex& b) {
        return std::tie(a[2], a[1], a[0]) < std::tie(b[2], b[1], b[0]);
    }

    const Occupancy& samples_;
    Cells& cells_;
    const RunContext& context_;
    std::vector<std::uint8_t> gaps_, is_at_gap_; ///< of each corner: GapFinder::gap; in at_gaps_
    std::vector<Index> at_gaps_;                 ///< corners
    std::vector<Piece> pieces_;                  ///< of the cells that were asked for, one after the other
    std::vector<Index> first_piece_;             ///< of each cell
    std::map<Index, Index> piece_counts_;        ///< of each cell with pieces_
    std::map<std::pair<Index, Index>, bool> touches_;
    std::vector<Around> around_;                       ///< of at_gaps_
    std::vector<std::map<Index, Index>> sets_;         ///< of at_gaps_: of the cells around
    std::vector<std::uint8_t> is_fleck_;               ///< of each piece
    std::vector<std::uint8_t> is_dropped_, is_parted_; ///< of each cell: has no samples; lies where parts come apart
    std::map<Index, Index> heir_;                      ///< of dropped cells
    std::vector<Index> copies_;                        ///< of each corner
    std::map<std::pair<Index, int>, Index> copy_of_;   ///< of cells and their corners, where there are several
    std::vector<Cells::Home> homes_;                   ///< by old numbers of cells
};

} // namespace

Result<std::optional<JoinedParts>> separate_parts(std::span<const Vec3f> positions, const WeldedTriangles& welded,
                                                  double scale, Cells& cells, const RunContext& context) {
    RunContext quiet = context;
    quiet.progress = nullptr;
    const Result<std::optional<Occupancy>> samples = gap_samples(positions, welded, scale, cells, quiet);
    if (!samples) return samples.error();
    if (!*samples) return std::optional<JoinedParts>();
    const Result<JoinedParts> left = PartSeparator(**samples, cells, quiet).run();
    if (!left) return left.error();
    return std::optional<JoinedParts>(*left);
}

} // namespace filigree
