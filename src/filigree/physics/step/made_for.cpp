#include "filigree/physics/step/made_for.h"

#include "filigree/physics/body/fields.h"
#include "filigree/physics/step/byte_stream.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace filigree {

namespace {

void write(ByteWriter& out, const Vec3d& v) {
    for (int axis = 0; axis < 3; ++axis) out.value(v[axis]);
}

template <class T>
void write(ByteWriter& out, const Keyed<T>& keyed) {
    out.array(std::span(keyed.times));
    out.array(std::span(keyed.values));
    if constexpr (std::is_same_v<T, double>)
        out.value(keyed.constant);
    else
        write(out, keyed.constant);
}

void write(ByteWriter& out, const RigidMotion& motion) {
    write(out, motion.centre);
    write(out, motion.move);
    write(out, motion.angle);
    const Eigen::Matrix4d start = motion.start.matrix();
    out.array(std::span(start.data(), std::size_t(start.size())));
}

void write(ByteWriter& out, const HalfSpace& ground) {
    write(out, ground.point);
    write(out, ground.normal);
}
void write(ByteWriter& out, const Ball& ball) {
    write(out, ball.centre);
    out.value(ball.radius);
}
void write(ByteWriter& out, const Cuboid& box) {
    write(out, box.centre);
    write(out, box.size);
}
/// The field is told by where it is and a few of its distances.
void write(ByteWriter& out, const MeshObstacle& mesh) {
    constexpr int kAsked = 5;
    write(out, mesh.offset);
    const Box& box = mesh.field->box();
    write(out, box.min);
    write(out, box.max);
    for (int n = 0; n < kAsked * kAsked * kAsked; ++n) {
        const Vec3d part = Vec3d(n % kAsked, n / kAsked % kAsked, n / (kAsked * kAsked)) / (kAsked - 1);
        out.value(mesh.field->at((box.min + part.cwiseProduct(box.max - box.min)).cast<float>()).distance);
    }
}

void write(ByteWriter& out, const PairContact& contact) {
    out.value(contact.friction);
    out.value(contact.restitution);
}

void write(ByteWriter& out, const Material& m) {
    out.value(std::uint64_t(m.model));
    for (const double number : {m.density, m.young_modulus, m.poisson_ratio, m.damping, m.internal_damping, m.bending,
                                m.yield_stress, m.creep_time, m.temperature, m.melting_from, m.melting_to, m.viscosity,
                                m.heating, m.conductivity, m.specific_heat, m.latent_heat})
        out.value(number);
}

void write(ByteWriter& out, const Body& body) {
    write(out, body.material);
    out.value(std::uint64_t(body.rest.size()));
    out.vectors(body.rest);
    out.array(std::span(body.mass));
    out.array(std::span(body.cells.cells));
    out.array(std::span(body.surface.points.rest));
    for (const FieldOf of : kFields) // of a body in which nothing varies the hash is what it would be without fields
        if (const std::vector<float>& field = body.fields.of(of); !field.empty()) {
            out.value(std::uint64_t(of));
            out.array(std::span(field));
        }
}

void write(ByteWriter& out, const Fracture& fracture) {
    for (const double number : {fracture.material.strength, fracture.material.scatter, fracture.material.energy,
                                fracture.material.plastic_opening})
        out.value(number);
    out.value(fracture.material.seed);
    for (const FractureEvent& event : fracture.events) {
        out.value(event.time);
        out.array(std::span(event.pieces));
        out.array(std::span(event.particles));
    }
    for (const std::shared_ptr<const Body>& piece : fracture.body->pieces) write(out, *piece);
}

std::uint64_t hash_of(ByteWriter out) {
    const std::string bytes = out.take();
    return XXH3_64bits(bytes.data(), bytes.size());
}

std::uint64_t hash_of(const World& world) {
    ByteWriter out;
    write(out, world.gravity);
    write(out, world.wind);
    for (const double number : {world.air_density, world.heat_pace, world.body_friction, world.body_restitution})
        out.value(number);
    for (const Obstacle& obstacle : world.obstacles) {
        out.value(std::uint64_t(obstacle.shape.index()));
        std::visit([&](const auto& shape) { write(out, shape); }, obstacle.shape);
        write(out, obstacle.motion);
        write(out, obstacle.temperature);
        for (const double number :
             {obstacle.friction, obstacle.restitution, obstacle.stiffness, obstacle.heat_transfer})
            out.value(number);
    }
    for (const Pin& pin : world.pins) {
        out.value(std::uint64_t(pin.body));
        out.array(std::span(pin.particles));
        write(out, pin.motion);
    }
    for (const RegionForce& force : world.forces) {
        out.value(std::uint64_t(force.body));
        out.array(std::span(force.particles));
        write(out, force.force);
    }
    for (const BodyPair& pair : world.body_pairs) {
        out.value(std::uint64_t(pair.first));
        out.value(std::uint64_t(pair.second));
        write(out, pair.contact);
    }
    for (const GroupPair& pair : world.group_pairs) {
        out.array(std::span(pair.first));
        out.array(std::span(pair.second));
        write(out, pair.contact);
    }
    return hash_of(std::move(out));
}

std::uint64_t hash_of(const StepOptions& o) {
    ByteWriter out;
    out.value(o.frames_per_second);
    for (const unsigned number : {unsigned(o.mode), o.most_substeps, unsigned(o.contacts_between_bodies),
                                  unsigned(o.contacts_within_bodies), unsigned(o.automatic_rigid)})
        out.value(number);
    return hash_of(std::move(out));
}

} // namespace

MadeFor made_for(const World& world, const StepOptions& options) {
    return {.bodies = 0, .world = hash_of(world), .options = hash_of(options)};
}

std::uint64_t made_of(const Actor& actor) {
    ByteWriter out;
    write(out, *actor.body);
    out.value(std::uint64_t(actor.fracture != nullptr));
    if (actor.fracture) write(out, *actor.fracture);
    return hash_of(std::move(out));
}

std::uint64_t made_of_all(std::span<const Index> slots, std::span<const std::uint64_t> actors) {
    ByteWriter out;
    out.array(slots);
    out.array(actors);
    return hash_of(std::move(out));
}

Status check_same(const MadeFor& saved, const MadeFor& here) {
    const auto other = [](const char* what) { return Error{ErrorCode::mismatch, what}; };
    if (saved.bodies != here.bodies)
        return other("The saved state is of other bodies than there are now: of another scene, or some were added or "
                     "removed in between; resume it with the bodies that there were when it was saved.");
    if (saved.world != here.world)
        return other("The saved state is of another world (gravity, wind, obstacles, pins, forces or friction differ); "
                     "resume it with the world it was saved from.");
    if (saved.options != here.options)
        return other("The saved state is of a simulation with other options (frames a second, mode, substeps, contacts "
                     "or automatic_rigid differ); resume it with the options it was saved from.");
    return Success{};
}

} // namespace filigree
