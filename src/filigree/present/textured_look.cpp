#include "filigree/present/textured_look.h"

#include "filigree/core/srgb.h"
#include "filigree/io/mesh/material_file.h"
#include "filigree/io/system/file.h"
#include "filigree/mesh.h"
#include "filigree/render/surface_materials.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

namespace filigree {

namespace {

constexpr int kMostParts = 64; // that a triangle's sides are divided into, for places

/// A picture, and halves of it in linear light.
class Pyramid {
public:
    explicit Pyramid(const Picture& picture) {
        levels_.push_back(picture);
        while (levels_.back().width > 1 || levels_.back().height > 1) levels_.push_back(half(levels_.back()));
    }

    unsigned width() const { return levels_.front().width; }
    unsigned height() const { return levels_.front().height; }

    /// Linear light around a place of the picture, which repeats; uv: v upwards. texels: how wide around.
    Vec3f at(const Vec2f& uv, double texels) const {
        const auto level =
            std::size_t(std::clamp(std::lround(std::log2(std::max(texels, 1.0))), 0L, long(levels_.size() - 1)));
        const Picture& picture = levels_[level];
        const double x = wrapped(uv.x()) * picture.width - 0.5, y = wrapped(1 - double(uv.y())) * picture.height - 0.5;
        const double left = std::floor(x), top = std::floor(y);
        Vec3f sum = Vec3f::Zero();
        for (int k = 0; k < 4; ++k) {
            const double across = k & 1 ? x - left : 1 - (x - left), down = k & 2 ? y - top : 1 - (y - top);
            sum += float(across * down) * linear(picture, long(left) + (k & 1), long(top) + (k >> 1));
        }
        return sum;
    }

private:
    static double wrapped(double t) { return t - std::floor(t); }
    static const std::array<float, 256>& table() {
        static const std::array<float, 256> kLinear = [] {
            std::array<float, 256> values{};
            for (std::size_t i = 0; i < 256; ++i) values[i] = float(linear_from_srgb(double(i) / 255));
            return values;
        }();
        return kLinear;
    }
    static Vec3f linear(const Picture& picture, long x, long y) {
        const long width = long(picture.width), height = long(picture.height);
        const std::uint8_t* rgb = picture.pixel(unsigned((x + width) % width), unsigned((y + height) % height));
        return {table()[rgb[0]], table()[rgb[1]], table()[rgb[2]]};
    }
    static Picture half(const Picture& picture) {
        Picture small(std::max(1u, picture.width / 2), std::max(1u, picture.height / 2));
        for (unsigned y = 0; y < small.height; ++y)
            for (unsigned x = 0; x < small.width; ++x) {
                Vec3f sum = Vec3f::Zero();
                for (int k = 0; k < 4; ++k) sum += linear(picture, 2 * long(x) + (k & 1), 2 * long(y) + (k >> 1));
                for (int c = 0; c < 3; ++c)
                    small.pixel(x, y)[c] = std::uint8_t(std::lround(255 * srgb_from_linear(double(sum[c]) / 4)));
            }
        return small;
    }

    std::vector<Picture> levels_;
};

/// What is seen on a triangle of a mesh.
class TriangleLook {
public:
    TriangleLook(const Mesh& mesh, const Vec3f& plain, const SurfaceMaterials& materials)
        : mesh_(mesh), plain_(linear(plain)) {
        std::map<const Picture*, std::shared_ptr<const Pyramid>> known;
        for (const SurfaceMaterial& material : materials.materials) {
            colors_.push_back(linear(material.color));
            std::shared_ptr<const Pyramid> pyramid;
            if (material.picture) {
                pyramid = known[material.picture];
                if (!pyramid) pyramid = known[material.picture] = std::make_shared<Pyramid>(*material.picture);
            }
            pictures_.push_back(std::move(pyramid));
        }
    }

    void go_to(const Triangle& corners, Index face) {
        const Index material = mesh_.materials.of_face[face];
        const bool has_material = material != kNoIndex;
        color_ = has_material ? colors_[material] : plain_;
        picture_ = has_material ? pictures_[material].get() : nullptr;
        for (std::size_t k = 0; k < 3 && picture_; ++k) {
            const Index uv = uv_of(face, corners[k]);
            if (uv == kNoIndex) picture_ = nullptr;
            if (uv != kNoIndex) uvs_[k] = mesh_.uvs.values[uv];
        }
        const auto at = [&](std::size_t k) { return mesh_.positions[corners[k]]; };
        const double area = double((at(1) - at(0)).cross(at(2) - at(0)).norm());
        if (!picture_) return;
        const Vec2f a = uvs_[1] - uvs_[0], b = uvs_[2] - uvs_[0];
        const double texels = std::abs(double(a.x() * b.y() - a.y() * b.x())) * picture_->width() * picture_->height();
        density_ = area > 0 ? std::sqrt(texels / area) : 1;
    }

    /// Linear light, RGB, around a place of it; width: of what lies around, model units.
    Vec3f at(const Vec3f& weights, double width) const {
        if (!picture_) return color_;
        const Vec2f uv = weights[0] * uvs_[0] + weights[1] * uvs_[1] + weights[2] * uvs_[2];
        return color_.cwiseProduct(picture_->at(uv, width * density_));
    }

private:
    static Vec3f linear(const Vec3f& color) {
        return color.unaryExpr([](float c) { return float(linear_from_srgb(double(c))); });
    }
    Index uv_of(Index face, Index vertex) const {
        if (mesh_.uvs.per_vertex()) return vertex;
        for (Index c = mesh_.face_offsets[face]; c < mesh_.face_offsets[face + 1]; ++c)
            if (mesh_.corners[c] == vertex) return mesh_.uvs.corners[c];
        return kNoIndex;
    }

    const Mesh& mesh_;
    Vec3f plain_, color_ = Vec3f::Ones();
    std::vector<Vec3f> colors_;
    std::vector<std::shared_ptr<const Pyramid>> pictures_;
    const Pyramid* picture_ = nullptr;
    std::array<Vec2f, 3> uvs_;
    double density_ = 1; ///< texels a model unit
};

Vec4f seen(const Vec3f& linear) {
    const Vec3f color = linear.unaryExpr([](float c) { return float(srgb_from_linear(double(c))); });
    return {color[0], color[1], color[2], 1};
}

} // namespace

Result<BodyLook> textured_look(const Mesh& mesh, const std::string& mesh_path, double spacing, const Vec3f& plain,
                               std::vector<std::string>& warnings, const RunContext& context) {
    if (std::optional<Error> error = mesh_error(mesh)) return *error;
    BodyLook look;
    if (mesh.materials.empty() || !mesh.colors.empty()) return look;
    const SurfaceMaterials loaded = load_surface_materials(mesh, path_of(mesh_path));
    warnings.insert(warnings.end(), loaded.warnings.begin(), loaded.warnings.end());
    look.materials = read_materials_and_pictures(mesh, path_of(mesh_path)).materials; // load_surface_materials warned
    const Result<Triangulation> triangles = triangulate(mesh, context);
    if (!triangles) return triangles.error();
    TriangleLook triangle(mesh, plain, loaded);
    std::vector<Vec3f> sums(mesh.vertex_count(), Vec3f::Zero());
    std::vector<float> counts(mesh.vertex_count(), 0);
    for (std::size_t t = 0; t < triangles->triangles.size(); ++t) {
        if (t % 1024 == 0 && context.is_cancelled()) return cancelled_error();
        const Triangle& corners = triangles->triangles[t];
        triangle.go_to(corners, triangles->source_face[t]);
        const std::array<Vec3f, 3> at = {mesh.positions[corners[0]], mesh.positions[corners[1]],
                                         mesh.positions[corners[2]]};
        double longest = 0;
        for (std::size_t k = 0; k < 3; ++k) longest = std::max(longest, double((at[k] - at[(k + 1) % 3]).norm()));
        for (int k = 0; k < 3; ++k) {
            sums[corners[std::size_t(k)]] += triangle.at(Vec3f::Unit(k), std::min(0.5 * longest, spacing));
            ++counts[corners[std::size_t(k)]];
        }
        // The middles of its parts: those that stand as it does, and those that are turned over.
        const int parts = int(std::clamp(std::ceil(longest / spacing), 1.0, double(kMostParts)));
        for (int i = 0; i < parts; ++i)
            for (int j = 0; i + j < parts; ++j)
                for (int turned = 0; turned < (i + j + 1 < parts ? 2 : 1); ++turned) {
                    const float third = turned ? 2.0f / 3 : 1.0f / 3;
                    const float b = (float(i) + third) / float(parts), c = (float(j) + third) / float(parts);
                    const Vec3f weights(1 - b - c, b, c);
                    look.places.push_back(weights[0] * at[0] + weights[1] * at[1] + weights[2] * at[2]);
                    look.place_colors.push_back(seen(triangle.at(weights, std::min(longest / parts, spacing))));
                }
    }
    for (std::size_t v = 0; v < sums.size(); ++v)
        look.vertex_colors.push_back(counts[v] > 0 ? seen(sums[v] / counts[v])
                                                   : Vec4f(plain[0], plain[1], plain[2], 1));
    return look;
}

DrawnSurface melt_as_drawn(const Mesh& surface, std::span<const SurfaceMaterial> materials) {
    std::vector<Vec3f> colors;
    for (const SurfaceMaterial& material : materials) colors.push_back(material.color);
    return colors.empty() ? DrawnSurface{surface, {}} : with_materials_apart(surface, colors);
}

Result<std::vector<BodyLook>> looks_of(const ReadyScene& ready, std::vector<std::string>& warnings,
                                       const RunContext& context) {
    std::vector<BodyLook> looks;
    for (const ReadyBody& body : ready.bodies) {
        looks.emplace_back();
        if (body.body->material.model != MaterialModel::mpm || !body.has_own_color) continue;
        Result<BodyLook> look = textured_look(level_mesh(body.model, body.model.finest_level()), body.mesh_path,
                                              0.5 * body.body->spacing() / body.scale, body.color, warnings, context);
        if (!look) return look.error();
        looks.back() = std::move(*look);
    }
    return looks;
}

} // namespace filigree
