#include "filigree/physics/contact.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <cstring>

namespace filigree {

namespace {

constexpr std::size_t kGrain = 256;
constexpr double kStiffness = 4;             ///< times the stiffness of a spacing of material under the point
constexpr float kTangentialStiffness = 0.5f; ///< of friction's spring, as a part of the normal stiffness
constexpr float kDeepest = 0.75f;            ///< spacings under a surface that a penalty is trusted with

/// How obstacles stand, and how their points move.
class ObstacleMotions {
public:
    ObstacleMotions(const World& world, double time) {
        for (const Obstacle& obstacle : world.obstacles) {
            const bool moves = !obstacle.motion.move.times.empty() || !obstacle.motion.angle.times.empty();
            motions_.push_back({obstacle.motion.at(time), obstacle.motion.at(moves ? time - kStep : time),
                                obstacle.motion.at(moves ? time + kStep : time), moves});
        }
    }
    const Eigen::Isometry3d& at(std::size_t obstacle) const { return motions_[obstacle].now; }
    Vec3f to_own_axes(std::size_t obstacle, const Vec3f& point) const {
        const Eigen::Isometry3d& now = motions_[obstacle].now;
        return (now.linear().transpose() * (point.cast<double>() - now.translation())).cast<float>();
    }
    Vec3f to_world(std::size_t obstacle, const Vec3f& own) const {
        return (motions_[obstacle].now * own.cast<double>()).cast<float>();
    }
    /// m/s, of the obstacle's matter at a point of the world.
    Vec3f velocity(std::size_t obstacle, const Vec3f& point) const {
        const Motion& motion = motions_[obstacle];
        if (!motion.moves) return Vec3f::Zero();
        const Vec3d own = motion.now.linear().transpose() * (point.cast<double>() - motion.now.translation());
        return ((motion.after * own - motion.before * own) / (2 * kStep)).cast<float>();
    }

private:
    static constexpr double kStep = 1e-4; ///< s
    struct Motion {
        Eigen::Isometry3d now, before, after;
        bool moves;
    };
    std::vector<Motion> motions_;
};

/// Part of the normal force that is left while a point moves away at `speed` (m/s): e^2 of it, so that a hard point
/// leaves with e times the speed it came with. Smooth about zero, where resting points tremble.
float unloading(double restitution, float speed, float smooth_speed) {
    return 1 - (1 - float(restitution * restitution)) * std::clamp(speed / smooth_speed, 0.0f, 1.0f);
}

float smooth_speed(const World& world, float dt) { return 0.02f + 4 * dt * float(world.gravity.norm()); }

/// N/m between two balls; a third, as a ball may touch several.
float pair_stiffness(const BodyState& a, Index point_of_a, const BodyState& b, Index point_of_b) {
    return std::min(a.skin_stiffness[point_of_a], b.skin_stiffness[point_of_b]) / 3;
}

Vec3f along_surface(const Vec3f& v, const Vec3f& normal) { return v - v.dot(normal) * normal; }

/// `pull` shortened to Coulomb's limit.
Vec3f limited(const Vec3f& pull, float limit) {
    const float length = pull.norm();
    return length > limit ? Vec3f(pull * (limit / length)) : pull;
}

} // namespace

std::vector<float> skin_stiffness(const Body& body, const Embedding& skin, float rest_rate) {
    const double modulus = body.material.density * std::pow(pressure_wave_speed(body.material), 2);
    std::vector<float> stiffness(skin.size());
    std::vector<double> sums(body.particle_count(), 0);
    const auto each_weight = [&](std::size_t point, const auto& visit) {
        for (Index k = skin.offsets[point]; k < skin.offsets[point + 1]; ++k)
            visit(skin.particles[k], std::abs(skin.weights[k]));
    };
    for (std::size_t s = 0; s < skin.size(); ++s) {
        stiffness[s] = float(kStiffness * modulus * double(body.skin.areas[s]) / body.spacing());
        each_weight(s, [&](Index particle, float weight) { sums[particle] += double(weight * stiffness[s]); });
    }
    for (std::size_t s = 0; s < skin.size(); ++s) {
        double part = 1;
        each_weight(s, [&](Index particle, float weight) {
            if (weight > 0)
                part = std::min(part, double(kContactRate) * double(body.mass[particle]) * double(rest_rate) /
                                          sums[particle]);
        });
        stiffness[s] *= float(part);
    }
    return stiffness;
}

Contacts::Contacts(const World& world, std::size_t bodies, bool between_bodies)
    : world_(world), between_bodies_(between_bodies), near_(bodies), touched_(bodies, 0) {}

void Contacts::look_around(std::span<const BodyState> bodies, double time, float travelled, float obstacle_reach,
                           float pair_reach, const RunContext& context) {
    if (travelled > near_until_ && !world_.obstacles.empty()) {
        find_near(bodies, time, travelled, obstacle_reach, context);
        near_until_ = travelled + obstacle_reach;
    }
    if (travelled > pairs_until_ && between_bodies_ && bodies.size() > 1) {
        find_pairs(bodies, travelled, pair_reach, context);
        pairs_until_ = travelled + pair_reach;
    }
}

void Contacts::find_near(std::span<const BodyState> bodies, double time, float travelled, float reach,
                         const RunContext& context) {
    const ObstacleMotions motions(world_, time);
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const BodyState& body = bodies[b];
        const std::size_t points = body.skin.size();
        std::vector<Vec3f> places(points);
        parallel_for(context, points, kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t s = begin; s < end; ++s) places[s] = embedded_point(body.skin, s, body.positions);
        });
        std::vector<Near> found;
        std::vector<float> distances(points);
        auto old = near_[b].begin();
        const Box box = bounds(places);
        for (std::size_t o = 0; o < world_.obstacles.size(); ++o) {
            const float nearest = distance_to(world_.obstacles[o], motions.at(o), box.centre().cast<float>()).distance -
                                  float(box.diagonal() / 2);
            if (nearest > reach) continue;
            parallel_for(context, points, kGrain, [&](std::size_t begin, std::size_t end) {
                for (std::size_t s = begin; s < end; ++s)
                    distances[s] = distance_to(world_.obstacles[o], motions.at(o), places[s]).distance;
            });
            for (Index s = 0; s < points; ++s) {
                if (!(distances[s] < reach)) continue;
                Near& near = found.emplace_back(Near{Index(o), s});
                while (old != near_[b].end() && std::pair(old->obstacle, old->point) < std::pair(Index(o), s)) ++old;
                if (old != near_[b].end() && old->obstacle == o && old->point == s) near = *old;
                near.clear_until = travelled + distances[s];
            }
        }
        near_[b] = std::move(found);
    }
}

void Contacts::find_pairs(std::span<const BodyState> bodies, float travelled, float reach, const RunContext& context) {
    pairs_.clear();
    std::vector<Box> boxes(bodies.size());
    for (std::size_t b = 0; b < bodies.size(); ++b)
        for (std::size_t i = 0; i < bodies[b].positions.size(); ++i)
            boxes[b].extend(bodies[b].positions[i].cast<double>());
    std::vector<std::vector<Vec3f>> balls(bodies.size());
    const auto find_balls = [&](std::size_t b) {
        if (!balls[b].empty()) return;
        balls[b].resize(bodies[b].balls.size());
        parallel_for(context, balls[b].size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t s = begin; s < end; ++s)
                balls[b][s] = embedded_point(bodies[b].balls, s, bodies[b].positions);
        });
    };
    for (std::size_t a = 0; a < bodies.size(); ++a)
        for (std::size_t b = a + 1; b < bodies.size(); ++b) {
            const float far = bodies[a].ball_radius + bodies[b].ball_radius + 2 * reach;
            const Vec3d low = boxes[a].min.cwiseMax(boxes[b].min) - Vec3d::Constant(double(far));
            const Vec3d high = boxes[a].max.cwiseMin(boxes[b].max) + Vec3d::Constant(double(far));
            if (!(low.array() <= high.array()).all()) continue;
            find_balls(a);
            find_balls(b);
            const auto is_common = [&](const Vec3f& p) {
                return (p.cast<double>().array() >= low.array()).all() &&
                       (p.cast<double>().array() <= high.array()).all();
            };
            using Key = std::array<int, 3>;
            const auto key_of = [&](const Vec3f& p) {
                const Vec3d q = (p.cast<double>() - low) / double(far);
                return Key{int(q.x()), int(q.y()), int(q.z())};
            };
            std::vector<std::pair<Key, Index>> grid;
            for (Index t = 0; t < balls[b].size(); ++t)
                if (is_common(balls[b][t])) grid.emplace_back(key_of(balls[b][t]), t);
            std::ranges::sort(grid);
            for (Index s = 0; s < balls[a].size(); ++s) {
                if (!is_common(balls[a][s])) continue;
                const Key key = key_of(balls[a][s]);
                for (int i = key[0] - 1; i <= key[0] + 1; ++i)
                    for (int j = key[1] - 1; j <= key[1] + 1; ++j) {
                        auto at = std::ranges::lower_bound(grid, std::pair(Key{i, j, key[2] - 1}, Index{0}));
                        for (; at != grid.end() && at->first <= Key{i, j, key[2] + 1}; ++at)
                            if (const float gap = (balls[b][at->second] - balls[a][s]).norm() - far + 2 * reach;
                                gap < 2 * reach)
                                pairs_.push_back({Index(a), s, Index(b), at->second, travelled + gap / 2});
                    }
            }
        }
}

ContactReport Contacts::add_forces(std::span<BodyState> bodies, double time, float travelled, float dt,
                                   const RunContext& context) {
    ContactReport report;
    const ObstacleMotions motions(world_, time);
    const float slow = smooth_speed(world_, dt);
    std::vector<Vec3f> forces;
    std::ranges::fill(touched_, std::uint8_t{0});

    for (std::size_t b = 0; b < bodies.size(); ++b) {
        BodyState& body = bodies[b];
        std::vector<Near>& near = near_[b];
        forces.assign(near.size(), Vec3f::Zero());
        parallel_for(context, near.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t k = begin; k < end; ++k) {
                Near& at = near[k];
                at.depth = 0;
                if (at.clear_until > travelled) {
                    at.anchored = false;
                    continue;
                }
                const Obstacle& obstacle = world_.obstacles[at.obstacle];
                const Vec3f place = embedded_point(body.skin, at.point, body.positions);
                const DistanceField::Sample surface = distance_to(obstacle, motions.at(at.obstacle), place);
                at.clear_until = travelled + surface.distance;
                if (!(surface.distance < 0)) {
                    at.anchored = false;
                    continue;
                }
                const Vec3f velocity =
                    embedded_point(body.skin, at.point, body.velocities) - motions.velocity(at.obstacle, place);
                const float stiffness = body.skin_stiffness[at.point] * float(obstacle.stiffness);
                const float away = velocity.dot(surface.normal);
                const float push = stiffness * -surface.distance * unloading(obstacle.restitution, away, slow);
                if (!at.anchored) at.anchor = motions.to_own_axes(at.obstacle, place);
                at.anchored = true;
                const float grip = kTangentialStiffness * stiffness;
                const Vec3f offset = along_surface(place - motions.to_world(at.obstacle, at.anchor), surface.normal);
                const Vec3f wanted = -grip * (offset + 2 * dt * along_surface(velocity, surface.normal));
                // What holds is judged by the penalty without its weakening, or a foot that trembles would slip at
                // every rise; what slides rubs by the push there is.
                const float hold = float(obstacle.friction) * stiffness * -surface.distance;
                const float stretch = grip * offset.norm();
                Vec3f held = limited(wanted, hold);
                if (stretch > hold) {
                    held = limited(wanted, float(obstacle.friction) * push);
                    at.anchor = motions.to_own_axes(at.obstacle, place - offset * (hold / stretch));
                }
                forces[k] = push * surface.normal + held;
                at.depth = -surface.distance;
            }
        });
        for (std::size_t k = 0; k < near.size(); ++k) {
            if (!(near[k].depth > 0)) continue;
            add_to_particles(body.skin, near[k].point, forces[k], body.forces);
            touched_[b] = 1;
            ++report.contacts;
            report.deepest = std::max(report.deepest, near[k].depth);
        }
    }

    forces.assign(pairs_.size(), Vec3f::Zero());
    parallel_for(context, pairs_.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            NearPair& pair = pairs_[k];
            if (pair.clear_until > travelled) continue;
            const BodyState &a = bodies[pair.first_body], &b = bodies[pair.second_body];
            const Vec3f between =
                embedded_point(a.balls, pair.first, a.positions) - embedded_point(b.balls, pair.second, b.positions);
            const float distance = between.norm(), depth = a.ball_radius + b.ball_radius - distance;
            pair.clear_until = travelled - depth / 2;
            if (!(depth > 0 && distance > 0)) continue;
            const Vec3f normal = between / distance;
            const Vec3f velocity =
                embedded_point(a.balls, pair.first, a.velocities) - embedded_point(b.balls, pair.second, b.velocities);
            const float stiffness = pair_stiffness(a, pair.first, b, pair.second);
            const float push = stiffness * depth * unloading(world_.body_restitution, velocity.dot(normal), slow);
            const Vec3f held =
                limited(-2 * stiffness * dt * along_surface(velocity, normal), float(world_.body_friction) * push);
            forces[k] = push * normal + held;
        }
    });
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
        if (forces[k].isZero(0)) continue;
        const NearPair& pair = pairs_[k];
        add_to_particles(bodies[pair.first_body].balls, pair.first, forces[k], bodies[pair.first_body].forces);
        add_to_particles(bodies[pair.second_body].balls, pair.second, -forces[k], bodies[pair.second_body].forces);
        touched_[pair.first_body] = touched_[pair.second_body] = 1;
        ++report.contacts;
    }
    return report;
}

void Contacts::push_out(std::span<BodyState> bodies, double time) {
    const ObstacleMotions motions(world_, time);
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        BodyState& body = bodies[b];
        const float most = kDeepest * float(body.body->spacing());
        for (const Near& at : near_[b]) {
            if (!(at.depth > most)) continue;
            const Vec3f place = embedded_point(body.skin, at.point, body.positions);
            const DistanceField::Sample surface =
                distance_to(world_.obstacles[at.obstacle], motions.at(at.obstacle), place);
            if (!(-surface.distance > most)) continue;
            // As XPBD projects one constraint of zero compliance: particles move by weight over mass.
            float yielding = 0;
            for (Index k = body.skin.offsets[at.point]; k < body.skin.offsets[at.point + 1]; ++k)
                yielding += body.skin.weights[k] * body.skin.weights[k] * body.inverse_mass[body.skin.particles[k]];
            if (!(yielding > 0)) continue;
            const float inwards = std::min(
                0.0f, (embedded_point(body.skin, at.point, body.velocities) - motions.velocity(at.obstacle, place))
                          .dot(surface.normal));
            for (Index k = body.skin.offsets[at.point]; k < body.skin.offsets[at.point + 1]; ++k) {
                const Index particle = body.skin.particles[k];
                const float share = body.skin.weights[k] * body.inverse_mass[particle] / yielding;
                body.positions.add(particle, share * (-surface.distance - most) * surface.normal);
                body.velocities.add(particle, share * -inwards * surface.normal);
            }
        }
    }
}

void Contacts::Blocks::look(const Vectors& positions) {
    start_ = positions;
    for (Entry& entry : entries_) {
        entry.place = embedded_point(*entry.embedding, entry.point, positions);
        if (entry.other)
            entry.other_place = embedded_point(entry.other->balls, entry.other_point, entry.other->positions);
    }
}

void Contacts::Blocks::add(Index particle, const Vectors& positions, Vec3f& force, Symmetric3& block) const {
    const Vec3f moved = positions[particle] - start_[particle];
    for (Index k = offsets_[particle]; k < offsets_[particle + 1]; ++k) {
        const Entry& entry = entries_[entry_of_[k]];
        const float weight = weight_of_[k], stiffness = entry.stiffness;
        const Vec3f place = entry.place + weight * moved;
        if (entry.other) {
            const Vec3f between = place - entry.other_place;
            const float distance = between.norm();
            if (!(distance < entry.reach && distance > 0)) continue;
            const Vec3f normal = between / distance;
            force += weight * stiffness * entry.unloading * (entry.reach - distance) * normal;
            block.add_outer(normal, weight * weight * stiffness);
        } else if (entry.obstacle) {
            const DistanceField::Sample surface = distance_to(*entry.obstacle, *entry.motion, place);
            if (!(surface.distance < 0)) continue;
            const float push = stiffness * entry.unloading * -surface.distance;
            force += weight * push * surface.normal;
            block.add_outer(surface.normal, weight * weight * stiffness);
            if (!entry.anchored) continue;
            const float grip = kTangentialStiffness * stiffness;
            force +=
                weight * limited(-grip * along_surface(place - entry.anchor, surface.normal), entry.friction * push);
            block.add_scaled_identity(weight * weight * grip);
            block.add_outer(surface.normal, -weight * weight * grip);
        } else {
            force += weight * stiffness * (entry.target - place);
            block.add_scaled_identity(weight * weight * stiffness);
        }
    }
}

void Contacts::Blocks::add_pull(const Embedding& points, std::size_t point, const Vec3f& target, float stiffness) {
    Entry& entry = entries_.emplace_back();
    entry.embedding = &points;
    entry.point = Index(point);
    entry.stiffness = stiffness;
    entry.target = target;
}

void Contacts::Blocks::link(std::size_t particles) {
    touched_.assign(particles, 0);
    offsets_.assign(particles + 1, 0);
    const auto each_weight = [&](const auto& visit) {
        for (Index e = 0; e < entries_.size(); ++e) {
            const Embedding& points = *entries_[e].embedding;
            for (Index k = points.offsets[entries_[e].point]; k < points.offsets[entries_[e].point + 1]; ++k)
                visit(e, points.particles[k], points.weights[k]);
        }
    };
    each_weight([&](Index, Index particle, float) { ++offsets_[particle + 1]; });
    for (std::size_t p = 0; p < particles; ++p) {
        touched_[p] = offsets_[p + 1] != 0;
        offsets_[p + 1] += offsets_[p];
    }
    entry_of_.resize(offsets_.back());
    weight_of_.resize(offsets_.back());
    std::vector<Index> next(offsets_.begin(), offsets_.end() - 1);
    each_weight([&](Index e, Index particle, float weight) {
        entry_of_[next[particle]] = e;
        weight_of_[next[particle]++] = weight;
    });
}

Contacts::Blocks Contacts::blocks(std::span<const BodyState> bodies, std::size_t b, double time, float dt,
                                  const std::function<void(Blocks&)>& pulls) const {
    const BodyState& body = bodies[b];
    const ObstacleMotions motions(world_, time);
    const float slow = smooth_speed(world_, dt);
    Blocks blocks;
    for (std::size_t o = 0; o < world_.obstacles.size(); ++o)
        blocks.motions_.push_back(std::make_unique<Eigen::Isometry3d>(motions.at(o)));
    for (const Near& at : near_[b]) {
        const Obstacle& obstacle = world_.obstacles[at.obstacle];
        const Vec3f place = embedded_point(body.skin, at.point, body.positions);
        const Vec3f normal = distance_to(obstacle, motions.at(at.obstacle), place).normal;
        const Vec3f velocity =
            embedded_point(body.skin, at.point, body.velocities) - motions.velocity(at.obstacle, place);
        Blocks::Entry& entry = blocks.entries_.emplace_back();
        entry.embedding = &body.skin;
        entry.point = at.point;
        entry.stiffness = body.skin_stiffness[at.point] * float(obstacle.stiffness);
        entry.obstacle = &obstacle;
        entry.motion = blocks.motions_[at.obstacle].get();
        entry.anchored = at.anchored;
        entry.anchor = motions.to_world(at.obstacle, at.anchor);
        entry.friction = float(obstacle.friction);
        entry.unloading = unloading(obstacle.restitution, velocity.dot(normal), slow);
    }
    const auto add_ball = [&](Index point, const BodyState& other, Index other_point) {
        const Vec3f velocity = embedded_point(body.balls, point, body.velocities) -
                               embedded_point(other.balls, other_point, other.velocities);
        const Vec3f between = embedded_point(body.balls, point, body.positions) -
                              embedded_point(other.balls, other_point, other.positions);
        Blocks::Entry& entry = blocks.entries_.emplace_back();
        entry.embedding = &body.balls;
        entry.point = point;
        entry.stiffness = pair_stiffness(body, point, other, other_point);
        entry.other = &other;
        entry.other_point = other_point;
        entry.reach = body.ball_radius + other.ball_radius;
        entry.unloading = unloading(world_.body_restitution, velocity.dot(between.stableNormalized()), slow);
    };
    for (const NearPair& pair : pairs_) {
        if (pair.first_body == b) add_ball(pair.first, bodies[pair.second_body], pair.second);
        if (pair.second_body == b) add_ball(pair.second, bodies[pair.first_body], pair.first);
    }
    pulls(blocks);
    blocks.link(body.positions.size());
    return blocks;
}

ContactReport Contacts::update_anchors(std::span<const BodyState> bodies, double time) {
    ContactReport report;
    const ObstacleMotions motions(world_, time);
    std::ranges::fill(touched_, std::uint8_t{0});
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const BodyState& body = bodies[b];
        for (Near& at : near_[b]) {
            const Obstacle& obstacle = world_.obstacles[at.obstacle];
            const Vec3f place = embedded_point(body.skin, at.point, body.positions);
            const DistanceField::Sample surface = distance_to(obstacle, motions.at(at.obstacle), place);
            at.depth = std::max(0.0f, -surface.distance);
            if (!(surface.distance < 0)) {
                at.anchored = false;
                continue;
            }
            touched_[b] = 1;
            ++report.contacts;
            report.deepest = std::max(report.deepest, -surface.distance);
            if (!at.anchored) at.anchor = motions.to_own_axes(at.obstacle, place);
            at.anchored = true;
            const float stiffness = body.skin_stiffness[at.point] * float(obstacle.stiffness);
            const float grip = kTangentialStiffness * stiffness;
            const float limit = float(obstacle.friction) * stiffness * -surface.distance;
            const Vec3f offset = along_surface(place - motions.to_world(at.obstacle, at.anchor), surface.normal);
            if (const float stretch = offset.norm(); grip * stretch > limit)
                at.anchor = motions.to_own_axes(at.obstacle, place - offset * (limit / (grip * stretch)));
        }
    }
    for (const NearPair& pair : pairs_) {
        const BodyState &a = bodies[pair.first_body], &b = bodies[pair.second_body];
        if ((embedded_point(a.balls, pair.first, a.positions) - embedded_point(b.balls, pair.second, b.positions))
                .norm() < a.ball_radius + b.ball_radius) {
            touched_[pair.first_body] = touched_[pair.second_body] = 1;
            ++report.contacts;
        }
    }
    return report;
}

std::vector<Contacts::Anchor> Contacts::anchors() const {
    std::vector<Anchor> anchors;
    for (Index b = 0; b < near_.size(); ++b)
        for (const Near& at : near_[b])
            if (at.anchored) anchors.push_back({b, at.obstacle, at.point, at.anchor});
    return anchors;
}

void Contacts::set_anchors(std::span<const Anchor> anchors) {
    for (std::vector<Near>& near : near_) near.clear();
    for (const Anchor& anchor : anchors)
        near_[anchor.body].push_back({anchor.obstacle, anchor.point, 0, 0, true, anchor.place});
}

} // namespace filigree
