// What touches in a frame, added up as forces and impulses are found. Private to the layer.
#pragma once

#include "filigree/physics/contact/contact_pair.h"
#include "filigree/physics/simulation.h"

#include <span>

namespace filigree {

struct ContactPoint;

class ContactEvents {
public:
    void resize(std::size_t slots) {
        found_.resize(slots);
        kept_.resize(slots);
    }
    void begin_frame(); ///< nothing has touched yet

    /// Forces are found anew; those that were not kept are forgotten.
    void begin_forces();
    /// A point touches with this force: impulse, N s along the normal in the substep; approach, m/s that it came
    /// nearer; normal, unit, towards the body. Of different bodies from several threads.
    void touch(Index body, ColliderId other, const Vec3f& place, const Vec3f& normal, float impulse, float approach) {
        add(found_[body], other, place, normal, impulse, approach);
    }
    /// The forces found last were those of a substep.
    void keep_forces();

    /// An impulse beside forces; counts at once.
    void push(Index body, ColliderId other, const Vec3f& place, const Vec3f& normal, float impulse,
              float approach = 0) {
        add(kept_[body], other, place, normal, impulse, approach);
    }
    /// Those of the solver of rigid bodies, after it has finished a substep.
    void push(std::span<const ContactPoint> points);

    /// Makes the frame's events. Cost O(slots + what touches).
    void end_frame(std::span<const BodyState> bodies);
    const std::vector<ContactEvent>& of_frame() const { return events_; }

    /// Two that touched in the last frame. Saved as it is.
    struct PairMemory {
        std::uint64_t body, other; ///< actors, or an obstacle
        std::uint32_t is_body;     ///< other is one
        std::uint32_t unused = 0;  ///< so that nothing is padding
        Vec3f place, normal;
    };
    const std::vector<PairMemory>& memory() const { return pairs_; }
    void set_memory(std::vector<PairMemory> pairs) { pairs_ = std::move(pairs); }
    void forget_frame() { events_.clear(); } ///< of_frame is of none

private:
    struct Sum { ///< of what a body has with another
        ColliderId other;
        double weight = 0, impulse = 0; ///< N s
        float speed = 0;
        Vec3d place = Vec3d::Zero(), normal = Vec3d::Zero(); ///< times weights
        void add(const Sum& more);
    };
    static void add(std::vector<Sum>& sums, ColliderId other, const Vec3f& place, const Vec3f& normal, float impulse,
                    float approach);
    static void add(std::vector<Sum>& sums, const Sum& more);
    std::vector<ContactEvent> touching(std::span<const BodyState> bodies) const;

    std::vector<std::vector<Sum>> found_, kept_; ///< by body
    std::vector<PairMemory> pairs_;
    std::vector<ContactEvent> events_;
};

} // namespace filigree
