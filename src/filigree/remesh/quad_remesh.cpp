// Based on: [Lee 1998] (the parametrisation), and docs/remesh.md, which says where we differ and what was measured.
#include "filigree/remesh.h"

#include "filigree/core/now_seconds.h"
#include "filigree/core/parallel_for.h"
#include "filigree/mesh.h"
#include "filigree/mesh/closest_point.h"
#include "filigree/mesh/edges.h"
#include "filigree/remesh/base_triangles.h"
#include "filigree/remesh/feature_curves.h"
#include "filigree/remesh/manifold_surface.h"
#include "filigree/remesh/patch_layout.h"
#include "filigree/remesh/quad_failure.h"
#include "filigree/remesh/relax.h"
#include "filigree/remesh/tips.h"
#include "filigree/remesh/transfer_attributes.h"
#include "filigree/remesh/voxel_wrap.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr std::size_t kFewestQuads = 6, kMostQuads = 100'000'000; // each takes some 200 bytes on the way
constexpr double kMostOverdrawn = 1.3;                            // quads over those asked for
constexpr double kMostRemoved = 0.05;                             // of the area, by small parts
constexpr double kLeastArea = 1e-6;     // of the diagonal squared; a wire a thousand times its thickness has 1e-3
constexpr double kShortHandle = 2;      // patch sides: loops up to this are closed, when small parts go
constexpr double kSmallComponent = 0.5; // patch sides, of a component's diagonal
constexpr unsigned kSampledLevels = 3;  // taken from the map; finer ones are halved from there
constexpr unsigned kCoarseSweeps = 20, kFineSweeps = 4;
constexpr std::size_t kManyQuads = 20'000; // from here on the input is no further from the quads than
constexpr double kMostLost = 6e-3;         // of the diagonal, unless the options say something else
constexpr int kTipRounds = 6;              // of holding tips; the last ones find next to none
constexpr double kWantedJacobian = 0.2;    // below it, places are searched
constexpr std::size_t kDistanceSamples = 100'000;
constexpr double kVoxelsPerQuad = 0.7; // along a quad's side, of the wrap

/// Seconds of each phase, added up over tries.
class PhaseClock {
public:
    explicit PhaseClock(std::vector<PhaseSeconds>& seconds) : seconds_(seconds) {}
    void end(const char* phase) {
        const double now = now_seconds(), passed = now - std::exchange(last_, now);
        const auto entry = std::ranges::find(seconds_, std::string_view(phase),
                                             [](const PhaseSeconds& s) { return std::string_view(s.phase); });
        if (entry == seconds_.end())
            seconds_.push_back({phase, passed});
        else
            entry->seconds += passed;
    }

private:
    std::vector<PhaseSeconds>& seconds_;
    double last_ = now_seconds();
};

double area_of(const ManifoldSurface& surface) {
    double area = 0;
    for (const Triangle& t : surface.triangles) {
        const Vec3d& a = surface.positions[t[0]];
        area += 0.5 * (surface.positions[t[1]] - a).cross(surface.positions[t[2]] - a).norm();
    }
    return area;
}

Mesh surface_mesh(const ManifoldSurface& surface, const Vec3d& origin) {
    Mesh mesh;
    mesh.origin = origin;
    for (const Vec3d& p : surface.positions) mesh.positions.push_back(p.cast<float>());
    for (const Triangle& t : surface.triangles) mesh.add_face(t);
    return mesh;
}

/// Of a mesh of quads, each cut in two.
SurfaceTopology quad_topology(const Mesh& mesh) {
    ManifoldSurface surface;
    surface.positions.resize(mesh.vertex_count());
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        const auto q = mesh.face(f);
        surface.triangles.push_back({q[0], q[1], q[2]});
        surface.triangles.push_back({q[0], q[2], q[3]});
    }
    return surface_topology(surface);
}

/// What came of a try: an error that no other try can mend, a failure, or neither, and the quads passed the gate.
using Outcome = Result<std::optional<QuadFailure>>;

class Remesher {
public:
    Remesher(const Mesh& mesh, const QuadRemeshOptions& options, const RunContext& context)
        : mesh_(mesh), options_(options), context_(context), watch_(result_.report.seconds) {}

    Result<QuadRemeshed> run() {
        if (Status checked = check_options(); !checked) return checked.error();
        if (Status prepared = prepare(); !prepared) return prepared.error();
        const bool only_wrap = options_.wrap == WrapUse::always;
        std::optional<QuadFailure> failure;
        bool has_room = true;
        if (!only_wrap) {
            failure = make_room(report().input.components);
            has_room = !failure;
            if (has_room) {
                const Outcome own = try_own_surface();
                if (!own) return own.error();
                failure = *own;
            }
            if (!failure) return finish();
            // a wrap joins parts that lie close: not what it takes to keep them
            const bool may_wrap =
                options_.wrap == WrapUse::automatic && (has_room || options_.small_parts == SmallParts::remove);
            if (!may_wrap) return refused(sentence(*failure));
            note_retry(*failure);
        }
        const Outcome wrap = try_wrap();
        if (!wrap) return wrap.error();
        if (!*wrap) return finish();
        if (only_wrap) return refused(sentence(**wrap));
        return refused(sentence(*failure) + " (A wrap around it failed as well: " + sentence(**wrap) + ")");
    }

private:
    QuadRemeshReport& report() { return result_.report; }

    static Error refused(std::string reason) { return {ErrorCode::unsuitable, std::move(reason)}; }

    void note_retry(const QuadFailure& failure) {
        ++report().tries;
        report().retried = sentence(failure);
    }

    Status check_options() const {
        const auto fail = [](std::string message) { return Error{ErrorCode::usage, std::move(message)}; };
        if (options_.quads < kFewestQuads || options_.quads > kMostQuads)
            return fail("Ask for 6 to 100,000,000 quads.");
        if (options_.levels && (*options_.levels < 1 || *options_.levels > kMostQuadLevels))
            return fail("Levels are 1 to " + std::to_string(kMostQuadLevels) + ".");
        if (!(options_.feature_angle_deg >= 0 && options_.feature_angle_deg <= 180))
            return fail("The feature angle is 0 to 180 degrees.");
        if (options_.max_distance && !(*options_.max_distance > 0)) return fail("The largest distance is above 0.");
        return Success{};
    }

    /// The cleaned surface, the layout, and the limits.
    Status prepare() {
        context_.report("cleaning", 0);
        Result<ManifoldSurface> manifold = make_manifold(mesh_, report().clean, context_);
        if (!manifold) return manifold.error();
        surface_ = std::move(*manifold);
        watch_.end("cleaning");

        const double diagonal = bounds(surface_mesh(surface_, mesh_.origin).positions).diagonal();
        if (!(area_of(surface_) > kLeastArea * diagonal * diagonal))
            return refused("The mesh is all but a line: its area is too small for its length.");

        layout_ = plan_patches(options_.quads, options_.levels);
        if (options_.small_parts == SmallParts::remove) {
            context_.report("small parts", 0);
            remove_small_parts();
            if (surface_topology(surface_).genus() > 0)
                if (Status closed = close_handles(surface_, kShortHandle * patch_side(), report().clean, context_);
                    !closed)
                    return closed;
            watch_.end("small parts");
        }
        if (context_.is_cancelled()) return cancelled_error();
        report().input = surface_topology(surface_);
        cleaned_ = surface_mesh(surface_, mesh_.origin);
        report().diagonal = bounds(cleaned_.positions).diagonal();
        report().max_distance = options_.max_distance.value_or(patch_side() / report().diagonal);
        report().max_distance_from_input = report().max_distance;
        // a wrap that was asked for closes cavities; few large patches were asked for as well
        if (!options_.max_distance && !options_.levels && options_.wrap != WrapUse::always &&
            options_.quads >= kManyQuads)
            report().max_distance_from_input = std::min(report().max_distance, kMostLost);
        return Success{};
    }

    /// Where most of a mesh is small parts, they are the mesh, and stay.
    void remove_small_parts() {
        ManifoldSurface rest = surface_;
        CleanReport clean = report().clean;
        remove_small_components(rest, kSmallComponent * patch_side(), clean);
        if (clean.removed_area > kMostRemoved) return;
        surface_ = std::move(rest);
        report().clean = clean;
    }

    double patch_side() const { return std::sqrt(area_of(surface_) / double(layout_.patches)); }

    /// Many parts need many patches: fewer levels where they were not asked for, else the reason why it cannot be.
    std::optional<QuadFailure> make_room(std::size_t parts) {
        const std::size_t least = least_patches(parts);
        if (!options_.levels) layout_ = with_more_patches(layout_, least);
        if (layout_.patches > kMostPatches)
            return QuadFailure{QuadFailure::Kind::too_many_patches, layout_.patches, kMostPatches};
        if (layout_.patches >= least) return std::nullopt;
        QuadFailure failure{QuadFailure::Kind::too_few_quads, least << (2 * layout_.levels)};
        failure.parts = parts;
        failure.levels = layout_.levels;
        return failure;
    }

    /// The surface itself, with what may help when it fails: features let go where they need too much, more patches,
    /// both.
    Outcome try_own_surface() {
        const std::optional<PatchLayout> finer = options_.levels ? std::nullopt : finer_layout(layout_);
        double angle = options_.feature_angle_deg;
        for (bool is_finer = false;;) {
            Outcome outcome = try_surface(surface_, is_finer ? *finer : layout_, angle);
            if (!outcome || !*outcome) return outcome;
            const bool has_features = angle < 180 && report().feature_edges > 0;
            const bool can_be_finer = finer && !is_finer;
            if (has_features && ((*outcome)->by_features || !can_be_finer))
                angle = 180;
            else if (can_be_finer)
                is_finer = true;
            else
                return outcome;
            note_retry(**outcome);
        }
    }

    Outcome try_wrap() {
        const double side = std::sqrt(area_of(surface_) / double(options_.quads));
        WrapOptions wrap;
        const double extent = bounds(cleaned_.positions).size().maxCoeff();
        wrap.resolution = static_cast<unsigned>(std::clamp(kVoxelsPerQuad * extent / side, 48.0, 256.0));
        Result<ManifoldSurface> wrapped = voxel_wrap(surface_.positions, surface_.triangles, wrap, context_);
        watch_.end("wrapping");
        if (!wrapped) return wrapped.error();
        report().wrapped = true;
        wrapped_ = std::move(*wrapped);
        if (options_.small_parts == SmallParts::remove) {
            CleanReport of_the_wrap; // says nothing about the mesh
            remove_small_components(wrapped_, kSmallComponent * patch_side(), of_the_wrap);
            if (Status closed = close_handles(wrapped_, kShortHandle * patch_side(), of_the_wrap, context_); !closed)
                return closed.error();
        }
        watch_.end("small parts");
        if (const auto failure = make_room(surface_topology(wrapped_).components)) return failure;
        return try_surface(wrapped_, layout_, 180);
    }

    /// From a manifold to quads that pass the gate.
    Outcome try_surface(const ManifoldSurface& surface, PatchLayout layout, double feature_angle) {
        const std::vector<Index> twins = opposite_half_edges(surface.triangles, surface.positions.size());
        const FeatureCurves curves = find_feature_curves(surface, twins, {feature_angle, patch_side()});
        report().feature_edges = curves.edge_count;
        watch_.end("features");
        if (const auto failure = check_corners(curves, layout)) return failure;

        std::optional<SurfaceMap> map;
        const Result<BaseQuads> base = make_base(surface, twins, curves, layout, map);
        if (!base) return base.error();
        if (const auto failure = check_quads(base->quads.size(), layout)) return failure;

        std::vector<std::uint8_t> features = curves.half_edges;
        for (Index h = 0; h < twins.size(); ++h) features[h] |= twins[h] == kNoIndex;
        std::vector<VertexKind> kinds(surface.positions.size());
        for (Index v = 0; v < kinds.size(); ++v) kinds[v] = map->kind(v);
        const SurfaceWalk walk(surface, twins, features, kinds);
        std::size_t inverted = 0;
        Result<PatchGrid> grid = make_grid(walk, map, *base, layout.levels, inverted);
        if (!grid) return grid.error();
        if (context_.is_cancelled()) return cancelled_error();
        Outcome outcome = gate(std::move(*grid), surface);
        // where there are features, they are the likeliest cause of inverted quads
        if (outcome && *outcome) (*outcome)->by_features = inverted > 0;
        return outcome;
    }

    static std::optional<QuadFailure> check_corners(const FeatureCurves& curves, const PatchLayout& layout) {
        const auto corners = static_cast<std::size_t>(std::ranges::count(curves.corners, 1));
        if (curves.edge_count == 0 || corners <= layout.patches) return std::nullopt;
        QuadFailure failure{QuadFailure::Kind::feature_corners, corners, layout.patches};
        failure.by_features = true;
        return failure;
    }

    std::optional<QuadFailure> check_quads(std::size_t patches, const PatchLayout& layout) const {
        const std::size_t quads = patches << (2 * layout.levels);
        if (!(double(quads) > kMostOverdrawn * double(options_.quads) + 24)) return std::nullopt;
        QuadFailure failure{QuadFailure::Kind::feature_quads, quads};
        failure.levels = layout.levels;
        failure.by_features = true;
        return failure;
    }

    /// The patches' grids, evened out, with the tips held that would be lost; without where that turns quads over.
    /// The map is not needed any more when the coarse grids are taken from it.
    Result<PatchGrid> make_grid(const SurfaceWalk& walk, std::optional<SurfaceMap>& map, const BaseQuads& base,
                                unsigned levels, std::size_t& inverted) {
        context_.report("sampling", 0);
        PatchGrid sampled = sample_patches(*map, base, walk, std::min(levels, kSampledLevels), context_);
        map.reset();
        watch_.end("sampling");
        if (context_.is_cancelled()) return cancelled_error();
        PatchGrid plain = sampled;
        relax(plain, walk, kCoarseSweeps, context_);
        std::optional<PatchGrid> with_tips;
        if (Status held = hold_what_sticks_out(walk, plain, std::move(sampled), with_tips); !held) return held.error();
        watch_.end("relaxing");
        if (with_tips) {
            if (Status finished = finish_grid(*with_tips, walk, levels, inverted); !finished) return finished.error();
            if (inverted == 0) return std::move(*with_tips);
        }
        if (Status finished = finish_grid(plain, walk, levels, inverted); !finished) return finished.error();
        return plain;
    }

    /// with_tips: the grid relaxed with tips held, if the surface sticks out of the one relaxed without.
    Status hold_what_sticks_out(const SurfaceWalk& walk, const PatchGrid& plain, PatchGrid sampled,
                                std::optional<PatchGrid>& with_tips) {
        if (context_.is_cancelled()) return cancelled_error();
        if (is_hopeless(plain)) return Success{};
        const ManifoldSurface& surface = walk.surface();
        const Mesh target = surface_mesh(surface, mesh_.origin);
        const double bound = tip_bound(plain);
        for (int round = 0; round < kTipRounds; ++round) {
            const Mesh quads = grid_mesh(with_tips ? *with_tips : plain, mesh_.origin);
            const Result<std::vector<float>> distances = distances_to_surface(target, quads, context_);
            if (!distances) return distances.error();
            const std::vector<Index> tips = find_tips(surface, walk.twins(), walk.kinds(), *distances, bound);
            if (tips.empty() || hold_tips(surface, walk.twins(), tips, bound, sampled) == 0) return Success{};
            with_tips = sampled;
            relax(*with_tips, walk, kCoarseSweeps, context_);
            if (context_.is_cancelled()) return cancelled_error();
        }
        return Success{};
    }

    /// How far the surface may stick out of a grid before a tip is held there, model units: half of what the gate
    /// allows, but no more than a quad's side, and no less than half of it, which is what bent quads are off by.
    double tip_bound(const PatchGrid& grid) {
        const std::size_t quads = grid.patches.patch_count() << (2 * grid.patches.levels);
        const double side = std::sqrt(area_of(surface_) / double(quads));
        return std::clamp(0.5 * report().max_distance_from_input * report().diagonal, 0.5 * side, side);
    }

    /// Down to the finest level, and untangled.
    Status finish_grid(PatchGrid& grid, const SurfaceWalk& walk, unsigned levels, std::size_t& inverted) {
        while (grid.patches.levels < levels) {
            grid = halve_grid(grid, walk, context_);
            if (context_.is_cancelled()) return cancelled_error();
            relax(grid, walk, kFineSweeps, context_);
        }
        watch_.end("relaxing");
        if (context_.is_cancelled()) return cancelled_error();
        inverted = untangle(grid, walk, kWantedJacobian, context_).inverted;
        watch_.end("untangling");
        if (context_.is_cancelled()) return cancelled_error();
        return Success{};
    }

    /// layout: with a level fewer where all sides had to be halved.
    Result<BaseQuads> make_base(const ManifoldSurface& surface, std::span<const Index> twins,
                                const FeatureCurves& curves, PatchLayout& layout, std::optional<SurfaceMap>& map) {
        // When a triangle finds no partner all sides are halved: that is one of the levels, or, where their number is
        // fixed, the base begins with a quarter of the patches.
        const bool fixed = options_.levels || layout.levels == 1;
        for (bool halve = false;; halve = true) {
            map.emplace(surface, twins, curves.half_edges, curves.corners);
            const std::size_t patches = halve ? std::max<std::size_t>(layout.patches / 4, 1) : layout.patches;
            if (Status made = make_base_triangles(*map, {2 * patches}, context_); !made) return made.error();
            watch_.end("decimating");
            Result<BaseQuads> base = make_base_quads(*map, halve, context_);
            watch_.end("pairing");
            if (!base) return base;
            if (base->halved && !halve && fixed) continue;
            if (base->halved && !halve) --layout.levels;
            return base;
        }
    }

    Outcome gate(PatchGrid grid, const ManifoldSurface& surface) {
        if (Status measured = measure(grid); !measured) return measured.error();
        source_ = std::move(grid.source);
        source_surface_ = &surface;
        result_.patches = std::move(grid.patches);
        return judge(surface);
    }

    /// What is wrong with the quads measured.
    std::optional<QuadFailure> judge(const ManifoldSurface& surface) {
        if (report().quality.inverted > 0)
            return QuadFailure{QuadFailure::Kind::inverted, report().quality.inverted, report().quality.quads};
        const SurfaceTopology in = surface_topology(surface), &out = report().output;
        if (in.euler != out.euler || in.components != out.components || in.border_loops != out.border_loops) {
            QuadFailure failure{QuadFailure::Kind::topology};
            failure.euler = out.euler;
            failure.expected_euler = in.euler;
            return failure;
        }
        const bool strays = report().to_input.max > report().max_distance;
        if (!strays && report().from_input.max <= report().max_distance_from_input) return std::nullopt;
        QuadFailure failure{QuadFailure::Kind::distance};
        failure.furthest = strays ? report().to_input.max : report().from_input.max;
        failure.allowed = strays ? report().max_distance : report().max_distance_from_input;
        return failure;
    }

    Status measure(const PatchGrid& grid) {
        context_.report("measuring", 0);
        result_.mesh = grid_mesh(grid, mesh_.origin);
        report().patches = grid.patches.patch_count();
        report().levels = grid.patches.levels;
        report().quality = measure_quads(result_.mesh, context_);
        report().output = quad_topology(result_.mesh);
        if (context_.is_cancelled()) return cancelled_error();
        const Result<MeshDistance> distance = mesh_distance(result_.mesh, cleaned_, kDistanceSamples, context_);
        if (!distance) return distance.error();
        const SurfaceDistance& between = *distance->surfaces;
        report().to_input = {distance->relative(between.rms_a_to_b), distance->relative(between.max_a_to_b)};
        report().from_input = {distance->relative(between.rms_b_to_a), distance->relative(between.max_b_to_a)};
        watch_.end("measuring");
        return Success{};
    }

    Result<QuadRemeshed> finish() {
        find_sources();
        if (context_.is_cancelled()) return cancelled_error();
        if (options_.attributes) {
            context_.report("attributes", 0);
            if (Status moved = transfer_attributes(mesh_, result_.source, result_.mesh, context_); !moved)
                return moved.error();
        }
        watch_.end("attributes");
        return std::move(result_);
    }

    /// Every vertex's place on the mesh: through the surface's own corners, or, where it has none, the closest.
    void find_sources() {
        result_.source.resize(source_.size());
        std::vector<std::size_t> lost;
        for (std::size_t v = 0; v < source_.size(); ++v) {
            const auto& corners = source_surface_->source_corners;
            if (!corners.empty() && corners[source_[v].triangle][0] != kNoIndex)
                result_.source[v] = {corners[source_[v].triangle], source_[v].barycentric.cast<float>()};
            else
                lost.push_back(v);
        }
        if (lost.empty()) return;
        const std::vector<Triangle>& corners =
            surface_.source_corners; // the cleaned input has its own, but for fillings
        std::vector<Triangle> triangles;
        std::vector<Index> ids;
        for (Index t = 0; t < corners.size(); ++t)
            if (corners[t][0] != kNoIndex) {
                triangles.push_back(surface_.triangles[t]);
                ids.push_back(t);
            }
        const ClosestPointTree tree(cleaned_.positions, triangles, context_);
        parallel_for(context_, lost.size(), 256, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end && !context_.is_cancelled(); ++i) {
                const SurfacePoint closest = tree.closest(result_.mesh.positions[lost[i]]);
                result_.source[lost[i]] = {corners[ids[closest.triangle]], closest.barycentric};
            }
        });
    }

    const Mesh& mesh_;
    const QuadRemeshOptions& options_;
    const RunContext& context_;
    QuadRemeshed result_;
    PhaseClock watch_;
    ManifoldSurface surface_, wrapped_;
    Mesh cleaned_; ///< surface_ as a mesh: what distances are measured from
    PatchLayout layout_;

    std::vector<TrianglePoint> source_;
    const ManifoldSurface* source_surface_ = nullptr; ///< what source_ lies on
};

} // namespace

Result<QuadRemeshed> quad_remesh(const Mesh& mesh, const QuadRemeshOptions& options, const RunContext& context) {
    if (std::optional<Error> error = mesh_error(mesh)) return *error;
    return Remesher(mesh, options, context).run();
}

Mesh base_mesh(const QuadRemeshed& remeshed) {
    Mesh base;
    base.origin = remeshed.mesh.origin;
    const std::vector<std::array<Index, 4>>& corners = remeshed.patches.base;
    Index count = 0;
    for (const auto& patch : corners)
        for (const Index v : patch) count = std::max(count, v + 1);
    base.positions.assign(remeshed.mesh.positions.begin(), remeshed.mesh.positions.begin() + count);
    for (const auto& patch : corners) base.add_face(patch);
    return base;
}

} // namespace filigree
