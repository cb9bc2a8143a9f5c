// Contacts in descent: blocks of the vertices' systems, and friction's anchors after a substep.
#include "filigree/physics/contact/contact.h"

#include "filigree/physics/contact/contact_law.h"

#include <algorithm>
#include <utility>

namespace filigree {

using namespace contact_law;

namespace {

/// N/m of friction's spring at a stretch of `length`: less beyond Coulomb's limit, so that the force is that limit.
float sliding_grip(float stiffness, float length, float limit) {
    const float grip = kTangentialStiffness * stiffness;
    return grip * length > limit ? limit / length : grip;
}

} // namespace

/// Calls visit(particle, weight) for the particles of this body that move an entry's place.
template <class Visit>
void Contacts::Blocks::each_weight(const Entry& entry, const Visit& visit) const {
    if (!entry.frame || entry.frame->body == body_) {
        const Embedding& points = *entry.embedding;
        for (Index k = points.offsets[entry.point]; k < points.offsets[entry.point + 1]; ++k)
            visit(points.particles[k], points.weights[k]);
    }
    if (entry.frame && entry.frame->other == body_) {
        const Matter& matter = matter_->matter(entry.frame->other);
        const Matter::Weights weights = matter.weights(entry.frame->place);
        const auto& corners = matter.corners(entry.frame->place.cell);
        for (int c = 0; c < 8; ++c) visit(corners[c], -weights[c]);
    }
}

void Contacts::Blocks::update_places(std::span<const BodyState> bodies, const Vectors& swept, float scale) {
    start_ = swept;
    scale_ = scale;
    const Vectors& positions = bodies[body_].positions;
    for (Entry& entry : entries_) {
        if (entry.frame) {
            const MatterContacts::Frame& frame = *entry.frame;
            entry.place = embedded_point(bodies[frame.body].surface, frame.point, bodies[frame.body].positions) -
                          matter_->matter(frame.other).mean(frame.place, bodies[frame.other].positions) + frame.start;
            continue;
        }
        entry.place = embedded_point(*entry.embedding, entry.point, positions);
    }
}

void Contacts::Blocks::add(Index particle, const Vectors& positions, Vec3f& force, Symmetric3& block) const {
    const Vec3f moved = scale_ * (positions[particle] - start_[particle]);
    for (Index k = offsets_[particle]; k < offsets_[particle + 1]; ++k) {
        const Entry& entry = entries_[entry_of_[k]];
        const float weight = weight_of_[k], stiffness = entry.stiffness, squared = scale_ * weight * weight;
        const Vec3f place = entry.place + weight * moved;
        if (entry.frame) {
            const MatterContacts::Frame& frame = *entry.frame;
            const float depth = frame.depth - place.dot(frame.normal);
            if (!(depth > 0)) continue;
            const float push = stiffness * frame.unloading * depth;
            force += weight * push * frame.normal;
            block.add_outer(frame.normal, squared * stiffness);
            if (!frame.holds) continue;
            const Vec3f offset = frame.offset + along_surface(place, frame.normal);
            const float grip = sliding_grip(stiffness, offset.norm(), frame.friction * push);
            force -= weight * grip * offset;
            block.add_scaled_identity(squared * grip);
            block.add_outer(frame.normal, -squared * grip);
        } else if (entry.obstacle) {
            const DistanceField::Sample surface = distance_to(*entry.obstacle, *entry.motion, place);
            if (!(surface.distance < 0)) continue;
            const float push = stiffness * entry.unloading * -surface.distance;
            force += weight * push * surface.normal;
            block.add_outer(surface.normal, squared * stiffness);
            if (!entry.anchored) continue;
            const Vec3f offset = along_surface(place - entry.anchor, surface.normal);
            const float grip = sliding_grip(stiffness, offset.norm(), entry.friction * push);
            force -= weight * grip * offset;
            block.add_scaled_identity(squared * grip);
            block.add_outer(surface.normal, -squared * grip);
        } else {
            force += weight * stiffness * (entry.target - place);
            block.add_scaled_identity(squared * stiffness);
        }
    }
}

bool Contacts::Blocks::holds() const {
    return std::ranges::any_of(entries_,
                               [](const Entry& entry) { return entry.frame ? entry.frame->holds : entry.anchored; });
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
    const auto each = [&](const auto& visit) {
        for (Index e = 0; e < entries_.size(); ++e)
            each_weight(entries_[e], [&](Index particle, float weight) { visit(e, particle, weight); });
    };
    each([&](Index, Index particle, float) { ++offsets_[particle + 1]; });
    for (std::size_t p = 0; p < particles; ++p) {
        touched_[p] = offsets_[p + 1] != 0;
        offsets_[p + 1] += offsets_[p];
    }
    entry_of_.resize(offsets_.back());
    weight_of_.resize(offsets_.back());
    std::vector<Index> next(offsets_.begin(), offsets_.end() - 1);
    each([&](Index e, Index particle, float weight) {
        entry_of_[next[particle]] = e;
        weight_of_[next[particle]++] = weight;
    });
}

Contacts::Blocks::Entry Contacts::block_of(const Near& at, const BodyState& body, const ObstaclePoses& poses,
                                           float dt) const {
    const Obstacle& obstacle = world_.obstacles[at.obstacle];
    const Vec3f place = embedded_point(body.surface, at.point, body.positions);
    const Vec3f normal = poses.distance_to(at.obstacle, place).normal;
    const Vec3f velocity = embedded_point(body.surface, at.point, body.velocities) - poses.velocity(at.obstacle, place);
    Blocks::Entry entry;
    entry.embedding = &body.surface;
    entry.point = at.point;
    entry.stiffness = body.surface_stiffness[at.point] * float(obstacle.stiffness);
    entry.obstacle = &obstacle;
    entry.anchored = at.grasp.holds;
    entry.anchor = poses.to_world(at.obstacle, at.anchor);
    entry.friction = float(obstacle.friction);
    entry.unloading = unloading(obstacle.restitution, velocity.dot(normal), smooth_speed(world_, dt));
    return entry;
}

Contacts::Meetings Contacts::meetings(std::span<BodyState> bodies, const Search& search, float dt,
                                      const RunContext& context) {
    place_corners(bodies, context);
    this->search(bodies, search, context);
    std::vector<MatterContacts::Frame> frames = matter_.frames(bodies, dt);
    if (matter_.wake_met(bodies, frames)) {
        near_until_ = -1; // of what slept nothing was found
        this->search(bodies, search, context);
        frames = matter_.frames(bodies, dt);
    }
    std::vector<Index> of_frames; // two bodies of each
    for (const MatterContacts::Frame& frame : frames) of_frames.insert(of_frames.end(), {frame.body, frame.other});
    return {ObstaclePoses(world_, search.time), std::move(frames), corners_at_vertices(of_frames, bodies.size())};
}

Contacts::Blocks Contacts::blocks(std::span<const BodyState> bodies, std::size_t b, const Meetings& met, float dt,
                                  const std::function<void(Blocks&)>& pulls) const {
    const BodyState& body = bodies[b];
    Blocks blocks;
    blocks.body_ = b;
    blocks.matter_ = &matter_;
    for (const Near& at : near_[b].points) {
        blocks.entries_.push_back(block_of(at, body, met.poses, dt));
        blocks.entries_.back().motion = &met.poses.at(at.obstacle);
    }
    const MatterContacts::Frame* before = nullptr;
    for (const Index end : met.frames_of[b]) {
        const MatterContacts::Frame& frame = met.frames[end / 2];
        if (std::exchange(before, &frame) == &frame) continue; // the body meets itself
        Blocks::Entry& entry = blocks.entries_.emplace_back();
        entry.frame = &frame;
        entry.embedding = &bodies[frame.body].surface;
        entry.point = frame.point;
        entry.stiffness = frame.stiffness;
    }
    pulls(blocks);
    blocks.link(body.positions.size());
    return blocks;
}

ContactReport Contacts::update_anchors(std::span<const BodyState> bodies, std::span<const Vectors>, double time) {
    ContactReport report;
    const ObstaclePoses poses(world_, time);
    std::ranges::fill(touched_, std::uint8_t{0});
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const BodyState& body = bodies[b];
        deepest_near_[b] = 0;
        for (Near& at : near_[b].points) {
            const Obstacle& obstacle = world_.obstacles[at.obstacle];
            const Vec3f place = embedded_point(body.surface, at.point, body.positions);
            const DistanceField::Sample surface = poses.distance_to(at.obstacle, place);
            at.depth = std::max(0.0f, -surface.distance);
            if (!(surface.distance < 0)) {
                at.grasp = {};
                continue;
            }
            touched_[b] |= kOnObstacle;
            ++report.contacts;
            deepest_near_[b] = std::max(deepest_near_[b], at.depth);
            if (!at.grasp.holds) at.anchor = poses.to_own_axes(at.obstacle, place);
            at.grasp = {true, false};
            const float stiffness = body.surface_stiffness[at.point] * float(obstacle.stiffness);
            const float grip = kTangentialStiffness * stiffness;
            const float limit = float(obstacle.friction) * stiffness * -surface.distance;
            const Vec3f offset = along_surface(place - poses.to_world(at.obstacle, at.anchor), surface.normal);
            if (const float stretch = offset.norm(); grip * stretch > limit)
                at.anchor = poses.to_own_axes(at.obstacle, place - offset * (limit / (grip * stretch)));
        }
        report.deepest = std::max(report.deepest, deepest_near_[b]);
    }
    const ContactReport inside = matter_.update_anchors(bodies, touched_);
    report.contacts += inside.contacts;
    report.deepest_in_matter = inside.deepest_in_matter;
    return report;
}

void Contacts::join_touching(DisjointSets& groups, std::span<std::uint8_t> is_held) const {
    matter_.each_touching([&](Index a, Index b) { groups.join(a, b); });
    for (std::size_t b = 0; b < touched_.size(); ++b)
        if (touched_[b] & kOnObstacle) is_held[b] = 1;
}

} // namespace filigree
