#include "softness.h"

#include <algorithm>

namespace filigree::studio {

std::shared_ptr<const std::vector<float>> softness_of(const State& state) {
    const bool fits = state.softness && state.source && state.softness->size() == state.source->mesh.vertex_count();
    return fits ? state.softness : nullptr;
}

std::shared_ptr<const std::vector<float>> softness_in(const Mesh& mesh) {
    for (const VertexScalar& scalar : mesh.scalars) {
        if (scalar.name != kSoftnessScalar || scalar.values.size() != mesh.vertex_count()) continue;
        auto values = std::make_shared<std::vector<float>>(scalar.values);
        for (float& value : *values) value = std::isfinite(value) ? std::clamp(value, 0.0f, 1.0f) : 0.0f;
        return values;
    }
    return nullptr;
}

Mesh with_softness(Mesh mesh, const State& state) {
    const auto softness = softness_of(state);
    if (!softness || softness->size() > mesh.vertex_count()) return mesh;
    std::erase_if(mesh.scalars, [](const VertexScalar& scalar) { return scalar.name == kSoftnessScalar; });
    std::vector<float> values = *softness;
    values.resize(mesh.vertex_count());
    mesh.scalars.push_back({kSoftnessScalar, std::move(values)});
    return mesh;
}

std::vector<float> painted(const Mesh& mesh, std::vector<float> softness, Index vertex, double radius,
                           bool takes_away) {
    softness.resize(mesh.vertex_count());
    const Vec3f centre = mesh.positions[vertex];
    const auto reach = float(radius);
    for (Index v = 0; v < softness.size(); ++v) {
        const float apart = (mesh.positions[v] - centre).norm();
        if (v != vertex && !(apart < reach)) continue;
        const float t = reach > 0 ? std::min(apart / reach, 1.0f) : 0;
        const float weight = (1 - t * t) * (1 - t * t); // 1 in the middle, flat there and at the rim
        softness[v] = takes_away ? std::min(softness[v], 1 - weight) : std::max(softness[v], weight);
    }
    return softness;
}

Result<std::shared_ptr<const DroppedBody>> softened(std::shared_ptr<const DroppedBody> made, const State& state,
                                                    const RunContext& context) {
    const auto softness = softness_of(state);
    if (!softness) return made;
    auto soft = std::make_shared<DroppedBody>(*made);
    if (made->body->material.model != MaterialModel::fem || made->fracture) {
        soft->report.warning += std::string(soft->report.warning.empty() ? "" : " ") +
                                "The painted softness counts for whole bodies of the method Finite elements.";
        return std::shared_ptr<const DroppedBody>(std::move(soft));
    }
    std::vector<float> factors;
    for (const float one : *softness) factors.push_back(1 + float(state.body.softest - 1) * one);
    Result<std::vector<float>> cells = spread_inwards(*made->body, state.source->mesh, factors, context);
    if (!cells) return cells.error();
    filigree::Body body = *made->body;
    BodyFields fields = body.fields;
    fields.stiffness = std::move(*cells);
    if (const Status set = set_fields(body, std::move(fields)); !set) return set.error();
    if (const std::string warning = fields_warning(body); !warning.empty())
        soft->report.warning += (soft->report.warning.empty() ? "" : " ") + warning;
    soft->body = std::make_shared<const filigree::Body>(std::move(body));
    return std::shared_ptr<const DroppedBody>(std::move(soft));
}

} // namespace filigree::studio
