#include "figures.h"

namespace filigree::report {

// In the sources by subject: figures_broken, figures_geometry, figures_reference, figures_rendered, figures_scan,
// figures_surfels.
Figure draw_simple_triangle(FigureRenderer& renderer);     // 1.1
Figure draw_wavy_cube(FigureRenderer& renderer);           // 2.1
Figure draw_ray_and_triangle(FigureRenderer& renderer);    // 2.2
Figure draw_border_cases(FigureRenderer& renderer);        // 2.3
Figure draw_shared_points(FigureRenderer& renderer);       // 2.4
Figure draw_inside_points(FigureRenderer& renderer);       // 2.5
Figure draw_removed_level(FigureRenderer& renderer);       // 2.6
Figure draw_barycentric_areas(FigureRenderer& renderer);   // 2.7
Figure draw_recursive_storing(FigureRenderer& renderer);   // 2.8
Figure draw_removed_detail(FigureRenderer& renderer);      // 2.9
Figure draw_deformation_process(FigureRenderer& renderer); // 2.10
Figure draw_extreme_deformation(FigureRenderer& renderer); // 3.1
Figure draw_border_rays(FigureRenderer& renderer);         // our own
Figure draw_fidelity(FigureRenderer& renderer);            // our own
Figure draw_surfels(FigureRenderer& renderer);             // our own
Figure draw_broken_cube(FigureRenderer& renderer);         // our own: the cube that the report's player shoots
Figure draw_remeshed_scan(FigureRenderer& renderer);       // our own: 2.9, 2.10 and 3.1 on a scan

std::span<const FigureEntry> all_figures() {
    // In the report's order. 2.11, the window, belongs behind 2.10.
    static constexpr FigureEntry kFigures[] = {
        {"1.1", draw_simple_triangle, "a simple deformation"},
        {"2.1", draw_wavy_cube, "the object"},
        {"2.2", draw_ray_and_triangle, "ray, plane and triangle"},
        {"2.3", draw_border_cases, "rays on an edge"},
        {"2.4", draw_shared_points, "rays at shared points"},
        {"2.5", draw_inside_points, "points inside"},
        {"2.6", draw_removed_level, "one level removed"},
        {"2.7", draw_barycentric_areas, "barycentric areas"},
        {"2.8", draw_recursive_storing, "recursive storing"},
        {"2.9", draw_removed_detail, "one and three levels removed"},
        {"2.10", draw_deformation_process, "stretched, detail returned"},
        {"3.1", draw_extreme_deformation, "an extreme deformation"},
        {"border", draw_border_rays, "rays through vertices and edges, answered"},
        {"codes", draw_fidelity, "the codes and a wrap deformer compared"},
        {"surfels", draw_surfels, "surfels drawn to particles, and carried"},
        {"broken", draw_broken_cube, "the cube broken by a fall: whole, cracked, apart"},
        {"scan", draw_remeshed_scan, "a scan as regular quads: levels, stretched, twisted"},
    };
    return kFigures;
}

} // namespace filigree::report
