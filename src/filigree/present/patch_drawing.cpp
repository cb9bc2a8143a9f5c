#include "filigree/present/patch_drawing.h"

#include "filigree/present/patch_colors.h"
#include "filigree/render.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr double kRibbon = 0.022;        // a border's half width, of a patch's side
constexpr double kWidestRibbon = 0.0011; // the same, of the diagonal: large patches have no thicker lines
constexpr double kLift = 0.6;            // of a ribbon's width, above the surface: quads are not flat

/// Unit normals of the vertices, zero where they have none.
std::vector<Vec3d> vertex_normals(const Mesh& mesh) {
    std::vector<Vec3d> normals(mesh.vertex_count(), Vec3d::Zero());
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        const std::span<const Index> face = mesh.face(f);
        if (face.size() != 4) continue;
        const auto at = [&](std::size_t k) { return Vec3d(mesh.positions[face[k]].cast<double>()); };
        const Vec3d twice_area = (at(2) - at(0)).cross(at(3) - at(1));
        for (const Index v : face) normals[v] += twice_area;
    }
    for (Vec3d& n : normals) n.normalize();
    return normals;
}

double total_area(const Mesh& mesh) {
    double area = 0;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        const std::span<const Index> face = mesh.face(f);
        const auto at = [&](std::size_t k) { return Vec3d(mesh.positions[face[k]].cast<double>()); };
        for (std::size_t k = 2; k < face.size(); ++k) area += 0.5 * (at(k - 1) - at(0)).cross(at(k) - at(0)).norm();
    }
    return area;
}

double ribbon_width(const Mesh& mesh, const RegularPatches& patches) {
    const double side = std::sqrt(total_area(mesh) / double(std::max<std::size_t>(1, patches.patch_count())));
    return std::min(kRibbon * side, kWidestRibbon * bounds(mesh).diagonal());
}

/// Vertex k, counted along side `side` of a patch, `rows` rows inwards.
Index along_side(const RegularPatches& patches, std::size_t patch, unsigned side, std::size_t k, std::size_t rows) {
    const std::size_t n = patches.side();
    switch (side) {
    case 0:
        return patches.at(patch, k, rows);
    case 1:
        return patches.at(patch, n - rows, k);
    case 2:
        return patches.at(patch, n - k, n - rows);
    default:
        return patches.at(patch, rows, n - k);
    }
}

} // namespace

Mesh colored_patches(const Mesh& mesh, const RegularPatches& patches) {
    const std::vector<Index> colors = choose_patch_colors(patches);
    const std::size_t n = patches.side(), stride = n + 1;
    Mesh drawn;
    drawn.origin = mesh.origin;
    for (std::size_t p = 0; p < patches.patch_count(); ++p) {
        const std::size_t first = drawn.positions.size();
        for (std::size_t k = 0; k < stride * stride; ++k) {
            drawn.positions.push_back(mesh.positions[patches.grid[p * stride * stride + k]]);
            const Vec3f& color = category_colors()[colors[p]];
            drawn.colors.emplace_back(color.x(), color.y(), color.z(), 1.0f);
        }
        const auto id = [&](std::size_t i, std::size_t j) { return static_cast<Index>(first + j * stride + i); };
        for (std::size_t j = 0; j < n; ++j)
            for (std::size_t i = 0; i < n; ++i)
                drawn.add_face(std::array{id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)});
    }
    return drawn;
}

Mesh border_ribbons(const Mesh& mesh, const RegularPatches& patches, double width) {
    const std::vector<Vec3d> normals = vertex_normals(mesh);
    Mesh ribbons;
    ribbons.origin = mesh.origin;
    const auto point = [&](Index border, Index inner) { // towards the next row, and at the border itself
        const Vec3d at = mesh.positions[border].cast<double>(), away = mesh.positions[inner].cast<double>() - at;
        const double length = away.norm(), reach = length > 0 ? std::min(0.45, width / length) : 0;
        const Vec3d lift = kLift * width * normals[border];
        ribbons.positions.push_back((at + lift).cast<float>());
        ribbons.positions.push_back((at + reach * away + lift).cast<float>());
    };
    for (std::size_t p = 0; p < patches.patch_count(); ++p)
        for (unsigned side = 0; side < 4; ++side) {
            const auto first = static_cast<Index>(ribbons.positions.size());
            for (std::size_t k = 0; k <= patches.side(); ++k)
                point(along_side(patches, p, side, k, 0), along_side(patches, p, side, k, 1));
            for (Index k = 0; k < patches.side(); ++k) {
                const Index a = first + 2 * k;
                ribbons.add_face(std::array{a, a + 2, a + 3, a + 1});
            }
        }
    return ribbons;
}

PatchDrawing::PatchDrawing(Drawable surface, Drawable borders, float line_width)
    : surface_(std::move(surface)), borders_(std::move(borders)) {
    surface_look_.edges = line_width > 0;
    surface_look_.edge_width = line_width;
    surface_look_.edge_color = {0.30f, 0.32f, 0.36f};
    surface_look_.gloss = 0.3f;
    border_look_.color = {0.13f, 0.14f, 0.17f};
    border_look_.gloss = 0;
}

Result<PatchDrawing> PatchDrawing::create(const Mesh& mesh, const RegularPatches& patches, float line_width,
                                          const RunContext& context) {
    if (std::optional<Error> error = mesh_error(mesh)) return *error;
    Result<Drawable> surface = Drawable::surface(colored_patches(mesh, patches), {}, context);
    if (!surface) return surface.error();
    const double width = ribbon_width(mesh, patches);
    Result<Drawable> borders = Drawable::surface(border_ribbons(mesh, patches, width), {}, context);
    if (!borders) return borders.error();
    return PatchDrawing(std::move(*surface), std::move(*borders), line_width);
}

void PatchDrawing::add_to(Scene& scene) const {
    scene.objects.push_back({&surface_, surface_look_});
    scene.objects.push_back({&borders_, border_look_});
}

} // namespace filigree
