// Levels of a model as GLB's meshes, with materials also where faces have no labels.
#pragma once

#include "filigree/io/glb_parts.h"
#include "filigree/strip.h"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace filigree {

class GlbLevels {
public:
    /// The model must outlive it. Libraries that its mesh names are looked for beside `materials_beside`.
    GlbLevels(const Model& model, const std::filesystem::path& materials_beside);

    /// level_mesh; faces of coarser levels have the material that most of their vertices are near.
    Mesh mesh(unsigned level) const;
    /// The materials for a level's parts, added to the file once for all levels that can share them: one without UVs
    /// cannot have pictures, and one without colours is greyer.
    const GlbMaterials& add_materials(GlbBuilder& builder, const GlbParts& parts);
    /// Down to which part of the screen each of `count` levels is shown, from `top` downwards (MSFT_lod): as far as the
    /// next one has triangles for. The last never goes away.
    std::vector<double> screen_coverages(unsigned top, std::size_t count) const;

    const std::vector<std::string>& warnings() const { return warnings_; }

private:
    const Model& model_;
    MeshMaterials found_;
    std::vector<std::string> warnings_;
    std::vector<Index> vertex_materials_; ///< of the finest mesh's vertices
    std::vector<std::pair<std::pair<bool, bool>, GlbMaterials>> added_;
};

} // namespace filigree
