// Reasons to doubt a run's motion: noted in each frame, reported at its end.
#pragma once

#include "filigree/physics/simulation.h"

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace filigree {

struct SceneFile;

/// Cells of a body that were inside out at the end of frames.
struct Inversion {
    std::uint64_t first = 0, last = 0, frames = 0; ///< the first and the last such frame, and how many
    std::uint64_t worst = 0;                       ///< the frame with the least volume of a cell
    std::uint64_t cells = 0;                       ///< inside out in that frame
    float least = 1;                               ///< that volume, as a part of the volume at rest
    Vec3f place = Vec3f::Zero();                   ///< of that cell: world, m

    void add(std::uint64_t frame, const InvertedCells& cells);
};

/// Cells or particles that have come to the limit of plastic strain.
struct FlowedOut {
    std::uint64_t first = 0; ///< frame
    std::uint64_t most = 0;  ///< of them
};

/// Substeps that were longer than was stable for a body.
struct Unstable {
    std::uint64_t first = 0, frames = 0, substeps = 0; ///< the first such frame, and how many
};

struct BodyDoubts {
    std::optional<std::uint64_t> first_lost; ///< the first frame in which parts of the driver were held
    std::optional<Inversion> inversion;
    std::optional<FlowedOut> flowed_out;
    std::optional<Unstable> unstable;
};

/// The first motion that was not finite or had to be limited.
struct FirstLoss {
    std::uint64_t frame = 0, body = 0;
    Vec3f place = Vec3f::Zero(); ///< world, m
};

/// Watches for energy that comes from nowhere. It begins when nothing but gravity does work on the bodies: from then on
/// the energy may not grow.
struct EnergyWatch {
    bool has_begun = false;
    double total = 0, moving = 0; ///< J when it began; moving: kinetic and elastic
    double potential = 0, least_potential = 0;
    // The frame in which most was too much; share: of what there was to move.
    std::uint64_t first = 0, worst = 0, body = 0;
    double grown = 0, share = 0; ///< J; 0: never
    Vec3f place = Vec3f::Zero(); ///< world, m: the middle of the body that moves most

    void begin(const Energy& energy);
    /// J too much, beyond a share of what there was and `least`; 0: none. Notes the potential.
    double excess(const Energy& energy, double allowed, double least);
};

/// The time, s, from which on only gravity does work on the bodies of a scene; infinite: never.
double left_alone_from(const SceneFile& scene);
/// The share by which energy may seem to grow: the energy of contacts is not counted, and breaking bonds give some
/// back.
double allowed_growth(const SceneFile& scene);

} // namespace filigree
