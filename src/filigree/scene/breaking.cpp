#include "filigree/scene/breaking.h"

#include <algorithm>

namespace filigree {

Result<ModelInPieces> cut_model(const Model& whole, const FractureCells& cells, double crack_spacing,
                                const RunContext& context) {
    Result<FracturedMesh> fractured = fracture(whole.mesh, cells, {.pieces_are_cells = true}, context);
    if (!fractured) return fractured.error();
    Result<BrokenModel> broken = break_model(whole, *fractured, cells, crack_spacing, context);
    if (!broken) return broken.error();
    ModelInPieces result{std::move(broken->model), {}, fractured->report};
    CarriedByPieces& carried = result.carried;
    carried.driver = std::move(broken->piece_of_driver);
    carried.driver_is_on_crack = std::move(broken->driver_is_on_crack);
    carried.vertices = std::move(fractured->piece_of_vertex);
    for (Index& piece : carried.vertices) piece = std::min(piece, cells.pieces() - 1); // of loose vertices: any
    carried.vertices.resize(result.model.mesh.vertex_count());
    for (std::size_t d = 0; d < carried.driver.size(); ++d)
        carried.vertices[result.model.driver().vertices[d]] = carried.driver[d];
    carried.crack_of_face = std::move(fractured->crack_of_face);
    for (const auto& [i, j] : fractured->cells_of_crack)
        carried.pieces_of_crack.push_back(
            {std::min(cells.piece_of(i), cells.piece_of(j)), std::max(cells.piece_of(i), cells.piece_of(j))});
    return result;
}

Result<Fracture> make_fracture(std::shared_ptr<const Body> body, const std::shared_ptr<const FractureCells>& cells,
                               double scale, const FractureMaterial& material, const RunContext& context,
                               BrokenBodyReport* report) {
    Partition partition{cells->pieces(), [cells, scale](const Vec3d& point) { return cells->piece_at(point / scale); }};
    Result<std::shared_ptr<const BrokenBody>> broken =
        break_body(std::move(body), std::move(partition), context, report);
    if (!broken) return broken.error();
    return Fracture{std::move(*broken), material, {}};
}

double usual_fracture_energy(double strength, double young_modulus, double diagonal) {
    return strength * strength * diagonal / (50 * young_modulus);
}

} // namespace filigree
