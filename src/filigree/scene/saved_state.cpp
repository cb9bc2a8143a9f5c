#include "filigree/scene/saved_state.h"

#include "filigree/physics/step/byte_stream.h"

#include <algorithm>
#include <cstring>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace filigree {

namespace {

constexpr std::string_view kFormat = "FILSTAT", kMagic = "FILSTATA"; // ends in the version: 9, A

void write_totals(ByteWriter& out, const RunTotals& t) {
    for (const std::uint64_t count :
         {t.frames, t.substeps, t.least_substeps, t.most_substeps, t.clamped_particles, t.most_contacts})
        out.value(count);
    out.value(t.deepest_contact);
    out.value(t.deepest_in_matter);
    out.value(t.least_volume_ratio);
    out.value(t.most_stretch);
    for (const double joules : {t.start.kinetic, t.start.elastic, t.start.potential}) out.value(joules);
}

RunTotals read_totals(ByteReader& in) {
    RunTotals t;
    for (std::uint64_t* count :
         {&t.frames, &t.substeps, &t.least_substeps, &t.most_substeps, &t.clamped_particles, &t.most_contacts})
        *count = in.value<std::uint64_t>();
    t.deepest_contact = in.value<double>();
    t.deepest_in_matter = in.value<double>();
    t.least_volume_ratio = in.value<float>();
    t.most_stretch = in.value<float>();
    for (double* joules : {&t.start.kinetic, &t.start.elastic, &t.start.potential}) *joules = in.value<double>();
    return t;
}

void write_point(ByteWriter& out, const Vec3f& point) {
    for (int axis = 0; axis < 3; ++axis) out.value(point[axis]);
}

Vec3f read_point(ByteReader& in) {
    Vec3f point;
    for (int axis = 0; axis < 3; ++axis) point[axis] = in.value<float>();
    return point;
}

void write_energy(ByteWriter& out, const EnergyWatch& watch) {
    for (const std::uint64_t count : {std::uint64_t(watch.has_begun), watch.first, watch.worst, watch.body})
        out.value(count);
    for (const double joules :
         {watch.total, watch.moving, watch.potential, watch.least_potential, watch.grown, watch.share})
        out.value(joules);
    write_point(out, watch.place);
}

EnergyWatch read_energy(ByteReader& in) {
    EnergyWatch watch;
    watch.has_begun = in.value<std::uint64_t>() != 0;
    for (std::uint64_t* count : {&watch.first, &watch.worst, &watch.body}) *count = in.value<std::uint64_t>();
    for (double* joules :
         {&watch.total, &watch.moving, &watch.potential, &watch.least_potential, &watch.grown, &watch.share})
        *joules = in.value<double>();
    watch.place = read_point(in);
    return watch;
}

void write_doubts(ByteWriter& out, const Recording& recording) {
    for (const BodyDoubts& body : recording.doubts) {
        const Inversion inversion = body.inversion.value_or(Inversion{});
        const FlowedOut flowed = body.flowed_out.value_or(FlowedOut{});
        const Unstable unstable = body.unstable.value_or(Unstable{});
        out.value(std::uint64_t(body.first_lost.has_value()) + 2 * std::uint64_t(body.inversion.has_value()) +
                  4 * std::uint64_t(body.flowed_out.has_value()) + 8 * std::uint64_t(body.unstable.has_value()));
        out.value(body.first_lost.value_or(0));
        for (const std::uint64_t count :
             {inversion.first, inversion.last, inversion.frames, inversion.worst, inversion.cells, flowed.first,
              flowed.most, unstable.first, unstable.frames, unstable.substeps})
            out.value(count);
        out.value(inversion.least);
        write_point(out, inversion.place);
    }
    const FirstLoss loss = recording.first_loss.value_or(FirstLoss{});
    for (const std::uint64_t count : {std::uint64_t(recording.first_loss.has_value()), loss.frame, loss.body})
        out.value(count);
    write_point(out, loss.place);
    write_energy(out, recording.energy);
}

void read_doubts(ByteReader& in, std::size_t bodies, Recording& recording) {
    for (std::size_t b = 0; b < bodies; ++b) {
        const auto flags = in.value<std::uint64_t>();
        const auto first_lost = in.value<std::uint64_t>();
        Inversion inversion;
        FlowedOut flowed;
        Unstable unstable;
        for (std::uint64_t* count :
             {&inversion.first, &inversion.last, &inversion.frames, &inversion.worst, &inversion.cells, &flowed.first,
              &flowed.most, &unstable.first, &unstable.frames, &unstable.substeps})
            *count = in.value<std::uint64_t>();
        inversion.least = in.value<float>();
        inversion.place = read_point(in);
        BodyDoubts& body = recording.doubts.emplace_back();
        if (flags & 1) body.first_lost = first_lost;
        if (flags & 2) body.inversion = inversion;
        if (flags & 4) body.flowed_out = flowed;
        if (flags & 8) body.unstable = unstable;
    }
    FirstLoss loss;
    const bool has_loss = in.value<std::uint64_t>() != 0;
    for (std::uint64_t* count : {&loss.frame, &loss.body}) *count = in.value<std::uint64_t>();
    loss.place = read_point(in);
    if (has_loss && loss.body < bodies) recording.first_loss = loss;
    recording.energy = read_energy(in);
    recording.energy.body = std::min<std::uint64_t>(recording.energy.body, bodies - 1);
}

void write_poses(ByteWriter& out, const PoseSequence& poses) {
    out.value(poses.frames_per_second);
    out.value(std::uint64_t{poses.frames.size()});
    for (const Pose& pose : poses.frames) {
        out.array(std::span(pose.positions));
        out.array(std::span(pose.gradients));
    }
}

PoseSequence read_poses(ByteReader& in) {
    PoseSequence poses;
    poses.frames_per_second = in.value<double>();
    const std::uint64_t count = in.value<std::uint64_t>();
    for (std::uint64_t frame = 0; frame < count && in.ok(); ++frame) {
        Pose& pose = poses.frames.emplace_back();
        pose.positions = in.array<Vec3f>();
        pose.gradients = in.array<Mat3f>();
    }
    return poses;
}

std::vector<std::vector<Vec3f>> read_particles(ByteReader& in) {
    std::vector<std::vector<Vec3f>> frames;
    const std::uint64_t count = in.value<std::uint64_t>();
    for (std::uint64_t frame = 0; frame < count && in.ok(); ++frame) frames.push_back(in.array<Vec3f>());
    return frames;
}

void write_matter(ByteWriter& out, const std::vector<MatterParticles>& frames) {
    out.value(std::uint64_t{frames.size()});
    for (const MatterParticles& matter : frames) {
        out.array(std::span(matter.positions));
        out.array(std::span(matter.volumes));
        out.array(std::span(matter.renewal));
        out.value(matter.spacing);
    }
}

std::vector<MatterParticles> read_matter(ByteReader& in) {
    std::vector<MatterParticles> frames;
    const std::uint64_t count = in.value<std::uint64_t>();
    for (std::uint64_t frame = 0; frame < count && in.ok(); ++frame) {
        MatterParticles& matter = frames.emplace_back();
        matter.positions = in.array<Vec3f>();
        matter.volumes = in.array<float>();
        matter.renewal = in.array<float>();
        matter.spacing = in.value<float>();
    }
    return frames;
}

/// What lies between the magic and the checksum, in the order of pack_state.
struct SavedRun {
    Recording recording;
    std::vector<char> simulation;
    bool is_whole = false;

    SavedRun(ByteReader& in, std::size_t bodies) {
        recording.totals = read_totals(in);
        read_doubts(in, bodies, recording);
        for (std::size_t b = 0; b < bodies; ++b) recording.poses.push_back(read_poses(in));
        const std::uint64_t with_particles = in.value<std::uint64_t>();
        for (std::uint64_t b = 0; b < with_particles && in.ok(); ++b) recording.particles.push_back(read_particles(in));
        for (std::size_t b = 0; b < bodies; ++b) recording.matter.push_back(read_matter(in));
        recording.checks = in.array<CheckTotals>();
        simulation = in.array<char>();
        is_whole = in.ok() && in.at_end();
        for (const PoseSequence& poses : recording.poses)
            is_whole = is_whole && poses.frames.size() == recording.totals.frames + 1;
        for (const std::vector<MatterParticles>& frames : recording.matter)
            is_whole = is_whole && (frames.empty() || frames.size() == recording.totals.frames + 1);
    }
};

} // namespace

std::string pack_state(const Recording& recording, const Simulation& simulation, std::uint64_t hash) {
    ByteWriter out;
    out.value(hash);
    write_totals(out, recording.totals);
    write_doubts(out, recording);
    for (const PoseSequence& poses : recording.poses) write_poses(out, poses);
    out.value(std::uint64_t{recording.particles.size()});
    for (const auto& frames : recording.particles) {
        out.value(std::uint64_t{frames.size()});
        for (const std::vector<Vec3f>& particles : frames) out.array(std::span(particles));
    }
    for (const std::vector<MatterParticles>& frames : recording.matter) write_matter(out, frames);
    out.array(std::span(recording.checks));
    const std::string state = simulation.save();
    out.array(std::span(state));
    std::string bytes = std::string(kMagic) + out.take();
    const std::uint64_t sum = XXH3_64bits(bytes.data(), bytes.size());
    bytes.append(reinterpret_cast<const char*>(&sum), sizeof sum);
    return bytes;
}

Status unpack_state(std::string_view bytes, const std::string& name, std::uint64_t hash, Recording& recording,
                    Simulation& simulation) {
    const Error damaged{ErrorCode::bad_file, name + ": is damaged; run the scene from its start."};
    if (!bytes.starts_with(kFormat)) return Error{ErrorCode::bad_file, name + ": is no saved state of a simulation."};
    if (!bytes.starts_with(kMagic))
        return Error{ErrorCode::bad_file,
                     name + ": was saved by another version of Filigree; run the scene from its start."};
    std::uint64_t sum = 0;
    if (bytes.size() < kMagic.size() + sizeof sum) return damaged;
    const std::string_view content = bytes.substr(0, bytes.size() - sizeof sum);
    std::memcpy(&sum, content.data() + content.size(), sizeof sum);
    if (sum != XXH3_64bits(content.data(), content.size())) return damaged;
    ByteReader in(content.substr(kMagic.size()));
    if (in.value<std::uint64_t>() != hash)
        return Error{ErrorCode::mismatch, name + ": is the state of another scene, or of this one before it was "
                                                 "changed; run the scene from its start."};
    SavedRun saved(in, recording.poses.size());
    if (!saved.is_whole || saved.recording.particles.size() != recording.particles.size()) return damaged;
    if (saved.recording.checks.size() != recording.checks.size())
        return Error{ErrorCode::usage,
                     name + (recording.checks.empty() ? ": was saved by a run that checked the restored meshes; check "
                                                        "them in this one too."
                                                      : ": was saved by a run that did not check the restored meshes; "
                                                        "leave the check out of this one.")};
    if (const Status restored = simulation.restore({saved.simulation.data(), saved.simulation.size()}); !restored)
        return Error{restored.error().code, name + ": " + restored.error().message};
    recording = std::move(saved.recording);
    return Success{};
}

} // namespace filigree
