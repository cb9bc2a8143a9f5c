// One surface that many others are measured against.
#pragma once

#include "filigree/mesh.h"

#include <memory>

namespace filigree {

/// What mesh_distance makes of its second mesh alone (samples, trees of triangles), made once.
class MeasuredSurface {
public:
    /// mesh: with faces; it is copied. samples: as of mesh_distance. Errors: cancelled. Cost O((V + samples) log F).
    static Result<MeasuredSurface> create(const Mesh& mesh, std::size_t samples, const RunContext& context);
    MeasuredSurface(MeasuredSurface&&) noexcept;
    MeasuredSurface& operator=(MeasuredSurface&&) noexcept;
    ~MeasuredSurface();

    /// From `other`, which has faces, and back: the surfaces of mesh_distance(other, mesh, samples, context), to the
    /// bit. Errors: cancelled. Not for several threads at once: a tree is made when it is first wanted.
    Result<SurfaceDistance> distance_of(const Mesh& other, const RunContext& context);

private:
    struct Content;
    explicit MeasuredSurface(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

} // namespace filigree
