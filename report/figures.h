// The report's figures, drawn by the program from what it computes.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"
#include "filigree/present/page.h"
#include "filigree/render.h"

#include <memory>
#include <optional>
#include <span>

#include <nlohmann/json.hpp>

namespace filigree::report {

using Json = nlohmann::ordered_json;

inline constexpr double kFigureWidth = 720; ///< of every figure, page units

/// A point as JSON has it.
inline std::vector<double> listed(const Vec3d& p) { return {p.x(), p.y(), p.z()}; }

struct Panel;

/// A figure, and the numbers in it.
struct Figure {
    Page page;
    Json values;
};

/// Draws meshes for figures; OpenGL starts with the first of them. What it draws throws BadResultAccess where it fails.
class FigureRenderer {
public:
    /// scale: pixels for each page unit. passes: as in PictureOptions. scan: what figures of scans show, z up; none: a
    /// shape of our own.
    FigureRenderer(double scale, unsigned passes, std::optional<Mesh> scan, const RunContext& context);
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

    const RunContext& context() const { return context_; }
    const std::optional<Mesh>& scan() const { return scan_; }
    /// A line's width in pixels.
    float pixels(double page_units) const { return static_cast<float>(scale_ * page_units); }

private:
    struct Graphics; ///< OpenGL and a renderer in it

    double scale_;
    unsigned passes_;
    std::optional<Mesh> scan_;
    const RunContext& context_;
    std::unique_ptr<Graphics> graphics_;
};

/// Flat faces with their edges drawn, in page units.
FigureRenderer::Look with_edges(float width);
/// The camera from which all of the meshes fill a panel.
Camera common_camera(std::span<const Mesh* const> meshes, const Vec3d& direction, const Panel& panel);
/// A mesh's picture in a panel.
void draw_mesh(Page& page, const Panel& panel, FigureRenderer& renderer, const Mesh& mesh,
               const FigureRenderer::Look& look, const Camera& camera);

struct FigureEntry {
    const char* name; ///< the report's number, or a word where it is ours
    Figure (*draw)(FigureRenderer&);
    const char* title;
};

/// In the report's order.
std::span<const FigureEntry> all_figures();

} // namespace filigree::report
