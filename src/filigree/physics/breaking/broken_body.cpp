#include "filigree/physics/breaking/broken_body.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/core/parallel_for.h"
#include "filigree/physics/body/embedding.h"
#include "filigree/physics/body/fields.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/body/surface_points.h"
#include "filigree/physics/breaking/piece_regions.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace filigree {

namespace {

constexpr int kCellSamples = 6; ///< along each axis of a cell that pieces share
constexpr float kSpeck = 0.25f; ///< samples that a piece counts as which none found in a cell
constexpr float kGap = 0.02f;   ///< spacings that a crack's surface points keep from the other pieces at rest
constexpr int kGapSteps = 6;
constexpr float kCrackPointSpacing = 1; ///< spacings

/// Part of a triangle where a function, linear in it, is negative.
float part_below_zero(const std::array<float, 3>& values) {
    int below = 0;
    for (const float v : values) below += v < 0;
    if (below == 0 || below == 3) return below == 0 ? 0.0f : 1.0f;
    for (int n = 0; n < 3; ++n) { // the one that differs from both others
        const float a = values[n], b = values[(n + 1) % 3], c = values[(n + 2) % 3];
        if ((a < 0) == (b < 0) || (a < 0) == (c < 0)) continue;
        const float part = a * a / ((a - b) * (a - c));
        return below == 1 ? part : 1 - part;
    }
    return 0;
}

class BodyBreaker {
public:
    BodyBreaker(std::shared_ptr<const Body> whole, Partition partition, const RunContext& context)
        : whole_(*whole), context_(context), h_(float(whole->spacing())) {
        result_.whole = std::move(whole);
        result_.partition = std::move(partition);
    }

    Result<BrokenBody> run() {
        const PieceGrid grid(whole_.cells, result_.partition, context_);
        const Index count = result_.partition.count;
        shares_.resize(whole_.cells.cells.size());
        find_shares(grid);
        for (Index piece = 0; piece < count; ++piece) {
            if (context_.is_cancelled()) return cancelled_error();
            regions_.push_back(grid.region(piece));
        }
        find_facets();
        for (std::size_t s = 0; s < whole_.surface.points.size(); ++s) take_point(s);
        if (Status made = make_pieces(); !made) return made.error();
        find_copies();
        number_facets();
        find_links();
        find_links_beside();
        return std::move(result_);
    }

private:
    const Vec3d at_rest(const Vec3f& point) const { return point.cast<double>(); }
    float depth_field(const Vec3f& point) const { return whole_.field->at(point).distance - whole_.field_radius; }

    /// The parts of a cell: of pieces, in samples.
    using Shares = std::vector<std::pair<Index, float>>;
    static void add_share(Shares& shares, Index piece, float samples) {
        for (auto& [of, count] : shares)
            if (of == piece) {
                count += samples;
                return;
            }
        shares.emplace_back(piece, samples);
    }
    static void ensure_share(Shares& shares, Index piece) {
        for (auto& [of, count] : shares)
            if (of == piece) {
                count = std::max(count, kSpeck);
                return;
            }
        shares.emplace_back(piece, kSpeck);
    }

    void find_shares(const PieceGrid& grid) {
        parallel_for(context_, shares_.size(), 64, [&](std::size_t begin, std::size_t end) {
            for (std::size_t c = begin; c < end; ++c) {
                if (grid.is_pure(Index(c))) {
                    shares_[c] = {{grid.at_centre(Index(c)), 1.0f}};
                    continue;
                }
                Shares inside, all;
                const auto& cell = whole_.cells.cells[c];
                for (int n = 0; n < kCellSamples * kCellSamples * kCellSamples; ++n) {
                    const Vec3d at(cell[0] + (n % kCellSamples + 0.5) / kCellSamples,
                                   cell[1] + (n / kCellSamples % kCellSamples + 0.5) / kCellSamples,
                                   cell[2] + (n / kCellSamples / kCellSamples + 0.5) / kCellSamples);
                    const Vec3d point = whole_.cells.origin + whole_.spacing() * at;
                    const Index piece = result_.partition.piece_at(point);
                    add_share(all, piece, 1);
                    if (depth_field(point.cast<float>()) < 0) add_share(inside, piece, 1);
                }
                shares_[c] = inside.empty() ? all : inside;
            }
        });
    }

    /// The piece across a region's border, kNoIndex where the grid ends.
    Index across(Index piece, const Vec3f& at, const Vec3f& normal) const {
        for (const float step : {0.01f, 0.03f, 0.1f}) {
            const Index other = result_.partition.piece_at((at + step * h_ * normal).cast<double>());
            if (other != piece) return other;
        }
        return kNoIndex;
    }

    void find_facets() {
        using Key = std::tuple<Index, Index, Index>; // whole cell, pieces
        struct Sum {
            Vec3f vector = Vec3f::Zero();
            float area = 0;
            std::array<float, 8> at_corner = {};
        };
        std::map<Key, Sum> sums;
        for (Index piece = 0; piece < regions_.size(); ++piece) {
            PieceGrid::Region& region = regions_[piece];
            std::vector<Triangle> inner;
            for (std::size_t t = 0; t < region.triangles.size(); ++t) {
                const Index cell = region.cells[t];
                if (cell == kNoIndex) continue;
                const auto& [a, b, c] = region.triangles[t];
                const Vec3f &p = region.positions[a], &q = region.positions[b], &r = region.positions[c];
                const float part = part_below_zero({depth_field(p), depth_field(q), depth_field(r)});
                if (!(part > 0)) continue;
                const Vec3f vector = 0.5f * part * (q - p).cross(r - p);
                const float area = vector.norm();
                if (!(area > 1e-9f * h_ * h_)) continue;
                const Vec3f middle = (p + q + r) / 3;
                const Index other = across(piece, middle, vector / area);
                if (other == kNoIndex) continue;
                inner.push_back(region.triangles[t]);
                ensure_share(shares_[cell], piece);
                ensure_share(shares_[cell], other);
                if (other < piece) continue; // counted from the other side
                Sum& sum = sums[{cell, piece, other}];
                sum.vector += vector;
                sum.area += area;
                const Vec3d local =
                    (middle.cast<double>() - whole_.cells.origin) / whole_.spacing() -
                    Vec3d(whole_.cells.cells[cell][0], whole_.cells.cells[cell][1], whole_.cells.cells[cell][2]);
                for (int n = 0; n < 8; ++n) {
                    double weight = 1;
                    for (int axis = 0; axis < 3; ++axis) {
                        const double x = std::clamp(local[axis], 0.0, 1.0);
                        weight *= n >> axis & 1 ? x : 1 - x;
                    }
                    sum.at_corner[n] += float(weight) * area;
                }
            }
            inner_triangles_.push_back(std::move(inner));
        }
        for (const auto& [key, sum] : sums) {
            const auto& [cell, a, b] = key;
            const float length = sum.vector.norm();
            if (!(length > 0.05f * sum.area)) continue; // folded onto itself
            CrackFacet& facet = result_.facets.emplace_back(
                CrackFacet{{a, b}, {kNoIndex, kNoIndex}, cell, sum.vector / length, sum.area, sum.at_corner, {}});
            for (float& share : facet.shares) share /= sum.area;
        }
    }

    Index cell_of(const Vec3f& point) const {
        const Vec3d at = ((at_rest(point) - whole_.cells.origin) / whole_.spacing()).array().floor();
        return whole_.cells.find_cell(int(at[0]), int(at[1]), int(at[2]));
    }

    /// The body's own surface points go to the pieces they lie in.
    void take_point(std::size_t s) {
        const Vec3f& point = whole_.surface.points.rest[s];
        const Index piece = result_.partition.piece_at(at_rest(point));
        if (const Index cell = cell_of(point); cell != kNoIndex) ensure_share(shares_[cell], piece);
        points_of_piece_.resize(result_.partition.count);
        points_of_piece_[piece].push_back(Index(s));
    }

    Status make_pieces() {
        points_of_piece_.resize(result_.partition.count);
        std::vector<std::vector<Index>> cells_of(result_.partition.count);
        for (Index c = 0; c < shares_.size(); ++c)
            for (const auto& [piece, samples] : shares_[c]) cells_of[piece].push_back(c);
        result_.piece_of_number.assign(result_.partition.count, kNoIndex);
        for (Index number = 0; number < result_.partition.count; ++number) {
            if (cells_of[number].empty()) continue;
            result_.piece_of_number[number] = Index(result_.number_of_piece.size());
            result_.number_of_piece.push_back(number);
            result_.cells_of_whole.push_back(std::move(cells_of[number]));
        }
        std::vector<std::shared_ptr<Body>> bodies;
        for (std::size_t k = 0; k < result_.cells_of_whole.size(); ++k) {
            Result<Body> body = make_piece(k);
            if (!body) return body.error();
            bodies.push_back(std::make_shared<Body>(std::move(body).value()));
        }
        for (std::size_t k = 0; k < bodies.size(); ++k) add_surface(*bodies[k], k, bodies);
        result_.pieces.assign(bodies.begin(), bodies.end());
        return Success{};
    }

    /// What a piece has of a cell's fraction: by its samples, but kLeastFraction at least, or as much as the others
    /// where the cell has less for each. A copy of less would be crushed by the corners beside it as soon as it lets
    /// go, and then ask for substeps that nothing else needs. The fractions of all pieces sum to the cell's.
    static float fraction_of(const Shares& shares, Index number, float fraction) {
        if (shares.size() == 1) return fraction;
        float all = 0;
        for (const auto& [piece, samples] : shares) all += samples;
        const float least = std::min(Cells::kLeastFraction, fraction / float(shares.size()));
        const auto above = [&](float samples) { return std::max(fraction * (samples / all) - least, 0.0f); };
        float own = 0, spare = 0;
        for (const auto& [piece, samples] : shares) {
            spare += above(samples);
            if (piece == number) own = above(samples);
        }
        if (!(spare > 0)) return least;
        return least + own * ((fraction - float(shares.size()) * least) / spare);
    }

    /// Without its surface.
    Result<Body> make_piece(std::size_t k) {
        const Index number = result_.number_of_piece[k];
        const Cells& from = whole_.cells;
        std::vector<Cells::LatticeIndex> indices;
        for (const Index c : result_.cells_of_whole[k]) indices.push_back(from.cells[c]);
        Cells cells = lattice_cells(std::move(indices), from.spacing, from.origin); // keeps their order
        for (std::size_t c = 0; c < result_.cells_of_whole[k].size(); ++c) {
            const Index of_whole = result_.cells_of_whole[k][c];
            cells.fraction[c] = fraction_of(shares_[of_whole], number, from.fraction[of_whole]);
        }
        Body body = bare_body(std::move(cells), whole_.material);
        body.scale = whole_.scale;
        body.fields = part_of(whole_.fields, result_.cells_of_whole[k]);
        if (!body.fields.density.empty()) set_masses(body);
        PieceGrid::Region& region = regions_[number];
        if (region.triangles.empty()) { // between the grid's points: as deep as nothing
            body.field = whole_.field;
            body.field_radius = whole_.field_radius;
            return body;
        }
        Mesh mesh;
        mesh.positions = region.positions;
        for (const Triangle& triangle : region.triangles) mesh.add_face(triangle);
        RunContext quiet = context_;
        quiet.progress = nullptr;
        Result<DistanceField> field = DistanceField::create(mesh, 1, 0.5 * whole_.spacing(), quiet);
        if (!field) return field.error();
        field->cut(*whole_.field, whole_.field_radius);
        body.field = std::make_shared<const DistanceField>(std::move(field).value());
        return body;
    }

    /// The share of the whole's surface, then the cracks'; none of these lies in another piece at rest.
    void add_surface(Body& body, std::size_t k, const std::vector<std::shared_ptr<Body>>& bodies) {
        const Index number = result_.number_of_piece[k];
        std::vector<Vec3f> points;
        for (const Index s : points_of_piece_[number]) {
            points.push_back(whole_.surface.points.rest[s]);
            body.surface.normals.push_back(whole_.surface.normals[s]);
            body.surface.areas.push_back(whole_.surface.areas[s]);
        }
        result_.outer_points.push_back(Index(points.size()));
        const SurfacePoints inner =
            spread_on_surface(regions_[number].positions, inner_triangles_[number], 1, double(kCrackPointSpacing * h_));
        for (std::size_t s = 0; s < inner.positions.size(); ++s) {
            points.push_back(inner.positions[s]);
            body.surface.normals.push_back(inner.normals[s]);
            body.surface.areas.push_back(inner.areas[s]);
        }
        parallel_for(context_, points.size(), 64, [&](std::size_t begin, std::size_t end) {
            for (std::size_t s = begin; s < end; ++s) keep_away(points[s], k, bodies);
        });
        body.surface.points = embed_in_cells(points, body.cells, context_);
    }

    void keep_away(Vec3f& point, std::size_t k, const std::vector<std::shared_ptr<Body>>& bodies) const {
        for (int step = 0; step < kGapSteps; ++step) {
            bool moved = false;
            for (std::size_t other = 0; other < bodies.size(); ++other) {
                if (other == k) continue;
                const Box& box = bodies[other]->field->box();
                const Vec3d at = at_rest(point);
                if (!((at.array() >= box.min.array()).all() && (at.array() <= box.max.array()).all())) continue;
                const DistanceField::Sample sample = bodies[other]->field->at(point);
                if (sample.distance >= kGap * h_) continue;
                point += (1.1f * kGap * h_ - sample.distance) * sample.normal;
                moved = true;
            }
            if (!moved) return;
        }
    }

    void find_copies() {
        std::vector<std::vector<CornerCopy>> at_corner(whole_.cells.corners.size());
        for (std::size_t k = 0; k < result_.pieces.size(); ++k) {
            const Cells& cells = result_.pieces[k]->cells;
            std::vector<Index>& of_whole = result_.corners_of_whole.emplace_back(cells.corners.size(), kNoIndex);
            for (std::size_t c = 0; c < cells.cells.size(); ++c)
                for (int n = 0; n < 8; ++n)
                    of_whole[cells.cell_corners[c][n]] = whole_.cells.cell_corners[result_.cells_of_whole[k][c]][n];
            for (Index corner = 0; corner < of_whole.size(); ++corner)
                at_corner[of_whole[corner]].push_back({Index(k), corner});
        }
        result_.copy_offsets = {0};
        for (const auto& copies : at_corner) {
            result_.copies.insert(result_.copies.end(), copies.begin(), copies.end());
            result_.copy_offsets.push_back(Index(result_.copies.size()));
        }
    }

    void number_facets() {
        for (CrackFacet& facet : result_.facets)
            for (int side = 0; side < 2; ++side) {
                Index& piece = facet.pieces[side];
                piece = result_.piece_of_number[piece];
                const std::vector<Index>& cells = result_.cells_of_whole[piece];
                facet.cells[side] = Index(std::ranges::lower_bound(cells, facet.cell) - cells.begin());
            }
    }

    Index copy_at(Index corner, Index piece) const {
        Index copy = result_.copy_offsets[corner];
        while (result_.copies[copy].piece != piece) ++copy;
        return copy;
    }

    void find_links() {
        struct Sum {
            float area = 0;
            std::vector<Index> facets;
        };
        std::map<std::tuple<Index, Index, Index>, Sum> sums; // corner of the whole, pieces
        for (Index f = 0; f < result_.facets.size(); ++f) {
            const CrackFacet& facet = result_.facets[f];
            for (int n = 0; n < 8; ++n) {
                Sum& sum = sums[{whole_.cells.cell_corners[facet.cell][n], facet.pieces[0], facet.pieces[1]}];
                sum.area += facet.area * facet.shares[n];
                sum.facets.push_back(f);
            }
        }
        join_specks(sums);
        for (const auto& [key, sum] : sums) {
            const auto& [corner, a, b] = key;
            for (const Index f : sum.facets)
                for (int n = 0; n < 8; ++n)
                    if (result_.facets[f].pieces == std::array{a, b} &&
                        whole_.cells.cell_corners[result_.facets[f].cell][n] == corner)
                        result_.facets[f].links[n] = Index(result_.links.size());
            result_.links.push_back({{a, b}, {copy_at(corner, a), copy_at(corner, b)}, corner, sum.area});
            auto& rows = result_.facets_of_link;
            rows.items.insert(rows.items.end(), sum.facets.begin(), sum.facets.end());
            rows.offsets.push_back(Index(rows.items.size()));
        }
    }

    /// Copies of a corner that no facet around joins to the others, as the samples saw a piece and the facets did not,
    /// break with the facets nearest by of the same piece.
    template <class Sums>
    void join_specks(Sums& sums) const {
        const auto facets_near = [&](Index corner, Index piece) {
            std::vector<Index> found;
            const auto& at = whole_.cells.corners[corner];
            for (int n = 0; n < 64; ++n) {
                const Index cell = whole_.cells.find_cell(at[0] + n % 4 - 2, at[1] + n / 4 % 4 - 2, at[2] + n / 16 - 2);
                if (cell == kNoIndex) continue;
                auto facet = std::ranges::lower_bound(result_.facets, cell, {}, &CrackFacet::cell);
                for (; facet != result_.facets.end() && facet->cell == cell; ++facet)
                    if (facet->pieces[0] == piece || facet->pieces[1] == piece)
                        found.push_back(Index(facet - result_.facets.begin()));
            }
            return found;
        };
        for (Index corner = 0; corner < whole_.cells.corners.size(); ++corner) {
            const std::span<const CornerCopy> copies = result_.copies_of(corner);
            if (copies.size() < 2) continue;
            DisjointSets sets(copies.size());
            for (std::size_t a = 0; a < copies.size(); ++a)
                for (std::size_t b = a + 1; b < copies.size(); ++b)
                    if (sums.contains({corner, copies[a].piece, copies[b].piece})) sets.join(Index(a), Index(b));
            for (Index a = 1; a < copies.size(); ++a) {
                if (sets.root(a) == sets.root(0)) continue;
                std::vector<Index> facets = facets_near(corner, copies[a].piece);
                if (facets.empty()) facets = facets_near(corner, copies[0].piece);
                if (facets.empty()) continue;
                sums[{corner, copies[0].piece, copies[a].piece}].facets = std::move(facets);
                sets.join(0, a);
            }
        }
    }

    void find_links_beside() {
        std::vector<Index> first(whole_.cells.corners.size() + 1, 0); // of each corner's links
        for (const CrackLink& link : result_.links) ++first[link.corner + 1];
        for (std::size_t c = 1; c < first.size(); ++c) first[c] += first[c - 1];
        std::map<Cells::LatticeIndex, Index> corner_at;
        for (const CrackLink& link : result_.links) corner_at[whole_.cells.corners[link.corner]] = link.corner;
        std::vector<std::vector<std::pair<Index, Index>>> lit(result_.links.size());
        for (std::size_t k = 0; k < result_.pieces.size(); ++k) {
            const Embedding& points = result_.pieces[k]->surface.points;
            for (Index s = result_.outer_points[k]; s < points.size(); ++s)
                for (Index n = points.offsets[s]; n < points.offsets[s + 1]; ++n) {
                    const Index corner = result_.corners_of_whole[k][points.particles[n]];
                    for (Index l = first[corner]; l < first[corner + 1]; ++l)
                        if (const auto& of = result_.links[l].pieces; of[0] == k || of[1] == k)
                            lit[l].emplace_back(Index(k), s);
                }
        }
        for (Index l = 0; l < result_.links.size(); ++l) {
            const CrackLink& link = result_.links[l];
            const auto& at = whole_.cells.corners[link.corner];
            for (int n = 0; n < 27; ++n) {
                const auto found =
                    corner_at.find({std::uint16_t(at[0] + n % 3 - 1), std::uint16_t(at[1] + n / 3 % 3 - 1),
                                    std::uint16_t(at[2] + n / 9 - 1)});
                if (found == corner_at.end()) continue;
                for (Index other = first[found->second]; other < first[found->second + 1]; ++other) {
                    const auto& of = result_.links[other].pieces;
                    const bool common = of[0] == link.pieces[0] || of[0] == link.pieces[1] || of[1] == link.pieces[0] ||
                                        of[1] == link.pieces[1];
                    if (common && other != l) result_.links_beside.items.push_back(other);
                }
            }
            result_.links_beside.offsets.push_back(Index(result_.links_beside.items.size()));
            for (const auto& [piece, point] : lit[l])
                result_.points_of_link.items.insert(result_.points_of_link.items.end(), {piece, point});
            result_.points_of_link.offsets.push_back(Index(result_.points_of_link.items.size()));
        }
    }

    const Body& whole_;
    const RunContext& context_;
    const float h_;
    BrokenBody result_;
    std::vector<Shares> shares_; ///< of each cell of the whole, by the partition's numbers
    std::vector<PieceGrid::Region> regions_;
    std::vector<std::vector<Triangle>> inner_triangles_; ///< of each region: those inside the body
    std::vector<std::vector<Index>> points_of_piece_;    ///< of the whole's surface, by number
};

} // namespace

Index BrokenBody::piece_at(const Vec3d& rest_point) const {
    if (const Index piece = piece_of_number[partition.piece_at(rest_point)]; piece != kNoIndex) return piece;
    return 0; // a piece without matter: any will do
}

Result<std::shared_ptr<const BrokenBody>> break_body(std::shared_ptr<const Body> whole, Partition partition,
                                                     const RunContext& context, BrokenBodyReport* report) {
    if (partition.count == 0 || !partition.piece_at)
        return Error{ErrorCode::usage, "A body breaks into one piece or more; the partition has none."};
    if (whole->material.model != MaterialModel::fem)
        return Error{ErrorCode::unsuitable,
                     "Only bodies of the model fem break; it yields before that where it has a yield stress."};
    if (whole->cells.is_parted())
        return Error{ErrorCode::unsuitable, "A body whose near parts are kept apart (separate) does not break; make it "
                                            "without."};
    Result<BrokenBody> broken = BodyBreaker(std::move(whole), std::move(partition), context).run();
    if (!broken) return broken.error();
    const auto kept = std::make_shared<const BrokenBody>(std::move(*broken));
    if (!report) return kept;
    *report = {.pieces = kept->pieces.size()};
    for (const CrackFacet& facet : kept->facets) report->crack_area += double(facet.area);
    std::vector<double> volumes;
    for (const auto& piece : kept->pieces) {
        double volume = 0;
        for (const float v : piece->volume) volume += double(v);
        volumes.push_back(volume);
    }
    std::ranges::sort(volumes);
    if (!volumes.empty()) {
        report->least_volume = volumes.front();
        report->median_volume = volumes[volumes.size() / 2];
    }
    return kept;
}

} // namespace filigree
