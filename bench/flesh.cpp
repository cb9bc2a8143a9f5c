// Flesh on skins made by formulas, beside the skins alone: volumes, overlaps, jiggles, frame rates, fast motion, speed.
//   flesh_table [--threads N] [joints] [jiggle] [rates] [fast] [cost]     default: all of them
#include "../tests/flesh/made_skins.h"

#include "filigree/flesh.h"

#include "spent.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace {

using namespace filigree;
using namespace filigree_test;

RunContext context(0);

constexpr unsigned kFine = 32;
FleshOptions options_for(std::size_t particles, double young_modulus = 2e4) {
    FleshOptions options;
    options.particles = particles;
    options.material.young_modulus = young_modulus;
    return options;
}

void joints() {
    std::printf("\njoints: volume over that at rest, and enclosed twice, at the end; 4,300 particles, 20 kPa\n");
    std::printf("%-14s %18s %18s\n", "", "flesh", "linear skin");
    const auto line = [](const char* name, const TubeMotion& motion) {
        const Flesh flesh = Flesh::create(tube(kFine, 2, motion), options_for(4300), {}, context).value();
        const FleshClip clip = simulate_flesh(flesh, 0, {.frames_per_second = 30}, context).value();
        const FleshMeasure m = measure_flesh(flesh, clip, 8, context).value();
        std::printf("%-14s %.4f  %8.1e   %.4f  %8.1e\n", name, m.least_volume, std::max(0.0, m.overlap),
                    m.skin_least_volume, std::max(0.0, m.skin_overlap));
    };
    line("elbow 65", elbow(65, 2));
    line("elbow 110", elbow(110, 2));
    line("elbow 130", elbow(130, 2));
    line("twist 170", twist(170, 2));
}

/// A layer on a held base that leans as its lowest shear wave: the frequency with which it swings.
void jiggle() {
    std::printf("\njiggle: a layer 0.1 m thick and 2 m long on a base, 10 kPa; theory f = sqrt(mu / rho) / 4 L, with "
                "springs of f_t: sqrt(f^2 + f_t^2)\n");
    const Mesh layer = make_box({0, 0.05, 0}, {2, 0.1, 0.3});
    Material soft;
    soft.young_modulus = 1e4;
    soft.damping = 0;
    BodyOptions body_options;
    body_options.cells.spacing = 0.0125;
    const auto body = std::make_shared<const Body>(make_body(layer, soft, body_options, context).value());
    const double rate = 240, alone = std::sqrt(lame_parameters(1e4, soft.poisson_ratio).mu / soft.density) / 0.4;
    for (const double spring : {0.0, 5.0, 10.0}) {
        World weightless;
        weightless.gravity.setZero();
        StepOptions options;
        options.frames_per_second = rate;
        options.mode = StepMode::explicit_steps;
        options.contacts_within_bodies = options.automatic_rigid = false;
        Simulation simulation = Simulation::create(weightless, {{.body = body}}, options, context).value();
        Follow follow;
        follow.damping = {0};
        Vectors leans = body->rest;
        std::size_t top = 0;
        for (std::size_t i = 0; i < body->particle_count(); ++i) {
            const Vec3f at = body->rest[i];
            const double height = std::max(0.0, double(at.y()));
            follow.frequency.push_back(at.y() < 1e-3f ? std::numeric_limits<float>::infinity() : float(spring));
            leans.x[i] += 0.002f * float(math::sin(0.5 * std::numbers::pi * height / 0.1));
            if ((at - Vec3f(0, 0.1f, 0)).norm() < (body->rest[top] - Vec3f(0, 0.1f, 0)).norm()) top = i;
        }
        const Vectors still(body->particle_count());
        if (!simulation.set_positions(0, leans) || !simulation.set_follow(0, follow, body->rest, still)) std::abort();
        std::vector<double> crossings;
        double before = 1;
        for (int frame = 1; frame <= 240; ++frame) {
            if (!simulation.advance(context)) std::abort();
            const double now = double(simulation.positions(0)[top].x() - body->rest[top].x());
            if (now * before < 0) crossings.push_back(frame - now / (now - before));
            before = now;
        }
        const double found = 0.5 * double(crossings.size() - 1) * rate / (crossings.back() - crossings.front());
        std::printf("springs of %2.0f Hz: %.2f Hz of %.2f\n", spring, found,
                    std::sqrt(alone * alone + spring * spring));
    }
}

void rates() {
    std::printf("\nframe rates: the end of a second of waving against 240 a second, rms over the diagonal\n");
    const Flesh flesh = Flesh::create(tube(kFine, 1, waving(25, 1)), options_for(2000), {}, context).value();
    const auto end = [&](double rate) {
        return simulate_flesh(flesh, 0, {.frames_per_second = rate}, context).value().frames.back();
    };
    const Vectors fine = end(240);
    for (const double rate : {24.0, 30.0, 60.0, 120.0}) {
        const Vectors coarse = end(rate);
        double sum = 0;
        for (std::size_t i = 0; i < fine.size(); ++i) sum += double((fine[i] - coarse[i]).squaredNorm());
        std::printf("%3.0f: %.1e\n", rate, std::sqrt(sum / double(fine.size())) / 1.04);
    }
}

void fast() {
    std::printf("\nfast motion at 60 frames a second, a second of it: least volume of a cell, inverted at the end, "
                "clamped, most substeps\n");
    const auto line = [](const char* name, const TubeMotion& motion, double size,
                         const std::function<Eigen::Affine3d(double)>& root) {
        SkinnedMesh skin = tube(kFine, 1, motion, root);
        for (Vec3f& p : skin.mesh.positions) p *= float(size);
        for (SkinJoint& joint : skin.joints) joint.place *= size;
        skin.transforms = [unit = skin.transforms, size](std::size_t clip, double t, std::span<Eigen::Affine3d> out) {
            unit(clip, t, out);
            for (Eigen::Affine3d& joint : out) joint.translation() *= size;
        };
        const Flesh flesh = Flesh::create(std::move(skin), options_for(2000), {}, context).value();
        const FleshClip clip = simulate_flesh(flesh, 0, {}, context).value();
        std::printf("%-28s %6.2f %4zu %4zu %4u\n", name, double(clip.least_volume_ratio), clip.inverted_cells,
                    clip.clamped_particles, clip.most_substeps);
    };
    const auto still = [](double) { return Eigen::Affine3d::Identity(); };
    for (const int times : {1, 4, 8})
        line(("waving 30 degrees, x" + std::to_string(times)).c_str(), waving(30, times), 1, still);
    line("teleport of 3 m", waving(40, 1), 1,
         [](double t) { return Eigen::Affine3d(Eigen::Translation3d(Vec3d(t > 0.5 ? 3 : 0, 0, 0))); });
    line("half a turn in a frame", waving(40, 1), 1,
         [](double t) { return Eigen::Affine3d(Eigen::AngleAxisd(t > 0.5 ? std::numbers::pi : 0, Vec3d::UnitY())); });
    line("10 m/s in a frame", waving(40, 1), 1,
         [](double t) { return Eigen::Affine3d(Eigen::Translation3d(Vec3d(0, 0, 10 * std::max(0.0, t - 0.5)))); });
    line("0.01 of the size", waving(50, 2), 0.01, still);
    line("100 times the size", waving(50, 2), 100, still);
}

void cost() {
    std::printf("\ncost: ms a frame, processor time of one thread, self-contact\n");
    const RunContext one(1);
    for (const std::size_t particles : {2500, 5000, 10000}) {
        const Flesh flesh =
            Flesh::create(tube(kFine, 1, waving(50, 1)), options_for(particles, 1.5e4), {}, one).value();
        const double before = now().processor;
        const FleshClip clip = simulate_flesh(flesh, 0, {}, one).value();
        const double seconds = (now().processor - before) / 60;
        const double ended = now().processor;
        std::vector<Eigen::Affine3d> transforms(2);
        Vectors positions, felt;
        for (int k = 0; k < 100; ++k) {
            flesh.skin().transforms(0, 0.01 * k, transforms);
            flesh.targets(transforms, Vec3d::Zero(), positions, &felt, one);
        }
        std::printf("%6zu particles: %5.2f ms, %4.0f frames a second, %u substeps at most; targets %.2f ms\n",
                    flesh.body()->particle_count(), 1e3 * seconds, 1 / seconds, clip.most_substeps,
                    10 * (now().processor - ended));
    }
}

} // namespace

int main(int count, char** arguments) {
    std::vector<std::string> names;
    for (int a = 1; a < count; ++a) {
        if (std::string(arguments[a]) == "--threads" && a + 1 < count)
            context = RunContext(unsigned(std::atoi(arguments[++a])));
        else
            names.emplace_back(arguments[a]);
    }
    const auto wanted = [&](const char* name) {
        return names.empty() || std::find(names.begin(), names.end(), name) != names.end();
    };
    if (wanted("joints")) joints();
    if (wanted("jiggle")) jiggle();
    if (wanted("rates")) rates();
    if (wanted("fast")) fast();
    if (wanted("cost")) cost();
}
