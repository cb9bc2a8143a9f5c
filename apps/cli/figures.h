// The report's figures, drawn by the program from what it computes.
#pragma once

#include "page.h"
#include "session.h"

#include "filigree/render/camera.h"
#include "filigree/render/renderer.h"

#include <memory>
#include <optional>

namespace filigree::cli {

class Stage;
struct Panel;

/// A figure, and the numbers in it.
struct Figure {
    Page page;
    Json values;
};

/// Draws meshes for figures; OpenGL starts with the first of them.
class FigureRenderer {
public:
    /// scale: pixels for each page unit. passes: as in PictureOptions. scan: what figures of scans show, z up; none: a
    /// shape of our own.
    FigureRenderer(Session& session, double scale, unsigned passes, std::optional<Mesh> scan);
    ~FigureRenderer();

    struct Look {
        SurfaceOptions surface = {};
        Appearance appearance = {};
        std::optional<double> ground_level = {}; ///< unset: the mesh stands on it
    };
    /// A picture of a scene on white, `width` x `height` page units large. z is up.
    Picture picture(Scene scene, const Camera& camera, double width, double height);
    /// OpenGL has to be there before something is made to be drawn.
    void start();
    /// A picture on white, `width` x `height` page units large. z is up.
    Picture picture(const Mesh& mesh, const Look& look, const Camera& camera, double width, double height);

    const RunContext& context() const { return session_.context(); }
    const std::optional<Mesh>& scan() const { return scan_; }
    /// A line's width in pixels.
    float pixels(double page_units) const { return static_cast<float>(scale_ * page_units); }

private:
    Session& session_;
    double scale_;
    unsigned passes_;
    std::optional<Mesh> scan_;
    std::unique_ptr<Stage> stage_;
};

/// Flat faces with their edges drawn, in page units.
FigureRenderer::Look with_edges(float width);
/// The camera from which all of the meshes fill a panel.
Camera common_camera(std::span<const Mesh* const> meshes, const Vec3d& direction, const Panel& panel);
/// A mesh's picture in a panel.
void draw_mesh(Page& page, const Panel& panel, FigureRenderer& renderer, const Mesh& mesh,
               const FigureRenderer::Look& look, const Camera& camera);

// One function a figure, in the report's order.
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
Figure draw_remeshed_scan(FigureRenderer& renderer);       // our own: 2.9, 2.10 and 3.1 on a scan

} // namespace filigree::cli
