#include "filigree/present/patch_surface.h"

#include "filigree/present/patch_colors.h"
#include "filigree/render.h"

namespace filigree {

Result<PatchData> PatchData::make(const Model& model, RestoreOptions restore, unsigned most_levels, RestoreOn where,
                                  const RunContext& context) {
    Result<FaceLabels> labels = patch_labels(model.mesh, most_levels, context);
    if (!labels) return labels.error();
    auto colored = std::make_shared<Model>(model);
    colored->mesh.materials = std::move(*labels);
    colored->mesh.colors.clear();
    colored->mesh.uvs = {};
    SurfaceOptions options;
    for (const Vec3f& color : category_colors()) options.materials.push_back({color, nullptr});
    restore.level.reset();
    Result<DrawData> data = DrawData::model(*colored, restore, options, where, context);
    if (!data) return data.error();
    return PatchData{std::move(colored), std::move(*data)};
}

} // namespace filigree
