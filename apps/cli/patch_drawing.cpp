// Based on:
// [Ottosson 2020] OKLab, so that the patches' colours are equally light.
#include "patch_drawing.h"

#include "session.h"

#include "filigree/core/srgb.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace filigree::cli {

namespace {

constexpr double kLightness = 0.80, kChroma = 0.095; // of OKLab: as colourful as sRGB is at every hue
constexpr std::size_t kCandidates = 8;               // hues a patch chooses from
constexpr double kRibbon = 0.022;                    // a border's half width, of a patch's side
constexpr double kWidestRibbon = 0.0011;             // the same, of the diagonal: large patches have no thicker lines
constexpr double kLift = 0.6;                        // of a ribbon's width, above the surface: quads are not flat

/// sRGB of a hue, 0 to 1, at the lightness and chroma of all patches.
Vec3f color_of_hue(double hue) {
    const double a = kChroma * std::cos(2 * std::numbers::pi * hue), b = kChroma * std::sin(2 * std::numbers::pi * hue);
    const auto cubed = [](double x) { return x * x * x; };
    const double l = cubed(kLightness + 0.3963377774 * a + 0.2158037573 * b);
    const double m = cubed(kLightness - 0.1055613458 * a - 0.0638541728 * b);
    const double s = cubed(kLightness - 0.0894841775 * a - 1.2914855480 * b);
    const Vec3d linear(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
                       -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
                       -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s);
    return linear.unaryExpr([](double x) { return srgb_from_linear(x); }).cast<float>();
}

/// How far two hues are from each other, 0 to 0.5.
double hue_distance(double a, double b) {
    const double d = std::abs(a - b);
    return std::min(d, 1 - d);
}

/// The patches at each vertex that is a patch's corner.
std::map<Index, std::vector<std::size_t>> patches_at_corners(const RegularPatches& patches) {
    std::map<Index, std::vector<std::size_t>> at;
    for (std::size_t p = 0; p < patches.patch_count(); ++p)
        for (const Index corner : patches.base[p]) at[corner].push_back(p);
    return at;
}

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
    return std::min(kRibbon * side, kWidestRibbon * bounds(mesh.positions).diagonal());
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

std::vector<Vec3f> patch_colors(const RegularPatches& patches) {
    const std::map<Index, std::vector<std::size_t>> at_corners = patches_at_corners(patches);
    std::vector<double> hues(patches.patch_count(), -1);
    std::vector<Vec3f> colors;
    colors.reserve(hues.size());
    std::size_t step = 0;
    const auto next_hue = [&step] { return std::fmod(double(step++) / std::numbers::phi, 1.0); };
    for (std::size_t p = 0; p < hues.size(); ++p) {
        double best = 0, best_distance = -1;
        for (std::size_t candidate = 0; candidate < kCandidates; ++candidate) {
            const double hue = next_hue();
            double nearest = 1;
            for (const Index corner : patches.base[p])
                for (const std::size_t neighbour : at_corners.at(corner))
                    if (hues[neighbour] >= 0) nearest = std::min(nearest, hue_distance(hue, hues[neighbour]));
            if (nearest > best_distance) {
                best = hue;
                best_distance = nearest;
            }
        }
        hues[p] = best;
        colors.push_back(color_of_hue(best));
    }
    return colors;
}

Mesh colored_patches(const Mesh& mesh, const RegularPatches& patches) {
    const std::vector<Vec3f> colors = patch_colors(patches);
    const std::size_t n = patches.side(), stride = n + 1;
    Mesh drawn;
    drawn.origin = mesh.origin;
    for (std::size_t p = 0; p < patches.patch_count(); ++p) {
        const std::size_t first = drawn.positions.size();
        for (std::size_t k = 0; k < stride * stride; ++k) {
            drawn.positions.push_back(mesh.positions[patches.grid[p * stride * stride + k]]);
            drawn.colors.emplace_back(colors[p].x(), colors[p].y(), colors[p].z(), 1.0f);
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

PatchDrawing::PatchDrawing(const Mesh& mesh, const RegularPatches& patches, float line_width, const RunContext& context)
    : surface_(require(Drawable::surface(colored_patches(mesh, patches), {}, context))),
      borders_(require(Drawable::surface(border_ribbons(mesh, patches, ribbon_width(mesh, patches)), {}, context))) {
    surface_look_.edges = line_width > 0;
    surface_look_.edge_width = line_width;
    surface_look_.edge_color = {0.30f, 0.32f, 0.36f};
    surface_look_.gloss = 0.3f;
    border_look_.color = {0.13f, 0.14f, 0.17f};
    border_look_.gloss = 0;
}

void PatchDrawing::add_to(Scene& scene) const {
    scene.objects.push_back({&surface_, surface_look_});
    scene.objects.push_back({&borders_, border_look_});
}

} // namespace filigree::cli
