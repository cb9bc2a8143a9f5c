// Deformations of space know their own gradients, and chain.
#include <filigree/filigree.h>

#include <cmath>
#include <cstdio>

using namespace filigree;

int main() {
    const RunContext context;
    Mesh bar = make_bar({.resolution = 24, .length = 3});
    const double volume = analyse_topology(bar, context).volume;

    const Box box = world_bounds(bar);
    std::vector<std::unique_ptr<SpaceWarp>> steps;
    steps.push_back(make_squeeze(box, Axis::x, 1.5).value()); // longer and thinner
    steps.push_back(make_twist(box, Axis::x, 180));
    const auto warp = make_chain(std::move(steps));

    // Neither step changes volumes: the gradient's determinant is 1 everywhere.
    const double determinant = warp->warp(Vec3d(0.3, 0.2, -0.1)).gradient.determinant();
    warp_mesh(*warp, bar, context);
    const double warped = analyse_topology(bar, context).volume;
    std::printf("determinant %.12f, volume %.4f, then %.4f\n", determinant, volume, warped);
    return std::abs(determinant - 1) < 1e-12 && std::abs(warped / volume - 1) < 0.01 ? 0 : 1;
}
