// The vertices of a glTF primitive: attributes, influences of joints, morph targets.
#include "filigree/core/srgb.h"
#include "filigree/io/gltf_scene.h"
#include "filigree/io/mesh_formats.h"
#include "filigree/io/text_scanner.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace filigree::gltf {

namespace {

constexpr double kSumTolerance = 0.01; // of a vertex's weights; rounded weights are within it

std::vector<Component> components(bool with_uint32 = false) {
    std::vector<Component> all = {Component::float32, Component::int8, Component::uint8, Component::int16,
                                  Component::uint16};
    if (with_uint32) all.push_back(Component::uint32);
    return all;
}

/// Reads the attributes and morph targets of a primitive.
class GeometryReader {
public:
    GeometryReader(Document& document, const Value& primitive, std::vector<std::string>& warnings,
                   std::set<std::string>& left_out)
        : document_(document), primitive_(primitive), attributes_(primitive["attributes"]), warnings_(warnings),
          left_out_(left_out) {}

    Geometry read() {
        refuse_compressed();
        read_positions();
        read_normals();
        read_uvs();
        read_colors();
        for (const std::string& name : attributes_.members()) read_other(name);
        read_influences();
        read_targets();
        geometry_.kept = count_;
        return std::move(geometry_);
    }

private:
    void refuse_compressed() {
        const Value position = attributes_["POSITION"];
        if (!primitive_["extensions"]["KHR_draco_mesh_compression"] || !position) return;
        const std::size_t number = position.index(document_.count("accessors"), "accessors");
        if (!document_.item("accessors", number)["bufferView"])
            primitive_.fail("is compressed with Draco, which is not read; unpack the file with 'gltf-transform copy'.",
                            ErrorCode::unsupported);
    }

    Accessor attribute(const Value& reference, const Wanted& wanted) {
        Accessor accessor = document_.accessor(reference, wanted);
        if (accessor.count != count_)
            reference.fail("has " + std::to_string(accessor.count) + " elements, but there are " +
                           std::to_string(count_) + " positions.");
        document_.charge(accessor.count, reference.path());
        return accessor;
    }

    void read_positions() {
        const Value reference = attributes_["POSITION"];
        const Accessor accessor = document_.accessor(reference, {.types = {"VEC3"}, .components = components()});
        count_ = accessor.count;
        document_.charge(count_, reference.path());
        if (count_ >= kNoIndex)
            reference.fail("has more vertices than 32-bit indices can count.", ErrorCode::unsupported);
        geometry_.positions.resize(count_);
        accessor.read_all(geometry_.positions.front().data());
        for (std::size_t v = 0; v < count_; ++v)
            if (!geometry_.positions[v].allFinite())
                reference.fail("vertex " + std::to_string(v) + " is not at a finite place.");
    }

    void read_normals() {
        const Value reference = attributes_["NORMAL"];
        if (!reference) return;
        geometry_.normals.resize(count_);
        attribute(reference, {.types = {"VEC3"}, .components = components()})
            .read_all(geometry_.normals.front().data());
        warn_mended(zero_not_finite(geometry_.normals), "normals", reference);
    }

    void read_uvs() {
        const Value reference = attributes_["TEXCOORD_0"];
        if (!reference) return;
        geometry_.uvs.resize(count_);
        attribute(reference, {.types = {"VEC2"}, .components = components()}).read_all(geometry_.uvs.front().data());
        for (Vec2f& uv : geometry_.uvs) uv.y() = 1 - uv.y();
        warn_mended(zero_not_finite(geometry_.uvs), "UVs", reference);
    }

    void read_colors() {
        const Value reference = attributes_["COLOR_0"];
        if (!reference) return;
        const Accessor accessor =
            attribute(reference, {.types = {"VEC3", "VEC4"},
                                  .components = {Component::float32, Component::uint8, Component::uint16},
                                  .normalized_if_integer = true});
        geometry_.colors_have_alpha = accessor.width == 4;
        geometry_.colors.reserve(count_);
        std::size_t mended = 0;
        for (std::size_t v = 0; v < count_; ++v) {
            double rgba[4] = {0, 0, 0, 1};
            accessor.read(v, rgba);
            if (!std::all_of(rgba, rgba + 4, [](double c) { return std::isfinite(c); })) {
                std::fill(rgba, rgba + 4, 0.0);
                ++mended;
            }
            Vec4f& color = geometry_.colors.emplace_back();
            for (int k = 0; k < 3; ++k) color[k] = static_cast<float>(srgb_from_linear(rgba[k]));
            color[3] = static_cast<float>(std::clamp(rgba[3], 0.0, 1.0));
        }
        warn_mended(mended, "colours", reference);
    }

    /// Numbers under names of their own become scalars. TANGENT follows from the rest.
    void read_other(const std::string& name) {
        if (name == "POSITION" || name == "NORMAL" || name == "TANGENT" || name == "TEXCOORD_0" || name == "COLOR_0" ||
            name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_"))
            return;
        const Value reference = attributes_[name];
        const std::size_t number = reference.index(document_.count("accessors"), "accessors");
        if (name.size() < 2 || name[0] != '_' || document_.item("accessors", number)["type"].text() != "SCALAR") {
            left_out_.insert(name);
            return;
        }
        VertexScalar scalar{name.substr(1), std::vector<float>(count_)};
        attribute(reference, {.types = {"SCALAR"}, .components = components(true)}).read_all(scalar.values.data());
        warn_mended(zero_not_finite(scalar.values), "values of the scalar " + in_quotes(scalar.name), reference);
        geometry_.scalars.push_back(std::move(scalar));
    }

    /// Four joints and their weights a vertex.
    struct InfluenceSet {
        Accessor joints, weights;
    };

    std::vector<InfluenceSet> influence_sets() {
        std::vector<InfluenceSet> sets;
        for (std::size_t s = 0;; ++s) {
            const std::string number = std::to_string(s);
            const Value joints = attributes_["JOINTS_" + number], weights = attributes_["WEIGHTS_" + number];
            if (!joints && !weights) return sets;
            if (!joints) weights.fail("has no joints beside it.");
            if (!weights) joints.fail("has no weights beside it.");
            sets.push_back({attribute(joints, {.types = {"VEC4"}, .components = {Component::uint8, Component::uint16}}),
                            attribute(weights, {.types = {"VEC4"},
                                                .components = {Component::float32, Component::uint8, Component::uint16},
                                                .normalized_if_integer = true})});
        }
    }

    /// Adds a vertex's influences of one set. Returns the sum of its weights, added to `sum`.
    double add_influences(const InfluenceSet& set, std::size_t vertex, double sum) {
        Influences& influences = geometry_.influences;
        double joints[4], weights[4];
        set.joints.read(vertex, joints);
        set.weights.read(vertex, weights);
        for (int k = 0; k < 4; ++k) {
            if (!std::isfinite(weights[k]))
                primitive_.fail("vertex " + std::to_string(vertex) + " has a weight that is not finite.");
            if (weights[k] == 0) continue;
            const auto joint = static_cast<Index>(joints[k]);
            influences.joints_used = std::max<std::size_t>(influences.joints_used, joint + std::size_t{1});
            influences.joints.push_back(joint);
            influences.weights.push_back(weights[k]);
            sum += weights[k];
        }
        return sum;
    }

    void read_influences() {
        const std::vector<InfluenceSet> sets = influence_sets();
        if (sets.empty()) return;
        Influences& influences = geometry_.influences;
        influences.first = {0};
        influences.first.reserve(count_ + 1);
        std::size_t odd_sums = 0;
        for (std::size_t v = 0; v < count_; ++v) {
            double sum = 0;
            for (const InfluenceSet& set : sets) sum = add_influences(set, v, sum);
            if (influences.joints.size() >= kNoIndex)
                primitive_.fail("has more weights than 32-bit indices can count.", ErrorCode::unsupported);
            influences.first.push_back(static_cast<Index>(influences.joints.size()));
            if (!(std::abs(sum - 1) <= kSumTolerance)) ++odd_sums;
        }
        if (odd_sums > 0)
            warnings_.push_back(primitive_.path() + ": the weights of " + std::to_string(odd_sums) +
                                " vertices do not add up to 1; they were taken as they are.");
    }

    void read_targets() {
        const Value targets = primitive_["targets"];
        for (std::size_t t = 0; t < targets.size(); ++t) {
            MorphTarget& target = geometry_.targets.emplace_back();
            const auto differences = [&](const char* name, std::optional<Accessor>& accessor) {
                if (const Value reference = targets[t][name])
                    accessor = attribute(reference, {.types = {"VEC3"}, .components = components()});
            };
            differences("POSITION", target.positions);
            differences("NORMAL", target.normals);
        }
    }

    void warn_mended(std::size_t count, const std::string& what, const Value& where) {
        if (count > 0)
            warnings_.push_back(where.path() + ": " + std::to_string(count) + " " + what +
                                " were not finite and became zero.");
    }

    Document& document_;
    const Value& primitive_;
    Value attributes_;
    std::vector<std::string>& warnings_;
    std::set<std::string>& left_out_;
    Geometry geometry_;
    std::size_t count_ = 0;
};

} // namespace

Geometry read_geometry(Document& document, const Value& primitive, std::vector<std::string>& warnings,
                       std::set<std::string>& left_out) {
    return GeometryReader(document, primitive, warnings, left_out).read();
}

} // namespace filigree::gltf
