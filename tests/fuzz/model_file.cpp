// Readers of models, plain and coded: the outline, every level, the poses and the whole. What the whole says, the parts
// say. Checksums are mended first, or no change would get past them.
#include "fuzz.h"
#include "model_sums.h"

#include "filigree/io/model/model_chunks.h"
#include "filigree/io/model/model_file.h"
#include "filigree/io/model/model_sections.h"
#include "filigree/io/model/reference_file.h"
#include "filigree/io/system/file.h"
#include "filigree/mesh.h"
#include "filigree/restore.h"
#include "filigree/strip.h"

#include <filesystem>

#include <unistd.h>

using namespace filigree_fuzz;

namespace {

std::string coded_file(const Model& model, const PackOptions& options) {
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("fuzz-" + std::to_string(::getpid()) + ".fil");
    std::string bytes;
    if (pack_model(model, {}, options, path, kContext)) {
        const Result<FileReader> file = FileReader::open(path);
        bytes = file->read_all().value();
    }
    std::filesystem::remove(path);
    return bytes;
}

std::string lossless_file(const Model& model, const PoseSequence& poses) {
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("fuzz-" + std::to_string(::getpid()) + ".fil");
    std::string bytes;
    if (pack_model_lossless(model, poses, path, kContext)) bytes = FileReader::open(path)->read_all().value();
    std::filesystem::remove(path);
    return bytes;
}

} // namespace

namespace filigree_fuzz {

std::vector<std::string> seeds() {
    const Mesh mesh = make_wavy_sphere({.resolution = 3});
    std::vector<std::string> all;
    const Model model = strip(mesh, {.base = 12}, kContext).value().model;
    all.push_back(write_model(model));
    PoseSequence poses;
    poses.frames = {rest_pose(model), rest_pose(model)};
    all.push_back(write_model(model, poses));
    all.push_back(lossless_file(model, poses));
    all.push_back(coded_file(model, {}));
    all.push_back(coded_file(model, {.bits = 10, .surface = true, .keep_order = true}));
    all.push_back(coded_file(model, {.levels = true}));
    const Mesh cube = make_wavy_cube({.resolution = 4});
    all.push_back(write_reference_model(strip_to_reference(cube, {}, kContext).value()));
    all.push_back(write_model(strip(cube, {.base = 20, .reorder = true}, kContext).value().model));
    Mesh painted = mesh; // two materials, a texture and colours, in levels
    painted.materials.names = {"a", "b"};
    for (std::size_t f = 0; f < mesh.face_count(); ++f) painted.materials.of_face.push_back(f < mesh.face_count() / 2);
    for (const Vec3f& p : mesh.positions) {
        painted.uvs.values.emplace_back(p[0], p[1]);
        painted.colors.emplace_back(0.5f, std::abs(p[2]), 0.0f, 1.0f);
    }
    all.push_back(coded_file(strip(painted, {.base = 12}, kContext).value().model, {.levels = true}));
    return all;
}

} // namespace filigree_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string bytes = with_sums(std::string(reinterpret_cast<const char*>(data), size));
    const FileReader file{std::string_view(bytes)};
    const Result<ModelOutline> outline = read_model_outline(file, "fuzz", kContext);
    const Result<Model> model = read_model(file, "fuzz", kContext);
    const Result<PoseSequence> poses = read_poses(file, "fuzz", kContext);
    is_sound(poses);
    if (is_sound(outline))
        for (unsigned k = 0; k < outline->levels.size() + 1; ++k) {
            const Result<Mesh> level = read_model_level(file, k, "fuzz", kContext);
            if (is_sound(level)) require(check_mesh(*level).empty(), "a level is a sound mesh");
        }
    is_sound(ModelChunks::open(FileReader(std::string_view(bytes)), "fuzz", kContext));
    if (const Result<ReferenceModel> reference = read_reference_model(file, "fuzz", kContext); is_sound(reference)) {
        require(check_model(*reference).empty(), "what was read is a sound model");
        is_sound(restore_reference(*reference, driver_positions(*reference), {}, kContext));
    }
    if (!is_sound(model)) return 0;
    require(check_model(*model).empty(), "what was read is a sound model");
    if (!outline.ok()) { // it looks for the poses, which the model can do without
        require(!poses.ok(), outline.error().message.c_str());
        return 0;
    }
    require(outline->levels.size() == model->levels.size() + 1, "the outline has the model's levels");
    for (unsigned k = 0; k < outline->levels.size(); ++k)
        require(outline->levels[k].vertices == level_counts(*model, k).vertices,
                "the outline has the levels' vertices");
    const Result<Restorer> restorer = Restorer::create(*model, {}, kContext);
    if (is_sound(restorer)) is_sound(restorer->positions(rest_pose(*model), kContext));
    return 0;
}
