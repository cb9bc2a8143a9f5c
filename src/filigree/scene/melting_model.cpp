#include "filigree/scene/melting_model.h"

#include <algorithm>

namespace filigree {

Result<MeltingModel> MeltingModel::create(std::shared_ptr<const Model> model, const Body& body, double scale,
                                          const BodyLook& look, const RunContext& context) {
    const Mesh mesh = level_mesh(*model, model->finest_level());
    Result<CompositeMesher> mesher = CompositeMesher::create(mesh, context);
    if (!mesher) return mesher.error();
    Result<Restorer> restorer = Restorer::create(*model, {}, context);
    if (!restorer) return restorer.error();
    MeltingModel melting(std::move(model), std::move(*restorer), std::move(*mesher));
    std::vector<Vec3f> rest;
    for (std::size_t p = 0; p < body.particle_count(); ++p) rest.push_back(Vec3f(body.rest[p]) / float(scale));
    const double spacing = body.spacing() / scale;
    melting.at_vertices_ = MatterAtPoints(mesh.positions, rest, spacing, context);
    if (look.empty()) {
        melting.particle_colors_ = matter_colors(mesh, mesh.positions, rest, spacing, context);
    } else {
        melting.vertex_colors_ = look.vertex_colors;
        const MatterAtPoints seen(rest, look.places, spacing, context);
        for (std::size_t p = 0; p < rest.size(); ++p)
            melting.particle_colors_.push_back(seen.at<Vec4f>(p, look.place_colors, Vec4f::Ones()));
    }
    if (context.is_cancelled()) return cancelled_error();
    return melting;
}

Result<std::optional<Mesh>> MeltingModel::surface(const Pose& pose, const MatterParticles& matter,
                                                  std::vector<std::uint8_t>& dead, const RunContext& context) const {
    std::vector<float> renewal(at_vertices_.size());
    for (std::size_t v = 0; v < renewal.size(); ++v) renewal[v] = at_vertices_.at<float>(v, matter.renewal, 0);
    const auto is_renewed = [](float value) { return value > CompositeMesher::kFadeBegin; };
    if (dead.empty() && std::none_of(renewal.begin(), renewal.end(), is_renewed)) return std::optional<Mesh>();
    Result<Mesh> restored = restorer_.mesh(pose, context);
    if (!restored) return restored.error();
    if (!vertex_colors_.empty()) restored->colors = vertex_colors_;
    const Result<ParticleField> field = make_particle_field(matter, {}, context);
    if (!field) return field.error();
    Result<CompositeSurface> surface =
        mesher_.make(*restored, renewal, matter, particle_colors_, *field, dead, context);
    if (!surface) return surface.error();
    surface->mesh.origin = model_->mesh.origin;
    return std::optional<Mesh>(std::move(surface->mesh));
}

std::vector<float> MeltingModel::temperatures(const MatterParticles& matter) const {
    std::vector<float> temperatures(at_vertices_.size());
    for (std::size_t v = 0; v < temperatures.size(); ++v)
        temperatures[v] = at_vertices_.at<float>(v, matter.temperatures, matter.temperatures.front());
    return temperatures;
}

MatterParticles scaled(MatterParticles matter, double scale) {
    for (Vec3f& p : matter.positions) p *= float(scale);
    for (float& volume : matter.volumes) volume *= float(scale * scale * scale);
    matter.spacing *= float(scale);
    return matter;
}

} // namespace filigree
