#include "estimate.h"

#include "random_warps.h"

#include "filigree/mesh.h"
#include "filigree/restore.h"
#include "filigree/strip.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace filigree::bench {

namespace {

constexpr std::size_t kWorstShown = 8;

/// A driver that poses are given to.
struct Driver {
    std::string mesh;
    Model model;
    Restorer restorer;
    PoseError error;
    double diagonal; ///< at rest

    Driver(std::string name, Model stripped, const RunContext& context)
        : mesh(std::move(name)), model(std::move(stripped)), restorer(Restorer::create(model, {}, context).value()),
          error(model), diagonal(world_bounds(model.mesh).diagonal()) {}
    std::string size() const { return fmt::format("{}", model.driver().vertices.size()); }
};

std::vector<std::unique_ptr<Driver>> make_drivers(const std::vector<NamedMesh>& meshes, const RunContext& context) {
    std::vector<std::unique_ptr<Driver>> drivers;
    for (const NamedMesh& named : meshes) {
        const std::size_t vertices = named.mesh.vertex_count();
        if (vertices < kSmallestMesh) continue;
        std::vector<std::size_t> bases;
        for (std::size_t base : kDriverSizes)
            if (4 * base <= vertices) bases.push_back(base);
        if (bases.empty()) bases = {vertices / 4};
        for (std::size_t base : bases) {
            StripOptions options;
            options.base = base;
            drivers.push_back(
                std::make_unique<Driver>(named.name, strip(named.mesh, options, context).value().model, context));
        }
    }
    return drivers;
}

/// One pose of one driver.
struct Judged {
    const Driver* driver;
    std::string kind;
    std::uint64_t seed;
    double error, estimate; ///< model units, no less than rounding

    double ratio() const { return estimate / error; }
};

bool is_within_two(double ratio) { return ratio >= 0.5 && ratio <= 2; }

Judged judge(const Driver& driver, const RandomWarp& warp, std::uint64_t seed, bool with_gradients,
             const RunContext& context) {
    const Mesh& mesh = driver.model.mesh;
    Pose pose = warp_pose(*warp.warp, driver.model, context);
    if (!with_gradients) pose.gradients.clear();
    const std::vector<Mat3f> gradients = driver.restorer.gradients(pose, context).value();
    const std::vector<Vec3f> truth = warp_positions(*warp.warp, mesh.positions, mesh.origin, context);
    const std::vector<Vec3f> restored = driver.restorer.positions(pose, context).value();
    const double rounding = kRounding * driver.diagonal;
    return {&driver, warp.kind, seed, std::max(vertex_distance(mesh, restored, truth, context).rms, rounding),
            std::max(driver.error.estimate(pose, gradients).value().rms, rounding)};
}

/// Percent of the poses that `counts` whose ratio is within a factor of 2.
template <class Counts>
double share_within_two(const std::vector<Judged>& poses, const Counts& counts) {
    double within = 0, count = 0;
    for (const Judged& pose : poses)
        if (counts(pose)) {
            within += is_within_two(pose.ratio());
            ++count;
        }
    return count > 0 ? 100 * within / count : 0;
}

/// A row for each value of `key`, in order of appearance.
template <class Key>
void add_shares(Table& table, const char* source, const std::vector<Judged>& poses, const Key& key) {
    std::vector<std::string> seen;
    for (const Judged& pose : poses) {
        const std::string value = key(pose);
        if (std::find(seen.begin(), seen.end(), value) != seen.end()) continue;
        seen.push_back(value);
        const auto counts = [&](const Judged& other) { return key(other) == value; };
        const double count = double(std::count_if(poses.begin(), poses.end(), counts));
        table.rows.push_back({source, value, count, share_within_two(poses, counts)});
    }
}

void add_worst(Table& table, const char* source, std::vector<Judged> poses) {
    const auto is_worse = [](const Judged& a, const Judged& b) {
        return std::abs(std::log(a.ratio())) > std::abs(std::log(b.ratio()));
    };
    std::stable_sort(poses.begin(), poses.end(), is_worse);
    for (std::size_t k = 0; k < std::min(kWorstShown, poses.size()); ++k) {
        const Judged& pose = poses[k];
        table.rows.push_back({source, pose.driver->mesh, pose.driver->size(), pose.kind, double(pose.seed),
                              pose.error / pose.driver->diagonal, pose.ratio()});
    }
}

void add_results(std::vector<Measurement>& results, const std::string& source, const std::vector<Judged>& poses) {
    const auto add = [&](const char* name, double value, const char* unit) {
        results.push_back({"estimate." + source + "." + name, value, unit});
    };
    const auto all = [](const Judged&) { return true; };
    std::vector<double> ratios;
    for (const Judged& pose : poses) ratios.push_back(pose.ratio());
    std::sort(ratios.begin(), ratios.end());
    add("poses", double(poses.size()), "");
    add("within_2", share_within_two(poses, all), "%");
    add("median_ratio", ratios[ratios.size() / 2], "of the error");
}

} // namespace

Measured measure_estimate(const std::vector<NamedMesh>& meshes, std::size_t poses, const RunContext& context) {
    Measured figures;
    const std::vector<std::unique_ptr<Driver>> drivers = make_drivers(meshes, context);
    if (drivers.empty()) return figures;
    Table by_kind{"estimate_by_kind", {"from", "warp", "poses", "within_2_percent"}, {}};
    Table by_mesh{"estimate_by_mesh", {"from", "mesh", "poses", "within_2_percent"}, {}};
    Table worst{"estimate_worst", {"from", "mesh", "driver", "warp", "seed", "error", "ratio"}, {}};
    for (const bool with_gradients : {false, true}) {
        std::vector<Judged> judged;
        for (std::uint64_t seed = 1; seed <= poses && !context.is_cancelled(); ++seed) {
            const Driver& driver = *drivers[seed % drivers.size()];
            const RandomWarp warp = random_warp(world_bounds(driver.model.mesh), seed);
            judged.push_back(judge(driver, warp, seed, with_gradients, context));
        }
        if (judged.empty()) return figures;
        const char* source = with_gradients ? "gradients" : "positions";
        add_results(figures.results, source, judged);
        add_shares(by_kind, source, judged, [](const Judged& pose) { return pose.kind; });
        add_shares(by_mesh, source, judged,
                   [](const Judged& pose) { return pose.driver->mesh + " on " + pose.driver->size(); });
        add_worst(worst, source, std::move(judged));
    }
    figures.tables = {std::move(by_kind), std::move(by_mesh), std::move(worst)};
    return figures;
}

} // namespace filigree::bench
