// Which level of a model is drawn: by its size on screen, by how long drawing takes, and how one melts into the next.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace filigree {

/// What a level costs, and what is lost by drawing it instead of the finest.
struct LevelFacts {
    std::size_t triangles = 0, vertices = 0;
    std::optional<double> deviation; ///< how far most of the finest level's vertices are from it, model units; unset:
                                     ///< not measured yet, so it is not chosen
};

/// The error on screen that nobody sees, and how much of it more than that a level may have before a finer one is
/// taken: between the two nothing changes, so that a camera which trembles does not make levels tremble.
inline constexpr double kUnseenPixels = 0.8, kHysteresis = 1.5;

/// The coarsest level up to `finest` whose deviation is below kUnseenPixels. `now` (the level drawn) stays while it is
/// not the coarsest by this measure, but one that is below kUnseenPixels * kHysteresis.
/// levels: coarse to fine; finest < levels.size(). pixels_a_unit: size of a model unit where the shape is nearest.
unsigned level_by_size(std::span<const LevelFacts> levels, unsigned finest, unsigned now, double pixels_a_unit);

/// What a picture of a moving shape costs here, learned from pictures drawn.
class DrawingCost {
public:
    /// milliseconds: of a picture with so many triangles; of restoring so many vertices, when the pose changed.
    void learn_drawing(double milliseconds, std::size_t triangles);
    void learn_restoring(double milliseconds, std::size_t vertices);

    /// Milliseconds of a picture; 0 while nothing is known.
    double expected(const LevelFacts& level, bool pose_changes) const;

private:
    /// milliseconds = base + slope * millions, by the last pictures; each new one counts for a quarter.
    struct Line {
        double milliseconds = 0, millions = 0;
        bool known = false;
        void learn(double ms, double amount);
        double at(double amount) const;
    };
    Line drawing_, restoring_;
};

/// The finest level up to `finest` that is expected to be drawn within `budget` milliseconds; 0 when none is. `now`
/// stays when it takes no more than kHysteresis budgets and the next finer one would not fit.
unsigned level_to_keep_up(std::span<const LevelFacts> levels, unsigned finest, unsigned now, const DrawingCost& cost,
                          bool pose_changes, double budget);

/// One level melting into another.
class LevelChange {
public:
    static constexpr double kSeconds = 0.3;
    static constexpr double kMostStep = 0.5; ///< of `part` from picture to picture: slow ones melt too, and take longer

    /// Starts at `now` (seconds of any clock) from what is shown most at the moment. To the level shown: nothing.
    void start(unsigned to, double now);
    /// At once.
    void set(unsigned level);
    /// Moves on; true while it goes on.
    bool advance(double now);

    unsigned to() const { return to_; }
    std::optional<unsigned> from() const { return from_; } ///< unset: nothing melts
    double part() const { return part_; }                  ///< of `to` that is drawn, 0 to 1

private:
    unsigned to_ = 0;
    std::optional<unsigned> from_;
    double part_ = 1, started_ = 0;
};

} // namespace filigree
