#include "filigree/melting/composite_surface.h"

#include "filigree/core/parallel_for.h"
#include "filigree/core/smoothstep.h"
#include "filigree/melting/cell_loops.h"
#include "filigree/melting/seam_cells.h"
#include "filigree/melting/search_boxes.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>

namespace filigree {

namespace {

constexpr float kGone = 0.98f;      // faded so far, a vertex dies
constexpr float kRenewed = 0.95f;   // of particles that count as new
constexpr int kFadeSteps = 4;       // of Newton's method, to the particles' surface
constexpr float kFadeReach = 4;     // cells that a vertex fades over at most
constexpr float kFadeStep = 0.7f;   // cells
constexpr float kOnSurface = 0.03f; // the field's value, of about 0.5 deep inside
constexpr float kFlat = 0.02f;      // the field's change over a cell that leads nowhere
constexpr float kFrail = 0.2f;      // faded so far, a vertex dies where fading folds the mesh
constexpr float kFolded = 0.3f;     // the cosine of a turn that is a fold

std::uint64_t edge_key(Index a, Index b) { return std::uint64_t(std::min(a, b)) << 32 | std::max(a, b); }

/// Whether every edge has one triangle on either side, which agree about the outside.
bool is_closed_and_oriented(std::span<const Triangle> triangles) {
    std::vector<std::uint64_t> there, back;
    there.reserve(3 * triangles.size());
    back.reserve(3 * triangles.size());
    for (const Triangle& t : triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint64_t a = t[k], b = t[(k + 1) % 3];
            there.push_back(a << 32 | b);
            back.push_back(b << 32 | a);
        }
    std::sort(there.begin(), there.end());
    std::sort(back.begin(), back.end());
    return there == back && std::adjacent_find(there.begin(), there.end()) == there.end();
}

/// Where the mesh's vertices are while they fade.
struct FadedMesh {
    std::vector<Vec3f> positions;
    std::vector<float> faded; ///< 0 as restored .. 1 on the particles' surface
};

/// The nearest place on the field's surface, near enough; none where that leads nowhere.
std::optional<Vec3f> place_on_surface(const ParticleField& field, const Vec3f& from) {
    const float cell = float(field.grid.cell());
    Vec3f at = from, gradient;
    for (int i = 0; i < kFadeSteps; ++i) {
        const float value = field.value(at, &gradient);
        const float length = gradient.norm();
        if (length * cell < kFlat) return {};
        const float step = std::clamp(value / length, -kFadeStep * cell, kFadeStep * cell);
        at -= gradient * (step / length);
    }
    if ((at - from).norm() > kFadeReach * cell || std::abs(field.value(at)) > kOnSurface) return {};
    return at;
}

Vec3f normal_of(const std::vector<Vec3f>& positions, const Triangle& t) {
    return (positions[t[1]] - positions[t[0]]).cross(positions[t[2]] - positions[t[0]]);
}

/// Fades what is renewed; dead: of each representative, those that die are added.
FadedMesh fade(const Mesh& restored, const Surface& surface, std::span<const float> renewal, const ParticleField& field,
               std::vector<std::uint8_t>& dead, const RunContext& context) {
    const std::size_t count = restored.positions.size();
    FadedMesh mesh = {restored.positions, std::vector<float>(count, 0)};
    parallel_for(context, count, 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            const Index place = surface.representative[v]; // vertices at one place stay together
            const float part =
                float(smoothstep(CompositeMesher::kFadeBegin, CompositeMesher::kFadeEnd, renewal[place]));
            if (part == 0) continue;
            const Vec3f& from = restored.positions[place];
            const std::optional<Vec3f> on_surface = place_on_surface(field, from);
            if (part > kGone || (!on_surface && part > kFrail)) dead[v] = 1;
            mesh.faded[v] = part;
            if (on_surface) mesh.positions[v] = from + part * (*on_surface - from);
        }
    });
    // A sharp edge does not lie smoothly on a round one.
    for (const Triangle& t : surface.triangles) {
        const auto is_frail = [&](Index v) { return mesh.faded[v] > kFrail; };
        if (std::none_of(t.begin(), t.end(), is_frail)) continue;
        const Vec3f before = normal_of(restored.positions, t), after = normal_of(mesh.positions, t);
        if (before.dot(after) >= kFolded * before.norm() * after.norm()) continue;
        for (const Index v : t)
            if (is_frail(v)) dead[v] = 1;
    }
    for (std::size_t v = 0; v < count; ++v) dead[v] = dead[surface.representative[v]];
    return mesh;
}

/// The particles' colours between them.
class ParticleColors {
public:
    ParticleColors(const MatterParticles& particles, std::span<const Vec4f> colors)
        : particles_(particles), colors_(colors), reach_(kReach * particles.spacing),
          boxes_(particles.positions, double(reach_)) {}

    /// None where no particle is near.
    std::optional<Vec4f> at(const Vec3f& place) const {
        const Vec3d scaled = (place.cast<double>() / double(reach_)).array().floor();
        Vec4f sum = Vec4f::Zero();
        float weights = 0;
        for (int q = 0; q < 27; ++q) {
            const Index box = boxes_.lookup.block(BlockGrid::key_of_block(std::int32_t(scaled[0]) + q % 3 - 1,
                                                                          std::int32_t(scaled[1]) + q / 3 % 3 - 1,
                                                                          std::int32_t(scaled[2]) + q / 9 - 1));
            if (box == kNoIndex) continue;
            for (std::size_t i = boxes_.starts[box]; i < boxes_.starts[box + 1]; ++i) {
                const Index p = boxes_.entries[i].particle;
                const float left = 1 - (particles_.positions[p] - place).squaredNorm() / (reach_ * reach_);
                if (left <= 0) continue;
                const float weight = left * left * left * left;
                sum += weight * colors_[p];
                weights += weight;
            }
        }
        if (weights <= 0) return {};
        return sum / weights;
    }

private:
    static constexpr float kReach = 2.6f; // spacings

    const MatterParticles& particles_;
    std::span<const Vec4f> colors_;
    float reach_;
    SearchBoxes boxes_;
};

/// Puts the parts of one frame together.
class CompositeAssembly {
public:
    CompositeAssembly(const Mesh& restored, const Surface& surface, const FadedMesh& faded,
                      std::span<const std::uint8_t> dead, const MatterParticles& particles,
                      std::span<const Vec4f> particle_colors, const ParticleField& field, const RunContext& context)
        : restored_(restored), surface_(surface), faded_(faded), dead_(dead), particles_(particles),
          particle_colors_(particle_colors), field_(field), context_(context) {}

    Result<CompositeSurface> run() {
        sort_triangles();
        std::vector<Vec3f> renewed;
        for (std::size_t p = 0; p < particles_.renewal.size(); ++p)
            if (particles_.renewal[p] >= kRenewed) renewed.push_back(particles_.positions[p]);
        SeamCells cells(living_, field_, renewed);
        if (const Status settled = cells.settle(context_); !settled) return settled.error();
        cells_ = &cells;
        find_pieces();
        keep_vertices();
        keep_faces();
        mark_cells_at_pieces();
        fill_cells();
        if (context_.is_cancelled()) return cancelled_error();
        add_unknown_normals();
        add_colors();
        return std::move(result_);
    }

private:
    void sort_triangles() {
        living_.positions = faded_.positions;
        for (Index t = 0; t < surface_.triangles.size(); ++t) {
            const Triangle& corners = surface_.triangles[t];
            const auto dead = std::count_if(corners.begin(), corners.end(), [&](Index v) { return dead_[v] != 0; });
            (dead == 0 ? living_.kept : dead == 3 ? living_.dead : living_.dying).push_back(corners);
            if (dead == 0) source_triangle_.push_back(t);
        }
    }

    /// Which triangles keep only some of their pieces, the edges that are divided for their sake, and what cells that
    /// are filled share with pieces.
    void find_pieces() {
        const GridCut& cut = cells_->cut();
        kept_pieces_.assign(living_.kept.size(), 0);
        std::vector<std::uint32_t> all_pieces(living_.kept.size(), 0);
        for (const GridCut::Piece& piece : cut.pieces()) {
            if (piece.source >= living_.kept.size()) continue;
            ++all_pieces[piece.source];
            kept_pieces_[piece.source] += cells_->keeps(piece.cell);
        }
        is_whole_.resize(living_.kept.size());
        for (Index t = 0; t < living_.kept.size(); ++t) {
            is_whole_[t] = !cells_->is_cut(t) || kept_pieces_[t] == all_pieces[t];
            if (is_whole_[t] || kept_pieces_[t] == 0) continue;
            for (std::size_t k = 0; k < 3; ++k)
                divided_.insert(edge_key(living_.kept[t][k], living_.kept[t][(k + 1) % 3]));
        }
        for (const GridCut::Piece& piece : cut.pieces())
            if (is_kept_part(piece)) find_rim(piece);
    }

    /// Whether a piece stays of a triangle that does not stay whole.
    bool is_kept_part(const GridCut::Piece& piece) const {
        return piece.source < living_.kept.size() && !is_whole_[piece.source] && cells_->keeps(piece.cell);
    }

    /// Edges of a piece on a face of its cell, beyond which a cell is filled.
    void find_rim(const GridCut::Piece& piece) {
        const GridCut& cut = cells_->cut();
        for (std::size_t k = 0; k < 3; ++k) {
            const Index a = piece.corners[k], b = piece.corners[(k + 1) % 3];
            for (int axis = 0; axis < 3; ++axis) {
                if (!cut.are_on_one_plane(a, b, axis)) continue;
                GridNode beyond = piece.cell;
                const std::int32_t plane = cut.place(a, axis) >> 1;
                beyond[std::size_t(axis)] = piece.cell[std::size_t(axis)] == plane ? plane - 1 : plane;
                const Index slot = cells_->grid().slot(beyond);
                if (slot != kNoIndex && !cells_->keeps(slot)) rims_[slot].push_back({b, a});
            }
        }
    }

    bool is_divided(Index a, Index b) const { return divided_.contains(edge_key(a, b)); }

    void keep_vertices() {
        Mesh& mesh = result_.mesh;
        std::vector<bool> is_used(restored_.positions.size(), false);
        const auto use = [&](Index triangle, Index place) {
            const Index face = surface_.source_face[source_triangle_[triangle]];
            is_used[restored_.corners[corner_at(face, place)]] = true;
        };
        for (Index t = 0; t < living_.kept.size(); ++t)
            for (const Index corner : living_.kept[t])
                if (is_whole_[t]) use(t, corner);
        for (const GridCut::Piece& piece : cells_->cut().pieces())
            for (const Index corner : piece.corners)
                if (is_kept_part(piece) && corner < cells_->cut().first_cut()) use(piece.source, corner);
        vertex_.assign(restored_.positions.size(), kNoIndex);
        mesh.uvs.values = restored_.uvs.values;
        mesh.materials.names = restored_.materials.names;
        mesh.material_files = restored_.material_files;
        mesh.embedded_materials = restored_.embedded_materials;
        mesh.normals.values = restored_.normals.values;
        for (Index v = 0; v < is_used.size(); ++v) {
            if (!is_used[v]) continue;
            vertex_[v] = Index(mesh.positions.size());
            mesh.positions.push_back(faded_.positions[v]);
            result_.origin.push_back(v);
        }
        cut_vertex_.assign(cells_->cut().vertex_count() - cells_->cut().first_cut(), kNoIndex);
    }

    /// `own` turned to the field's normal by a part; where the field has none, and own neither, the faces' around it.
    Index add_normal(const Vec3f& at, const Vec3f& own = Vec3f::Zero(), float part = 1) {
        const Vec3f there = field_.normal(at);
        Vec3f normal = own.normalized();
        if (!there.isZero()) normal += part * (there - normal);
        const float sum = normal.norm();
        const Index index = Index(result_.mesh.normals.values.size());
        result_.mesh.normals.values.push_back(sum > 0.1f ? Vec3f(normal / sum) : Vec3f::Zero());
        if (sum <= 0.1f) unknown_normals_.insert(index);
        return index;
    }

    void add_unknown_normals() {
        if (unknown_normals_.empty()) return;
        Mesh& mesh = result_.mesh;
        for (std::size_t f = 0; f < mesh.face_count(); ++f)
            for (Index c = mesh.face_offsets[f]; c < mesh.face_offsets[f + 1]; ++c) {
                if (!unknown_normals_.contains(mesh.normals.corners[c])) continue;
                const Index size = mesh.face_size(f), first = mesh.face_offsets[f], k = c - first;
                const Vec3f &at = mesh.positions[mesh.corners[c]],
                            &next = mesh.positions[mesh.corners[first + (k + 1) % size]],
                            &last = mesh.positions[mesh.corners[first + (k + size - 1) % size]];
                mesh.normals.values[mesh.normals.corners[c]] += (next - at).cross(last - at);
            }
        for (const Index n : unknown_normals_) {
            const float length = mesh.normals.values[n].norm();
            mesh.normals.values[n] = length > 0 ? Vec3f(mesh.normals.values[n] / length) : Vec3f::UnitZ();
        }
    }

    /// A new vertex with a normal of its own.
    Index add_vertex(const Vec3f& at) {
        result_.mesh.positions.push_back(at);
        result_.origin.push_back(kNoIndex);
        new_normal_.push_back(add_normal(at));
        return Index(result_.mesh.positions.size() - 1);
    }

    Index cut_vertex(Index cut) {
        Index& vertex = cut_vertex_[cut - cells_->cut().first_cut()];
        if (vertex == kNoIndex) {
            vertex = add_vertex(cells_->cut().position(cut));
            cut_at_.emplace(vertex, cut);
        }
        return vertex;
    }

    void add_corner(Index vertex, Index uv, Index normal) {
        Mesh& mesh = result_.mesh;
        mesh.corners.push_back(vertex);
        if (!mesh.uvs.values.empty()) mesh.uvs.corners.push_back(uv);
        mesh.normals.corners.push_back(normal);
    }

    /// As the restored mesh's corner is, but for its vertex's number.
    void add_old_corner(Index corner) {
        const Index v = restored_.corners[corner];
        const Index uv = restored_.uvs.per_vertex() ? v : restored_.uvs.corners[corner];
        add_corner(vertex_[v], uv, old_normal(corner));
    }

    Index old_normal(Index corner) {
        const Index v = restored_.corners[corner];
        Index own = kNoIndex;
        if (!restored_.normals.empty()) own = restored_.normals.per_vertex() ? v : restored_.normals.corners[corner];
        if (own != kNoIndex && faded_.faded[v] == 0) return own;
        const auto [found, is_new] = faded_normals_.try_emplace(std::uint64_t(v) << 32 | own, kNoIndex);
        if (is_new)
            found->second = own == kNoIndex
                                ? add_normal(faded_.positions[v])
                                : add_normal(faded_.positions[v], restored_.normals.values[own], faded_.faded[v]);
        return found->second;
    }

    /// A UV of a corner of a face's triangle, of a cut, or of what lies between such; kNoIndex: the face has none.
    Index uv_at(Index v, Index face) {
        if (restored_.uvs.empty()) return kNoIndex;
        if (v < cells_->cut().first_cut()) {
            const Index corner = corner_at(face, v);
            if (corner == kNoIndex) return kNoIndex;
            return restored_.uvs.per_vertex() ? restored_.corners[corner] : restored_.uvs.corners[corner];
        }
        const GridCut::Between& between = cells_->cut().between(v);
        const Index from = uv_at(between.from, face), to = uv_at(between.to, face);
        if (from == kNoIndex || to == kNoIndex) return kNoIndex;
        for (const CutUv& known : cut_uvs_[v])
            if (known.from == from && known.to == to) return known.uv; // of the other side of an edge
        std::vector<Vec2f>& values = result_.mesh.uvs.values;
        values.push_back(values[from] + between.part * (values[to] - values[from]));
        cut_uvs_[v].push_back({from, to, Index(values.size() - 1)});
        return Index(values.size() - 1);
    }

    /// In the middle of a triangle.
    Index middle_uv(const Triangle& corners, Index face) {
        Vec2f sum = Vec2f::Zero();
        for (const Index v : corners) {
            const Index uv = uv_at(v, face);
            if (uv == kNoIndex) return kNoIndex;
            sum += result_.mesh.uvs.values[uv];
        }
        result_.mesh.uvs.values.push_back(sum / 3);
        return Index(result_.mesh.uvs.values.size() - 1);
    }

    void add_new_corner(Index vertex, Index uv = kNoIndex) {
        const std::size_t first_new = result_.origin.size() - new_normal_.size();
        add_corner(vertex, uv, new_normal_[vertex - first_new]);
    }

    void end_face(Index source_face) {
        Mesh& mesh = result_.mesh;
        mesh.face_offsets.push_back(Index(mesh.corners.size()));
        if (restored_.materials.empty()) return;
        mesh.materials.of_face.push_back(source_face == kNoIndex ? kNoIndex : restored_.materials.of_face[source_face]);
    }

    /// The corner of a face at a place.
    Index corner_at(Index face, Index place) const {
        for (Index c = restored_.face_offsets[face]; c < restored_.face_offsets[face + 1]; ++c)
            if (surface_.representative[restored_.corners[c]] == place) return c;
        return kNoIndex; // not of a face's triangle
    }

    void keep_faces() {
        std::unordered_map<Index, std::vector<Triangle>> parts;
        for (const GridCut::Piece& piece : cells_->cut().pieces())
            if (is_kept_part(piece)) parts[piece.source].push_back(piece.corners);
        for (Index t = 0; t < living_.kept.size();) {
            const Index face = surface_.source_face[source_triangle_[t]];
            Index end = t;
            bool is_untouched = true;
            for (; end < living_.kept.size() && surface_.source_face[source_triangle_[end]] == face; ++end) {
                is_untouched = is_untouched && is_whole_[end];
                for (std::size_t k = 0; k < 3; ++k)
                    is_untouched = is_untouched && !is_divided(living_.kept[end][k], living_.kept[end][(k + 1) % 3]);
            }
            if (is_untouched && end - t + 2 == restored_.face_size(face)) {
                for (Index c = restored_.face_offsets[face]; c < restored_.face_offsets[face + 1]; ++c)
                    add_old_corner(c);
                end_face(face);
                result_.kept_triangles += end - t;
                t = end;
                continue;
            }
            for (; t < end; ++t) {
                if (is_whole_[t]) {
                    keep_whole(t, face);
                    continue;
                }
                const auto found = parts.find(t);
                if (found == parts.end()) continue;
                for (const Triangle& part : found->second) keep_part(part, face);
            }
        }
    }

    void add_piece_corner(Index v, Index face) {
        if (v < cells_->cut().first_cut())
            add_old_corner(corner_at(face, v));
        else
            add_new_corner(cut_vertex(v), uv_at(v, face));
    }

    void keep_part(const Triangle& corners, Index face) {
        for (const Index v : corners)
            if (v >= cells_->cut().first_cut()) cut_vertex(v);
        for (const Index v : corners) add_piece_corner(v, face);
        end_face(face);
        ++result_.seam_triangles;
    }

    /// A triangle whose edges may be divided, as those of a neighbour that is cut are.
    void keep_whole(Index t, Index face) {
        const Triangle& corners = living_.kept[t];
        std::vector<Index> outline;
        for (std::size_t k = 0; k < 3; ++k) {
            outline.push_back(corners[k]);
            if (is_divided(corners[k], corners[(k + 1) % 3])) divide(corners[k], corners[(k + 1) % 3], outline);
        }
        if (outline.size() == 3) {
            for (const Index v : corners) add_old_corner(corner_at(face, v));
            end_face(face);
            ++result_.kept_triangles;
            return;
        }
        const GridCut& cut = cells_->cut();
        const Vec3f middle = (cut.position(corners[0]) + cut.position(corners[1]) + cut.position(corners[2])) / 3;
        for (const Index v : outline)
            if (v >= cut.first_cut()) cut_vertex(v);
        const Index centre = add_vertex(middle), centre_uv = middle_uv(corners, face);
        for (std::size_t k = 0; k < outline.size(); ++k) {
            add_piece_corner(outline[k], face);
            add_piece_corner(outline[(k + 1) % outline.size()], face);
            add_new_corner(centre, centre_uv);
            end_face(face);
            ++result_.seam_triangles;
        }
    }

    /// The cuts between two vertices, in order.
    void divide(Index a, Index b, std::vector<Index>& outline) const {
        const Index middle = cells_->cut().cut_between(a, b);
        if (middle == kNoIndex) return;
        divide(a, middle, outline);
        outline.push_back(middle);
        divide(middle, b, outline);
    }

    /// The vertex where the field's surface crosses the edge of the grid above a node.
    Index crossing(Index slot, int axis) {
        const auto [found, is_new] = crossing_.try_emplace(4 * std::uint64_t(slot) + std::uint64_t(axis), kNoIndex);
        if (!is_new) return found->second;
        const float here = cells_->value(slot), there = cells_->value(cells_->grid().step(slot, axis, 1));
        // Where the mesh says who is inside, the field may not change its sign; it is nearest to that at one end.
        const float part = (here > 0) != (there > 0)          ? here / (here - there)
                           : std::abs(here) < std::abs(there) ? 0.0f
                                                              : 1.0f;
        Vec3d at = cells_->grid().position(cells_->grid().node(slot));
        at[axis] += cells_->grid().cell() * std::clamp(double(part), 0.002, 0.998);
        return found->second = add_vertex(at.cast<float>());
    }

    void fill_cells() {
        const BlockGrid& grid = cells_->grid();
        for (Index slot = 0; slot < grid.slot_count() && !context_.is_cancelled(); ++slot) {
            if (cells_->keeps(slot)) continue;
            const std::array<Index, 8> corners = grid.corners(slot);
            unsigned inside = 0;
            for (unsigned q = 0; q < 8; ++q) inside |= unsigned(cells_->is_inside(corners[q])) << q;
            const bool is_at_pieces = is_at_pieces_[slot];
            if ((inside == 0 || inside == 255) && !is_at_pieces) continue;
            segments_.clear();
            if (const auto rim = rims_.find(slot); rim != rims_.end())
                for (const auto& [from, to] : rim->second) segments_.push_back({cut_vertex(from), cut_vertex(to)});
            const auto at_edge = [&](int edge) { return crossing(corners[std::size_t(edge & 7)], edge >> 3); };
            for (int axis = 0; axis < 3; ++axis)
                for (int side = 0; side < 2; ++side) {
                    if (cells_->keeps(grid.step(slot, axis, 2 * side - 1))) continue;
                    if (is_at_pieces)
                        add_face_segments(corners, inside, axis, side);
                    else
                        for_face_segments(int(inside), axis, side, [&](int from, int to) {
                            segments_.push_back({at_edge(from), at_edge(to)});
                        });
                }
            link_loops();
        }
    }

    /// As for_face_segments, of edges that may be crossed several times.
    void add_face_segments(const std::array<Index, 8>& corners, unsigned inside, int axis, int side) {
        outline_.clear();
        const std::array<int, 4> face = face_corners(axis, side);
        for (std::size_t i = 0; i < 4; ++i) {
            const int from = face[i], to = face[(i + 1) % 4], edge = edge_between(from, to);
            const Index slot = corners[std::size_t(edge & 7)];
            const std::size_t first = outline_.size();
            if (cells_->touches_pieces(slot, edge >> 3)) {
                for (const SeamCells::Crossing& c : cells_->crossings(slot, edge >> 3))
                    outline_.push_back(cut_vertex(c.vertex));
                if (from > to) std::reverse(outline_.begin() + std::ptrdiff_t(first), outline_.end());
            } else if ((inside >> from & 1) != (inside >> to & 1)) {
                outline_.push_back(crossing(slot, edge >> 3));
            }
        }
        // Crossings lead in and out in turn; the first one in where the walk begins outside.
        const std::size_t count = outline_.size();
        for (std::size_t i = inside >> face[0] & 1; i < count; i += 2)
            segments_.push_back({outline_[i], outline_[(i + 1) % count]});
    }

    void mark_cells_at_pieces() {
        const BlockGrid& grid = cells_->grid();
        is_at_pieces_.assign(grid.slot_count(), false);
        for (Index slot = 0; slot < grid.slot_count(); ++slot) {
            if (!cells_->keeps(slot)) continue;
            for (int q = 0; q < 27; ++q)
                if (const Index near = grid.step(slot, q % 3 - 1, q / 3 % 3 - 1, q / 9 - 1); near != kNoIndex)
                    is_at_pieces_[near] = true;
        }
    }

    /// Each segment ends where one other begins.
    void link_loops() {
        while (!segments_.empty()) {
            loop_.assign(1, segments_.back()[0]);
            Index to = segments_.back()[1];
            segments_.pop_back();
            while (to != loop_.front()) {
                const auto next = std::find_if(segments_.begin(), segments_.end(),
                                               [&](const std::array<Index, 2>& s) { return s[0] == to; });
                if (next == segments_.end()) return; // cannot be: see SeamCells
                loop_.push_back(to);
                to = (*next)[1];
                *next = segments_.back();
                segments_.pop_back();
            }
            fill_loop();
        }
    }

    void fill_loop() {
        const auto add = [&](Index a, Index b, Index c) {
            for (const Index v : {a, b, c}) add_new_corner(v);
            end_face(kNoIndex);
            ++result_.matter_triangles;
        };
        if (loop_.size() < 3) return; // there and back along an edge of the grid
        if (loop_.size() == 3) return add(loop_[0], loop_[1], loop_[2]);
        Vec3f sum = Vec3f::Zero();
        for (const Index v : loop_) sum += result_.mesh.positions[v];
        Vec3f middle = sum / float(loop_.size());
        const Index centre = add_vertex(middle);
        for (std::size_t i = 0; i < loop_.size(); ++i) add(centre, loop_[i], loop_[(i + 1) % loop_.size()]);
    }

    void add_colors() {
        if (particle_colors_.empty()) return;
        Mesh& mesh = result_.mesh;
        mesh.colors.resize(mesh.positions.size());
        const ParticleColors colors(particles_, particle_colors_);
        parallel_for(context_, mesh.positions.size(), 1024, [&](std::size_t begin, std::size_t end) {
            for (std::size_t v = begin; v < end; ++v) {
                const auto cut = cut_at_.find(Index(v));
                if (result_.origin[v] != kNoIndex)
                    mesh.colors[v] = color_of(result_.origin[v], colors);
                else if (cut != cut_at_.end())
                    mesh.colors[v] = color_of(cut->second, colors);
                else
                    mesh.colors[v] = colors.at(mesh.positions[v]).value_or(Vec4f::Ones());
            }
        });
    }

    /// Of the restored mesh's vertex or of a cut, as far as it has faded the particles'.
    Vec4f color_of(Index v, const ParticleColors& colors) const {
        if (v >= cells_->cut().first_cut()) {
            const GridCut::Between& between = cells_->cut().between(v);
            const Vec4f from = color_of(between.from, colors);
            return from + between.part * (color_of(between.to, colors) - from);
        }
        const Vec4f own = restored_.colors.empty() ? Vec4f::Ones() : restored_.colors[v];
        const float part = restored_.colors.empty() ? 1 : faded_.faded[v];
        if (part == 0) return own;
        return own + part * (colors.at(faded_.positions[v]).value_or(own) - own);
    }

    const Mesh& restored_;
    const Surface& surface_;
    const FadedMesh& faded_;
    std::span<const std::uint8_t> dead_;
    const MatterParticles& particles_;
    std::span<const Vec4f> particle_colors_;
    const ParticleField& field_;
    const RunContext& context_;
    LivingMesh living_;
    std::vector<Index> source_triangle_; ///< of living_.kept: the surface's triangle
    const SeamCells* cells_ = nullptr;
    std::vector<bool> is_whole_;
    std::vector<std::uint32_t> kept_pieces_;
    std::unordered_set<std::uint64_t> divided_;                         ///< edges
    std::unordered_map<Index, std::vector<std::array<Index, 2>>> rims_; ///< of cells: segments of kept pieces' borders
    std::unordered_map<std::uint64_t, Index> crossing_;                 ///< by 4 * slot + axis
    std::vector<Index> vertex_, cut_vertex_, new_normal_;
    std::unordered_map<std::uint64_t, Index> faded_normals_; ///< by vertex and the restored mesh's normal
    std::unordered_set<Index> unknown_normals_;
    std::unordered_map<Index, Index> cut_at_; ///< of new vertices
    struct CutUv {
        Index from, to, uv;
    };
    std::unordered_map<Index, std::vector<CutUv>> cut_uvs_; ///< of cuts: one a pair of UVs that they lie between
    std::vector<std::array<Index, 2>> segments_;
    std::vector<Index> loop_, outline_;
    std::vector<bool> is_at_pieces_; ///< of cells: whether one that keeps its pieces touches it
    CompositeSurface result_;
};

} // namespace

Result<CompositeMesher> CompositeMesher::create(const Mesh& mesh, const RunContext& context) {
    Result<Surface> surface = make_surface(mesh, context);
    if (!surface) return surface.error();
    if (!is_closed_and_oriented(surface->triangles))
        return Error{ErrorCode::unsuitable, "The mesh has open edges, edges with more than two faces, or faces that "
                                            "disagree about the outside; a surface that melts must be closed: "
                                            "close it first."};
    return CompositeMesher(std::move(*surface), mesh.face_count());
}

void CompositeMesher::append(const CompositeMesher& other) {
    const Index first = Index(surface_.vertex_count());
    for (const Index v : other.surface_.representative) surface_.representative.push_back(first + v);
    for (const auto& [a, b, c] : other.surface_.triangles)
        surface_.triangles.push_back({first + a, first + b, first + c});
    for (const Index f : other.surface_.source_face) surface_.source_face.push_back(Index(face_count_) + f);
    surface_.place_count += other.surface_.place_count;
    face_count_ += other.face_count_;
}

Result<CompositeSurface> CompositeMesher::make(const Mesh& restored, std::span<const float> renewal,
                                               const MatterParticles& particles, std::span<const Vec4f> particle_colors,
                                               const ParticleField& field, std::vector<std::uint8_t>& dead,
                                               const RunContext& context) const {
    const auto usage = [](std::string message) { return Error{ErrorCode::usage, std::move(message)}; };
    if (restored.positions.size() != surface_.vertex_count() || renewal.size() != surface_.vertex_count() ||
        restored.face_count() != face_count_)
        return usage("The mesh, its renewal and the mesh at rest have different numbers of vertices or faces.");
    if (!particle_colors.empty() && particle_colors.size() != particles.positions.size())
        return usage("There is not one colour for each particle.");
    for (std::size_t v = 0; v < renewal.size(); ++v)
        if (!restored.positions[v].allFinite() || !std::isfinite(renewal[v]))
            return usage("Vertex " + std::to_string(v) + " has a position or renewal that is not finite.");
    if (std::optional<Error> error = mesh_error(restored, "The restored mesh")) return *error;
    if (dead.empty()) dead.resize(renewal.size(), 0);
    if (dead.size() != renewal.size()) return usage("It is not known of each vertex whether it is dead.");
    const FadedMesh faded = fade(restored, surface_, renewal, field, dead, context);
    const auto is_zero = [](auto value) { return value == 0; };
    if (std::all_of(faded.faded.begin(), faded.faded.end(), is_zero) &&
        std::all_of(dead.begin(), dead.end(), is_zero)) {
        CompositeSurface whole = {restored, std::vector<Index>(restored.positions.size())};
        for (Index v = 0; v < whole.origin.size(); ++v) whole.origin[v] = v;
        whole.kept_triangles = surface_.triangles.size();
        return whole;
    }
    return CompositeAssembly(restored, surface_, faded, dead, particles, particle_colors, field, context).run();
}

} // namespace filigree
