#include "filigree/present/patch_colors.h"

#include "filigree/render.h"

#include <algorithm>
#include <map>

namespace filigree {

namespace {

/// Steps around the circle of colours from one to another.
std::size_t color_distance(std::size_t a, std::size_t b) {
    const std::size_t d = a > b ? a - b : b - a;
    return std::min(d, kCategoryCount - d);
}

/// The patches at each vertex that is a patch's corner.
std::map<Index, std::vector<std::size_t>> patches_at_corners(const RegularPatches& patches) {
    std::map<Index, std::vector<std::size_t>> at;
    for (std::size_t p = 0; p < patches.patch_count(); ++p)
        for (const Index corner : patches.base[p]) at[corner].push_back(p);
    return at;
}

} // namespace

std::vector<Index> choose_patch_colors(const RegularPatches& patches) {
    const std::map<Index, std::vector<std::size_t>> at_corners = patches_at_corners(patches);
    std::vector<Index> result(patches.patch_count(), kNoIndex);
    for (std::size_t p = 0; p < result.size(); ++p) {
        std::size_t best = 0, best_distance = 0;
        for (std::size_t k = 0; k < kCategoryCount; ++k) {
            const std::size_t wish = (3 * p + k) % kCategoryCount; // every patch begins elsewhere: all are used
            std::size_t nearest = kCategoryCount;
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

Result<FaceLabels> patch_labels(const Mesh& mesh, unsigned most_levels, const RunContext& context) {
    const Result<RegularPatches> patches = find_regular_patches(mesh, most_levels, context);
    if (!patches) return patches.error();
    std::vector<Index> patch_inside(mesh.vertex_count(), kNoIndex); // of vertices on no border
    for (std::size_t p = 0; p < patches->patch_count(); ++p)
        for (std::size_t j = 1; j < patches->side(); ++j)
            for (std::size_t i = 1; i < patches->side(); ++i) patch_inside[patches->at(p, i, j)] = Index(p);
    const std::vector<Index> colors = choose_patch_colors(*patches);
    FaceLabels labels;
    labels.names.resize(kCategoryCount);
    labels.of_face.assign(mesh.face_count(), kNoIndex);
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        for (const Index v : mesh.face(f)) // a patch has two quads a side or more, so one of them is inside
            if (patch_inside[v] != kNoIndex) labels.of_face[f] = colors[patch_inside[v]];
    return labels;
}

} // namespace filigree
