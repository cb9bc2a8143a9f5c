// Based on: [Lee 1998] (the parametrisation), and docs/remesh.md, which says where we differ and what was measured.
#include "filigree/remesh/quad_remesh.h"

#include "filigree/core/parallel_for.h"
#include "filigree/mesh/closest_point.h"
#include "filigree/mesh/mesh_distance.h"
#include "filigree/remesh/base_triangles.h"
#include "filigree/remesh/feature_curves.h"
#include "filigree/remesh/half_edges.h"
#include "filigree/remesh/relax.h"
#include "filigree/remesh/voxel_wrap.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

namespace filigree {

namespace {

constexpr unsigned kMostLevels = 8;
constexpr std::size_t kFewestQuads = 6, kMostQuads = 100'000'000; // each takes some 200 bytes on the way
constexpr double kEnoughPatches = 500;          // levels that were not asked for leave about so many, or more
constexpr double kMostOverdrawn = 1.3;          // quads over those asked for
constexpr std::size_t kLeastTriangles = 8;      // of the base, for each component
constexpr std::size_t kMostPatches = 4'000'000; // indices are 32 bits, and a base is refined before it is decimated
constexpr double kMostRemoved = 0.05;           // of the area, by small parts
constexpr double kLeastArea = 1e-6;     // of the diagonal squared; a wire a thousand times its thickness has 1e-3
constexpr double kShortHandle = 2;      // patch sides: loops up to this are closed, when small parts go
constexpr double kSmallComponent = 0.5; // patch sides, of a component's diagonal
constexpr unsigned kSampledLevels = 3;  // taken from the map; finer ones are halved from there
constexpr unsigned kCoarseSweeps = 20, kFineSweeps = 4;
constexpr double kWantedJacobian = 0.2; // below it, places are searched
constexpr std::size_t kDistanceSamples = 100'000;
constexpr double kVoxelsPerQuad = 0.7; // along a quad's side, of the wrap

class Stopwatch {
public:
    explicit Stopwatch(std::vector<PhaseSeconds>& seconds) : seconds_(seconds) {}
    void end(const char* phase) {
        const auto now = std::chrono::steady_clock::now();
        const double passed = std::chrono::duration<double>(now - last_).count();
        last_ = now;
        const auto entry = std::ranges::find(seconds_, std::string_view(phase),
                                             [](const PhaseSeconds& s) { return std::string_view(s.phase); });
        if (entry == seconds_.end())
            seconds_.push_back({phase, passed});
        else
            entry->seconds += passed;
    }

private:
    std::vector<PhaseSeconds>& seconds_;
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
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

std::string counted(std::size_t quads, unsigned levels) {
    return std::to_string(quads) + " quads at " + std::to_string(levels) + (levels == 1 ? " level" : " levels");
}

std::string short_number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2g", value);
    return text;
}

/// How the quads asked for are laid out.
struct Layout {
    std::size_t patches = 0;
    unsigned levels = 0;
};

std::size_t patches_for(std::size_t quads, unsigned levels) {
    return std::max<std::size_t>(1, static_cast<std::size_t>(std::llround(double(quads) / std::pow(4.0, levels))));
}

class Remesher {
public:
    Remesher(const Mesh& mesh, const QuadRemeshOptions& options, const RunContext& context)
        : mesh_(mesh), options_(options), context_(context), watch_(result_.report.seconds) {}

    Result<QuadRemeshed> run() {
        if (Status prepared = prepare(); !prepared) return prepared.error();
        std::string reason;
        if (options_.wrap != WrapUse::always) reason = make_room(report().input.components);
        const bool has_room = reason.empty();
        if (options_.wrap != WrapUse::always && has_room) reason = try_own_surface();
        // a wrap joins parts that lie close: not what it takes to keep them
        const bool may_wrap =
            options_.wrap == WrapUse::automatic && (has_room || options_.small_parts == SmallParts::remove);
        if (options_.wrap == WrapUse::always || (may_wrap && worth_another_try(reason))) {
            if (!reason.empty()) retry(reason);
            const std::string wrap_reason = try_wrap();
            if (wrap_reason.empty() || options_.wrap == WrapUse::always)
                reason = wrap_reason;
            else
                reason += " (A wrap around it failed as well: " + wrap_reason + ")";
        }
        if (error_) return *error_;
        if (!reason.empty()) return Error{ErrorCode::unsuitable, reason};
        return finish();
    }

private:
    QuadRemeshReport& report() { return result_.report; }

    bool worth_another_try(const std::string& reason) const { return !error_ && !reason.empty(); }

    void retry(const std::string& reason) {
        ++report().tries;
        report().retried = reason;
    }

    Status prepare() {
        const auto fail = [](std::string message) { return Error{ErrorCode::usage, std::move(message)}; };
        if (options_.quads < kFewestQuads || options_.quads > kMostQuads)
            return fail("Ask for 6 to 100,000,000 quads.");
        if (options_.levels && (*options_.levels < 1 || *options_.levels > kMostLevels))
            return fail("Levels are 1 to " + std::to_string(kMostLevels) + ".");
        if (!(options_.feature_angle_deg >= 0 && options_.feature_angle_deg <= 180))
            return fail("The feature angle is 0 to 180 degrees.");
        if (options_.max_distance && !(*options_.max_distance > 0)) return fail("The largest distance is above 0.");
        context_.report("cleaning", 0);
        Result<ManifoldSurface> manifold = make_manifold(mesh_, report().clean, context_);
        if (!manifold) return manifold.error();
        surface_ = std::move(*manifold);
        watch_.end("cleaning");

        const double diagonal = bounds(surface_mesh(surface_, mesh_.origin).positions).diagonal();
        if (!(area_of(surface_) > kLeastArea * diagonal * diagonal))
            return Error{ErrorCode::unsuitable, "The mesh is all but a line: its area is too small for its length."};

        layout_.levels = options_.levels.value_or(1);
        if (!options_.levels)
            while (layout_.levels < kMostLevels &&
                   double(options_.quads) / std::pow(4.0, layout_.levels + 1) >= kEnoughPatches)
                ++layout_.levels;
        layout_.patches = patches_for(options_.quads, layout_.levels);
        if (options_.small_parts == SmallParts::remove) {
            context_.report("small parts", 0);
            remove_small_parts();
            if (surface_topology(surface_).genus() > 0)
                if (Status closed = close_handles(surface_, kShortHandle * patch_side(), report().clean, context_);
                    !closed)
                    return closed;
            watch_.end("small parts");
        }
        report().input = surface_topology(surface_);
        cleaned_ = surface_mesh(surface_, mesh_.origin);
        report().diagonal = bounds(cleaned_.positions).diagonal();
        report().max_distance = options_.max_distance.value_or(patch_side() / report().diagonal);
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

    /// Many parts need many patches: fewer levels where that is ours to choose, else the reason why it cannot be.
    std::string make_room(std::size_t parts) {
        const std::size_t least = kLeastTriangles / 2 * parts;
        while (layout_.patches < least && !options_.levels && layout_.levels > 1)
            --layout_.levels, layout_.patches *= 4;
        if (layout_.patches > kMostPatches)
            return "Those are " + std::to_string(layout_.patches) + " patches, more than " +
                   std::to_string(kMostPatches) + "; ask for fewer quads or more levels.";
        if (layout_.patches >= least) return "";
        const std::string need = counted(least << (2 * layout_.levels), layout_.levels);
        if (parts == 1) return "The mesh needs at least " + need + "; ask for more quads.";
        return "The mesh has " + std::to_string(parts) + " separate parts, which need at least " + need +
               "; ask for more quads, or for a wrap around them.";
    }

    /// The surface itself, with what may help when it fails: features let go where they need too much, more patches,
    /// both.
    std::string try_own_surface() {
        Layout layout = layout_;
        double angle = options_.feature_angle_deg;
        for (;;) {
            const std::string reason = try_surface(surface_, layout, angle);
            if (!worth_another_try(reason)) return reason;
            const bool has_features = angle < 180 && report().feature_edges > 0;
            const bool can_be_finer = !options_.levels && layout_.levels > 1 && layout.levels == layout_.levels;
            if (has_features && (features_need_more_ || !can_be_finer))
                angle = 180;
            else if (can_be_finer)
                layout = {4 * layout_.patches, layout_.levels - 1};
            else
                return reason;
            retry(reason);
        }
    }

    std::string try_wrap() {
        const double side = std::sqrt(area_of(surface_) / double(options_.quads));
        WrapOptions wrap;
        const double extent = bounds(cleaned_.positions).size().maxCoeff();
        wrap.resolution = static_cast<unsigned>(std::clamp(kVoxelsPerQuad * extent / side, 48.0, 256.0));
        Result<ManifoldSurface> wrapped = voxel_wrap(surface_.positions, surface_.triangles, wrap, context_);
        watch_.end("wrapping");
        if (!wrapped) {
            error_ = wrapped.error();
            return error_->message;
        }
        report().wrapped = true;
        wrapped_ = std::move(*wrapped);
        if (options_.small_parts == SmallParts::remove) {
            CleanReport of_the_wrap; // says nothing about the mesh
            remove_small_components(wrapped_, kSmallComponent * patch_side(), of_the_wrap);
            if (Status closed = close_handles(wrapped_, kShortHandle * patch_side(), of_the_wrap, context_); !closed) {
                error_ = closed.error();
                return error_->message;
            }
        }
        watch_.end("small parts");
        if (const std::string reason = make_room(surface_topology(wrapped_).components); !reason.empty()) return reason;
        return try_surface(wrapped_, layout_, 180);
    }

    /// From a manifold to quads that pass the gate, or the reason why not.
    std::string try_surface(const ManifoldSurface& surface, Layout layout, double feature_angle) {
        const std::vector<Index> twins = opposite_half_edges(surface.triangles, surface.positions.size());
        const FeatureCurves curves = find_feature_curves(surface, twins, {feature_angle, patch_side()});
        report().feature_edges = curves.edge_count;
        watch_.end("features");
        const auto corners = static_cast<std::size_t>(std::ranges::count(curves.corners, 1));
        features_need_more_ = curves.edge_count > 0 && corners > layout.patches;
        if (features_need_more_)
            return "The mesh's sharp edges have " + std::to_string(corners) + " corners, too many for " +
                   std::to_string(layout.patches) + " patches; ask for more quads, or keep fewer features.";

        std::optional<SurfaceMap> map;
        std::optional<BaseQuads> base = make_base(surface, twins, curves, layout, map);
        if (!base) return error_->message;
        const std::size_t quads = base->quads.size() << (2 * layout.levels);
        features_need_more_ = double(quads) > kMostOverdrawn * double(options_.quads) + 24;
        if (features_need_more_)
            return "The mesh's features and handles need " + counted(quads, layout.levels) +
                   "; ask for more quads or fewer levels, or keep fewer features.";

        std::vector<std::uint8_t> features = curves.half_edges;
        for (Index h = 0; h < twins.size(); ++h) features[h] |= twins[h] == kNoIndex;
        std::vector<VertexKind> kinds(surface.positions.size());
        for (Index v = 0; v < kinds.size(); ++v) kinds[v] = map->kind(v);
        const SurfaceWalk walk(surface, twins, features, kinds);
        context_.report("sampling", 0);
        PatchGrid grid = sample_patches(*map, *base, walk, std::min(layout.levels, kSampledLevels), context_);
        map.reset();
        watch_.end("sampling");
        relax(grid, walk, kCoarseSweeps, context_);
        while (grid.patches.levels < layout.levels) {
            grid = halve_grid(grid, walk, context_);
            relax(grid, walk, kFineSweeps, context_);
        }
        watch_.end("relaxing");
        const Untangled untangled = untangle(grid, walk, kWantedJacobian, context_);
        watch_.end("untangling");
        features_need_more_ = untangled.inverted > 0; // where there are any, they are the likeliest cause
        return gate(std::move(grid), surface);
    }

    std::optional<BaseQuads> make_base(const ManifoldSurface& surface, std::span<const Index> twins,
                                       const FeatureCurves& curves, Layout& layout, std::optional<SurfaceMap>& map) {
        // When a triangle finds no partner all sides are halved: that is one of the levels, or, where their number is
        // fixed, the base begins with a quarter of the patches.
        const bool fixed = options_.levels || layout.levels == 1;
        for (const bool halve : {false, true}) {
            map.emplace(surface, twins, curves.half_edges, curves.corners);
            const std::size_t patches = halve ? std::max<std::size_t>(layout.patches / 4, 1) : layout.patches;
            if (Status made = make_base_triangles(*map, {2 * patches}, context_); !made) {
                error_ = made.error();
                return {};
            }
            watch_.end("decimating");
            Result<BaseQuads> base = make_base_quads(*map, halve, context_);
            watch_.end("pairing");
            if (!base) {
                error_ = base.error();
                return {};
            }
            if (base->halved && !halve && fixed) continue;
            if (base->halved && !halve) --layout.levels;
            return std::move(*base);
        }
        return {};
    }

    /// Measures, and says what is wrong.
    std::string gate(PatchGrid grid, const ManifoldSurface& surface) {
        if (context_.is_cancelled()) {
            error_ = cancelled_error();
            return error_->message;
        }
        context_.report("measuring", 0);
        result_.mesh = grid_mesh(grid, mesh_.origin);
        report().patches = grid.patches.patch_count();
        report().levels = grid.patches.levels;
        report().quality = measure_quads(result_.mesh, context_);
        report().output = quad_topology(result_.mesh);
        const Result<MeshDistance> distance = mesh_distance(result_.mesh, cleaned_, kDistanceSamples, context_);
        if (!distance) {
            error_ = distance.error();
            return error_->message;
        }
        const SurfaceDistance& between = *distance->surfaces;
        report().to_input = {distance->relative(between.rms_a_to_b), distance->relative(between.max_a_to_b)};
        report().from_input = {distance->relative(between.rms_b_to_a), distance->relative(between.max_b_to_a)};
        watch_.end("measuring");
        source_ = std::move(grid.source);
        source_surface_ = &surface;
        result_.patches = std::move(grid.patches);

        if (report().quality.inverted > 0)
            return std::to_string(report().quality.inverted) + " of " + std::to_string(report().quality.quads) +
                   " quads came out inverted; ask for more quads, or fewer levels.";
        const SurfaceTopology in = surface_topology(surface), &out = report().output;
        if (in.euler != out.euler || in.components != out.components || in.border_loops != out.border_loops)
            return "The quads' topology is not the mesh's (Euler number " + std::to_string(out.euler) + " instead of " +
                   std::to_string(in.euler) + "); please report this.";
        const double furthest = std::max(report().to_input.max, report().from_input.max);
        if (!(furthest <= report().max_distance))
            return "The quads are up to " + short_number(furthest) + " of the diagonal from the mesh, more than " +
                   short_number(report().max_distance) + "; ask for more quads, or allow more.";
        return "";
    }

    Result<QuadRemeshed> finish() {
        find_sources();
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
        context_.arena().execute([&] {
            const ClosestPointTree tree(cleaned_.positions, triangles);
            parallel_for(context_, lost.size(), 256, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) {
                    const SurfacePoint closest = tree.closest(result_.mesh.positions[lost[i]]);
                    result_.source[lost[i]] = {corners[ids[closest.triangle]], closest.barycentric};
                }
            });
        });
    }

    const Mesh& mesh_;
    const QuadRemeshOptions& options_;
    const RunContext& context_;
    QuadRemeshed result_;
    Stopwatch watch_;
    ManifoldSurface surface_, wrapped_;
    Mesh cleaned_; ///< surface_ as a mesh: what distances are measured from
    Layout layout_;
    bool features_need_more_ = false; ///< what the last try failed by
    std::optional<Error> error_;      ///< what no other try can mend: cancelled, no memory

    std::vector<TrianglePoint> source_;
    const ManifoldSurface* source_surface_ = nullptr; ///< what source_ lies on
};

} // namespace

Result<QuadRemeshed> quad_remesh(const Mesh& mesh, const QuadRemeshOptions& options, const RunContext& context) {
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
