#include "filigree/remesh/quad_failure.h"

#include <cstdio>

namespace filigree {

namespace {

std::string quads_at_levels(const QuadFailure& failure) {
    return std::to_string(failure.count) + " quads at " + std::to_string(failure.levels) +
           (failure.levels == 1 ? " level" : " levels");
}

std::string short_number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2g", value);
    return text;
}

} // namespace

std::string sentence(const QuadFailure& failure) {
    const std::string count = std::to_string(failure.count), most = std::to_string(failure.most);
    switch (failure.kind) {
    case QuadFailure::Kind::too_many_patches:
        return "Those are " + count + " patches, more than " + most + "; ask for fewer quads or more levels.";
    case QuadFailure::Kind::too_few_quads:
        if (failure.parts == 1) return "The mesh needs at least " + quads_at_levels(failure) + "; ask for more quads.";
        return "The mesh has " + std::to_string(failure.parts) + " separate parts, which need at least " +
               quads_at_levels(failure) + "; ask for more quads, or for a wrap around them.";
    case QuadFailure::Kind::feature_corners:
        return "The mesh's sharp edges have " + count + " corners, too many for " + most +
               " patches; ask for more quads, or keep fewer features.";
    case QuadFailure::Kind::feature_quads:
        return "The mesh's features and handles need " + quads_at_levels(failure) +
               "; ask for more quads or fewer levels, or keep fewer features.";
    case QuadFailure::Kind::inverted:
        return count + " of " + most + " quads came out inverted; ask for more quads, or fewer levels.";
    case QuadFailure::Kind::topology:
        return "The quads' topology is not the mesh's (Euler number " + std::to_string(failure.euler) + " instead of " +
               std::to_string(failure.expected_euler) + "); please report this.";
    case QuadFailure::Kind::distance:
        return "The quads are up to " + short_number(failure.furthest) + " of the diagonal from the mesh, more than " +
               short_number(failure.allowed) + "; ask for more quads, or allow more.";
    }
    return {};
}

} // namespace filigree
