// A body that breaks, on its way: which copies of corners are tied, what lets go, and how it holds on until it is free.
// Private to the layer.
#pragma once

#include "filigree/physics/body/body_state.h"
#include "filigree/physics/breaking/crack_law.h"

namespace filigree {

/// What holds two copies of a corner.
struct LinkState {
    enum Phase : std::uint32_t { tied, coming_apart, free };
    std::uint32_t phase = tied;
    crack_law::Cohesion cohesion;
};

/// All that cracks remember.
struct CrackMemory {
    std::uint32_t is_open = 0;
    std::vector<LinkState> links;
    std::vector<double> broke; ///< s, of each piece
};

class Cracks {
public:
    /// whole, first_piece: numbers of bodies.
    Cracks(std::shared_ptr<const Fracture> fracture, std::size_t whole, std::size_t first_piece);

    std::size_t whole() const { return whole_; }
    const BrokenBody& body() const { return *fracture_->body; }
    std::size_t first_piece() const { return first_; }
    bool is_open() const { return is_open_; } ///< the pieces move, and no longer the whole

    /// After a substep that ended at `time`: what lets go. Whether anything did, and forces have to be found anew.
    bool advance(std::span<BodyState> bodies, double time, const RunContext& context);
    /// What cohesion asks of a substep.
    struct Pace {
        float squared_frequency = 0; ///< 1/s^2: a bound on what it adds
        float opening_step =
            std::numeric_limits<float>::infinity(); ///< s: in longer ones cracks open too far at a time
    };
    /// Points of cracks that have opened touch others from now on. Whether there are any new ones.
    bool reveal(std::span<BodyState> bodies);
    /// Adds what holds pieces that come apart, then adds up over tied copies.
    Pace add_forces(std::span<BodyState> bodies, const RunContext& context) const;

    /// Around something that moves copies one by one: what moved one of them then moves all that are tied.
    void remember_places(std::span<const BodyState> bodies);
    void rejoin(std::span<BodyState> bodies) const;

    /// Piece bodies where the whole is, with its velocities; they take part from here on only if the body is open.
    void follow_whole(std::span<BodyState> bodies) const;
    /// The whole's particles where the pieces' are, to be looked at.
    void show_whole(std::span<BodyState> bodies) const;
    /// Whether two copies of one corner of the whole are tied, as numbers into BrokenBody::copies.
    bool are_tied(Index copy, Index other) const { return group_of_copy_[copy] == group_of_copy_[other]; }
    /// Gradients at the corners of the pieces' bodies: means over tied copies.
    std::vector<std::vector<Mat3f>> gradients(std::span<const BodyState> bodies, const RunContext& context) const;

    FractureReport report() const;
    CrackMemory memory() const;
    /// False where it is not of this body. Positions come afterwards.
    bool set_memory(const CrackMemory& memory, std::span<BodyState> bodies);

private:
    struct Stress {
        Vec3f traction, normal; ///< Pa and unit, in the world, on the first piece
        float opened = 0;       ///< m, for good
    };
    BodyState& state(std::span<BodyState> bodies, Index piece) const { return bodies[first_ + piece]; }
    const BodyState& state(std::span<const BodyState> bodies, Index piece) const { return bodies[first_ + piece]; }
    Stress stress(const CrackFacet& facet, std::span<const BodyState> bodies) const;
    float held_part(const CrackFacet& facet) const;
    std::vector<float> at_links(const std::vector<float>& field) const;
    float strength(Index link) const;
    float most_opened(Index link) const;
    Vec3f between(Index link, std::span<const BodyState> bodies) const;
    float stiffest(Index link, std::span<const BodyState> bodies) const;
    void let_go(Index link, const Vec3f& pull, double time);
    bool open_links(std::span<const BodyState> bodies, double time, const RunContext& context);
    bool let_events_go(double time);
    bool let_specks_go(double time);
    void take_part(std::span<BodyState> bodies);
    void hide(BodyState& to, Index piece) const;
    void find_groups(std::span<BodyState> bodies);
    void find_tied();

    std::shared_ptr<const Fracture> fracture_;
    std::size_t whole_, first_;
    float young_modulus_;
    double front_energy_; ///< J/m^2
    bool is_open_ = false;
    std::vector<LinkState> links_;
    std::vector<double> broke_;              ///< s, of each piece
    std::vector<std::uint8_t> beside_crack_; ///< of each link
    std::vector<float> strengths_;           ///< Pa, of each link away from cracks
    /// Of each link, the body's fields in the cells that hold it, as multiples; each empty where that does not vary.
    std::vector<float> stiffness_there_, strength_there_, yield_there_;
    std::vector<Index> tied_, facets_of_tied_;   ///< links, and what they feel
    std::vector<Index> group_of_copy_;           ///< numbers into BrokenBody::copies
    std::vector<Index> group_offsets_, members_; ///< of the groups of two and more
    std::vector<Vec3f> places_, speeds_;         ///< of those, by remember_places
    double checked_until_ = -1;                  ///< s: events before that are done
};

} // namespace filigree
