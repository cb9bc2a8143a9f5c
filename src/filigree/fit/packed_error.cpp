#include "filigree/fit/packed_error.h"

#include <cmath>

namespace filigree {

namespace {

constexpr double kShareOfPositions = 0.25, kShareOfPoses = 1.0 / 3;

} // namespace

double error_of_fit(double error) {
    return error * std::sqrt(1 - kShareOfPositions * kShareOfPositions - kShareOfPoses * kShareOfPoses);
}

double error_of_poses(double error) { return kShareOfPoses * error; }

unsigned bits_of_positions(double error, const Mesh& mesh) {
    constexpr unsigned kFewest = 12, kMost = 16;
    const Box box = world_bounds(mesh);
    const double side = box.size().maxCoeff() / box.diagonal();
    unsigned bits = kFewest;
    while (bits < kMost && 0.5 * side / double((1u << bits) - 1) > kShareOfPositions * error) ++bits;
    return bits;
}

} // namespace filigree
