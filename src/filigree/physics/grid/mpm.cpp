#include "filigree/physics/grid/mpm.h"

#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/physics/grid/mpm_contact.h"
#include "filigree/physics/step/byte_stream.h"
#include "filigree/physics/step/external_forces.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace filigree::mpm {

namespace {

constexpr float kMostTravel = 0.4f;     ///< of a cell, in a step
constexpr float kMostMeeting = 0.05f;   ///< of a cell, in a step, of a body towards another one
constexpr float kLeastNodeMass = 1e-6f; ///< of a full node's: what tracers look at
constexpr float kRidge = 0.01f;         ///< cells squared: holds a tracer's gradient at a rim
constexpr float kHeldShare = 0.5f;      ///< of a node's mass that is pinned, from which on the node is
constexpr std::size_t kTracerGrain = 256;
/// Particles tell of the half of a surface's slope that lies inside, and of less where the body is a few cells thick.
constexpr float kMostSurface = 8;

float coarsest_spacing(std::span<const Actor> actors) {
    double spacing = 0;
    for (const Actor& actor : actors)
        if (actor.body->material.model == MaterialModel::mpm) spacing = std::max(spacing, actor.body->spacing());
    return float(spacing);
}

Float4 lanes(float x, float y, float z, float w) { return Float4{x, y, z, w}; }

} // namespace

Bodies::Bodies(const World& world, std::span<const Actor> actors, std::size_t first, float spacing)
    : world_(world), laws_(world, first + actors.size()), field_of_(first + actors.size(), kNoIndex),
      spacing_(std::max(spacing, coarsest_spacing(actors))), grid_(2 * spacing_), barriers_(world, spacing_) {
    for (std::size_t a = 0; a < actors.size(); ++a) {
        const Body& body = *actors[a].body;
        if (body.material.model != MaterialModel::mpm) continue;
        field_of_[first + a] = Index(matter_.size());
        first_.push_back(particles_.size());
        actor_of_field_.push_back(first + a);
        matter_.emplace_back(body.material, world.heat_pace);
        has_heat_ |= matter_.back().has_heat();
        start_enthalpy_.push_back(matter_.back().enthalpy(float(body.material.temperature)));
        for (std::size_t p = 0; p < body.particle_count(); ++p) {
            particles_.push_back(at_rest(body.mass[p], body.volume[p], field_of_[first + a]));
            field_.push_back(field_of_[first + a]);
        }
    }
    first_.push_back(particles_.size());
    if (particles_.empty()) return;
    for (Matter& matter : matter_) {
        matter.limit_viscosity(grid_.spacing());
        grid_mass_.push_back(matter.density() * grid_.spacing() * grid_.spacing() * grid_.spacing());
    }
    find_surfaces(actors, first);
}

/// What belongs to a body is worked out on a grid of its own, as it is when all bodies are made at once.
void Bodies::add(const Actor& actor) {
    const auto field = Index(matter_.size());
    Bodies alone(world_, std::span(&actor, 1), field_of_.size(), spacing_);
    field_of_.push_back(alone.matter_.empty() ? kNoIndex : field);
    if (alone.matter_.empty()) return;
    matter_.push_back(alone.matter_.front());
    actor_of_field_.push_back(alone.actor_of_field_.front());
    start_enthalpy_.push_back(alone.start_enthalpy_.front());
    grid_mass_.push_back(alone.grid_mass_.front());
    surface_.push_back(alone.surface_.front());
    has_heat_ |= alone.has_heat_;
    particles_.insert(particles_.end(), alone.particles_.begin(), alone.particles_.end());
    field_.resize(particles_.size(), field);
    first_.push_back(particles_.size());
}

void Bodies::remove(std::size_t actor) {
    const Index field = std::exchange(field_of_[actor], kNoIndex);
    if (field == kNoIndex) return;
    const std::size_t begin = first_[field], end = first_[field + 1];
    const auto erase = [&](auto& values) {
        values.erase(values.begin() + std::ptrdiff_t(begin), values.begin() + std::ptrdiff_t(end));
    };
    erase(particles_);
    erase(field_);
    for (std::size_t f = field + 1; f < first_.size(); ++f) first_[f] -= end - begin;
    std::erase_if(fixed_, [&](std::uint32_t number) { return number >= begin && number < end; });
    for (std::uint32_t& number : fixed_)
        if (number >= end) number -= std::uint32_t(end - begin);
}

Particle Bodies::at_rest(float mass, float volume, std::size_t field) const {
    Particle particle = {};
    particle.mass = mass;
    particle.volume = volume;
    particle.b[0] = particle.b[1] = particle.b[2] = 1;
    particle.volume_ratio() = 1;
    particle.enthalpy() = start_enthalpy_[field];
    particle.melted = matter_[field].liquid(particle.enthalpy()) >= 1;
    return particle;
}

/// The gradient of mass around particles tells where the surface is, and not quite how large. At rest that is known.
void Bodies::find_surfaces(std::span<const Actor> actors, std::size_t first) {
    const RunContext alone(1);
    for (std::size_t f = 0; f < matter_.size(); ++f)
        set_positions(actor_of_field_[f], actors[actor_of_field_[f] - first].body->rest);
    grid_.begin(particles_, field_, {}, alone);
    scatter(0, alone);
    std::vector<double> told(matter_.size());
    std::vector<AtParticle> found;
    Node tile[kTileNodes];
    for (const std::vector<std::uint32_t>& group : grid_.groups())
        for (const std::uint32_t block : group) {
            grid_.read_tile(block, tile);
            const std::span<const std::uint32_t> numbers = grid_.particles(block);
            const std::uint32_t field = grid_.place(block).body;
            found.resize(numbers.size());
            gather_at_particles(numbers, particles_.data(), grid_.spacing(), tile, found.data());
            for (std::size_t i = 0; i < numbers.size(); ++i)
                told[field] += double(particles_[numbers[i]].volume * emptiness(found[i], field).norm());
        }
    for (std::size_t f = 0; f < matter_.size(); ++f) {
        double area = 0;
        for (const float part : actors[actor_of_field_[f] - first].body->surface.areas) area += double(part);
        surface_.push_back(told[f] > 0 ? std::clamp(float(area / told[f]), 1.0f, kMostSurface) : 1.0f);
    }
}

/// Gradient of the share of space that is full, 1/m.
Vec3f Bodies::emptiness(const AtParticle& found, std::size_t field) const {
    const float h = grid_.spacing();
    return 4 / (h * h * grid_mass_[field]) * Vec3f(found.slope[0][3], found.slope[1][3], found.slope[2][3]);
}

std::size_t Bodies::particle_count(std::size_t actor) const {
    return first_[field_of_[actor] + 1] - first_[field_of_[actor]];
}

void Bodies::step(double from, double until, const RunContext& context) {
    const auto dt = float(until - from);
    if (!barriers_.empty()) {
        barriers_.begin_step(from, until);
        find_shadows(context);
    }
    grid_.begin(particles_, field_, hidden_, context);
    scatter(dt, context);
    update_nodes(dt, until, context);
    gather(dt, until, context);
    move_tracers(dt, context);
}

float Bodies::least_volume_ratio(std::size_t actor) const {
    float least = 1;
    for (std::size_t i = first_[field_of_[actor]]; i < first_[field_of_[actor] + 1]; ++i)
        least = std::min(least, particles_[i].volume_ratio());
    return least;
}

/// Until an obstacle that moves has met the matter it may go as far as matter itself.
float Bodies::longest_step_beside_obstacles(double now) const {
    float step = std::numeric_limits<float>::infinity();
    if (std::ranges::none_of(world_.obstacles, [](const Obstacle& obstacle) { return obstacle.motion.moves(); }))
        return step;
    Box box;
    for (const Particle& p : particles_) box.extend(Vec3d(double(p.x[0]), double(p.x[1]), double(p.x[2])));
    const ObstaclePoses poses(world_, now);
    for (std::size_t o = 0; o < world_.obstacles.size(); ++o) {
        if (!world_.obstacles[o].motion.moves()) continue;
        float speed = 0;
        for (int corner = 0; corner < 8; ++corner) {
            Vec3d at = box.min;
            for (int axis = 0; axis < 3; ++axis)
                if (corner >> axis & 1) at[axis] = box.max[axis];
            speed = std::max(speed, poses.velocity(o, at.cast<float>()).norm());
        }
        const float apart = std::abs(poses.distance_to(o, box.centre().cast<float>()).distance);
        const float gap = apart - 0.5f * float(box.diagonal());
        if (speed > 0) step = std::min(step, std::max(kMostTravel * grid_.spacing(), gap) / speed);
    }
    return step;
}

float Bodies::longest_step(double now, const RunContext& context) const {
    constexpr std::size_t kGrain = 16384;
    std::vector<float> fastest((particles_.size() + kGrain - 1) / kGrain, 0.0f); // squared
    parallel_for(context, fastest.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t part = begin; part < end; ++part)
            for (std::size_t i = part * kGrain; i < std::min(particles_.size(), (part + 1) * kGrain); ++i) {
                const Particle& p = particles_[i];
                fastest[part] = std::max(fastest[part], p.v[0] * p.v[0] + p.v[1] * p.v[1] + p.v[2] * p.v[2]);
            }
    });
    float squared_speed = 0;
    for (const float squared : fastest) squared_speed = std::max(squared_speed, squared);
    float step = kMostTravel * grid_.spacing() / std::sqrt(std::max(squared_speed, 1e-12f));
    for (std::size_t f = 0; f < matter_.size(); ++f)
        if (first_[f] < first_[f + 1]) step = std::min(step, matter_[f].longest_step(grid_.spacing()));
    if (approach_ > 0) step = std::min(step, kMostMeeting * grid_.spacing() / approach_);
    return std::min(step, longest_step_beside_obstacles(now));
}

/// What walls hide from each particle.
void Bodies::find_shadows(const RunContext& context) {
    constexpr std::size_t kGrain = 1024;
    hidden_.assign(particles_.size(), 0);
    shadow_of_.assign(particles_.size(), kNoIndex);
    std::vector<std::vector<Shadow>> found((particles_.size() + kGrain - 1) / kGrain);
    parallel_for(context, found.size(), 1, [&](std::size_t begin, std::size_t end) {
        Barriers::Near near;
        for (std::size_t part = begin; part < end; ++part) {
            std::optional<BlockPlace> near_to; // particles that follow each other are mostly beside each other
            for (std::size_t i = part * kGrain; i < std::min(particles_.size(), (part + 1) * kGrain); ++i) {
                const BlockPlace place = Grid::block_of(Stencil(particles_[i].x, grid_.spacing()).base, 0);
                if (near_to != place) barriers_.go_to(place, near);
                near_to = place;
                if (near.empty()) continue;
                const float* const x = particles_[i].x;
                const std::optional<Shadow> shadow = barriers_.shadow({x[0], x[1], x[2]}, near);
                if (!shadow) continue;
                hidden_[i] = shadow->hidden;
                shadow_of_[i] = Index(found[part].size());
                found[part].push_back(*shadow);
            }
        }
    });
    shadows_.clear();
    for (std::size_t part = 0; part < found.size(); ++part) {
        for (std::size_t i = part * kGrain; i < std::min(particles_.size(), (part + 1) * kGrain); ++i)
            if (shadow_of_[i] != kNoIndex) shadow_of_[i] += Index(shadows_.size());
        shadows_.insert(shadows_.end(), found[part].begin(), found[part].end());
    }
}

void Bodies::scatter(float dt, const RunContext& context) {
    for (const std::vector<std::uint32_t>& group : grid_.groups())
        parallel_for(context, group.size(), 1, [&](std::size_t begin, std::size_t end) {
            Node tile[kTileNodes], hidden[kTileNodes];
            for (std::size_t g = begin; g < end; ++g) {
                std::fill_n(tile, kTileNodes, Node{});
                const Index behind = grid_.behind(group[g]);
                if (behind != kNoIndex) std::fill_n(hidden, kTileNodes, Node{});
                scatter_particles(grid_.particles(group[g]), particles_.data(), matter_[grid_.place(group[g]).body],
                                  grid_.spacing(), dt, tile, widest_vectors(),
                                  behind == kNoIndex ? BehindWalls{} : BehindWalls{hidden_, hidden});
                grid_.add_tile(group[g], tile);
                if (behind != kNoIndex) grid_.add_tile(behind, hidden);
            }
        });
}

void Bodies::update_nodes(float dt, double time, const RunContext& context) {
    const ObstaclePoses poses(world_, time);
    const NodeContacts contacts(grid_, world_, barriers_, laws_, actor_of_field_, grid_mass_, context);
    const Vec3f gravity = dt * world_.gravity.cast<float>();
    const Float4 kick = lanes(gravity.x(), gravity.y(), gravity.z(), 0);
    parallel_for(context, contacts.place_count(), 8, [&](std::size_t begin, std::size_t end) {
        for (std::size_t place = begin; place < end; ++place) {
            const std::span<const std::uint32_t> blocks = contacts.blocks(place);
            for (const std::uint32_t block : blocks) {
                Node* const nodes = grid_.nodes(block);
                for (int n = 0; n < kBlockNodes; ++n) {
                    const float mass = nodes[n].motion[3];
                    if (!(mass > 0)) continue;
                    const float inverse = 1 / mass;
                    nodes[n].motion = nodes[n].motion * lanes(inverse, inverse, inverse, 1) + kick;
                    nodes[n].matter *= inverse;
                }
            }
        }
    });
    approach_ = contacts.act(grid_, poses, context);
    hold_nodes();
}

/// Nodes whose matter is mostly pinned go as the pins do.
void Bodies::hold_nodes() {
    if (fixed_.empty()) return;
    pinned_.assign(grid_.block_count() * kBlockNodes, Float4{});
    for (const std::uint32_t number : fixed_) {
        const Particle& p = particles_[number];
        const Stencil at(p.x, grid_.spacing());
        for (int n = 0; n < 27; ++n) {
            const int k[3] = {n % 3, n / 3 % 3, n / 9};
            const std::array<int, 3> node = {at.base[0] + k[0], at.base[1] + k[1], at.base[2] + k[2]};
            const float mass = p.mass * at.weight[0][k[0]] * at.weight[1][k[1]] * at.weight[2][k[2]];
            pinned_[grid_.node_index(node, field_[number])] += mass * lanes(p.v[0], p.v[1], p.v[2], 1);
        }
    }
    for (std::size_t block = 0; block < grid_.block_count(); ++block)
        for (std::size_t n = 0; n < kBlockNodes; ++n) {
            const Float4& held = pinned_[block * kBlockNodes + n];
            Node& node = grid_.nodes(block)[n];
            if (held[3] > kHeldShare * node.motion[3])
                for (int k = 0; k < 3; ++k) node.motion[k] = held[k] / held[3];
        }
}

void Bodies::gather(float dt, double time, const RunContext& context) {
    const float h = grid_.spacing(), moment = 4 / (h * h);
    const ObstaclePoses poses(world_, time);
    const HeatExchange exchange(world_, time, dt, grid_.spacing(), particles_);
    const bool has_heat = has_heat_ || HeatExchange::acts_in(world_), has_wind = world_.air_density > 0;
    const Vec3f wind = world_.wind.at(time).cast<float>();
    for (const std::vector<std::uint32_t>& group : grid_.groups())
        parallel_for(context, group.size(), 1, [&](std::size_t begin, std::size_t end) {
            Node tile[kTileNodes], hidden[kTileNodes];
            std::vector<AtParticle> found;
            std::vector<std::size_t> near; // obstacles
            Barriers::Near walls;
            for (std::size_t g = begin; g < end; ++g) {
                grid_.read_tile(group[g], tile);
                const std::span<const std::uint32_t> numbers = grid_.particles(group[g]);
                const std::uint32_t field = grid_.place(group[g]).body;
                const Matter& matter = matter_[field];
                const float kept = math::exp(-dt * matter.damping());
                exchange.go_to(grid_.place(group[g]), poses, near);
                if (!barriers_.empty()) barriers_.go_to(grid_.place(group[g]), walls);
                const Index behind = grid_.behind(group[g]);
                if (behind != kNoIndex) grid_.read_tile(behind, hidden);
                found.resize(numbers.size());
                gather_at_particles(numbers, particles_.data(), h, tile, found.data());
                for (std::size_t i = 0; i < numbers.size(); ++i) {
                    Particle& p = particles_[numbers[i]];
                    if (!walls.empty() && is_held(numbers[i])) found[i] = gather_beside(numbers[i], tile, hidden);
                    const auto& [value, slope] = found[i];
                    if (!std::isfinite(value[0] + value[1] + value[2])) { // it stays, at rest
                        for (int k = 0; k < 3; ++k) p.v[k] = p.c[k][0] = p.c[k][1] = p.c[k][2] = 0;
                        continue;
                    }
                    if (has_heat) {
                        p.add_heat(value[5]);
                        exchange.act(p, matter, emptiness(found[i], field).norm(), surface_[field], poses, near);
                    }
                    for (int k = 0; k < 3; ++k) {
                        p.v[k] = kept * value[k];
                        for (int r = 0; r < 3; ++r) p.c[k][r] = moment * slope[k][r];
                        p.warming[k] = moment * slope[k][4];
                    }
                    move(numbers[i], dt * Vec3f(value[0], value[1], value[2]), walls);
                    if (has_wind) blow(p, emptiness(found[i], field), surface_[field], wind, dt);
                }
                matter.deform(numbers, particles_.data(), dt);
            }
        });
}

/// Nodes that walls hold say what is on the particle's own side, and nothing that goes into the wall.
AtParticle Bodies::gather_beside(std::uint32_t number, const Node* tile, const Node* behind) const {
    const float h = grid_.spacing();
    const Stencil at(particles_[number].x, h);
    const Shadow& shadow = shadows_[shadow_of_[number]];
    AtParticle sum = {};
    const int first = Grid::tile_index(at.base);
    for (int n = 0; n < 27; ++n) {
        const int k[3] = {n % 3, n / 3 % 3, n / 9};
        Node node = (shadow.hides(n) ? behind : tile)[first + (k[2] * kTileSide + k[1]) * kTileSide + k[0]];
        if (shadow.holds(n)) set_velocity(node, barriers_.beside(velocity_of(node), shadow.wall_before(n)));
        const float w = at.weight[0][k[0]] * at.weight[1][k[1]] * at.weight[2][k[2]];
        for (int e = 0; e < 8; ++e) {
            const float part = w * (e < 4 ? node.motion[e] : node.matter[e - 4]);
            sum.value[e] += part;
            for (int axis = 0; axis < 3; ++axis) sum.slope[axis][e] += part * (at.first_way[axis] + float(k[axis]) * h);
        }
    }
    return sum;
}

/// Never through a wall.
void Bodies::move(std::uint32_t number, const Vec3f& way, const Barriers::Near& walls) {
    Particle& p = particles_[number];
    const Vec3f from(p.x[0], p.x[1], p.x[2]);
    Vec3f to = from + way;
    if (!walls.empty()) {
        const Index shadow = shadow_of_[number];
        Vec3f velocity(p.v[0], p.v[1], p.v[2]);
        barriers_.hold(from, to, shadow == kNoIndex ? barriers_.reach() : shadows_[shadow].clearance, walls, &velocity);
        for (int k = 0; k < 3; ++k) p.v[k] = velocity[k];
    }
    for (int k = 0; k < 3; ++k) p.x[k] = to[k];
}

void Bodies::move_tracers(float dt, const RunContext& context) {
    parallel_for(context, tracers_.size(), kTracerGrain, [&](std::size_t begin, std::size_t end) {
        Barriers::Near walls;
        for (std::size_t t = begin; t < end; ++t) {
            if (!barriers_.empty())
                barriers_.go_to(Grid::block_of(Stencil(tracers_[t].x.data(), grid_.spacing()).base, 0), walls);
            move_tracer(tracers_[t], dt, walls);
        }
    });
}

void Bodies::move_tracer(Tracer& tracer, float dt, const Barriers::Near& walls) const {
    const float h = grid_.spacing();
    const Stencil at(tracer.x.data(), h);
    Eigen::Matrix4f moments = Eigen::Matrix4f::Zero();
    Eigen::Matrix<float, 4, 3> sums = Eigen::Matrix<float, 4, 3>::Zero();
    float mass = 0, renewal = 0;
    std::optional<Shadow> shadow;
    if (!walls.empty()) shadow = barriers_.shadow(tracer.x, walls);
    for (int n = 0; n < 27; ++n) {
        const int k[3] = {n % 3, n / 3 % 3, n / 9};
        const std::array<int, 3> node = {at.base[0] + k[0], at.base[1] + k[1], at.base[2] + k[2]};
        const bool is_hidden = shadow && shadow->hides(n);
        const std::size_t index = grid_.node_index(node, is_hidden ? tracer.field | kBehind : tracer.field);
        if (index == Grid::kNoNode) continue;
        const Node& value = grid_.node(index);
        if (!(value.motion[3] > kLeastNodeMass * grid_mass_[tracer.field])) continue;
        Vec3f velocity = velocity_of(value);
        if (shadow && shadow->holds(n)) velocity = barriers_.beside(velocity, shadow->wall_before(n));
        const float w = at.weight[0][k[0]] * at.weight[1][k[1]] * at.weight[2][k[2]];
        Eigen::Vector4f row(1, 0, 0, 0);
        for (int axis = 0; axis < 3; ++axis) row[axis + 1] = at.first_way[axis] + float(k[axis]) * h;
        moments += w * row * row.transpose();
        sums += w * row * velocity.transpose();
        mass += w * value.motion[3];
        renewal += w * value.motion[3] * value.matter[3];
    }
    if (!(mass > 0)) return;
    for (int k = 1; k < 4; ++k) moments(k, k) += kRidge * h * h * moments(0, 0);
    const Eigen::Matrix<float, 4, 3> fit = moments.ldlt().solve(sums);
    if (!fit.allFinite()) return;
    Vec3f to = tracer.x + dt * fit.row(0).transpose();
    if (!walls.empty()) barriers_.hold(tracer.x, to, shadow ? shadow->clearance : barriers_.reach(), walls, nullptr);
    tracer.x = to;
    tracer.gradient += dt * fit.bottomRows<3>().transpose() * tracer.gradient;
    tracer.renewal = std::max(tracer.renewal, std::min(1.0f, renewal / mass));
}

void Bodies::kick(std::size_t actor, const Vectors& forces, float dt) {
    Particle* const particles = &particles_[first_[field_of_[actor]]];
    for (std::size_t i = 0; i < forces.size(); ++i)
        for (int k = 0; k < 3; ++k) particles[i].v[k] += dt / particles[i].mass * forces[i][k];
}

void Bodies::set_fixed(std::size_t actor, std::span<const std::uint8_t> fixed) {
    for (std::size_t i = 0; i < fixed.size(); ++i)
        if (fixed[i]) fixed_.push_back(std::uint32_t(first_[field_of_[actor]] + i));
}

void Bodies::move_fixed(std::size_t actor, const Vectors& positions, const Vectors& velocities) {
    const std::size_t first = first_[field_of_[actor]];
    for (const std::uint32_t number : fixed_) {
        if (field_[number] != field_of_[actor]) continue;
        for (int k = 0; k < 3; ++k) {
            particles_[number].x[k] = positions[number - first][k];
            particles_[number].v[k] = velocities[number - first][k];
        }
    }
}

/// What a spring may have whose stable step is the grid's.
float Bodies::rest_squared_frequency(std::size_t actor) const {
    const float step = matter_[field_of_[actor]].longest_elastic_step(grid_.spacing());
    return 1 / (step * step);
}

/// Wind on the surface that a particle has, by the gradient of what is full.
void Bodies::blow(Particle& p, const Vec3f& emptiness, float surface, const Vec3f& wind, float dt) const {
    const float slope = emptiness.norm(), area = surface * slope * p.volume * p.volume_ratio();
    if (!(area > 0)) return;
    const Vec3f inward = emptiness / slope;
    const float towards = (wind - Vec3f(p.v[0], p.v[1], p.v[2])).dot(inward);
    if (!(towards > 0)) return;
    const float gained = dt / p.mass * wind_push(world_.air_density, towards, area, p.mass, 1 / double(dt));
    for (int k = 0; k < 3; ++k) p.v[k] += gained * inward[k];
}

void Bodies::read(std::size_t actor, Vectors& positions, Vectors& velocities) const {
    const std::size_t first = first_[field_of_[actor]];
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const Particle& p = particles_[first + i];
        positions.set(i, {p.x[0], p.x[1], p.x[2]});
        velocities.set(i, {p.v[0], p.v[1], p.v[2]});
    }
}

void Bodies::set_positions(std::size_t actor, const Vectors& positions) {
    const std::size_t first = first_[field_of_[actor]];
    for (std::size_t i = 0; i < positions.size(); ++i)
        for (int k = 0; k < 3; ++k) particles_[first + i].x[k] = positions[i][k];
}

void Bodies::set_velocities(std::size_t actor, const Vectors& velocities) {
    const std::size_t first = first_[field_of_[actor]];
    for (std::size_t i = 0; i < velocities.size(); ++i)
        for (int k = 0; k < 3; ++k) particles_[first + i].v[k] = velocities[i][k];
}

std::size_t Bodies::repair(std::size_t actor, const Vectors& positions, const Vectors& velocities,
                           std::span<const std::uint8_t> is_lost) {
    const Index field = field_of_[actor];
    std::size_t repaired = 0;
    for (std::size_t i = 0; i < is_lost.size(); ++i) {
        Particle& p = particles_[first_[field] + i];
        if (!is_lost[i] && p.is_sound()) continue;
        ++repaired;
        for (int k = 0; k < 3; ++k) {
            p.x[k] = positions[i][k];
            p.v[k] = velocities[i][k];
        }
        if (p.is_sound()) continue;
        Particle whole = at_rest(p.mass, p.volume, field);
        std::copy_n(p.x, 3, whole.x);
        std::copy_n(p.v, 3, whole.v);
        p = whole;
    }
    return repaired;
}

/// A body that turns or shears as a whole, from the velocities of its particles.
void Bodies::set_velocity_gradient(std::size_t actor, const Mat3f& gradient) {
    for (std::size_t i = first_[field_of_[actor]]; i < first_[field_of_[actor] + 1]; ++i)
        for (int k = 0; k < 3; ++k)
            for (int r = 0; r < 3; ++r) particles_[i].c[k][r] = gradient(r, k);
}

MatterParticles Bodies::matter(std::size_t actor) const {
    MatterParticles result;
    result.spacing = spacing_;
    const Matter& matter = matter_[field_of_[actor]];
    for (std::size_t i = first_[field_of_[actor]]; i < first_[field_of_[actor] + 1]; ++i) {
        const Particle& p = particles_[i];
        result.positions.emplace_back(p.x[0], p.x[1], p.x[2]);
        // Melt has no tension, and a ratio above 1 says that particles drifted apart, not that there is more matter.
        result.volumes.push_back(p.volume * std::min(p.volume_ratio(), 1.0f));
        result.temperatures.push_back(matter.temperature(p.enthalpy()));
        result.liquid.push_back(matter.liquid(p.enthalpy()));
        result.renewal.push_back(p.renewal);
    }
    return result;
}

double Bodies::elastic_energy() const {
    double sum = 0;
    for (std::size_t i = 0; i < particles_.size(); ++i) sum += matter_[field_[i]].energy(particles_[i]);
    return sum;
}

/// A particle stands for the quarter of a cell's square around it, along each axis.
double Bodies::affine_energy() const {
    double sum = 0;
    for (const Particle& p : particles_)
        for (int k = 0; k < 3; ++k)
            for (int r = 0; r < 3; ++r) sum += double(p.mass) * double(p.c[k][r]) * double(p.c[k][r]);
    return 0.5 * 0.25 * double(grid_.spacing()) * double(grid_.spacing()) * sum;
}

Vec3d Bodies::affine_momentum() const {
    Vec3d sum = Vec3d::Zero();
    for (const Particle& p : particles_)
        sum += double(p.mass) *
               Vec3d(double(p.c[1][2] - p.c[2][1]), double(p.c[2][0] - p.c[0][2]), double(p.c[0][1] - p.c[1][0]));
    return 0.25 * double(grid_.spacing()) * double(grid_.spacing()) * sum;
}

double Bodies::heat() const {
    double sum = 0;
    for (const Particle& p : particles_) sum += double(p.mass) * (double(p.enthalpy()) + double(p.enthalpy_beside));
    return sum;
}

std::size_t Bodies::add_tracers(std::size_t actor, std::span<const Vec3f> points, std::span<const Mat3f> gradients) {
    const std::size_t first = tracers_.size();
    for (std::size_t k = 0; k < points.size(); ++k) tracers_.push_back({points[k], gradients[k], 0, field_of_[actor]});
    return first;
}

void Bodies::remove_tracers(std::size_t first, std::size_t count) {
    const auto begin = tracers_.begin() + std::ptrdiff_t(first);
    tracers_.erase(begin, begin + std::ptrdiff_t(count));
}

void Bodies::read_tracers(std::size_t first, std::span<Vec3f> points, std::span<Mat3f> gradients) const {
    for (std::size_t k = 0; k < points.size(); ++k) points[k] = tracers_[first + k].x;
    for (std::size_t k = 0; k < gradients.size(); ++k) gradients[k] = tracers_[first + k].gradient;
}

void Bodies::read_renewal(std::size_t first, std::span<float> renewal) const {
    for (std::size_t k = 0; k < renewal.size(); ++k) renewal[k] = tracers_[first + k].renewal;
}

std::string Bodies::state() const {
    if (empty()) return {};
    ByteWriter writer;
    writer.array(std::span(particles_));
    writer.array(std::span(tracers_));
    writer.array(std::span(&approach_, 1));
    return writer.take();
}

bool Bodies::restore_state(std::string_view bytes) {
    if (empty()) return bytes.empty();
    ByteReader reader(bytes);
    std::vector<Particle> particles = reader.array<Particle>();
    std::vector<Tracer> tracers = reader.array<Tracer>();
    const std::vector<float> approach = reader.array<float>();
    if (!reader.ok() || !reader.at_end() || particles.size() != particles_.size() || approach.size() != 1) return false;
    for (std::size_t p = 0; p < particles.size(); ++p) // what never changes
        if (particles[p].mass != particles_[p].mass || particles[p].volume != particles_[p].volume) return false;
    for (const Tracer& tracer : tracers)
        if (tracer.field >= matter_.size()) return false;
    particles_ = std::move(particles);
    approach_ = approach.front();
    // Points attached since stay where they are.
    if (tracers.size() < tracers_.size())
        tracers.insert(tracers.end(), tracers_.begin() + std::ptrdiff_t(tracers.size()), tracers_.end());
    tracers_ = std::move(tracers);
    return true;
}

} // namespace filigree::mpm
