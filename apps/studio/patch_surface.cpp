#include "patch_surface.h"

#include "filigree/hierarchy/regular_patches.h"

#include <algorithm>
#include <map>

namespace filigree::studio {

namespace {

// sRGB: eight hues, evenly around OKLab's circle of lightness 0.80 and chroma 0.095, so that none stands out.
const std::array<Vec3f, 8> kColors = {{{0.95f, 0.64f, 0.73f},
                                       {0.95f, 0.67f, 0.54f},
                                       {0.84f, 0.73f, 0.46f},
                                       {0.64f, 0.80f, 0.56f},
                                       {0.45f, 0.82f, 0.75f},
                                       {0.46f, 0.80f, 0.92f},
                                       {0.65f, 0.73f, 0.99f},
                                       {0.84f, 0.67f, 0.91f}}};

/// Steps around the circle of colours from one to another.
std::size_t color_distance(std::size_t a, std::size_t b) {
    const std::size_t d = a > b ? a - b : b - a;
    return std::min(d, kColors.size() - d);
}

/// The patches at each vertex that is a patch's corner.
std::map<Index, std::vector<std::size_t>> patches_at_corners(const RegularPatches& patches) {
    std::map<Index, std::vector<std::size_t>> at;
    for (std::size_t p = 0; p < patches.patch_count(); ++p)
        for (const Index corner : patches.base[p]) at[corner].push_back(p);
    return at;
}

/// One of kColors a patch: the one that differs most from those its neighbours have by then.
std::vector<Index> colors_of(const RegularPatches& patches) {
    const std::map<Index, std::vector<std::size_t>> at_corners = patches_at_corners(patches);
    std::vector<Index> result(patches.patch_count(), kNoIndex);
    for (std::size_t p = 0; p < result.size(); ++p) {
        std::size_t best = 0, best_distance = 0;
        for (std::size_t k = 0; k < kColors.size(); ++k) {
            const std::size_t wish = (3 * p + k) % kColors.size(); // every patch begins elsewhere: all are used
            std::size_t nearest = kColors.size();
            for (const Index corner : patches.base[p])
                for (const std::size_t neighbour : at_corners.at(corner))
                    if (result[neighbour] != kNoIndex)
                        nearest = std::min(nearest, color_distance(wish, result[neighbour]));
            if (nearest > best_distance) {
                best = wish;
                best_distance = nearest;
            }
        }
        result[p] = Index(best);
    }
    return result;
}

} // namespace

Result<FaceLabels> patch_labels(const Mesh& mesh, unsigned most_levels, const RunContext& context) {
    const Result<RegularPatches> patches = find_regular_patches(mesh, most_levels, context);
    if (!patches) return patches.error();
    std::vector<Index> patch_inside(mesh.vertex_count(), kNoIndex); // of vertices on no border
    for (std::size_t p = 0; p < patches->patch_count(); ++p)
        for (std::size_t j = 1; j < patches->side(); ++j)
            for (std::size_t i = 1; i < patches->side(); ++i) patch_inside[patches->at(p, i, j)] = Index(p);
    const std::vector<Index> colors = colors_of(*patches);
    FaceLabels labels;
    labels.names.resize(kColors.size());
    labels.of_face.assign(mesh.face_count(), kNoIndex);
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        for (const Index v : mesh.face(f)) // a patch has two quads a side or more, so one of them is inside
            if (patch_inside[v] != kNoIndex) labels.of_face[f] = colors[patch_inside[v]];
    return labels;
}

Result<PatchData> PatchData::make(const Model& model, RestoreOptions restore, unsigned most_levels, RestoreOn where,
                                  const RunContext& context) {
    Result<FaceLabels> labels = patch_labels(model.mesh, most_levels, context);
    if (!labels) return labels.error();
    auto colored = std::make_shared<Model>(model);
    colored->mesh.materials = std::move(*labels);
    colored->mesh.colors.clear();
    colored->mesh.uvs = {};
    SurfaceOptions options;
    for (const Vec3f& color : kColors) options.materials.push_back({color, nullptr});
    restore.level.reset();
    Result<DrawData> data = DrawData::model(*colored, restore, options, where, context);
    if (!data) return data.error();
    return PatchData{std::move(colored), std::move(*data)};
}

} // namespace filigree::studio
