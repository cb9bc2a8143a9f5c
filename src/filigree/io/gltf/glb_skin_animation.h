// A driver's motion as keys of a skin's joints.
#pragma once

#include "filigree/file.h"
#include "filigree/io/gltf/glb_builder.h"
#include "filigree/io/gltf/gltf_export_error.h"
#include "filigree/restore.h"

#include <array>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace filigree {

/// A key, and how its tangent follows from what lies around it: sum of weights times samples.
struct SkinKey {
    std::size_t sample;
    std::array<std::pair<std::size_t, double>, 3> slope = {};
};

/// What every joint does, sampled at keys, and for cubic keys at two moments more for each.
class SkinAnimation {
public:
    /// Errors: those of the poses; unsupported (more than a GLB can hold, found before the work); cancelled.
    /// Memory: 48 bytes a joint and sample.
    static Result<SkinAnimation> sample(const Skin& skin, const FrameSource<Pose>& stream, PoseSampler& poses,
                                        const Restorer& restorer, const SkinOptions& options,
                                        const RunContext& context);

    std::vector<double> key_times() const;
    /// 95th percentile over driver vertices and keys of ExportReport::normal_error_degrees.
    double normal_error_degrees() const { return normal_error_degrees_; }

    /// The largest distance of two skins' vertices in some keys, fraction of the driver's diagonal. The skins have the
    /// joints of this animation, and other weights and positions.
    double distance(const Skin& a, const Skin& b, const RunContext& context) const;

    /// Adds the keys, as an animation of that name, to a file where joint j has the outer node first_node + 2 j and the
    /// inner node after it. Returns the animation, null when nothing moves. A property that stays at rest has no
    /// channel; one that stays elsewhere has one key.
    GlbBuilder::Json add_to(GlbBuilder& builder, const std::string& name, const Skin& skin, std::size_t first_node,
                            const RunContext& context) const;

private:
    bool cubic_ = false, small_rotations_ = false;
    std::optional<double> key_error_; ///< keys are coded within this error, a fraction of the diagonal
    std::vector<double> times_;       ///< of samples, seconds
    std::vector<SkinKey> keys_;
    std::vector<std::vector<Mat3f>> matrices_;     ///< of each joint, sample after sample
    std::vector<std::vector<Vec3f>> translations_; ///< the same
    double normal_error_degrees_ = 0;

    GlbBuilder::Json add_coded(GlbBuilder& builder, const std::string& name, const Skin& skin, std::size_t first_node,
                               std::span<const std::vector<NestedRotations>> parts, const RunContext& context) const;
    double diagonal() const;
    Vec3d place(const Skin& skin, std::size_t vertex, std::size_t sample) const;
    void plan(const FrameSource<Pose>& stream, const SkinOptions& options);
};

} // namespace filigree
