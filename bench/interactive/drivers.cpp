#include "drivers.h"

#include "timing.h"

#include "filigree/mesh.h"
#include "filigree/pose.h"
#include "filigree/restore.h"

#include <algorithm>
#include <array>

namespace filigree::bench {

namespace {

constexpr double kNoise = 1.05;             // errors may grow by so much
constexpr double kRoundingOfNormals = 0.01; // degrees
constexpr double kGoals[] = {1e-4, 1e-5};

/// The largest over some warps.
struct Errors {
    double rms = 0, normals = 0; ///< of the diagonal, degrees

    void add(const VertexDistance& distance, double diagonal) {
        if (diagonal > 0) rms = std::max(rms, distance.rms / diagonal);
        normals = std::max(normals, distance.normal_p95_deg);
    }
};

using Warps = std::vector<std::unique_ptr<SpaceWarp>>;

Warps family(const Box& box) {
    Warps warps;
    for (NamedWarp& named : fidelity_warps(box))
        if (!named.affine) warps.push_back(std::move(named.warp));
    return warps;
}

/// Of the family's kinds and no stronger: along every axis, over a shorter side by so much less that the curvature
/// stays.
Warps others(const Box& box) {
    Warps warps;
    const double longest = box.size().maxCoeff();
    for (const Axis axis : {Axis::x, Axis::y, Axis::z}) {
        const double part = longest > 0 ? box.size()[static_cast<int>(axis)] / longest : 0;
        warps.push_back(make_bend(box, axis, 150 * part));
        warps.push_back(make_taper(box, axis, 1 - 0.4 * part).value());
    }
    for (const double degrees : {-160, 100}) // about a shorter side the ends would go further round
        warps.push_back(make_twist(box, longest_axis(box), degrees));
    for (const std::uint64_t seed : {77, 78, 79}) warps.push_back(make_smooth_random(box, 0.2, seed));
    return warps;
}

/// From positions and with gradients.
std::array<Errors, 2> measure_errors(const Model& model, const Warps& warps, const RunContext& context) {
    std::array<Errors, 2> errors;
    const Restorer restorer = Restorer::create(model, {}, context).value();
    for (const auto& warp : warps) {
        Pose pose = warp_pose(*warp, model, context);
        const std::vector<Vec3f> truth = warp_positions(*warp, model.mesh.positions, model.mesh.origin, context);
        const double diagonal = bounds(truth).diagonal();
        const auto measured = [&] {
            const std::vector<Vec3f> restored = restorer.positions(pose, context).value();
            return vertex_distance(model.mesh, restored, truth, context);
        };
        errors[1].add(measured(), diagonal);
        pose.gradients.clear();
        errors[0].add(measured(), diagonal);
    }
    return errors;
}

bool rises(double from, double to, double rounding) { return to > kNoise * std::max(from, rounding); }

} // namespace

Measured measure_drivers(const std::vector<NamedMesh>& meshes, const RunContext& context) {
    Table table{
        "drivers",
        {"mesh", "vertices", "driver", "positions_rms", "positions_deg", "gradients_rms", "gradients_deg", "rises"},
        {}};
    double steps = 0, rms_rises = 0, normal_rises = 0;
    for (const NamedMesh& named : meshes) {
        std::optional<std::array<Errors, 2>> coarser;
        const Warps warps = family(world_bounds(named.mesh));
        for (std::size_t base : kDriverSizes) {
            if (base >= named.mesh.vertex_count() || context.is_cancelled()) continue;
            StripOptions options;
            options.base = base;
            const Model model = strip(named.mesh, options, context).value().model;
            const std::array<Errors, 2> errors = measure_errors(model, warps, context);
            std::string note;
            for (std::size_t source = 0; coarser && source < 2; ++source) {
                const char* from = source == 0 ? "positions " : "gradients ";
                steps += 1;
                if (rises((*coarser)[source].rms, errors[source].rms, kRounding)) {
                    rms_rises += 1;
                    note += std::string(from) + "rms ";
                }
                if (rises((*coarser)[source].normals, errors[source].normals, kRoundingOfNormals)) {
                    normal_rises += 1;
                    note += std::string(from) + "normals ";
                }
            }
            coarser = errors;
            table.rows.push_back({named.name, double(named.mesh.vertex_count()), double(model.driver().vertices.size()),
                                  errors[0].rms, errors[0].normals, errors[1].rms, errors[1].normals, note});
        }
    }
    return {{{"drivers.steps", steps, ""},
             {"drivers.rms_rises", rms_rises, "steps"},
             {"drivers.normal_rises", normal_rises, "steps"}},
            {std::move(table)}};
}

Measured measure_goals(const std::vector<NamedMesh>& meshes, const RunContext& context) {
    Table table{"goals",
                {"mesh", "vertices", "asked", "from", "driver", "family", "others", "reached", "tried", "seconds"},
                {}};
    double count = 0, reached = 0;
    for (const NamedMesh& named : meshes) {
        if (named.mesh.vertex_count() < kSmallestMesh) continue;
        const Warps warps = others(world_bounds(named.mesh));
        for (const double goal : kGoals)
            for (const PoseSource source : {PoseSource::positions, PoseSource::gradients}) {
                if (context.is_cancelled()) continue;
                const double start = now_seconds();
                const StrippedToFidelity result = strip_to_fidelity(named.mesh, {}, {goal, source}, context).value();
                const double seconds = now_seconds() - start;
                const Errors errors =
                    measure_errors(result.stripped.model, warps, context)[source == PoseSource::gradients];
                const bool is_reached = std::max(result.error, errors.rms) <= goal;
                count += 1;
                reached += is_reached;
                table.rows.push_back({named.name, double(named.mesh.vertex_count()), goal,
                                      source == PoseSource::gradients ? "gradients" : "positions",
                                      double(result.stripped.model.driver().vertices.size()), result.error, errors.rms,
                                      is_reached ? "yes" : "no", double(result.tried), seconds});
            }
    }
    return {{{"goals.asked", count, ""}, {"goals.reached", reached, ""}}, {std::move(table)}};
}

} // namespace filigree::bench
