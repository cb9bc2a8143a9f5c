#include "filigree/io/model/model_code.h"

#include "filigree/levels/vertex_order.h"
#include "filigree/mesh/measured_surface.h"
#include "filigree/pack/clip_code.h"
#include "filigree/pack/driver_code.h"
#include "filigree/pack/mesh_code.h"
#include "filigree/pack/mesh_levels.h"
#include "filigree/restore.h"
#include "filigree/strip.h"

#include <ranges>

namespace filigree {

namespace {

std::string frames_of(const SectionReader& in, std::string_view name, std::uint32_t index = 0) {
    const std::vector<char> bytes = in.array<char>(name, index);
    return {bytes.begin(), bytes.end()};
}

Level driver_of(const SectionReader& in, const FileCode& code) {
    const std::size_t among = is_made_elsewhere(in) ? code.driver_vertices : code.vertices;
    std::optional<DriverFaces> driver =
        decode_driver(frames_of(in, "cd.drv"), {code.driver_vertices, code.driver_faces, code.driver_corners, among});
    if (!driver) throw FileDamage{"has a damaged driver"};
    Level level;
    level.vertices = std::move(driver->vertices);
    level.face_offsets = std::move(driver->face_offsets);
    level.corners = std::move(driver->corners);
    return level;
}

/// The driver's vertices first and in their order, so that they ascend; then the others.
Mesh with_driver_first(Mesh mesh, Level& driver, const RunContext& context) {
    std::vector<bool> is_driver(mesh.vertex_count());
    for (const Index v : driver.vertices) is_driver[v] = true;
    std::vector<Index> order = driver.vertices;
    for (Index v = 0; v < mesh.vertex_count(); ++v)
        if (!is_driver[v]) order.push_back(v);
    for (Index i = 0; i < driver.vertices.size(); ++i) driver.vertices[i] = i;
    return with_vertex_order(std::move(mesh), order, context);
}

/// The order in which a reader has the vertices: as with_driver_first makes it. coded: which vertex each coded one is.
std::vector<Index> order_as_read(std::span<const Index> coded, std::span<const Index> driver) {
    std::vector<bool> is_driver(coded.size());
    std::vector<Index> order(driver.begin(), driver.end());
    for (const Index v : driver) is_driver[v] = true;
    for (const Index v : coded)
        if (!is_driver[v]) order.push_back(v);
    return order;
}

/// Whether the mesh's faces use none of the driver's vertices, though there are faces in both, and these do not stand
/// behind the mesh's own: nothing says how the two belong together.
bool is_driver_apart(const Model& model) {
    if (model.driver_is_behind || model.mesh.face_count() == 0 || model.driver().face_count() == 0) return false;
    std::vector<bool> is_used(model.mesh.vertex_count());
    for (const Index v : model.mesh.corners) is_used[v] = true;
    return std::ranges::none_of(model.driver().vertices, [&](Index v) { return is_used[v]; });
}

/// A mesh and a driver that was made elsewhere, bound anew.
Model bind_elsewhere(const SectionReader& in, Mesh mesh, const FileCode& code, const RunContext& context) {
    const Level level = driver_of(in, code);
    if (!std::ranges::equal(level.vertices, std::views::iota(Index{0}, Index(level.vertices.size()))))
        throw FileDamage{"has a damaged driver"};
    Mesh driver;
    driver.origin = mesh.origin;
    driver.positions = in.array<Vec3f>("cd.dpos");
    driver.face_offsets = level.face_offsets;
    driver.corners = level.corners;
    if (!std::ranges::all_of(driver.positions, [](const Vec3f& p) { return p.allFinite(); }))
        throw FileDamage{"has a damaged driver"};
    Result<Stripped> bound = strip_to_driver(std::move(mesh), driver, context);
    if (!bound) throw bound.error();
    return std::move(bound->model);
}

constexpr double kClipShare = 0.45;     // of the error of restored vertices: that of each of a pose's numbers
constexpr double kGradientReach = 0.01; // of the diagonal: how far vertices lie from their driver, about

/// The most frames of a block, with the one at rest: as many as are 2^25 numbers, but at least 8.
std::size_t most_clip_frames(std::size_t numbers_a_frame) {
    constexpr std::size_t kClipNumbers = std::size_t{1} << 25;
    return std::clamp<std::size_t>(kClipNumbers / std::max<std::size_t>(numbers_a_frame, 1), 8, kClipFrames);
}

std::vector<float> clip_numbers(std::span<const Vec3f> positions, std::span<const Mat3f> gradients,
                                std::size_t numbers) {
    std::vector<float> values;
    for (std::size_t v = 0; v < positions.size(); ++v) {
        values.insert(values.end(), positions[v].data(), positions[v].data() + 3);
        if (numbers == 3) continue;
        const Mat3f gradient = gradients.empty() ? Mat3f::Identity() : gradients[v];
        values.insert(values.end(), gradient.data(), gradient.data() + 9);
    }
    return values;
}

/// With gradients, as a page's decoder does not estimate them.
PoseSequence with_gradients(const Model& model, const PoseSequence& poses, const RunContext& context) {
    if (!poses.frames[0].gradients.empty()) return poses;
    const Result<Restorer> restorer = Restorer::create(model, {.level = 0}, context);
    if (!restorer) throw restorer.error();
    PoseSequence filled = poses;
    for (Pose& pose : filled.frames) {
        Result<std::vector<Mat3f>> gradients = restorer->gradients(pose, context);
        if (!gradients) throw gradients.error();
        pose.gradients = std::move(*gradients);
    }
    return filled;
}

/// The faces as fans from their first corners, as they are coded: quads that are not flat have two surfaces.
Mesh as_fans(const Mesh& mesh) {
    Mesh fans;
    fans.positions = mesh.positions;
    fans.origin = mesh.origin;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        const auto face = mesh.face(f);
        for (std::size_t k = 1; k + 1 < face.size(); ++k) fans.add_face(std::array{face[0], face[k], face[k + 1]});
    }
    return fans;
}

/// How far the surface of every beginning of a stream is off; the last one's is that of all of it.
std::vector<FileLevel> levels_of(const PackedMesh& coded, const Mesh& mesh, const RunContext& context) {
    const LevelCodeOptions options = level_options(coded.options);
    LevelReader reader(options.steps, options.is_refined, kNoIndex);
    constexpr std::size_t kSamples = 20'000;
    const Mesh fans = as_fans(mesh);
    std::optional<MeasuredSurface> whole; // its tree serves all levels
    if (fans.face_count() > 0)
        if (Result<MeasuredSurface> made = MeasuredSurface::create(fans, kSamples, context)) whole = std::move(*made);
    std::vector<FileLevel> levels;
    const auto add = [&](std::uint32_t vertices, std::uint32_t triangles, std::uint32_t batches) {
        float error = 0;
        if (const Mesh level = mesh_of_levels(reader, coded); whole && level.face_count() > 0)
            if (const Result<SurfaceDistance> distance = whole->distance_of(level, context))
                error = static_cast<float>(distance->rms_distance);
        levels.push_back({vertices, triangles, batches, error});
    };
    const PackedLevels& code = coded.levels;
    reader.read_coarsest(code.connectivity, code.places, code.attributes);
    add(code.vertices, code.triangles, 0);
    for (const PackedLevel& level : code.levels) {
        reader.read_level(level.splits, level.batches);
        add(level.vertices, level.triangles, level.batches);
    }
    if (!options.is_refined || code.levels.empty()) return levels;
    for (const PackedLevel& level : code.levels) reader.refine_level(level.refinement);
    add(code.levels.back().vertices, code.levels.back().triangles, 0);
    return levels;
}

} // namespace

void code_clips(const Model& model, const PoseSequence& poses, double error, PackedModel& coded) {
    const Level& driver = model.driver();
    const ClipOrder order = clip_order(driver.face_offsets, driver.corners, driver.vertices.size());
    coded.clip = {static_cast<std::uint32_t>(poses.frames.size()), poses.frames[0].gradients.empty() ? 3u : 12u};
    coded.frames_per_second = poses.frames_per_second;
    const std::size_t numbers = coded.clip.numbers;
    const double diagonal = world_bounds(model.mesh).diagonal(), unit = diagonal > 0 ? diagonal : 1;
    std::vector<double> weights(numbers, kGradientReach * unit);
    std::fill_n(weights.begin(), 3, 1.0);
    const std::vector<float> rest = clip_numbers(driver_positions(model), {}, numbers);
    const std::size_t block = most_clip_frames(rest.size()) - 1;
    for (std::size_t begin = 0; begin < poses.frames.size(); begin += block) {
        ClipFrames frames = {rest};
        for (std::size_t f = begin; f < std::min(begin + block, poses.frames.size()); ++f)
            frames.push_back(clip_numbers(poses.frames[f].positions, poses.frames[f].gradients, numbers));
        coded.clips.push_back(encode_clip(frames, weights, kClipShare * error * unit, order));
        coded.report.bytes.clips += coded.clips.back().size();
    }
}

Result<PackedModel> code_model(const Model& model, const PoseSequence& poses, const PackOptions& options,
                               const RunContext& context) {
    const bool elsewhere = model.driver_is_behind;
    if (!(options.clip_error > 0 && options.clip_error <= 1))
        return Error{ErrorCode::usage, "clip_error must be above 0 and at most 1: it is a fraction of the diagonal."};
    if (elsewhere && options.levels)
        return Error{ErrorCode::unsuitable, "The model was stripped to a driver made elsewhere, and streams need one "
                                            "of the mesh's own vertices; the other profiles take it."};
    if (is_driver_apart(model))
        return Error{ErrorCode::unsuitable, "The mesh's faces use none of the driver's vertices, and these do not "
                                            "stand behind the mesh's own; the profile lossless takes such a model."};
    const Mesh source = level_mesh(model, model.finest_level());
    PackedModel coded;
    PackedMeshReport report;
    Result<PackedMesh> mesh = pack_mesh(source, options, &report, context);
    if (!mesh) return mesh.error();
    coded.mesh = std::move(*mesh);
    if (options.levels) coded.levels = levels_of(coded.mesh, source, context);
    const Level& driver = model.driver();
    if (elsewhere) coded.driver_positions = driver_positions(model);
    // Which coded vertex each of the mesh's is, or each of the driver's own.
    std::vector<Index> place(elsewhere ? driver.vertices.size() : source.vertex_count());
    for (Index i = 0; i < place.size(); ++i) place[options.keep_order || elsewhere ? i : report.vertex[i]] = i;
    std::vector<Index> driver_places;
    for (const Index v : driver.vertices) driver_places.push_back(place[elsewhere ? v - driver.vertices.front() : v]);
    coded.driver = encode_driver(driver.face_offsets, driver.corners, driver_places, place.size());
    coded.code = {.vertices = coded.mesh.vertices,
                  .faces = coded.mesh.faces,
                  .corners = coded.mesh.corners,
                  .low = coded.mesh.low,
                  .step = coded.mesh.step,
                  .bits = options.bits,
                  .surface = options.surface,
                  .keep_order = options.keep_order,
                  .unused = 0,
                  .driver_vertices = driver.vertices.size(),
                  .driver_faces = driver.face_count(),
                  .driver_corners = driver.corners.size()};
    coded.report = {.rms = report.rms,
                    .largest = report.largest,
                    .out_of_reach = report.out_of_reach,
                    .bytes = {coded.mesh.connectivity.size(), coded.mesh.places.size(), coded.mesh.attributes.size(),
                              coded.mesh.order.size(),
                              coded.driver.size() + sizeof(Vec3f) * coded.driver_positions.size()}};
    if (!options.keep_order)
        coded.report.vertex_order = elsewhere ? report.vertex : order_as_read(report.vertex, driver.vertices);
    if (!poses.empty())
        code_clips(model, options.levels ? with_gradients(model, poses, context) : poses, options.clip_error, coded);
    for (const PackedLevel& level : coded.mesh.levels.levels) {
        coded.report.bytes.levels += level.splits.size();
        coded.report.bytes.refinements += level.refinement.size();
    }
    coded.report.bytes.levels += coded.mesh.levels.connectivity.size() + coded.mesh.levels.places.size();
    coded.report.bytes.attributes += coded.mesh.levels.attributes.size();
    coded.report.lacks_level_attributes = options.levels && coded.mesh.levels.attributes.empty() &&
                                          (!source.uvs.empty() || !source.colors.empty() || !source.materials.empty());
    return coded;
}

void write_model_code(SectionWriter& out, const PackedModel& coded) {
    out.value("cd.rev", coded.mesh.levels.attributes.empty() ? kCodeRevision : kRevisionWithAttributes);
    out.value("cd.par", coded.code);
    out.array("cd.stm", coded.levels);
    const PackedLevels& levels = coded.mesh.levels;
    if (!coded.levels.empty()) { // what is wanted first comes first
        out.bytes("cd.bcon", levels.connectivity, 0);
        out.bytes("cd.bpos", levels.places, 0);
        if (!levels.attributes.empty()) out.bytes("cd.batt", levels.attributes, 0);
    }
    out.bytes("cd.drv", coded.driver, 0);
    if (!coded.driver_positions.empty()) out.array("cd.dpos", coded.driver_positions);
    if (!coded.clips.empty()) {
        out.value("pose.fps", coded.frames_per_second);
        out.value("cd.pose", coded.clip);
    }
    for (std::uint32_t k = 0; k < coded.clips.size(); ++k) out.bytes("cd.clip", coded.clips[k], k);
    for (std::uint32_t k = 0; k < levels.levels.size(); ++k) out.bytes("cd.lev", levels.levels[k].splits, k + 1);
}

void write_end_of_code(SectionWriter& out, const PackedModel& coded) {
    const PackedLevels& levels = coded.mesh.levels;
    for (std::uint32_t k = 0; k < levels.levels.size(); ++k)
        if (!levels.levels[k].refinement.empty()) out.bytes("cd.ref", levels.levels[k].refinement, k + 1);
    out.bytes("cd.con", coded.mesh.connectivity, 0);
    out.bytes("cd.pos", coded.mesh.places, 0);
    out.bytes("cd.att", coded.mesh.attributes, 0);
    if (!coded.mesh.order.empty()) out.bytes("cd.ord", coded.mesh.order, 0);
}

bool is_coded(const SectionReader& in) { return in.count("cd.par").first > 0; }
bool is_made_elsewhere(const SectionReader& in) { return in.count("cd.dpos").first > 0; }

double unpacked_bytes(const FileCode& code) {
    const double vertices = double(code.vertices) + double(code.driver_vertices);
    const double faces = double(code.faces) + double(code.driver_faces);
    const double corners = double(code.corners) + double(code.driver_corners);
    return sizeof(Vec3f) * vertices + sizeof(Index) * (faces + corners);
}

double unpacked_bytes(const FileClip& clip, const FileCode& code) {
    return double(clip.frames) * double(code.driver_vertices) * double(clip.numbers) * sizeof(float);
}

FileCode read_file_code(const SectionReader& in) {
    const auto revision = in.count("cd.rev").first == 0 ? 0 : in.value<std::uint32_t>("cd.rev");
    if (revision != kCodeRevision && revision != kRevisionWithAttributes)
        throw FileDamage{"was packed by another version of filigree", "pack its source again"};
    const auto code = in.value<FileCode>("cd.par");
    const std::uint64_t most_driver = is_made_elsewhere(in) ? in.item_count<Vec3f>("cd.dpos") : code.vertices;
    if (code.bits > 16 || code.driver_vertices == 0 || code.driver_vertices > most_driver ||
        (is_made_elsewhere(in) && code.driver_vertices != most_driver) || code.vertices >= kNoIndex)
        throw FileDamage{"has packed parts that make no sense"};
    in.require_room(unpacked_bytes(code));
    return code;
}

FileClip clip_of(const SectionReader& in) {
    if (in.count("cd.pose").first == 0) return {};
    const auto clip = in.value<FileClip>("cd.pose");
    if (clip.numbers != 3 && clip.numbers != 12) throw FileDamage{"has poses that make no sense"};
    in.require_room(unpacked_bytes(clip, in.value<FileCode>("cd.par")));
    return clip;
}

PoseSequence read_clips(const SectionReader& in) {
    PoseSequence poses;
    const FileClip clip = clip_of(in);
    if (clip.frames == 0) return poses;
    const FileDamage damage{"has damaged poses", "pack it again"};
    poses.frames_per_second = in.value<double>("pose.fps");
    const Level driver = driver_of(in, read_file_code(in));
    const ClipOrder order = clip_order(driver.face_offsets, driver.corners, driver.vertices.size());
    const std::size_t most_frames = most_clip_frames(driver.vertices.size() * clip.numbers);
    for (std::uint32_t k = 0; poses.frames.size() < clip.frames; ++k) {
        const std::optional<ClipFrames> frames =
            decode_clip(frames_of(in, "cd.clip", k), clip.numbers, order, most_frames);
        if (!frames || frames->size() < 2 || poses.frames.size() + frames->size() - 1 > clip.frames) throw damage;
        for (std::size_t f = 1; f < frames->size(); ++f) {
            Pose& pose = poses.frames.emplace_back();
            for (const float* v = (*frames)[f].data(); v < (*frames)[f].data() + (*frames)[f].size();
                 v += clip.numbers) {
                pose.positions.emplace_back(v[0], v[1], v[2]);
                if (clip.numbers == 12) pose.gradients.push_back(Eigen::Map<const Mat3f>(v + 3));
            }
        }
    }
    return poses;
}

PackedMesh coded_outline(const SectionReader& in, const FileCode& code) {
    return {.vertices = code.vertices,
            .faces = code.faces,
            .corners = code.corners,
            .low = code.low,
            .step = code.step,
            .options = {code.bits, code.surface != 0, code.keep_order != 0, in.count("cd.stm").first > 0}};
}

Packing coding_of(const SectionReader& in, const FileCode& code) {
    const std::vector<FileLevel> table = in.array<FileLevel>("cd.stm");
    std::vector<PackedLevelMark> levels;
    std::uint64_t level_bytes = in.item_count<char>("cd.bcon") + in.item_count<char>("cd.bpos"), refinements = 0;
    std::uint64_t clips = 0;
    const std::uint64_t attributes = in.item_count<char>("cd.att") + in.item_count<char>("cd.batt");
    for (std::uint32_t k = 0; k < in.count("cd.clip").first; ++k) clips += in.item_count<char>("cd.clip", k);
    for (std::uint32_t k = 0; k < table.size(); ++k) {
        level_bytes += in.item_count<char>("cd.lev", k);
        refinements += in.item_count<char>("cd.ref", k);
        const bool is_refinement = k > 0 && table[k].batches == 0;
        const std::uint64_t end = k == 0          ? std::max(in.end_of("cd.bpos"), in.end_of("cd.batt"))
                                  : is_refinement ? in.end_of("cd.ref", k - 1)
                                                  : in.end_of("cd.lev", k);
        levels.push_back({table[k].vertices, table[k].error, end});
    }
    return {.options = coded_outline(in, code).options,
            .step = code.step,
            .bytes = {in.item_count<char>("cd.con"), in.item_count<char>("cd.pos"), attributes,
                      in.item_count<char>("cd.ord"),
                      in.item_count<char>("cd.drv") + sizeof(Vec3f) * in.item_count<Vec3f>("cd.dpos"), level_bytes,
                      refinements, clips},
            .levels = std::move(levels)};
}

PackedLevels read_levels(const SectionReader& in) {
    const std::vector<FileLevel> table = in.array<FileLevel>("cd.stm");
    PackedLevels levels;
    if (table.empty()) return levels;
    if (table.size() > 64) throw FileDamage{"has more levels than make sense"};
    levels.vertices = table[0].vertices;
    levels.triangles = table[0].triangles;
    levels.connectivity = frames_of(in, "cd.bcon");
    levels.places = frames_of(in, "cd.bpos");
    levels.attributes = frames_of(in, "cd.batt");
    for (std::uint32_t k = 1; k < table.size() && table[k].batches > 0; ++k)
        levels.levels.push_back({.batches = table[k].batches,
                                 .vertices = table[k].vertices,
                                 .triangles = table[k].triangles,
                                 .splits = frames_of(in, "cd.lev", k),
                                 .refinement = frames_of(in, "cd.ref", k)});
    return levels;
}

Model read_model_code(const SectionReader& in, Mesh rest, const RunContext& context) {
    const FileCode code = read_file_code(in);
    in.require_room(unpacked_bytes(code) + double(rest.scalars.size()) * double(code.vertices) * sizeof(float));
    PackedMesh coded = coded_outline(in, code);
    coded.connectivity = frames_of(in, "cd.con");
    coded.places = frames_of(in, "cd.pos");
    coded.attributes = frames_of(in, "cd.att");
    coded.order = frames_of(in, "cd.ord");
    coded.levels = read_levels(in);
    coded.rest = std::move(rest);
    Result<Mesh> mesh = unpack_mesh(coded, context);
    if (!mesh && mesh.error().code == ErrorCode::cancelled) throw mesh.error();
    if (!mesh) throw FileDamage{"holds a packed mesh that is damaged", "pack it again"};
    if (is_made_elsewhere(in)) return bind_elsewhere(in, std::move(*mesh), code, context);
    Level driver = driver_of(in, code);
    if (code.keep_order && !std::ranges::is_sorted(driver.vertices)) throw FileDamage{"has a damaged driver"};
    if (!code.keep_order) *mesh = with_driver_first(std::move(*mesh), driver, context);
    Result<Model> model = bind_to_own_driver(std::move(*mesh), std::move(driver), context);
    if (!model) throw model.error();
    return std::move(*model);
}

} // namespace filigree
