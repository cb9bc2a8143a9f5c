#include "filigree/io/gltf/gltf.h"
#include "filigree/io/gltf/gltf_scene.h"
#include "filigree/io/mesh/mesh_formats.h"
#include "filigree/io/system/file.h"

#include <atomic>
#include <new>
#include <stdexcept>

namespace filigree {

namespace {

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

/// Extensions that a file may require: what they say of a mesh is read, or is nothing of a mesh (lights, notes).
bool is_supported(const std::string& extension) {
    static constexpr std::string_view kKnown[] = {"KHR_mesh_quantization",
                                                  "KHR_texture_transform",
                                                  "KHR_materials_pbrSpecularGlossiness",
                                                  "KHR_materials_unlit",
                                                  "KHR_lights_punctual",
                                                  "KHR_xmp",
                                                  "KHR_xmp_json_ld",
                                                  "MSFT_lod"};
    return std::find(std::begin(kKnown), std::end(kKnown), extension) != std::end(kKnown);
}

/// What to do about another one.
std::string advice_on(const std::string& extension) {
    constexpr std::size_t kLongestName = 64;
    const std::string the_extension = "the extension " + in_quotes(extension, kLongestName);
    if (extension == "KHR_draco_mesh_compression" || extension.ends_with("_meshopt_compression"))
        return extension + " (compressed data) is not read; unpack the file with 'gltf-transform copy'.";
    if (extension.find("_texture_") != std::string::npos)
        return the_extension + " is required and not read; export the file with pictures in PNG or JPEG.";
    if (extension.starts_with("KHR_materials_"))
        return the_extension + " is required and not read; export the file with plain materials.";
    return the_extension + " is not known; export the file without it.";
}

void check_extensions(gltf::Scene& scene) {
    using gltf::Value;
    const Value required = scene.document->root()["extensionsRequired"];
    for (std::size_t e = 0; e < required.size(); ++e) {
        const std::string name = required[e].text();
        if (!is_supported(name)) required[e].fail(advice_on(name), ErrorCode::unsupported);
    }
    const Value used = scene.document->root()["extensionsUsed"];
    for (std::size_t e = 0; e < used.size(); ++e)
        if (used[e].text() == "EXT_mesh_gpu_instancing")
            scene.warnings.push_back("Instances of EXT_mesh_gpu_instancing are left out; nodes are read once each.");
}

void read_export_report(gltf::Scene& scene) {
    const gltf::Value extras = scene.document->root()["asset"]["extras"];
    if (!extras || !extras.json().is_object()) return;
    if (const gltf::Value report = extras["filigree"]) scene.export_report = report.json().dump(-1, ' ', true);
}

/// A damaged file can have one for each of its parts.
void shorten(std::vector<std::string>& warnings) {
    constexpr std::size_t kMost = 20;
    if (warnings.size() <= kMost) return;
    const std::size_t more = warnings.size() - kMost;
    warnings.resize(kMost);
    warnings.push_back("There are " + std::to_string(more) + " more warnings of this kind.");
}

void place_rest(gltf::Scene& scene, const RunContext& context) {
    Mesh& mesh = scene.mesh;
    std::vector<Vec3d> world(mesh.positions.size());
    const gltf::ScenePose pose = gltf::rest_pose(scene);
    gltf::place_vertices(scene, pose, context, [&](std::size_t first, std::span<const Vec3d> positions) {
        std::copy(positions.begin(), positions.end(), world.begin() + static_cast<std::ptrdiff_t>(first));
    });
    if (context.is_cancelled()) throw gltf::Damage{"", ErrorCode::cancelled};
    for (std::size_t v = 0; v < world.size(); ++v)
        if (!(world[v].allFinite() && fits_float(world[v].cwiseAbs().maxCoeff())))
            throw gltf::Damage{"its nodes carry vertex " + std::to_string(v) +
                               " to no place that 32-bit float can hold."};
    split_origin(world, mesh);
    if (!mesh.normals.empty()) mesh.normals.values = gltf::turned_normals(scene, pose, context);
}

std::filesystem::path folder_of(const std::string& name) {
    const std::filesystem::path folder = path_of(name).parent_path();
    return folder.empty() ? "." : folder;
}

} // namespace

Status gltf::read_scene(std::string_view bytes, Scene& scene, const RunContext& context) {
    try {
        if (bytes.starts_with(kByteOrderMark)) bytes.remove_prefix(kByteOrderMark.size());
        if (context.is_cancelled()) return cancelled_error();
        scene.document = std::make_unique<gltf::Document>(bytes, folder_of(scene.name), path_of(scene.name));
        check_extensions(scene);
        gltf::read_nodes(scene);
        gltf::read_skins(scene);
        gltf::read_animations(scene);
        gltf::read_meshes(scene, context);
        place_rest(scene, context);
        if (context.is_cancelled()) return cancelled_error();
        read_export_report(scene);
        scene.files_beside = scene.document->files_beside();
        shorten(scene.warnings);
    } catch (const gltf::Damage& damage) {
        if (damage.code == ErrorCode::cancelled) return cancelled_error();
        return Error{damage.code, scene.name + ": " + damage.what};
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, scene.name + ": does not fit into memory."};
    } catch (const std::length_error&) {
        return Error{ErrorCode::out_of_memory, scene.name + ": does not fit into memory."};
    }
    return Success{};
}

struct GltfScene::Scene : gltf::Scene {};

GltfScene::GltfScene(std::unique_ptr<Scene> scene) : scene_(std::move(scene)) {}
GltfScene::GltfScene(GltfScene&&) noexcept = default;
GltfScene& GltfScene::operator=(GltfScene&&) noexcept = default;
GltfScene::~GltfScene() = default;

Result<GltfScene> GltfScene::read(const std::filesystem::path& path, const RunContext& context) {
    Result<std::string> bytes = read_file(path);
    if (!bytes) return bytes.error();
    return read(*std::move(bytes), path == "-" ? "standard input" : path.string(), context);
}

Result<GltfScene> GltfScene::read(std::string bytes, const std::string& name, const RunContext& context) {
    auto scene = std::make_unique<Scene>();
    scene->name = name;
    scene->owned = std::move(bytes);
    if (Status read = gltf::read_scene(scene->owned, *scene, context); !read) return read.error();
    return GltfScene(std::move(scene));
}

Result<GltfScene> GltfScene::read_view(std::string_view bytes, const std::string& name, const RunContext& context) {
    auto scene = std::make_unique<Scene>();
    scene->name = name;
    if (Status read = gltf::read_scene(bytes, *scene, context); !read) return read.error();
    return GltfScene(std::move(scene));
}

const Mesh& GltfScene::mesh() const { return scene_->mesh; }
const std::vector<std::string>& GltfScene::warnings() const { return scene_->warnings; }
const std::vector<GltfAnimation>& GltfScene::animations() const { return scene_->summaries; }
const std::vector<std::string>& GltfScene::files_beside() const { return scene_->files_beside; }
std::size_t GltfScene::joint_count() const {
    std::size_t count = 0;
    for (const gltf::Skin& skin : scene_->skins) count += skin.joints.size();
    return count;
}

std::size_t GltfScene::morph_count() const {
    std::size_t most = 0;
    for (const auto& geometry : scene_->geometries) most = std::max(most, geometry.targets.size());
    return most;
}

const std::string& GltfScene::export_report() const { return scene_->export_report; }

Status GltfScene::positions(std::size_t animation, double seconds, std::span<Vec3f> out,
                            const RunContext& context) const {
    assert(animation < scene_->animations.size() && out.size() == scene_->mesh.vertex_count());
    if (context.is_cancelled()) return cancelled_error();
    const gltf::ScenePose pose = gltf::pose_at(*scene_, scene_->animations[animation], seconds);
    std::atomic<bool> finite = true;
    const Vec3d origin = scene_->mesh.origin;
    gltf::place_vertices(*scene_, pose, context, [&](std::size_t first, std::span<const Vec3d> positions) {
        bool all_finite = true;
        for (std::size_t i = 0; i < positions.size(); ++i) {
            out[first + i] = (positions[i] - origin).cast<float>();
            all_finite = all_finite && out[first + i].allFinite();
        }
        if (!all_finite) finite = false;
    });
    if (context.is_cancelled()) return cancelled_error();
    if (!finite)
        return Error{ErrorCode::bad_file, scene_->name + ": animations[" + std::to_string(animation) +
                                              "]: carries vertices to no place that 32-bit float can hold."};
    return Success{};
}

Result<Mesh> GltfScene::mesh_at(std::size_t animation, double seconds, const RunContext& context) const {
    Mesh mesh = scene_->mesh;
    if (Status placed = positions(animation, seconds, mesh.positions, context); !placed) return placed.error();
    if (!mesh.normals.empty())
        mesh.normals.values =
            gltf::turned_normals(*scene_, gltf::pose_at(*scene_, scene_->animations[animation], seconds), context);
    if (context.is_cancelled()) return cancelled_error();
    return mesh;
}

bool is_gltf(std::string_view bytes) {
    constexpr std::string_view kBlanks = " \t\r\n";
    if (bytes.starts_with("glTF")) return true;
    if (bytes.starts_with(kByteOrderMark)) bytes.remove_prefix(kByteOrderMark.size());
    const std::size_t first = bytes.find_first_not_of(kBlanks);
    return first != std::string_view::npos && bytes[first] == '{';
}

Result<MeshFile> read_gltf(const MeshSource& source) {
    gltf::Scene scene;
    scene.name = source.name;
    if (Status read = gltf::read_scene(source.bytes, scene, source.context); !read) return read.error();
    return MeshFile{std::move(scene.mesh), std::move(scene.warnings)};
}

} // namespace filigree
