#include "filigree/scene/melting_surface.h"

#include "filigree/core/parallel_for.h"
#include "filigree/hierarchy/blend_code.h"
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

/// Values that corners refer to, behind those of another mesh; corners without a value where there are none.
template <class T>
void append_values(const CornerAttribute<T>& part, const Mesh& part_mesh, CornerAttribute<T>& whole) {
    const Index first = Index(whole.values.size());
    whole.values.insert(whole.values.end(), part.values.begin(), part.values.end());
    if (part.empty()) {
        whole.corners.insert(whole.corners.end(), part_mesh.corner_count(), kNoIndex);
        return;
    }
    for (const Index value : part.per_vertex() ? part_mesh.corners : part.corners)
        whole.corners.push_back(value == kNoIndex ? kNoIndex : first + value);
}

} // namespace

Result<MeltingSurface> MeltingSurface::create(const ReadyScene& ready, const RunContext& context) {
    return create(ready, {}, context);
}

Result<MeltingSurface> MeltingSurface::create(const ReadyScene& ready, std::span<const BodyLook> looks,
                                              const RunContext& context) {
    MeltingSurface surface;
    surface.ready_ = &ready;
    for (std::size_t b = 0; b < ready.bodies.size(); ++b) {
        if (ready.bodies[b].body->material.model != MaterialModel::mpm) continue;
        const BodyLook* look = b < looks.size() && !looks[b].empty() ? &looks[b] : nullptr;
        if (const Status added = surface.add(b, look, context); !added) return added.error();
    }
    return surface;
}

Status MeltingSurface::add(std::size_t b, const BodyLook* look, const RunContext& context) {
    const ReadyBody& body = ready_->bodies[b];
    const Mesh mesh = level_mesh(body.model, body.model.finest_level());
    Result<CompositeMesher> mesher = CompositeMesher::create(mesh, context);
    if (!mesher && mesher.error().code == ErrorCode::unsuitable) {
        warnings.push_back(fmt::format("body '{}': its mesh is not closed, so it neither parts nor joins where it "
                                       "melts; its open edges have to be closed",
                                       body.name));
        return Success{};
    }
    if (!mesher) return mesher.error();
    Result<Restorer> restorer = Restorer::create(body.model, {}, context);
    if (!restorer) return restorer.error();
    Result<Surfels> surfels = make_surfels(mesh, context);
    if (look && surfels) { // vertices' colours go with them
        Mesh colored = mesh;
        colored.colors = look->vertex_colors;
        surfels = make_surfels(colored, context);
    }
    if (!surfels) return surfels.error();
    for (float& radius : surfels->rest_radius) radius *= float(body.body->scale);
    if (surfels->colors.empty()) surfels->colors.assign(surfels->size(), opaque(body.color));
    BodyPart& part = bodies_.emplace_back(
        BodyPart{b, std::move(*restorer), body.in_metres(mesh.positions), std::move(*surfels), {}, {}});
    has_uvs_ = has_uvs_ || !mesh.uvs.empty();
    std::vector<Vec3f> rest;
    for (std::size_t p = 0; p < body.body->particle_count(); ++p) rest.push_back(body.body->rest[p]);
    part.matter = MatterAtPoints(part.start, rest, body.body->spacing(), context);
    std::vector<Vec4f> colors = matter_colors(mesh, part.start, rest, body.body->spacing(), context);
    if (look) {
        part.colors = look->vertex_colors;
        part.has_look = true;
        part.first_material = Index(materials_.size());
        for (const MeshMaterial& material : look->materials) {
            materials_.push_back(material);
            if (ready_->bodies.size() > 1) materials_.back().name = body.name + ": " + material.name;
        }
        const MatterAtPoints seen(rest, body.in_metres(look->places), body.body->spacing(), context);
        for (std::size_t p = 0; p < rest.size(); ++p)
            colors.push_back(seen.at<Vec4f>(p, look->place_colors, opaque(body.color)));
    }
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

/// Puts a body's mesh behind those before it: positions, faces, colours, normals, and what looks need.
void MeltingSurface::append(const Mesh& part_mesh, const BodyPart& part, const RunContext& context, Mesh& whole) const {
    const Index first = Index(whole.positions.size());
    whole.positions.insert(whole.positions.end(), part_mesh.positions.begin(), part_mesh.positions.end());
    for (std::size_t f = 0; f < part_mesh.face_count(); ++f) {
        for (const Index v : part_mesh.face(f)) whole.corners.push_back(first + v);
        whole.face_offsets.push_back(Index(whole.corners.size()));
    }
    const std::vector<Vec4f>& colors = part.has_look ? part.colors : part_mesh.colors;
    if (colors.empty())
        whole.colors.insert(whole.colors.end(), part_mesh.positions.size(), opaque(ready_->bodies[part.body].color));
    else
        whole.colors.insert(whole.colors.end(), colors.begin(), colors.end());
    CornerAttribute<Vec3f> normals = part_mesh.normals;
    if (normals.empty()) normals = {vertex_normals(part_mesh, part_mesh.positions, context), {}};
    append_values(normals, part_mesh, whole.normals);
    if (has_uvs_) append_values(part_mesh.uvs, part_mesh, whole.uvs);
    for (std::size_t f = 0; f < part_mesh.face_count() && !materials_.empty(); ++f) {
        const Index material = part.has_look ? part_mesh.materials.of_face[f] : kNoIndex;
        whole.materials.of_face.push_back(material == kNoIndex ? kNoIndex : part.first_material + material);
    }
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
    for (const MeshMaterial& material : materials_) restored.materials.names.push_back(material.name);
    restored.embedded_materials = materials_;
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
            append(start, part, context, restored);
        } else {
            const Result<Mesh> now = part.restorer.mesh(recording.poses[part.body].frames[frame], context);
            if (!now) return now.error();
            append(*now, part, context, restored);
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
        Surfels own = carried_surfels(part.surfels, places, vertex_gradients(model.detail, *driver));
        append_if(own, [&](const Triangle& t) {
            return std::all_of(t.begin(), t.end(), [&](Index v) { return now[first + v] != kNoIndex; });
        });
        first += part.start.size();
    }
    Result<Surfels> split = split_surfels(all);
    if (!split) return split.error();
    all = std::move(split).value();
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
