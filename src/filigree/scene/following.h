// A body of a scene that follows an animated character. Private to the layer.
#pragma once

#include "filigree/physics/simulation.h"
#include "filigree/scene/world_setup.h"

#include <span>

namespace filigree {

class Following {
public:
    /// body: one that follows; it and the actor outlive this. number: of the body.
    Following(const ReadyBody& body, const Actor& actor, std::size_t number, double frames_per_second,
              const RunContext& context);

    std::size_t body() const { return number_; }
    /// Puts the body on its targets, before the first frame. Errors: those of Simulation::set_follow.
    Status begin(Simulation& simulation);
    /// Says where the targets are at the end of the next frame. Errors: those of Simulation::set_targets.
    Status next(Simulation& simulation);
    /// What the body's flesh does not carry, in a frame: vertices of its mesh, among others, as the joints have them.
    /// positions: m, in the scene. gradients: as many, or empty.
    void carry_left_out(std::size_t frame, std::span<const Index> vertices, std::span<Vec3f> positions,
                        std::span<Mat3f> gradients);

private:
    double clip_seconds(double frame) const;
    void set_transforms(double frame);
    Vectors targets(double frame, Vectors* felt);
    Vectors velocities(double frame, const Vectors& now);
    std::vector<Mat3f> stretches(double frame);

    const ReadyBody& body_;
    const Flesh& flesh_;
    const Eigen::Isometry3d placement_;
    const std::size_t number_;
    const double rate_;
    const RunContext context_;
    std::vector<Eigen::Affine3d> transforms_;
};

} // namespace filigree
