// Keys of a skin's joints in as few bytes as an error allows, for the filters of EXT_meshopt_compression.
#pragma once

#include "filigree/context.h"
#include "filigree/io/gltf/glb_builder.h"

#include <array>
#include <span>
#include <string>
#include <vector>

namespace filigree {

/// One animated property of one node: `width` numbers a sample.
struct KeyTrack {
    const char* path; ///< as glTF names it
    bool inner;       ///< of the joint's inner node
    std::size_t width;
    std::vector<double> values;
    std::array<double, 4> rest; ///< what the node has when nothing plays
    /// How far a key may be moved: distance, difference of scales, or angle in radians. Coded keys alone use it.
    double tolerance = 0;

    bool is_rotation() const { return width == 4; }
};

/// A track as it is coded.
struct CodedTrack {
    std::size_t count = 0; ///< of keys; 0: it stays at rest and is left out; 1: it stays elsewhere
    unsigned step = 0;     ///< keys are every 2^step-th of all, and the last
    std::string bytes;     ///< as a viewer unpacks them: floats, or 16-bit numbers of rotations
    std::string filtered;  ///< the same as they are packed
};

/// The numbers of keys that a step keeps.
std::vector<std::size_t> kept_keys(std::size_t keys, unsigned step);

/// Codes a track whose samples are its keys, linearly interpolated. No key of it, unpacked and interpolated at all of
/// the times, is farther from the given one than the tolerance, as far as 24 bits a number and 16 bits a rotation
/// allow.
CodedTrack code_track(const KeyTrack& track, std::span<const double> times);

/// Puts the coded tracks of all joints together as one animation.
class CodedChannels {
public:
    CodedChannels(GlbBuilder& builder, std::span<const double> times) : builder_(builder), times_(times) {}

    void add(const KeyTrack& track, CodedTrack coded, std::size_t node);
    /// The animation, or null when nothing moves.
    GlbBuilder::Json finish(const std::string& name);

private:
    struct Channel {
        std::size_t node;
        const char* path;
        unsigned step;
        std::size_t count, offset;
        bool rotation;
    };
    struct Stream {
        std::string bytes, filtered;
    };
    GlbBuilder& builder_;
    std::span<const double> times_;
    Stream vectors_, rotations_;
    std::vector<Channel> channels_;
};

} // namespace filigree
