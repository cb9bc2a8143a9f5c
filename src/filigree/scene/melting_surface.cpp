#include "filigree/scene/melting_surface.h"

#include "filigree/core/parallel_for.h"
#include "filigree/mesh/normals.h"

#include <algorithm>

#include <fmt/format.h>

namespace filigree {

namespace {

std::vector<Vec3f> placed(std::vector<Vec3f> points, const Eigen::Isometry3d& placement) {
    for (Vec3f& p : points) p = (placement * p.cast<double>()).cast<float>();
    return points;
}

Vec4f opaque(const Vec3f& color) { return {color[0], color[1], color[2], 1}; }

/// Puts a mesh behind another: positions, faces, colours, and normals where the mesh has a normal a corner or vertex.
void append(const Mesh& part, const Vec3f& color, const RunContext& context, Mesh& whole) {
    const Index first = Index(whole.positions.size()), first_normal = Index(whole.normals.values.size());
    whole.positions.insert(whole.positions.end(), part.positions.begin(), part.positions.end());
    for (std::size_t f = 0; f < part.face_count(); ++f) {
        for (const Index v : part.face(f)) whole.corners.push_back(first + v);
        whole.face_offsets.push_back(Index(whole.corners.size()));
    }
    if (part.colors.empty())
        whole.colors.insert(whole.colors.end(), part.positions.size(), opaque(color));
    else
        whole.colors.insert(whole.colors.end(), part.colors.begin(), part.colors.end());
    std::vector<Vec3f> normals = part.normals.values;
    if (normals.empty()) normals = vertex_normals(part, part.positions, context);
    whole.normals.values.insert(whole.normals.values.end(), normals.begin(), normals.end());
    const bool per_vertex = part.normals.empty() || part.normals.per_vertex();
    for (const Index corner : per_vertex ? part.corners : part.normals.corners)
        whole.normals.corners.push_back(first_normal + corner);
}

} // namespace

Result<MeltingSurface> MeltingSurface::create(const ReadyScene& ready, const RunContext& context) {
    MeltingSurface surface;
    surface.ready_ = &ready;
    for (std::size_t b = 0; b < ready.bodies.size(); ++b) {
        if (ready.bodies[b].body->material.model != MaterialModel::mpm) continue;
        if (const Status added = surface.add(b, context); !added) return added.error();
    }
    return surface;
}

Status MeltingSurface::add(std::size_t b, const RunContext& context) {
    const ReadyBody& body = ready_->bodies[b];
    Result<CompositeMesher> mesher = CompositeMesher::create(body.model.mesh, context);
    if (!mesher && mesher.error().code == ErrorCode::unsuitable) {
        warnings.push_back(fmt::format("body '{}': its mesh is not closed, so it neither parts nor joins where it "
                                       "melts; `filigree info` shows where it is open",
                                       body.name));
        return Success{};
    }
    if (!mesher) return mesher.error();
    Result<Restorer> restorer = Restorer::create(body.model, {}, context);
    if (!restorer) return restorer.error();
    Result<Surfels> surfels = make_surfels(body.model.mesh, context);
    if (!surfels) return surfels.error();
    for (float& radius : surfels->rest_radius) radius *= float(body.body->scale);
    if (surfels->colors.empty()) surfels->colors.assign(surfels->size(), opaque(body.color));
    BodyPart& part = bodies_.emplace_back(
        BodyPart{b, std::move(*restorer), body.in_metres(body.model.mesh.positions), std::move(*surfels), {}});
    std::vector<Vec3f> rest;
    for (std::size_t p = 0; p < body.body->particle_count(); ++p) rest.push_back(body.body->rest[p]);
    part.matter = MatterAtPoints(part.start, rest, body.body->spacing(), context);
    const std::vector<Vec4f> colors = matter_colors(body.model.mesh, part.start, rest, body.body->spacing(), context);
    if (colors.empty())
        particle_colors_.insert(particle_colors_.end(), rest.size(), opaque(body.color));
    else
        particle_colors_.insert(particle_colors_.end(), colors.begin(), colors.end());
    name_ += (name_.empty() ? "" : "+") + body.name;
    if (mesher_)
        mesher_->append(*mesher);
    else
        mesher_.emplace(std::move(*mesher));
    return Success{};
}

/// How far the matter at a vertex is renewed.
float MeltingSurface::renewal_at(const BodyPart& part, std::size_t vertex, const MatterParticles& matter) {
    return part.matter.at<float>(vertex, matter.renewal, 0); // so far from all matter it counts as old
}

bool MeltingSurface::has_body(std::size_t body) const {
    return std::any_of(bodies_.begin(), bodies_.end(), [&](const BodyPart& part) { return part.body == body; });
}

Result<CompositeSurface> MeltingSurface::frame(const Recording& recording, std::size_t frame,
                                               const RunContext& context) {
    if (frame == 0) dead_.clear();
    MatterParticles matter;
    Mesh restored;
    std::vector<float> renewal;
    for (const BodyPart& part : bodies_) {
        const ReadyBody& body = ready_->bodies[part.body];
        const MatterParticles& own = recording.matter[part.body][frame];
        matter.spacing = std::max(matter.spacing, own.spacing);
        matter.positions.insert(matter.positions.end(), own.positions.begin(), own.positions.end());
        matter.volumes.insert(matter.volumes.end(), own.volumes.begin(), own.volumes.end());
        matter.renewal.insert(matter.renewal.end(), own.renewal.begin(), own.renewal.end());
        if (frame == 0) {
            Mesh start = body.model.mesh;
            start.positions = placed(part.start, ready_->actors[part.body].placement);
            start.normals = {}; // of the mesh before it was turned
            append(start, body.color, context, restored);
        } else {
            const Result<Mesh> now = part.restorer.mesh(recording.poses[part.body].frames[frame], context);
            if (!now) return now.error();
            append(*now, body.color, context, restored);
        }
        for (std::size_t v = 0; v < part.start.size(); ++v) renewal.push_back(renewal_at(part, v, own));
    }
    const Result<ParticleField> field = make_particle_field(matter, {}, context);
    if (!field) return field.error();
    return mesher_->make(restored, renewal, matter, particle_colors_, *field, dead_, context);
}

Result<Surfels> MeltingSurface::surfels(const CompositeSurface& surface, const Recording& recording, std::size_t frame,
                                        const RunContext& context) const {
    // Where each vertex of the bodies is in the surface, as long as it is where it was restored to.
    std::vector<Index> now;
    for (const BodyPart& part : bodies_) now.resize(now.size() + part.start.size(), kNoIndex);
    for (Index v = 0; v < surface.origin.size(); ++v)
        if (surface.origin[v] != kNoIndex) now[surface.origin[v]] = v;
    std::vector<bool> is_kept(surface.origin.size(), false);
    std::size_t first = 0;
    for (const BodyPart& part : bodies_) {
        for (std::size_t v = 0; v < part.start.size(); ++v) {
            Index& at = now[first + v];
            if (renewal_at(part, v, recording.matter[part.body][frame]) > CompositeMesher::kFadeBegin) at = kNoIndex;
            if (at != kNoIndex) is_kept[at] = true;
        }
        first += part.start.size();
    }

    Surfels all;
    all.origin = surface.mesh.origin;
    const auto append_if = [&](const Surfels& some, const auto& is_wanted) {
        for (std::size_t i = 0; i < some.size(); ++i) {
            if (!is_wanted(some.corners[i])) continue;
            all.positions.push_back(some.positions[i]);
            all.u.push_back(some.u[i]);
            all.v.push_back(some.v[i]);
            all.colors.push_back(some.colors[i]);
            all.rest_radius.push_back(some.rest_radius[i]);
            all.corners.push_back(some.corners[i]);
            all.weights.push_back(some.weights[i]);
        }
    };
    first = 0;
    for (const BodyPart& part : bodies_) {
        const Model& model = ready_->bodies[part.body].model;
        const Result<std::vector<Mat3f>> driver =
            part.restorer.gradients(recording.poses[part.body].frames[frame], context);
        if (!driver) return driver.error();
        std::vector<Vec3f> places(part.start.size(), Vec3f::Zero());
        for (std::size_t v = 0; v < places.size(); ++v)
            if (const Index at = now[first + v]; at != kNoIndex) places[v] = surface.mesh.positions[at];
        Surfels own =
            carried_surfels(part.surfels, places, vertex_gradients(std::get<BlendDetail>(model.detail), *driver));
        append_if(own, [&](const Triangle& t) {
            return std::all_of(t.begin(), t.end(), [&](Index v) { return now[first + v] != kNoIndex; });
        });
        first += part.start.size();
    }
    all = split_surfels(all);
    Result<Surfels> fresh = make_surfels(surface.mesh, context);
    if (!fresh) return fresh.error();
    append_if(*fresh,
              [&](const Triangle& t) { return std::any_of(t.begin(), t.end(), [&](Index v) { return !is_kept[v]; }); });
    return all;
}

Result<std::vector<Vec3f>> MeltingSurface::velocities(const CompositeSurface& surface, const Recording& recording,
                                                      std::size_t frame, double frames_per_second,
                                                      const RunContext& context) const {
    // Ahead to the next frame; at the end back to the one before.
    const std::size_t frames = bodies_.empty() ? 0 : recording.matter[bodies_[0].body].size();
    const std::size_t from = frame + 1 < frames || frame == 0 ? frame : frame - 1;
    std::vector<Vec3f> positions, ways;
    double spacing = 0;
    for (const BodyPart& part : bodies_) {
        const auto& matter = recording.matter[part.body];
        const std::vector<Vec3f>& next = matter[std::min(from + 1, frames - 1)].positions;
        positions.insert(positions.end(), matter[frame].positions.begin(), matter[frame].positions.end());
        for (std::size_t p = 0; p < next.size(); ++p) ways.push_back(next[p] - matter[from].positions[p]);
        spacing = std::max(spacing, double(matter[frame].spacing));
    }
    std::vector<Vec3f> velocities(surface.mesh.vertex_count(), Vec3f::Zero());
    const MatterAtPoints matter(surface.mesh.positions, positions, spacing, context);
    for (std::size_t v = 0; v < velocities.size(); ++v)
        velocities[v] = float(frames_per_second) * matter.at<Vec3f>(v, ways, Vec3f::Zero());
    if (context.is_cancelled()) return cancelled_error();
    return velocities;
}

} // namespace filigree
