// Another program moved the driver and handed back positions alone: the gradients are estimated from them.
#include <filigree/filigree.h>

#include <cmath>
#include <cstdio>

using namespace filigree;

/// Mean height of the sheet's bumps when its driver is stretched to `factor` along x.
double bump_height(const Model& model, const Restorer& restorer, float factor, const RunContext& context) {
    Pose pose = rest_pose(model);
    for (Vec3f& p : pose.positions) p.x() *= factor;
    const std::vector<Vec3f> restored = restorer.positions(pose, context).value();
    double sum = 0;
    for (const Vec3f& p : restored) sum += double(std::abs(p.z()));
    return sum / double(restored.size());
}

int main() {
    const RunContext context;
    Mesh sheet = make_wavy_plane({.resolution = 128, .frequency = 8, .amplitude = 0.02});
    const Model model = strip(std::move(sheet), {.base = 25}, context).value().model;
    const Restorer restorer = Restorer::create(model, {}, context).value();

    // Positions in a plane do not say what happens off it: bumps grow with the square root of the area around them.
    const double rest = bump_height(model, restorer, 1, context), stretched = bump_height(model, restorer, 4, context);
    std::printf("height at rest %.5f; stretched 4 times %.5f\n", rest, stretched);
    return std::abs(stretched / rest - 2) < 0.2 ? 0 : 1;
}
