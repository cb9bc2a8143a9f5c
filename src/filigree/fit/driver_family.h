// Drivers of any size for one mesh, of its own vertices, and a smaller mesh to try them on.
#pragma once

#include "filigree/fit.h"
#include "filigree/levels/edge_collapse.h"
#include "filigree/levels/simplify_levels.h"

#include <array>
#include <optional>
#include <span>
#include <vector>

namespace filigree {

/// A mesh, simplified once: down to a sample (65,536 vertices at most), further to a piece (about 40,000), and from
/// there edge by edge, in an order for each choice. A driver is a beginning of that order backwards.
class DriverFamily {
public:
    /// mesh and work, with triangles, must outlive it. Cost O(F). Errors: cancelled, and those of make_surface.
    static Result<DriverFamily> create(const Mesh& mesh, const WorkingMesh& work, const RunContext& context);
    DriverFamily(DriverFamily&&) = default;

    /// The sample's vertices in the mesh, ascending; its mesh, which may be the whole one.
    std::span<const Index> sample_vertices() const { return sample_vertices_; }
    const Mesh& sample_mesh() const { return is_whole() ? mesh_ : sample_; }
    const WorkingMesh& sample_work() const { return is_whole() ? work_ : sample_work_; }
    /// Vertices of the piece.
    std::size_t most_vertices() const { return piece_count_; }

    /// Orders the piece's vertices. shapes: of DriverChoice::motion, positions of the sample in some frames, scaled to
    /// the diagonal of the rest shape. Cost O(piece log piece) a shape.
    Status order(DriverChoice choice, std::span<const std::vector<Vec3f>> shapes, const RunContext& context);

    /// The driver of at most `vertices` (more where the parts need them), as a level of the sample. order was called.
    Level sample_driver(DriverChoice choice, std::size_t vertices) const;
    /// The same driver as levels of the mesh, coarse to fine.
    std::vector<Level> levels(DriverChoice choice, std::size_t vertices) const;

private:
    DriverFamily(const Mesh& mesh, const WorkingMesh& work) : mesh_(mesh), work_(work) {}
    bool is_whole() const { return sample_.vertex_count() == 0; }
    std::vector<Triangle> in_mesh(std::vector<Triangle> of_sample) const;
    Status make_sample(std::vector<Triangle> triangles, const RunContext& context);

    struct Bulk {
        std::vector<Triangle> triangles; ///< over the mesh's vertices
        std::size_t vertices;
    };
    const Mesh& mesh_;
    const WorkingMesh& work_;
    std::vector<Bulk> bulk_; ///< on the way from the mesh to the piece, fine to coarse
    std::vector<Index> sample_vertices_;
    Mesh sample_; ///< empty: the whole mesh is small enough
    WorkingMesh sample_work_;
    std::vector<Triangle> piece_; ///< over the sample's vertices
    std::size_t piece_count_ = 0;
    std::array<std::optional<CollapseOrder>, 2> orders_;
};

} // namespace filigree
