// Another program moved the driver and handed back positions alone: the gradients are estimated from them.
#include <filigree/hierarchy/restore.h>
#include <filigree/hierarchy/strip.h>
#include <filigree/mesh/shapes.h>

#include <cmath>
#include <cstdio>

using namespace filigree;

/// Mean height of the sheet's bumps when its driver is stretched to `factor` along x.
double bump_height(const Model& model, const RestoreOptions& options, float factor, const RunContext& context) {
    Pose pose = rest_pose(model);
    for (Vec3f& p : pose.positions) p.x() *= factor;
    const Restorer restorer = Restorer::create(model, options, context).value();
    const std::vector<Vec3f> restored = restorer.positions(pose, context).value();
    double sum = 0;
    for (const Vec3f& p : restored) sum += double(std::abs(p.z()));
    return sum / double(restored.size());
}

int main() {
    const RunContext context;
    Mesh sheet = make_wavy_plane({.resolution = 128, .frequency = 8, .amplitude = 0.02});
    const Model model = strip(std::move(sheet), {.base = 25}, context).value().model;

    // A sheet is no solid: with thin_shell its bumps keep their shape, and the law says how high they stand.
    const double rest = bump_height(model, {}, 1, context);
    const double keep = bump_height(model, {.law = HeightLaw::keep, .thin_shell = true}, 4, context);
    const double volume = bump_height(model, {.law = HeightLaw::volume, .thin_shell = true}, 4, context);
    const double proportional = bump_height(model, {.law = HeightLaw::proportional, .thin_shell = true}, 4, context);
    std::printf("height at rest %.5f; stretched 4 times: keep %.5f, volume %.5f, proportional %.5f\n", rest, keep,
                volume, proportional);
    return std::abs(keep / rest - 1) < 0.1 && volume < 0.6 * rest && proportional > 1.5 * rest ? 0 : 1;
}
