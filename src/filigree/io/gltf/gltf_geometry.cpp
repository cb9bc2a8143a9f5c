// The vertices of a glTF primitive: attributes, influences of joints, morph targets.
#include "filigree/core/math.h"
#include "filigree/core/srgb.h"
#include "filigree/io/gltf/gltf_scene.h"
#include "filigree/io/mesh/mesh_formats.h"
#include "filigree/io/system/text_scanner.h"

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
    GeometryReader(Document& document, const Value& primitive, const std::set<std::size_t>& uv_sets,
                   std::vector<std::string>& warnings, AttributeNotes& notes)
        : document_(document), primitive_(primitive), attributes_(primitive["attributes"]), uv_sets_(uv_sets),
          warnings_(warnings), notes_(notes) {}

    Geometry read() {
        refuse_compressed();
        read_positions();
        read_normals();
        for (const std::size_t set : uv_sets_) read_uvs(set);
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

    /// An attribute that the mesh can do without; none, with a note, where its numbers are of another kind.
    std::optional<Accessor> optional_attribute(const std::string& name, const Wanted& wanted) {
        const Value reference = attributes_[name];
        if (!reference) return {};
        if (document_.serves(reference, wanted)) return attribute(reference, wanted);
        notes_.unsuited.insert(name);
        return {};
    }

    /// Integers that should be normalized, and are not said to be.
    void mend(Accessor& accessor, const std::string& name) {
        Accessor* const one[] = {&accessor};
        note(mend_unflagged(one), name);
    }

    void note(Unflagged done, const std::string& name) {
        if (done == Unflagged::as_normalized) notes_.as_normalized.insert(name);
        if (done == Unflagged::as_they_are) notes_.as_they_are.insert(name);
    }

    void read_normals() {
        std::optional<Accessor> accessor =
            optional_attribute("NORMAL", {.types = {"VEC3"}, .components = components()});
        if (!accessor) return;
        mend(*accessor, "NORMAL");
        geometry_.normals.resize(count_);
        accessor->read_all(geometry_.normals.front().data());
        warn_mended(zero_not_finite(geometry_.normals), "normals", attributes_["NORMAL"]);
    }

    void read_uvs(std::size_t set) {
        const std::string name = "TEXCOORD_" + std::to_string(set);
        std::optional<Accessor> accessor = optional_attribute(name, {.types = {"VEC2"}, .components = components()});
        if (!accessor) return;
        if (!is_quantized()) mend(*accessor, name);
        std::vector<Vec2f>& uvs = geometry_.uvs[set];
        uvs.resize(count_);
        accessor->read_all(uvs.front().data());
        warn_mended(zero_not_finite(uvs), "UVs", attributes_[name]);
    }

    /// Whether UVs may be integers that are not normalized, which a texture's transform brings to their size.
    bool is_quantized() const {
        const Value used = document_.root()["extensionsUsed"];
        for (std::size_t e = 0; e < used.size(); ++e)
            if (used[e].text() == "KHR_mesh_quantization") return true;
        return false;
    }

    void read_colors() {
        std::optional<Accessor> accessor =
            optional_attribute("COLOR_0", {.types = {"VEC3", "VEC4"}, .components = components()});
        if (!accessor) return;
        mend(*accessor, "COLOR_0");
        geometry_.colors_have_alpha = accessor->width == 4;
        geometry_.colors.reserve(count_);
        const double full = full_color(*accessor);
        std::size_t mended = 0;
        for (std::size_t v = 0; v < count_; ++v) {
            double rgba[4] = {0, 0, 0, 1};
            accessor->read(v, rgba);
            if (!std::all_of(rgba, rgba + 4, [](double c) { return std::isfinite(c); })) {
                std::fill(rgba, rgba + 4, 0.0);
                ++mended;
            }
            Vec4f& color = geometry_.colors.emplace_back();
            for (int k = 0; k < 3; ++k) color[k] = static_cast<float>(srgb_from_linear(rgba[k] / full));
            color[3] = static_cast<float>(std::clamp(accessor->width == 4 ? rgba[3] / full : 1, 0.0, 1.0));
        }
        warn_mended(mended, "colours", attributes_["COLOR_0"]);
    }

    /// What stands for a full colour: 1, or 255 where floats are whole numbers beyond 1.
    double full_color(const Accessor& accessor) {
        constexpr double kBytes = 255;
        double rgba[4], largest = 0;
        bool whole = accessor.component == Component::float32;
        for (std::size_t v = 0; v < count_; ++v) {
            accessor.read(v, rgba);
            for (std::size_t k = 0; k < accessor.width; ++k) {
                whole = whole && rgba[k] == std::floor(rgba[k]);
                if (std::isfinite(rgba[k])) largest = std::max(largest, rgba[k]);
            }
        }
        if (largest <= 1) return 1;
        const bool bytes = whole && largest <= kBytes;
        warnings_.push_back(attributes_["COLOR_0"].path() +
                            (bytes ? ": goes beyond 1 and was taken as 0 to 255." : ": what is beyond 1 became 1."));
        return bytes ? kBytes : 1;
    }

    /// Numbers under names of their own become scalars. TANGENT follows from the rest.
    void read_other(const std::string& name) {
        if (name == "POSITION" || name == "NORMAL" || name == "TANGENT" || name == "COLOR_0" ||
            name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_"))
            return;
        if (std::any_of(uv_sets_.begin(), uv_sets_.end(),
                        [&](std::size_t set) { return name == "TEXCOORD_" + std::to_string(set); }))
            return;
        const Value reference = attributes_[name];
        const std::size_t number = reference.index(document_.count("accessors"), "accessors");
        if (name.size() < 2 || name[0] != '_' || document_.item("accessors", number)["type"].text() != "SCALAR") {
            notes_.left_out.insert(name);
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
            if (!joints && !weights) break;
            if (!joints) weights.fail("has no joints beside it.");
            if (!weights) joints.fail("has no weights beside it.");
            sets.push_back({joint_numbers(joints, "JOINTS_" + number),
                            attribute(weights, {.types = {"VEC4"}, .components = components()})});
        }
        std::vector<Accessor*> weights; // together, as the smaller ones of a vertex may be 0 and 1 of 255
        for (InfluenceSet& set : sets) weights.push_back(&set.weights);
        note(mend_unflagged(weights), "WEIGHTS_0");
        return sets;
    }

    /// Joints are whole numbers, in whatever type.
    Accessor joint_numbers(const Value& reference, const std::string& name) {
        Accessor joints = attribute(reference, {.types = {"VEC4"}, .components = components(true)});
        const bool usual = joints.component == Component::uint8 || joints.component == Component::uint16;
        if (!usual || joints.normalized) notes_.whole_numbers.insert(name);
        joints.normalized = false;
        return joints;
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
            if (!(joints[k] >= 0 && joints[k] < kNoIndex && joints[k] == std::floor(joints[k])))
                primitive_.fail("vertex " + std::to_string(vertex) + " has a joint that is no whole number from 0 up.");
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
            if (target.normals) mend(*target.normals, "NORMAL");
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
    const std::set<std::size_t>& uv_sets_;
    std::vector<std::string>& warnings_;
    AttributeNotes& notes_;
    Geometry geometry_;
    std::size_t count_ = 0;
};

} // namespace

Unflagged mend_unflagged(std::span<Accessor* const> accessors) {
    bool any = false;
    double largest = 0, numbers[16];
    for (const Accessor* accessor : accessors) {
        if (accessor->component == Component::float32 || accessor->normalized) continue;
        any = true;
        for (std::size_t i = 0; i < accessor->count; ++i) {
            accessor->read(i, numbers);
            for (std::size_t k = 0; k < accessor->width; ++k) largest = std::max(largest, std::abs(numbers[k]));
        }
    }
    if (!any) return Unflagged::none;
    if (largest <= 1) return Unflagged::as_they_are;
    for (Accessor* accessor : accessors) accessor->normalized = accessor->component != Component::float32;
    return Unflagged::as_normalized;
}

Vec2f UvUse::apply(const Vec2f& uv) const {
    if (*this == UvUse{.set = set}) return {uv.x(), 1 - uv.y()};
    const double x = scale[0] * uv.x(), y = scale[1] * uv.y(), c = math::cos(rotation), s = math::sin(rotation);
    return {static_cast<float>(offset[0] + c * x + s * y), static_cast<float>(1 - (offset[1] - s * x + c * y))};
}

Geometry read_geometry(Document& document, const Value& primitive, const std::set<std::size_t>& uv_sets,
                       std::vector<std::string>& warnings, AttributeNotes& notes) {
    return GeometryReader(document, primitive, uv_sets, warnings, notes).read();
}

} // namespace filigree::gltf
