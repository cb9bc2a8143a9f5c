// Nodes, skins and animations of a glTF file.
#include "filigree/io/gltf/gltf_scene.h"
#include "filigree/io/system/text_scanner.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace filigree::gltf {

namespace {

constexpr std::size_t kMatrixNumbers = 16;
constexpr double kUnitTolerance = 1e-3; // of a rotation; beyond it is worth a warning

bool is_affine(const double* columns) {
    constexpr double kTolerance = 1e-5; // exporters round
    return std::abs(columns[3]) <= kTolerance && std::abs(columns[7]) <= kTolerance &&
           std::abs(columns[11]) <= kTolerance && std::abs(columns[15] - 1) <= kTolerance;
}

Affine affine_of(const double* columns) {
    Affine affine;
    for (int c = 0; c < 3; ++c) affine.linear.col(c) = Vec3d(columns[4 * c], columns[4 * c + 1], columns[4 * c + 2]);
    affine.translation = Vec3d(columns[12], columns[13], columns[14]);
    return affine;
}

class NodeReader {
public:
    explicit NodeReader(Scene& scene) : scene_(scene), document_(*scene.document), count_(document_.count("nodes")) {}

    void read() {
        scene_.nodes.resize(count_);
        for (std::size_t n = 0; n < count_; ++n) scene_.nodes[n].parent = n;
        for (std::size_t n = 0; n < count_; ++n) read_node(n);
        sort();
        if (odd_rotations_ > 0)
            scene_.warnings.push_back(std::to_string(odd_rotations_) +
                                      " rotations of nodes are not of unit length and were scaled to it, or taken as "
                                      "none where they are zero.");
    }

private:
    void read_node(std::size_t n) {
        const Value place = document_.item("nodes", n);
        Node& node = scene_.nodes[n];
        if (const Value name = place["name"]; name && name.json().is_string()) node.name = name.text();
        if (const Value mesh = place["mesh"]) node.mesh = mesh.index(document_.count("meshes"), "meshes");
        if (const Value skin = place["skin"]) node.skin = skin.index(document_.count("skins"), "skins");
        const Value children = place["children"];
        for (std::size_t c = 0; c < children.size(); ++c) {
            const std::size_t child = children[c].index(count_, "nodes");
            if (scene_.nodes[child].parent != child || child == n)
                children[c].fail("node " + std::to_string(child) +
                                 (child == n ? " is its own child." : " is a child of two nodes."));
            scene_.nodes[child].parent = n;
            node.children.push_back(child);
        }
        const Value weights = place["weights"];
        for (std::size_t w = 0; w < weights.size(); ++w) node.weights.push_back(weights[w].number());
        read_transform(place, node);
    }

    void read_transform(const Value& place, Node& node) {
        double numbers[16];
        if (place["matrix"].numbers(numbers, 16)) {
            if (!is_affine(numbers)) place["matrix"].fail("has a last row that is not 0 0 0 1.");
            node.matrix = affine_of(numbers);
        }
        if (place["translation"].numbers(numbers, 3)) node.translation = Vec3d(numbers);
        if (place["scale"].numbers(numbers, 3)) node.scale = Vec3d(numbers);
        if (place["rotation"].numbers(numbers, 4)) {
            const Eigen::Quaterniond rotation(numbers[3], numbers[0], numbers[1], numbers[2]);
            const double length = rotation.norm();
            if (!(std::abs(length - 1) <= kUnitTolerance)) ++odd_rotations_;
            if (length > 0 && std::isfinite(length)) node.rotation = rotation.normalized();
        }
    }

    /// Parents before children. What a walk from the roots does not meet is in a circle.
    void sort() {
        std::vector<std::size_t>& order = scene_.order;
        order.reserve(count_);
        for (std::size_t n = 0; n < count_; ++n)
            if (scene_.nodes[n].parent == n) order.push_back(n);
        for (std::size_t next = 0; next < order.size(); ++next) {
            const std::vector<std::size_t>& children = scene_.nodes[order[next]].children;
            order.insert(order.end(), children.begin(), children.end());
        }
        if (order.size() == count_) return;
        std::vector<bool> met(count_, false);
        for (const std::size_t n : order) met[n] = true;
        for (std::size_t n = 0; n < count_; ++n)
            if (!met[n]) document_.item("nodes", n).fail("is among its own descendants.");
    }

    Scene& scene_;
    Document& document_;
    std::size_t count_, odd_rotations_ = 0;
};

std::vector<const char*> output_types(Path path) {
    return {path == Path::rotation ? "VEC4" : path == Path::weights ? "SCALAR" : "VEC3"};
}

class AnimationReader {
public:
    AnimationReader(Scene& scene, std::size_t number)
        : scene_(scene), document_(*scene.document), place_(document_.item("animations", number)) {}

    Animation read() {
        if (const Value name = place_["name"]; name && name.json().is_string()) animation_.summary.name = name.text();
        const Value channels = place_["channels"];
        sampler_of_.resize(place_["samplers"].size());
        for (std::size_t c = 0; c < channels.size(); ++c) read_channel(channels[c]);
        double first = INFINITY, last = 0;
        for (const Sampler& sampler : animation_.samplers) {
            first = std::min(first, sampler.times.scalar(0));
            last = std::max(last, sampler.times.scalar(sampler.times.count - 1));
        }
        animation_.summary.first_key = std::isfinite(first) ? first : 0;
        animation_.summary.last_key = last;
        return std::move(animation_);
    }

    std::size_t pointers() const { return pointers_; }
    std::size_t unflagged() const { return unflagged_; }

private:
    void read_channel(const Value& channel) {
        const Value target = channel["target"], path = target["path"], node = target["node"];
        const std::string name = path.text();
        if (name == "pointer") {
            ++pointers_;
            return;
        }
        if (!node) return; // as the specification wants
        static constexpr std::pair<const char*, Path> kPaths[] = {{"translation", Path::translation},
                                                                  {"rotation", Path::rotation},
                                                                  {"scale", Path::scale},
                                                                  {"weights", Path::weights}};
        const auto* const found =
            std::find_if(std::begin(kPaths), std::end(kPaths), [&](const auto& p) { return name == p.first; });
        if (found == std::end(kPaths)) path.fail("is " + in_quotes(name) + ", which cannot be animated.");
        Channel read;
        read.node = node.index(scene_.nodes.size(), "nodes");
        read.path = found->second;
        std::size_t width = read.path == Path::rotation ? 4 : 3;
        if (read.path == Path::weights) {
            width = target_count(read.node);
            if (width == 0) path.fail("animates weights of a node that has no morph targets.");
        } else if (scene_.nodes[read.node].matrix) {
            node.fail("moves a node that has a matrix; only translation, rotation and scale can be moved.");
        }
        document_.charge(width, path.path());
        read.sampler = sampler(channel["sampler"], read.path, width);
        animation_.channels.push_back(read);
    }

    std::size_t target_count(std::size_t node) const {
        if (!scene_.nodes[node].mesh) return 0;
        const Value primitives = document_.item("meshes", *scene_.nodes[node].mesh)["primitives"];
        return primitives.size() > 0 ? primitives[std::size_t{0}]["targets"].size() : 0;
    }

    /// The sampler's place in animation_.samplers; each is checked for what it moves.
    std::size_t sampler(const Value& reference, Path path, std::size_t width) {
        const std::size_t number = reference.index(sampler_of_.size(), "samplers");
        const auto [entry, is_new] = sampler_of_[number].try_emplace({path, width}, animation_.samplers.size());
        if (!is_new) return entry->second;
        const Value place = place_["samplers"][number];
        Sampler sampler;
        sampler.width = width;
        const std::string how = place["interpolation"].text("LINEAR");
        if (how == "STEP")
            sampler.interpolation = Interpolation::step;
        else if (how == "CUBICSPLINE")
            sampler.interpolation = Interpolation::cubic;
        else if (how != "LINEAR")
            place["interpolation"].fail("is " + in_quotes(how) + ", which is not known.");
        sampler.times = times(place["input"]);
        sampler.values =
            document_.accessor(place["output"], {.types = output_types(path),
                                                 .components = {Component::float32, Component::int8, Component::uint8,
                                                                Component::int16, Component::uint16}});
        if (path == Path::rotation || path == Path::weights) {
            Accessor* const values[] = {&sampler.values};
            if (mend_unflagged(values) == Unflagged::as_normalized) ++unflagged_;
        }
        const std::size_t tangents = sampler.interpolation == Interpolation::cubic ? 3 : 1;
        const std::size_t each = tangents * (path == Path::weights ? width : 1);
        if (sampler.values.count / each != sampler.times.count || sampler.values.count % each != 0)
            place["output"].fail("has " + std::to_string(sampler.values.count) + " elements for " +
                                 std::to_string(sampler.times.count) + " keys of " + std::to_string(each) + ".");
        animation_.samplers.push_back(std::move(sampler));
        return entry->second;
    }

    Accessor times(const Value& reference) {
        Accessor times = document_.accessor(reference, {.types = {"SCALAR"}, .components = {Component::float32}});
        if (!checked_times_.insert(times.path).second) return times;
        document_.charge(times.count, times.path);
        for (std::size_t k = 0; k < times.count; ++k) {
            const double time = times.scalar(k);
            if (!std::isfinite(time))
                throw Damage{times.path + ": key " + std::to_string(k) + " is at no finite time."};
            if (k > 0 && !(time > times.scalar(k - 1)))
                throw Damage{times.path + ": key " + std::to_string(k) + " is not after the one before."};
        }
        return times;
    }

    Scene& scene_;
    Document& document_;
    Value place_;
    Animation animation_;
    std::vector<std::map<std::pair<Path, std::size_t>, std::size_t>> sampler_of_; ///< by path and width
    std::set<std::string> checked_times_;
    std::size_t pointers_ = 0, unflagged_ = 0;
};

} // namespace

void read_nodes(Scene& scene) { NodeReader(scene).read(); }

void read_skins(Scene& scene) {
    Document& document = *scene.document;
    for (std::size_t s = 0; s < document.count("skins"); ++s) {
        const Value place = document.item("skins", s), joints = place["joints"];
        Skin& skin = scene.skins.emplace_back();
        if (joints.size() == 0) joints.fail("has no joints.");
        document.charge(kMatrixNumbers * joints.size(), joints.path());
        for (std::size_t j = 0; j < joints.size(); ++j)
            skin.joints.push_back(joints[j].index(scene.nodes.size(), "nodes"));
        skin.inverse_binds.resize(skin.joints.size());
        const Value binds = place["inverseBindMatrices"];
        if (!binds) continue;
        const Accessor matrices = document.accessor(binds, {.types = {"MAT4"}, .components = {Component::float32}});
        if (matrices.count < skin.joints.size())
            binds.fail("has " + std::to_string(matrices.count) + " matrices for " + std::to_string(skin.joints.size()) +
                       " joints.");
        for (std::size_t j = 0; j < skin.joints.size(); ++j) {
            double columns[kMatrixNumbers];
            matrices.read(j, columns);
            const bool finite =
                std::all_of(columns, columns + kMatrixNumbers, [](double x) { return std::isfinite(x); });
            if (finite && is_affine(columns)) {
                skin.inverse_binds[j] = affine_of(columns);
            } else { // harmless where no vertex has a weight for the joint, which the meshes tell
                skin.damaged.resize(skin.joints.size(), false);
                skin.damaged[j] = true;
            }
        }
    }
}

void read_animations(Scene& scene) {
    std::size_t pointers = 0, unflagged = 0;
    for (std::size_t a = 0; a < scene.document->count("animations"); ++a) {
        AnimationReader reader(scene, a);
        scene.animations.push_back(reader.read());
        scene.summaries.push_back(scene.animations.back().summary);
        pointers += reader.pointers();
        unflagged += reader.unflagged();
    }
    if (unflagged > 0)
        scene.warnings.push_back(std::to_string(unflagged) +
                                 " samplers of animations have integers without \"normalized\"; they were taken as "
                                 "normalized.");
    if (pointers > 0)
        scene.warnings.push_back(std::to_string(pointers) +
                                 " channels animate other things than nodes (KHR_animation_pointer); left out.");
}

} // namespace filigree::gltf
