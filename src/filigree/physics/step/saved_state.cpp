#include "filigree/physics/step/saved_state.h"

#include "filigree/physics/step/byte_stream.h"

#include <array>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace filigree {

namespace {

// The name of the format, its version last. C: contacts are pairs of one kind; obstacles that were set, and what
// touched in the last frame.
constexpr std::uint64_t kMagic = 0x43455441'54534c46;            // "FLSTATEC"
constexpr std::uint64_t kMagicWithTargets = 0x47455441'54534c46; // "FLSTATEG": bodies follow targets
static_assert(sizeof(SetMotion) == sizeof(std::uint64_t) + 26 * sizeof(double), "padding would be saved");
static_assert(sizeof(ContactEvents::PairMemory) == 2 * sizeof(std::uint64_t) + 2 * sizeof(Index) + 2 * sizeof(Vec3f),
              "padding would be saved");
static_assert(sizeof(Contacts::CandidateMemory) == 4 * sizeof(Index) + 4 * sizeof(Vec3f) + sizeof(Vec3d),
              "padding would be saved");
static_assert(sizeof(Contacts::PairMemory) == 8 * sizeof(Index), "padding would be saved");
static_assert(sizeof(RigidPairs::Point) == 3 * sizeof(Index) + 4 * sizeof(Vec3f), "padding would be saved");
static_assert(sizeof(RigidPairs::PairMemory) == 16 * sizeof(Index), "padding would be saved");
static_assert(sizeof(LinkState) == 2 * sizeof(float) + sizeof(Vec3f), "padding would be saved");

void write_pose(ByteWriter& writer, const std::optional<RigidPose>& pose) {
    writer.value(std::uint64_t(pose.has_value()));
    if (!pose) return;
    for (const Vec3d& v : {pose->centre, pose->velocity, pose->angular})
        for (int axis = 0; axis < 3; ++axis) writer.value(v[axis]);
    for (int k = 0; k < 4; ++k) writer.value(pose->turn.coeffs()[k]);
    writer.value(pose->quiet_seconds);
    writer.value(std::uint64_t(pose->sleeps) + 2 * std::uint64_t(pose->rests));
}

std::optional<RigidPose> read_pose(ByteReader& reader) {
    if (reader.value<std::uint64_t>() == 0) return std::nullopt;
    RigidPose pose;
    for (Vec3d* v : {&pose.centre, &pose.velocity, &pose.angular})
        for (int axis = 0; axis < 3; ++axis) (*v)[axis] = reader.value<double>();
    for (int k = 0; k < 4; ++k) pose.turn.coeffs()[k] = reader.value<double>();
    pose.quiet_seconds = reader.value<double>();
    const auto flags = reader.value<std::uint64_t>();
    pose.sleeps = (flags & 1) != 0;
    pose.rests = (flags & 2) != 0;
    return pose;
}

/// Calls visit(number) for each, in order.
template <class Hit, class Visit>
void each_number(Hit& hit, const Visit& visit) {
    visit(hit.seconds);
    for (auto* v :
         {&hit.pushed.normal, &hit.pushed.place, &hit.pushed.other_velocity, &hit.centre, &hit.velocity, &hit.spin})
        for (int axis = 0; axis < 3; ++axis) visit((*v)[axis]);
    for (auto* number : {&hit.pushed.force, &hit.pushed.restitution, &hit.pushed.other}) visit(*number);
}

void write_hit(ByteWriter& writer, const BodyHit& hit) {
    each_number(hit, [&](const double& number) { writer.value(number); });
}

BodyHit read_hit(ByteReader& reader) {
    BodyHit hit;
    each_number(hit, [&](double& number) { number = reader.value<double>(); });
    return hit;
}

void write_body(ByteWriter& writer, const SavedBody& body) {
    writer.value(std::uint64_t(body.positions.size()));
    writer.vectors(body.positions);
    writer.vectors(body.velocities);
    writer.array(std::span(body.elasticity));
    writer.value(body.rubbed_seconds);
    write_hit(writer, body.hit);
    write_pose(writer, body.rigid);
}

SavedBody read_body(ByteReader& reader) {
    SavedBody body;
    const std::size_t count = reader.count(6 * sizeof(float));
    body.positions = reader.vectors(count);
    body.velocities = reader.vectors(count);
    const std::vector<char> elasticity = reader.array<char>();
    body.elasticity.assign(elasticity.begin(), elasticity.end());
    body.rubbed_seconds = reader.value<float>();
    body.hit = read_hit(reader);
    body.rigid = read_pose(reader);
    return body;
}

void write_contacts(ByteWriter& writer, const Contacts::Memory& contacts) {
    writer.value(contacts.travelled);
    writer.value(contacts.reach);
    writer.array(std::span(contacts.pairs));
    writer.array(std::span(contacts.candidates));
    writer.array(std::span(contacts.recovers));
    writer.array(std::span(contacts.touched));
}

Contacts::Memory read_contacts(ByteReader& reader) {
    Contacts::Memory contacts;
    contacts.travelled = reader.value<float>();
    contacts.reach = reader.value<float>();
    contacts.pairs = reader.array<Contacts::PairMemory>();
    contacts.candidates = reader.array<Contacts::CandidateMemory>();
    contacts.recovers = reader.array<std::uint8_t>();
    contacts.touched = reader.array<ContactEvents::PairMemory>();
    return contacts;
}

template <class Memory>
auto vectors_of(Memory& targets) {
    return std::array{&targets.from, &targets.from_velocities, &targets.to, &targets.to_velocities,
                      &targets.accelerations};
}

void write_targets(ByteWriter& writer, std::span<const TargetsMemory> targets) {
    writer.value(std::uint64_t(targets.size()));
    for (const TargetsMemory& of : targets) {
        writer.value(of.actor);
        writer.value(of.is_set);
        for (const Vectors* vectors : vectors_of(of)) {
            writer.value(std::uint64_t(vectors->size()));
            writer.vectors(*vectors);
        }
        writer.array(std::span(of.from_stretches));
        writer.array(std::span(of.to_stretches));
    }
}

std::vector<TargetsMemory> read_targets(ByteReader& reader) {
    std::vector<TargetsMemory> targets(reader.count(9 * sizeof(std::uint64_t)));
    for (TargetsMemory& of : targets) {
        of.actor = reader.value<std::uint64_t>();
        of.is_set = reader.value<std::uint64_t>();
        for (Vectors* vectors : vectors_of(of)) {
            const std::size_t count = reader.count(3 * sizeof(float));
            Vectors read = reader.vectors(count);
            if (count > 0) *vectors = std::move(read);
        }
        of.from_stretches = reader.array<RestStretch>();
        of.to_stretches = reader.array<RestStretch>();
    }
    return targets;
}

} // namespace

std::string write_saved_state(const SavedState& state) {
    ByteWriter writer;
    writer.value(state.targets.empty() ? kMagic : kMagicWithTargets);
    for (const std::uint64_t hash : {state.made_for.bodies, state.made_for.world, state.made_for.options})
        writer.value(hash);
    writer.value(state.frame);
    writer.array(std::span(state.set_motions));
    writer.value(std::uint64_t(state.bodies.size()));
    for (const SavedBody& body : state.bodies) write_body(writer, body);
    write_contacts(writer, state.contacts);
    writer.array(std::span(state.rigid_pairs.pairs));
    writer.array(std::span(state.rigid_pairs.points));
    writer.array(std::span(state.grid));
    if (!state.targets.empty()) write_targets(writer, state.targets);
    for (const CrackMemory& cracks : state.cracks) {
        writer.value(cracks.is_open);
        writer.array(std::span(cracks.links));
        writer.array(std::span(cracks.broke));
    }
    std::string bytes = writer.take();
    ByteWriter sum;
    sum.value(std::uint64_t{XXH3_64bits(bytes.data(), bytes.size())});
    return bytes + sum.take();
}

Result<SavedState> read_saved_state(std::string_view bytes) {
    const Error damaged{ErrorCode::bad_file, "The saved state is damaged; start the simulation anew."};
    const auto magic = ByteReader(bytes).value<std::uint64_t>();
    if (magic != kMagic && magic != kMagicWithTargets)
        return Error{ErrorCode::bad_file,
                     "The saved state is damaged or of another version; start the simulation anew."};
    const std::string_view contents = bytes.substr(0, bytes.size() - sizeof(std::uint64_t));
    const auto sum = ByteReader(bytes.substr(contents.size())).value<std::uint64_t>();
    if (sum != XXH3_64bits(contents.data(), contents.size())) return damaged;
    ByteReader reader(contents);
    reader.value<std::uint64_t>(); // the magic
    SavedState state;
    for (std::uint64_t* hash : {&state.made_for.bodies, &state.made_for.world, &state.made_for.options})
        *hash = reader.value<std::uint64_t>();
    state.frame = reader.value<std::uint64_t>();
    state.set_motions = reader.array<SetMotion>();
    state.bodies.resize(reader.count(sizeof(std::uint64_t)));
    for (SavedBody& body : state.bodies) body = read_body(reader);
    state.contacts = read_contacts(reader);
    state.rigid_pairs.pairs = reader.array<RigidPairs::PairMemory>();
    state.rigid_pairs.points = reader.array<RigidPairs::Point>();
    const std::vector<char> grid = reader.array<char>();
    state.grid.assign(grid.begin(), grid.end());
    if (magic == kMagicWithTargets) state.targets = read_targets(reader);
    while (reader.ok() && !reader.at_end()) {
        CrackMemory& cracks = state.cracks.emplace_back();
        cracks.is_open = reader.value<std::uint32_t>();
        cracks.links = reader.array<LinkState>();
        cracks.broke = reader.array<double>();
    }
    if (!reader.ok() || !reader.at_end()) return damaged;
    return state;
}

} // namespace filigree
