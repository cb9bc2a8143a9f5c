#include "simulate_recording.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace filigree::cli {

namespace {

constexpr std::string_view kMagic = "FILSTAT1"; // ends in the version

class Packer {
public:
    explicit Packer(std::string& bytes) : bytes_(bytes) {}
    template <class T>
    void value(const T& item) {
        static_assert(std::is_trivially_copyable_v<T>);
        bytes_.append(reinterpret_cast<const char*>(&item), sizeof item);
    }
    template <class T>
    void array(const T& items) {
        value(std::uint64_t{items.size()});
        bytes_.append(reinterpret_cast<const char*>(items.data()), items.size() * sizeof(*items.data()));
    }

private:
    std::string& bytes_;
};

/// Reads what a Packer wrote; once something does not fit, everything reads as empty and is_sound() is false.
class Unpacker {
public:
    explicit Unpacker(std::string_view bytes) : bytes_(bytes) {}
    template <class T>
    void value(T& item) {
        if (take(sizeof item)) std::memcpy(static_cast<void*>(&item), taken_, sizeof item);
    }
    std::size_t count(std::size_t item_size) {
        std::uint64_t count = 0;
        value(count);
        if (count > bytes_.size() / item_size) is_sound_ = false;
        return is_sound_ ? count : 0;
    }
    template <class T>
    void array(T& items) {
        items.resize(count(sizeof(*items.data())));
        if (take(items.size() * sizeof(*items.data())) && !items.empty())
            std::memcpy(static_cast<void*>(items.data()), taken_, items.size() * sizeof(*items.data()));
    }
    bool is_sound() const { return is_sound_; }
    bool is_at_end() const { return is_sound_ && bytes_.empty(); }

private:
    bool take(std::size_t size) {
        if (size > bytes_.size()) is_sound_ = false;
        if (!is_sound_) return false;
        taken_ = bytes_.data();
        bytes_.remove_prefix(size);
        return true;
    }

    std::string_view bytes_;
    const char* taken_ = nullptr;
    bool is_sound_ = true;
};

void pack_poses(Packer& out, const PoseSequence& poses) {
    out.value(poses.frames_per_second);
    out.value(std::uint64_t{poses.frames.size()});
    for (const Pose& pose : poses.frames) {
        out.array(pose.positions);
        out.array(pose.gradients);
    }
}

void unpack_poses(Unpacker& in, PoseSequence& poses) {
    in.value(poses.frames_per_second);
    poses.frames.resize(in.count(2 * sizeof(std::uint64_t)));
    for (Pose& pose : poses.frames) {
        in.array(pose.positions);
        in.array(pose.gradients);
    }
}

} // namespace

void Totals::add(const FrameReport& report) {
    ++frames;
    ++(report.used == StepMode::descent ? descent_frames : explicit_frames);
    substeps += report.substeps;
    least_substeps = std::min<std::uint64_t>(least_substeps, report.substeps);
    most_substeps = std::max<std::uint64_t>(most_substeps, report.substeps);
    clamped_particles += report.clamped_particles;
    most_contacts = std::max<std::uint64_t>(most_contacts, report.contacts);
    elastic_seconds += report.elastic_seconds;
    contact_seconds += report.contact_seconds;
    other_seconds += report.other_seconds;
    deepest_contact = std::max(deepest_contact, report.deepest_contact);
    least_volume_ratio = std::min(least_volume_ratio, report.least_volume_ratio);
    most_stretch = std::max(most_stretch, report.most_stretch);
}

std::string pack_state(const Recording& recording, const Simulation& simulation, std::uint64_t hash) {
    std::string bytes(kMagic);
    Packer out(bytes);
    out.value(hash);
    out.value(recording.totals);
    for (const PoseSequence& poses : recording.poses) pack_poses(out, poses);
    out.value(std::uint64_t{recording.particles.size()});
    for (const auto& frames : recording.particles) {
        out.value(std::uint64_t{frames.size()});
        for (const std::vector<Vec3f>& particles : frames) out.array(particles);
    }
    out.array(recording.checks);
    out.array(simulation.save());
    out.value(XXH3_64bits(bytes.data(), bytes.size()));
    return bytes;
}

Status unpack_state(std::string_view bytes, const std::string& name, std::uint64_t hash, Recording& recording,
                    Simulation& simulation) {
    const Error damaged{ErrorCode::bad_file, name + ": is damaged; run the scene from its start."};
    if (!bytes.starts_with(kMagic))
        return Error{ErrorCode::bad_file, name + ": is no saved state of a simulation; --save writes them."};
    std::uint64_t sum = 0, saved_hash = 0;
    if (bytes.size() < kMagic.size() + sizeof sum) return damaged;
    const std::string_view content = bytes.substr(0, bytes.size() - sizeof sum);
    std::memcpy(&sum, content.data() + content.size(), sizeof sum);
    if (sum != XXH3_64bits(content.data(), content.size())) return damaged;
    Unpacker in(content.substr(kMagic.size()));
    in.value(saved_hash);
    if (saved_hash != hash)
        return Error{ErrorCode::mismatch, name + ": is the state of another scene, or of this one before it was "
                                                 "changed; run the scene from its start."};
    Recording saved;
    saved.poses.resize(recording.poses.size());
    in.value(saved.totals);
    for (PoseSequence& poses : saved.poses) unpack_poses(in, poses);
    saved.particles.resize(in.count(sizeof(std::uint64_t)));
    for (auto& frames : saved.particles) {
        frames.resize(in.count(sizeof(std::uint64_t)));
        for (std::vector<Vec3f>& particles : frames) in.array(particles);
    }
    in.array(saved.checks);
    std::string state;
    in.array(state);
    if (!in.is_at_end() || saved.particles.size() != recording.particles.size()) return damaged;
    for (std::size_t b = 0; b < saved.poses.size(); ++b)
        if (saved.poses[b].frames.size() != saved.totals.frames + 1) return damaged;
    if (saved.checks.size() != recording.checks.size())
        return Error{ErrorCode::usage,
                     name + (recording.checks.empty() ? ": was saved with --check; resume it so."
                                                      : ": was saved without --check; resume it so.")};
    if (Status status = simulation.restore(state); !status) {
        status = Error{status.error().code, name + ": " + status.error().message};
        return status;
    }
    recording = std::move(saved);
    return Success{};
}

} // namespace filigree::cli
