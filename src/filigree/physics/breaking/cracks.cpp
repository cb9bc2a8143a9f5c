#include "filigree/physics/breaking/cracks.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/core/parallel_for.h"
#include "filigree/physics/fem/cell_kernel.h"
#include "filigree/physics/fem/cofactor.h"
#include "filigree/physics/fem/plastic_cells.h"

#include <algorithm>
#include <limits>

namespace filigree {

using namespace crack_law;

namespace {

constexpr std::size_t kCrackGrain = 256;
constexpr float kLeastHeld = 0.05f;  ///< part of a facet that counts as holding
constexpr float kOpeningStep = 0.1f; ///< of the last opening that a crack may widen in a substep

/// The mean deformation gradient of a cell.
Mat3f mean_gradient(const Vectors& x, const std::array<Index, 8>& corners, float spacing) {
    std::array<Vec3f, 8> p;
    for (int c = 0; c < 8; ++c) p[c] = x[corners[c]];
    Mat3f gradient;
    gradient.col(0) = (p[1] - p[0]) + (p[3] - p[2]) + ((p[5] - p[4]) + (p[7] - p[6]));
    gradient.col(1) = (p[2] - p[0]) + (p[3] - p[1]) + ((p[6] - p[4]) + (p[7] - p[5]));
    gradient.col(2) = (p[4] - p[0]) + (p[5] - p[1]) + ((p[6] - p[2]) + (p[7] - p[3]));
    return gradient / (4 * spacing);
}

} // namespace

Cracks::Cracks(std::shared_ptr<const Fracture> fracture, std::size_t whole, std::size_t first_piece)
    : fracture_(std::move(fracture)), whole_(whole), first_(first_piece),
      young_modulus_(float(body().whole->material.young_modulus)),
      front_energy_(front_energy(fracture_->material, body().whole->material)), links_(body().links.size()),
      broke_(body().pieces.size(), std::numeric_limits<double>::infinity()), beside_crack_(body().links.size(), 0) {
    for (const CrackLink& link : body().links)
        strengths_.push_back(strength_of(fracture_->material, body().number_of_piece[link.pieces[0]],
                                         body().number_of_piece[link.pieces[1]]));
    const BodyFields& fields = body().whole->fields;
    stiffness_there_ = at_links(fields.stiffness);
    strength_there_ = at_links(fields.strength);
    yield_there_ = at_links(fields.yield_stress);
    for (std::size_t l = 0; l < strength_there_.size(); ++l) strengths_[l] *= strength_there_[l];
    find_tied();
}

/// Of each link, the mean of a field over its facets' cells, by area; empty for a field that is.
std::vector<float> Cracks::at_links(const std::vector<float>& field) const {
    std::vector<float> there;
    if (field.empty()) return there;
    for (Index l = 0; l < links_.size(); ++l) {
        float sum = 0, area = 0;
        for (const Index f : body().facets_of_link[l]) {
            sum += body().facets[f].area * field[body().facets[f].cell];
            area += body().facets[f].area;
        }
        there.push_back(area > 0 ? sum / area : 1);
    }
    return there;
}

/// What the second piece pulls the first with in a cell.
Cracks::Stress Cracks::stress(const CrackFacet& facet, std::span<const BodyState> bodies) const {
    const Body& whole = *body().whole;
    const auto spacing = float(whole.spacing());
    cell_kernel::CellMaterial material = cell_kernel::cell_material(whole.material, whole.spacing());
    if (const std::vector<float>& stiffness = whole.fields.stiffness; !stiffness.empty()) {
        material.shear *= stiffness[facet.cell];
        material.bulk *= stiffness[facet.cell];
    }
    Stress sum{Vec3f::Zero(), Vec3f::Zero()};
    const auto add = [&](Mat3f gradient, std::span<const PlasticCell> plastic, Index cell, float share) {
        Vec3f normal = facet.normal;
        if (!plastic.empty()) { // the elastic part, and the force by what the facet's area was at rest
            sum.opened += share * plastic_opening(plastic[cell], normal, spacing);
            gradient *= plastic[cell].inverse;
            normal = plastic[cell].inverse.transpose() * normal;
        }
        const Mat3f areas = cofactor(gradient);
        const float squares = gradient.squaredNorm(), volume = gradient.col(0).dot(areas.col(0));
        const Vec3f along = areas * normal;
        sum.traction += share * (material.shear * (squares / (squares + 1)) * (gradient * normal) +
                                 material.bulk * (volume - material.rest_ratio) * along);
        sum.normal += share * along;
    };
    if (!is_open_) {
        add(mean_gradient(bodies[whole_].positions, whole.cells.cell_corners[facet.cell], spacing),
            bodies[whole_].elasticity->plastic_cells(), facet.cell, 1);
    } else {
        std::array<float, 2> fractions;
        for (int side = 0; side < 2; ++side)
            fractions[side] = body().pieces[facet.pieces[side]]->cells.fraction[facet.cells[side]];
        for (int side = 0; side < 2; ++side) {
            const BodyState& piece = state(bodies, facet.pieces[side]);
            add(mean_gradient(piece.positions, piece.body->cells.cell_corners[facet.cells[side]], spacing),
                piece.elasticity->plastic_cells(), facet.cells[side], fractions[side] / (fractions[0] + fractions[1]));
        }
    }
    return sum;
}

/// Part of a facet's area that still holds: what it carries goes through that.
float Cracks::held_part(const CrackFacet& facet) const {
    float part = 0;
    for (int n = 0; n < 8; ++n) {
        const LinkState& link = links_[facet.links[n]];
        if (link.phase == LinkState::tied)
            part += facet.shares[n];
        else if (link.phase == LinkState::coming_apart)
            part += facet.shares[n] *
                    (1 - link.cohesion.opening / link.cohesion.last_opening(float(fracture_->material.energy)));
    }
    return part;
}

float Cracks::strength(Index link) const {
    if (!beside_crack_[link]) return strengths_[link];
    const double stiffness = stiffness_there_.empty() ? 1 : double(stiffness_there_[link]);
    const float scale = strength_there_.empty() ? 1 : strength_there_[link];
    return scale * strength_at_front(strengths_[link] / scale, front_energy_, stiffness * double(young_modulus_),
                                     body().whole->spacing());
}

/// m: how far matter may have opened there for good.
float Cracks::most_opened(Index link) const {
    const FractureMaterial& material = fracture_->material;
    return float(material.plastic_opening) * (strengths_[link] / float(material.strength));
}

/// From the first piece's copy to the second's.
Vec3f Cracks::between(Index link, std::span<const BodyState> bodies) const {
    const CornerCopy &a = body().copies[body().links[link].copies[0]], &b = body().copies[body().links[link].copies[1]];
    return state(bodies, b.piece).positions[b.corner] - state(bodies, a.piece).positions[a.corner];
}

/// N/m that cohesion may have there.
float Cracks::stiffest(Index link, std::span<const BodyState> bodies) const {
    float yields = 0;
    for (const Index copy : body().links[link].copies)
        yields = std::max(yields, state(bodies, body().copies[copy].piece).inverse_mass[body().copies[copy].corner]);
    return kCohesionShare * bodies[whole_].rest_squared_frequency / std::max(yields, 1e-30f);
}

void Cracks::let_go(Index link, const Vec3f& pull, double time) {
    const CrackLink& which = body().links[link];
    links_[link] = {which.area > 0 && !pull.isZero(0) ? LinkState::coming_apart : LinkState::free, {pull, 0}};
    for (const Index piece : which.pieces) broke_[piece] = std::min(broke_[piece], time);
}

bool Cracks::let_events_go(double time) {
    bool any = false;
    for (const FractureEvent& event : fracture_->events) {
        if (event.time > time || event.time <= checked_until_) continue;
        const auto has = [](std::span<const Index> list, Index value) {
            return list.empty() || std::ranges::find(list, value) != list.end();
        };
        for (Index l = 0; l < links_.size(); ++l) {
            const CrackLink& link = body().links[l];
            if (links_[l].phase == LinkState::free || !has(event.particles, link.corner)) continue;
            if (!has(event.pieces, body().number_of_piece[link.pieces[0]]) &&
                !has(event.pieces, body().number_of_piece[link.pieces[1]]))
                continue;
            let_go(l, Vec3f::Zero(), time);
            any = true;
        }
    }
    checked_until_ = time;
    return any;
}

/// Links of no area let go with the last of the facets nearby.
bool Cracks::let_specks_go(double time) {
    bool any = false;
    for (Index l = 0; l < links_.size(); ++l) {
        if (body().links[l].area > 0 || links_[l].phase != LinkState::tied) continue;
        const bool held =
            std::ranges::any_of(body().facets_of_link[l], [&](Index f) { return held_part(body().facets[f]) > 0; });
        if (held) continue;
        let_go(l, Vec3f::Zero(), time);
        any = true;
    }
    return any;
}

/// Links that are pulled too hard.
bool Cracks::open_links(std::span<const BodyState> bodies, double time, const RunContext& context) {
    std::vector<Stress> stresses(body().facets.size());
    parallel_for(context, facets_of_tied_.size(), kCrackGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const Index f = facets_of_tied_[k];
            stresses[f] = stress(body().facets[f], bodies);
            stresses[f].traction /= std::max(held_part(body().facets[f]), kLeastHeld);
        }
    });
    const auto tearing = float(kTearing * body().whole->material.yield_stress);
    std::vector<Vec3f> pulls(links_.size(), Vec3f::Zero());
    parallel_for(context, tied_.size(), kCrackGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const Index l = tied_[k];
            Vec3f traction = Vec3f::Zero(), normal = Vec3f::Zero();
            float area = 0, opened = 0;
            for (const Index f : body().facets_of_link[l]) {
                opened += body().facets[f].area * stresses[f].opened;
                traction += body().facets[f].area * stresses[f].traction;
                normal += body().facets[f].area * stresses[f].normal;
                area += body().facets[f].area;
            }
            const Traction found = split_traction(traction / area, normal.stableNormalized());
            const float tears_from = yield_there_.empty() ? tearing : tearing * yield_there_[l];
            const bool tears = opened / area >= most_opened(l) && found.size >= tears_from;
            if (tears || found.size >= strength(l)) pulls[l] = found.pull;
        }
    });
    bool any = false;
    for (const Index l : tied_) {
        if (pulls[l].isZero(0) || !pulls[l].allFinite()) continue;
        let_go(l, pulls[l], time);
        any = true;
    }
    return any;
}

bool Cracks::advance(std::span<BodyState> bodies, double time, const RunContext& context) {
    bool changed = let_events_go(time);
    changed |= open_links(bodies, time, context);
    bool any_ended = false;
    if (is_open_)
        for (Index l = 0; l < links_.size(); ++l) {
            LinkState& link = links_[l];
            if (link.phase != LinkState::coming_apart) continue;
            const float opening = between(l, bodies).norm();
            if (!std::isfinite(opening)) continue;
            link.cohesion.opening = std::max(link.cohesion.opening, opening);
            if (!link.cohesion.has_ended(float(fracture_->material.energy))) continue;
            link.phase = LinkState::free;
            any_ended = true;
        }
    if (changed || any_ended) changed |= let_specks_go(time);
    if (any_ended && !changed) find_groups(bodies);
    if (!changed) return false;
    if (!is_open_) {
        follow_whole(bodies);
        is_open_ = true;
    }
    take_part(bodies);
    return true;
}

void Cracks::follow_whole(std::span<BodyState> bodies) const {
    const BodyState& whole = bodies[whole_];
    for (Index piece = 0; piece < body().pieces.size(); ++piece) {
        BodyState& to = state(bodies, piece);
        const std::vector<Index>& from = body().corners_of_whole[piece];
        for (Index c = 0; c < from.size(); ++c) {
            to.positions.set(c, whole.positions[from[c]]);
            to.velocities.set(c, whole.velocities[from[c]]);
        }
        to.elasticity->take_over(whole.elasticity->plastic_cells(), body().cells_of_whole[piece]);
    }
}

void Cracks::show_whole(std::span<BodyState> bodies) const {
    if (!is_open_) return;
    BodyState& whole = bodies[whole_];
    for (Index corner = 0; corner < whole.positions.size(); ++corner) {
        float heaviest = -1;
        for (const CornerCopy& copy : body().copies_of(corner)) {
            const float mass = body().pieces[copy.piece]->mass[copy.corner];
            if (!(mass > heaviest)) continue;
            heaviest = mass;
            whole.positions.set(corner, state(bodies, copy.piece).positions[copy.corner]);
        }
        whole.velocities.set(corner, Vec3f::Zero());
    }
}

/// Which bodies move, what is tied, and what lies beside cracks.
void Cracks::take_part(std::span<BodyState> bodies) {
    bodies[whole_].is_absent = is_open_;
    if (is_open_) bodies[whole_].velocities = Vectors(bodies[whole_].positions.size());
    for (Index piece = 0; piece < body().pieces.size(); ++piece) {
        BodyState& to = state(bodies, piece);
        to.is_absent = !is_open_;
        if (to.hidden.empty()) hide(to, piece);
    }
    find_groups(bodies);
    std::ranges::fill(beside_crack_, std::uint8_t{0});
    for (Index l = 0; l < links_.size(); ++l)
        if (links_[l].phase != LinkState::tied)
            for (const Index other : body().links_beside[l]) beside_crack_[other] = 1;
}

void Cracks::hide(BodyState& to, Index piece) const {
    to.hidden.assign(to.surface.size(), 0);
    std::fill(to.hidden.begin() + body().outer_points[piece], to.hidden.end(), std::uint8_t{1});
}

bool Cracks::reveal(std::span<BodyState> bodies) {
    bool any = false;
    for (Index l = 0; l < links_.size(); ++l) {
        if (links_[l].phase == LinkState::tied) continue;
        const std::span<const Index> lit = body().points_of_link[l];
        for (std::size_t n = 0; n < lit.size(); n += 2)
            any |= std::exchange(state(bodies, lit[n]).hidden[lit[n + 1]], 0);
    }
    return any;
}

void Cracks::find_groups(std::span<BodyState> bodies) {
    const std::vector<CornerCopy>& copies = body().copies;
    DisjointSets sets(copies.size());
    for (Index l = 0; l < links_.size(); ++l)
        if (links_[l].phase == LinkState::tied) sets.join(body().links[l].copies[0], body().links[l].copies[1]);
    group_of_copy_.resize(copies.size());
    group_offsets_ = {0};
    members_.clear();
    for (Index corner = 0; corner + 1 < body().copy_offsets.size(); ++corner) {
        const Index begin = body().copy_offsets[corner], end = body().copy_offsets[corner + 1];
        for (Index copy = begin; copy < end; ++copy) group_of_copy_[copy] = sets.root(copy);
        for (Index root = begin; root < end; ++root) {
            if (group_of_copy_[root] != root) continue;
            double mass = 0;
            bool fixed = false;
            const std::size_t first = members_.size();
            for (Index copy = root; copy < end; ++copy) {
                if (group_of_copy_[copy] != root) continue;
                members_.push_back(copy);
                mass += double(body().pieces[copies[copy].piece]->mass[copies[copy].corner]);
                fixed |= state(bodies, copies[copy].piece).fixed[copies[copy].corner] != 0;
            }
            for (std::size_t m = first; m < members_.size(); ++m)
                state(bodies, copies[members_[m]].piece).inverse_mass[copies[members_[m]].corner] =
                    fixed ? 0.0f : float(1 / mass);
            if (members_.size() == first + 1)
                members_.pop_back();
            else
                group_offsets_.push_back(Index(members_.size()));
        }
    }
    find_tied();
}

void Cracks::find_tied() {
    tied_.clear();
    facets_of_tied_.clear();
    std::vector<std::uint8_t> is_felt(body().facets.size(), 0);
    for (Index l = 0; l < links_.size(); ++l) {
        if (links_[l].phase != LinkState::tied) continue;
        tied_.push_back(l);
        for (const Index f : body().facets_of_link[l]) is_felt[f] = 1;
    }
    for (Index f = 0; f < is_felt.size(); ++f)
        if (is_felt[f]) facets_of_tied_.push_back(f);
}

Cracks::Pace Cracks::add_forces(std::span<BodyState> bodies, const RunContext& context) const {
    Pace pace;
    if (!is_open_) return pace;
    const std::vector<CornerCopy>& copies = body().copies;
    const auto energy = float(fracture_->material.energy);
    std::vector<float> stiffness(copies.size(), 0); // of springs at each group
    for (Index l = 0; l < links_.size(); ++l) {
        if (links_[l].phase != LinkState::coming_apart) continue;
        const CrackLink& link = body().links[l];
        if (are_tied(link.copies[0], link.copies[1])) continue; // still, by way of a third
        const CohesionSpring spring =
            cohesion_spring(links_[l].cohesion, between(l, bodies), link.area, energy, stiffest(l, bodies));
        const Vec3f force = spring.stiffness * spring.stretch;
        for (int side = 0; side < 2; ++side) {
            const CornerCopy& copy = copies[link.copies[side]];
            state(bodies, copy.piece).forces.add(copy.corner, side == 0 ? force : Vec3f(-force));
            stiffness[group_of_copy_[link.copies[side]]] += spring.stiffness;
        }
        const auto speed = [&](int side) {
            const CornerCopy& copy = copies[link.copies[side]];
            return state(bodies, copy.piece).velocities[copy.corner];
        };
        const float way = kOpeningStep * links_[l].cohesion.last_opening(energy);
        pace.opening_step = std::min(pace.opening_step, way / std::max((speed(1) - speed(0)).norm(), 1e-30f));
    }
    parallel_for(context, group_offsets_.size() - 1, kCrackGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t g = begin; g < end; ++g) {
            Vec3f sum = Vec3f::Zero();
            for (Index m = group_offsets_[g]; m < group_offsets_[g + 1]; ++m)
                sum += state(bodies, copies[members_[m]].piece).forces[copies[members_[m]].corner];
            for (Index m = group_offsets_[g]; m < group_offsets_[g + 1]; ++m)
                state(bodies, copies[members_[m]].piece).forces.set(copies[members_[m]].corner, sum);
        }
    });
    float& added = pace.squared_frequency;
    for (Index copy = 0; copy < copies.size(); ++copy)
        if (stiffness[copy] > 0)
            added = std::max(added,
                             2 * stiffness[copy] * state(bodies, copies[copy].piece).inverse_mass[copies[copy].corner]);
    return pace;
}

void Cracks::remember_places(std::span<const BodyState> bodies) {
    places_.resize(members_.size());
    speeds_.resize(members_.size());
    for (std::size_t m = 0; m < members_.size(); ++m) {
        const CornerCopy& copy = body().copies[members_[m]];
        places_[m] = state(bodies, copy.piece).positions[copy.corner];
        speeds_[m] = state(bodies, copy.piece).velocities[copy.corner];
    }
}

void Cracks::rejoin(std::span<BodyState> bodies) const {
    for (std::size_t g = 0; g + 1 < group_offsets_.size(); ++g) {
        const Index first = group_offsets_[g], last = group_offsets_[g + 1];
        Vec3f way = Vec3f::Zero(), push = Vec3f::Zero();
        for (Index m = first; m < last; ++m) {
            const CornerCopy& copy = body().copies[members_[m]];
            way += state(bodies, copy.piece).positions[copy.corner] - places_[m];
            push += state(bodies, copy.piece).velocities[copy.corner] - speeds_[m];
        }
        if (way.isZero(0) && push.isZero(0)) continue;
        for (Index m = first; m < last; ++m) {
            const CornerCopy& copy = body().copies[members_[m]];
            state(bodies, copy.piece).positions.set(copy.corner, places_[first] + way);
            state(bodies, copy.piece).velocities.set(copy.corner, speeds_[first] + push);
        }
    }
}

std::vector<std::vector<Mat3f>> Cracks::gradients(std::span<const BodyState> bodies, const RunContext& context) const {
    const std::vector<CornerCopy>& copies = body().copies;
    std::vector<std::vector<Mat3f>> found;
    for (Index piece = 0; piece < body().pieces.size(); ++piece) {
        const BodyState& from = state(bodies, piece);
        from.elasticity->gradients(from.positions, found.emplace_back(from.positions.size()), context);
    }
    parallel_for(context, group_offsets_.size() - 1, kCrackGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t g = begin; g < end; ++g) {
            Mat3f sum = Mat3f::Zero();
            float mass = 0;
            for (Index m = group_offsets_[g]; m < group_offsets_[g + 1]; ++m) {
                const CornerCopy& copy = copies[members_[m]];
                const float own = body().pieces[copy.piece]->mass[copy.corner];
                sum += own * found[copy.piece][copy.corner];
                mass += own;
            }
            for (Index m = group_offsets_[g]; m < group_offsets_[g + 1]; ++m)
                found[copies[members_[m]].piece][copies[members_[m]].corner] = sum / mass;
        }
    });
    return found;
}

FractureReport Cracks::report() const {
    FractureReport report{.breaks = true, .pieces = body().pieces.size(), .broke = broke_};
    DisjointSets parts(report.pieces);
    for (Index l = 0; l < links_.size(); ++l) {
        const CrackLink& link = body().links[l];
        report.crack_area += double(link.area);
        if (links_[l].phase == LinkState::tied) {
            parts.join(link.pieces[0], link.pieces[1]);
            continue;
        }
        report.broken_area += double(link.area);
        report.dissipated += double(link.area * links_[l].cohesion.spent(float(fracture_->material.energy)));
    }
    for (Index piece = 0; piece < report.pieces; ++piece) {
        report.parts += parts.root(piece) == piece;
        report.first = std::min(report.first, broke_[piece]);
    }
    return report;
}

CrackMemory Cracks::memory() const { return {is_open_, links_, broke_}; }

bool Cracks::set_memory(const CrackMemory& memory, std::span<BodyState> bodies) {
    if (memory.links.size() != links_.size() || memory.broke.size() != broke_.size()) return false;
    for (const LinkState& link : memory.links)
        if (link.phase > LinkState::free || !link.cohesion.pull.allFinite() || !(link.cohesion.opening >= 0))
            return false;
    is_open_ = memory.is_open != 0;
    links_ = memory.links;
    broke_ = memory.broke;
    checked_until_ = -1;
    take_part(bodies);
    for (Index piece = 0; piece < body().pieces.size(); ++piece) hide(state(bodies, piece), piece);
    reveal(bodies);
    return true;
}

std::string check_fracture(const FractureMaterial& material) {
    if (!(material.strength > 0) || !std::isfinite(material.strength)) return "The strength must be above 0 Pa.";
    if (!(material.scatter >= 0 && material.scatter <= 1)) return "The scatter of the strength must be from 0 to 1.";
    if (!(material.plastic_opening > 0)) return "The plastic opening must be above 0 m.";
    if (!(material.energy > 0) || !std::isfinite(material.energy)) return "The fracture energy must be above 0 J/m^2.";
    return "";
}

} // namespace filigree
