#include "filigree/io/gltf/glb_skeleton.h"

#include "filigree/io/system/file.h"

#include <algorithm>
#include <array>

namespace filigree {

namespace {

using Json = GlbSkeleton::Json;

template <class Numbers>
Json json_list(const Numbers& numbers) {
    Json list = Json::array();
    for (const double x : numbers) list.push_back(float(x));
    return list;
}

const char* name_of(gltf::Path path) {
    return path == gltf::Path::translation ? "translation" : path == gltf::Path::rotation ? "rotation" : "scale";
}
const char* name_of(gltf::Interpolation interpolation) {
    return interpolation == gltf::Interpolation::step     ? "STEP"
           : interpolation == gltf::Interpolation::linear ? "LINEAR"
                                                          : "CUBICSPLINE";
}

} // namespace

Result<GlbSkeleton> GlbSkeleton::read(const std::filesystem::path& path, const RunContext& context) {
    Result<std::string> bytes = read_file(path);
    if (!bytes) return bytes.error();
    auto scene = std::make_shared<gltf::Scene>();
    scene->name = path.string();
    scene->owned = *std::move(bytes);
    if (Status read = gltf::read_scene(scene->owned, *scene, context); !read) return read.error();
    GlbSkeleton skeleton;
    skeleton.scene_ = std::move(scene);
    return skeleton;
}

void GlbSkeleton::add_nodes(GlbBuilder& builder, Json& nodes, Json& roots) {
    first_node_ = nodes.size();
    Json cameras = Json::array();
    for (std::size_t n = 0; n < scene_->nodes.size(); ++n) {
        const gltf::Node& from = scene_->nodes[n];
        Json node = Json::object();
        if (!from.name.empty()) node["name"] = from.name;
        if (from.matrix) {
            std::array<double, 16> columns = {};
            columns[15] = 1;
            for (int column = 0; column < 4; ++column)
                for (int row = 0; row < 3; ++row)
                    columns[std::size_t(4 * column + row)] =
                        column < 3 ? from.matrix->linear(row, column) : from.matrix->translation[row];
            node["matrix"] = json_list(columns);
        } else {
            if (!from.translation.isZero(0)) node["translation"] = json_list(from.translation);
            const Eigen::Vector4d turn = from.rotation.coeffs(); // x, y, z, w
            if (turn != Eigen::Vector4d(0, 0, 0, 1)) node["rotation"] = json_list(turn);
            if (from.scale != Vec3d::Ones()) node["scale"] = json_list(from.scale);
        }
        for (const std::size_t child : from.children) node["children"].push_back(first_node_ + child);
        const gltf::Value camera = scene_->document->item("nodes", n)["camera"];
        if (camera && camera.json().is_number_unsigned() &&
            camera.json().get<std::size_t>() < scene_->document->count("cameras")) {
            node["camera"] = cameras.size();
            cameras.push_back(Json(scene_->document->item("cameras", camera.json().get<std::size_t>()).json()));
        }
        if (from.parent == n) roots.push_back(nodes.size());
        nodes.push_back(std::move(node));
    }
    if (!cameras.empty()) builder.json["cameras"] = std::move(cameras);
}

void GlbSkeleton::add_channels(GlbBuilder& builder, const std::string& name, Json& animation) const {
    std::size_t number = 0;
    for (; number < scene_->animations.size(); ++number) {
        const std::string& own = scene_->animations[number].summary.name;
        if (own.empty() ? name == "clip " + std::to_string(number + 1) : name == own) break;
    }
    if (number == scene_->animations.size()) return;
    const gltf::Animation& from = scene_->animations[number];
    std::vector<std::size_t> sampler_of(from.samplers.size(), from.samplers.size());
    for (const gltf::Channel& channel : from.channels) {
        if (channel.path == gltf::Path::weights) continue;
        if (animation.is_null()) animation = {{"name", name}, {"channels", Json::array()}, {"samplers", Json::array()}};
        Json& samplers = animation["samplers"];
        const gltf::Sampler& sampler = from.samplers[channel.sampler];
        if (sampler_of[channel.sampler] == from.samplers.size()) {
            sampler_of[channel.sampler] = samplers.size();
            std::vector<float> times(sampler.times.count), values(sampler.values.count * sampler.values.width);
            for (std::size_t k = 0; k < times.size(); ++k)
                times[k] = float(std::max(0.0, sampler.times.scalar(k) - from.summary.first_key));
            sampler.values.read_all(values.data());
            const std::size_t input = builder.add_scalars(times, GltfTarget::none, true);
            const std::size_t output =
                builder.add({.type = sampler.values.width == 4 ? "VEC4" : "VEC3", .count = sampler.values.count},
                            bytes_of(std::span<const float>(values)));
            samplers.push_back(
                {{"input", input}, {"output", output}, {"interpolation", name_of(sampler.interpolation)}});
        }
        animation["channels"].push_back(
            {{"sampler", sampler_of[channel.sampler]},
             {"target", {{"node", first_node_ + channel.node}, {"path", name_of(channel.path)}}}});
    }
}

} // namespace filigree
