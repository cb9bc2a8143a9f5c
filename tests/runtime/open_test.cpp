// Opening: what a model has, every status, and every edge.
#include "runtime/opened.h"

#include "filigree/io/model/model_file.h"
#include "filigree/io/model/model_sections.h"
#include "filigree/pack.h"
#include "filigree/reference.h"

#include "runtime/rt_hash.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <unistd.h>

extern "C" std::uint64_t filigree_rt_from_c(const void* bytes, std::size_t size); // uses.c

namespace filigree {
namespace {

using namespace filigree_test;

std::string packed(const std::function<bool(const std::filesystem::path&)>& write) {
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("runtime_test_" + std::to_string(::getpid()) + ".fil");
    EXPECT_TRUE(write(path));
    std::ifstream file(path, std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(file)), {});
    file.close();
    std::filesystem::remove(path);
    return bytes;
}

const Model& cube_model() {
    static const Model model = stripped(make_wavy_cube({.resolution = 12}), {.base = 50}).model;
    return model;
}
const std::string& cube_file() {
    static const std::string bytes = write_model(cube_model());
    return bytes;
}

/// The file with other bytes somewhere, and with sums that fit.
class Forged {
public:
    explicit Forged(std::string bytes) : bytes_(std::move(bytes)) {
        std::memcpy(&header_, bytes_.data(), sizeof header_);
        table_.resize(header_.section_count);
        std::memcpy(table_.data(), bytes_.data() + sizeof header_, table_.size() * sizeof(FileSection));
    }
    FileSection& section(const std::string& name, std::uint32_t index = 0) {
        for (FileSection& section : table_)
            if (name_of(section) == name && section.index == index) return section;
        ADD_FAILURE() << name;
        return table_[0];
    }
    template <class T>
    Forged& set(const std::string& name, std::size_t item, T value, std::uint32_t index = 0) {
        std::memcpy(bytes_.data() + section(name, index).offset + item * sizeof(T), &value, sizeof value);
        return *this;
    }
    Forged& rename(const std::string& name, const std::string& to) {
        FileSection& renamed = section(name);
        std::memset(renamed.name, 0, sizeof renamed.name);
        std::memcpy(renamed.name, to.data(), to.size());
        return *this;
    }
    ModelHeader& header() { return header_; }

    std::string bytes() {
        for (FileSection& section : table_)
            if (section.item_size > 0 && section.offset <= bytes_.size() &&
                section.count <= (bytes_.size() - section.offset) / section.item_size)
                section.hash = XXH3_64bits(bytes_.data() + section.offset, section.count * section.item_size);
        std::memcpy(bytes_.data() + sizeof header_, table_.data(), table_.size() * sizeof(FileSection));
        header_.table_hash = XXH3_64bits(table_.data(), table_.size() * sizeof(FileSection));
        std::memcpy(bytes_.data(), &header_, sizeof header_);
        return bytes_;
    }

private:
    std::string bytes_;
    ModelHeader header_;
    std::vector<FileSection> table_;
};

// ---- What a model has ----

TEST(RuntimeOpen, TellsWhatTheLibraryKnows) {
    for (const auto& [name, model] : models_of_every_kind()) {
        const std::string bytes = write_model(model);
        for (unsigned level = 0; level <= model.finest_level(); ++level) {
            SCOPED_TRACE(name + ", level " + std::to_string(level));
            const Opened opened = open_model(bytes, options_of(0, level));
            const flg_info info = info_of(opened);
            const Mesh mesh = level_mesh(model, level);
            EXPECT_EQ(info.vertices, mesh.vertex_count());
            EXPECT_EQ(info.faces, mesh.face_count());
            EXPECT_EQ(info.levels, model.levels.size() + 1);
            EXPECT_EQ(info.level, level);
            EXPECT_EQ(info.driver_vertices, model.driver().vertices.size());
            EXPECT_EQ(info.driver_triangles, model.driver().face_count());
            EXPECT_EQ(info.frames, 0u);
            EXPECT_EQ(info.frames_per_second, 0);
            EXPECT_EQ(info.has_fit, 1u);
            for (int k = 0; k < 3; ++k) EXPECT_EQ(info.origin[k], model.mesh.origin[k]);
            EXPECT_EQ(info.normal_source, mesh.normals.empty()        ? FLG_NORMALS_COMPUTED
                                          : mesh.normals.per_vertex() ? FLG_NORMALS_VERTEX
                                                                      : FLG_NORMALS_CORNER);
            const std::vector<Vec3f> rest = driver_positions(model);
            EXPECT_EQ(std::memcmp(flg_driver_rest(opened.get()), rest.data(), rest.size() * sizeof(Vec3f)), 0);
            if (info.driver_triangles > 0)
                EXPECT_EQ(std::memcmp(flg_driver_triangles(opened.get()), model.driver().corners.data(),
                                      model.driver().corners.size() * 4),
                          0);
            else
                EXPECT_EQ(flg_driver_triangles(opened.get()), nullptr);
            const std::uint32_t* vertices = flg_level_vertices(opened.get());
            EXPECT_EQ(vertices != nullptr, level < model.finest_level());
            for (std::size_t v = 0; vertices && v < info.vertices; ++v)
                ASSERT_EQ(vertices[v], model.levels[level].vertices[v]);
        }
    }
}

TEST(RuntimeOpen, TrianglesAreFansOfFaces) {
    Mesh mesh = make_wavy_cube({.resolution = 5}); // quads
    mesh.uvs.values = {{0, 0}, {1, 0}, {1, 1}};
    for (std::size_t c = 0; c < mesh.corner_count(); ++c)
        mesh.uvs.corners.push_back(c % 7 == 0 ? kNoIndex : Index(c % 3));
    mesh = with_corner_normals(std::move(mesh));
    const Model model = stripped(mesh, {.base = 20}).model;
    const Opened opened = open_model(write_model(model));
    const flg_info info = info_of(opened);
    ASSERT_EQ(info.triangles, 2 * info.faces);
    std::size_t at = 0;
    for (Index f = 0; f < model.mesh.face_count(); ++f)
        for (std::size_t k = 1; k + 1 < model.mesh.face_size(f); ++k, ++at) {
            EXPECT_EQ(flg_triangle_faces(opened.get())[at], f);
            const std::size_t first = model.mesh.face_offsets[f];
            const std::size_t corners[3] = {first, first + k, first + k + 1};
            for (int j = 0; j < 3; ++j) {
                EXPECT_EQ(flg_triangles(opened.get())[3 * at + j], model.mesh.corners[corners[j]]);
                EXPECT_EQ(flg_triangle_uvs(opened.get())[3 * at + j], model.mesh.uvs.corners[corners[j]]);
            }
        }
    EXPECT_EQ(at, info.triangles);
    Mesh split = model.mesh;
    split_shared_normals(split);
    EXPECT_EQ(flg_triangle_normals(opened.get())[3 * 20 + 2], split.normals.corners[4 * 10 + 2]);
}

TEST(RuntimeOpen, LeavesOutWhatIsNotWanted) {
    const Model model = stripped(with_corner_normals(make_wavy_cube({.resolution = 8})), {.base = 30}).model;
    const std::string bytes = write_model(model);
    const Opened bare = open_model(
        bytes, options_of(FLG_WITHOUT_NORMALS | FLG_WITHOUT_TRIANGLES | FLG_WITHOUT_FIT | FLG_WITHOUT_CHECKSUMS));
    const flg_info info = info_of(bare);
    EXPECT_EQ(info.normal_source, FLG_NORMALS_NONE);
    EXPECT_EQ(info.normals, 0u);
    EXPECT_EQ(info.has_fit, 0u);
    EXPECT_EQ(flg_triangles(bare.get()), nullptr);
    EXPECT_EQ(flg_triangle_normals(bare.get()), nullptr);
    EXPECT_NE(flg_driver_triangles(bare.get()), nullptr);
    Pose pose = random_pose(model, 1);
    EXPECT_EQ(SetPose(bare, without_gradients(pose)).status, FLG_MISSING);
    EXPECT_EQ(flg_gradients(bare.get(), floats(pose.positions), info.driver_vertices, 0, 1, pose.gradients[0].data()),
              FLG_MISSING);
    const SetPose set(bare, pose);
    ASSERT_EQ(set.status, FLG_OK);
    Scratch scratch(bare);
    std::vector<Vec3f> positions(info.vertices), normals(1);
    EXPECT_EQ(flg_restore(bare.get(), set.get(), floats(positions), floats(normals), scratch.get()), FLG_MISSING);
    EXPECT_EQ(flg_restore(bare.get(), set.get(), floats(positions), nullptr, scratch.get()), FLG_OK);
    EXPECT_TRUE(same_bytes(positions, restored(model, pose)));
}

TEST(RuntimeOpen, AnInfoOfAnOlderProgramIsFilledAsFarAsItGoes) {
    const Opened opened = open_model(cube_file());
    flg_info info;
    std::memset(&info, 0xaa, sizeof info);
    info.struct_size = offsetof(flg_info, triangles);
    ASSERT_EQ(flg_get_info(opened.get(), &info), FLG_OK);
    EXPECT_EQ(info.vertices, cube_model().mesh.vertex_count());
    EXPECT_EQ(info.struct_size, offsetof(flg_info, triangles));
    EXPECT_EQ(info.triangles, 0xaaaaaaaau);
    for (const std::uint32_t wrong : {0u, 3u, std::uint32_t(sizeof info + 1)}) {
        info.struct_size = wrong;
        EXPECT_EQ(flg_get_info(opened.get(), &info), FLG_ARGUMENT);
    }
}

TEST(RuntimeOpen, HasAVersionAndASentenceForEveryStatus) {
    EXPECT_EQ(flg_abi(), FLG_ABI);
    std::set<std::string> texts;
    for (int status = FLG_OK; status <= FLG_OLD_RECORDS; ++status) texts.insert(flg_status_text(flg_status(status)));
    EXPECT_EQ(texts.size(), std::size_t{FLG_OLD_RECORDS} + 1);
    for (const std::string& text : texts) EXPECT_EQ(text.back(), '.');
    EXPECT_STREQ(flg_status_text(flg_status(FLG_OLD_RECORDS + 1)), "Unknown status.");
}

TEST(RuntimeOpen, IsCalledFromC) {
    const Opened opened = open_model(cube_file());
    Pose pose = rest_pose(cube_model());
    for (Vec3f& p : pose.positions) p.x() *= 2;
    const RuntimeMesh out = restore_all(opened, pose);
    const auto* bytes = reinterpret_cast<const unsigned char*>(out.positions.data());
    std::uint64_t sum = 0;
    for (std::size_t k = 0; k < out.positions.size() * sizeof(Vec3f); ++k) sum = sum * 31 + bytes[k];
    EXPECT_EQ(filigree_rt_from_c(cube_file().data(), cube_file().size()), sum);
}

// ---- Sections and frames ----

TEST(RuntimeSections, AreFoundAsTheyLie) {
    Mesh mesh = make_wavy_cube({.resolution = 6});
    for (const Vec3f& p : mesh.positions) mesh.uvs.values.emplace_back(p[0], p[1]);
    mesh.materials.names = {"red"};
    mesh.materials.of_face.assign(mesh.face_count(), 0);
    const Model model = stripped(mesh, {.base = 20}).model;
    std::string bytes = write_model(model);
    const void* items;
    std::uint32_t size;
    std::size_t count;
    ASSERT_EQ(flg_find_section(bytes.data(), bytes.size(), "uv.val", 0, &items, &size, &count), FLG_OK);
    ASSERT_EQ(size, sizeof(Vec2f));
    ASSERT_EQ(count, model.mesh.uvs.values.size());
    EXPECT_EQ(std::memcmp(items, model.mesh.uvs.values.data(), size * count), 0);
    ASSERT_EQ(flg_find_section(bytes.data(), bytes.size(), "mat.nam", 0, &items, &size, &count), FLG_OK);
    EXPECT_EQ(std::string(static_cast<const char*>(items), count), std::string("red\0", 4));
    ASSERT_EQ(flg_find_section(bytes.data(), bytes.size(), "lev.vert", 0, &items, &size, &count), FLG_OK); // 8 letters
    EXPECT_EQ(count, model.driver().vertices.size());
    EXPECT_EQ(flg_find_section(bytes.data(), bytes.size(), "uv.val", 1, &items, &size, &count), FLG_MISSING);
    EXPECT_EQ(flg_find_section(bytes.data(), bytes.size(), "uv.va", 0, &items, &size, &count), FLG_MISSING);
    EXPECT_EQ(flg_find_section(bytes.data(), bytes.size(), "uv.values", 0, &items, &size, &count), FLG_ARGUMENT);
    EXPECT_EQ(items, nullptr);
    Forged forged(bytes);
    bytes[forged.section("uv.val").offset + 5] ^= 1;
    EXPECT_EQ(flg_find_section(bytes.data(), bytes.size(), "uv.val", 0, &items, &size, &count), FLG_DAMAGED);
    EXPECT_EQ(open_status(bytes), FLG_OK); // it does not read them
}

std::string moving_file(const Model& model, std::size_t frames, bool gradients) {
    PoseSequence poses;
    poses.frames_per_second = 25;
    for (unsigned k = 0; k < frames; ++k) {
        const Pose pose = random_pose(model, 10 + k);
        poses.frames.push_back(gradients ? pose : without_gradients(pose));
    }
    return write_model(model, poses);
}

TEST(RuntimeFrames, AreThoseOfTheFile) {
    for (const bool gradients : {false, true}) {
        const std::string bytes = moving_file(cube_model(), 4, gradients);
        const Opened opened = open_model(bytes);
        const flg_info info = info_of(opened);
        ASSERT_EQ(info.frames, 4u);
        EXPECT_EQ(info.frames_have_gradients, gradients);
        EXPECT_EQ(info.frames_per_second, 25);
        for (std::uint32_t k = 0; k < 4; ++k) {
            const Pose wanted = random_pose(cube_model(), 10 + k);
            Pose got{std::vector<Vec3f>(info.driver_vertices), std::vector<Mat3f>(info.driver_vertices)};
            ASSERT_EQ(flg_read_frame(opened.get(), bytes.data(), bytes.size(), k, floats(got.positions),
                                     gradients ? got.gradients[0].data() : nullptr),
                      FLG_OK);
            EXPECT_TRUE(same_bytes(got.positions, wanted.positions));
            EXPECT_TRUE(!gradients || got.gradients == wanted.gradients);
        }
        std::vector<Vec3f> positions(info.driver_vertices);
        std::vector<Mat3f> unwanted(info.driver_vertices);
        EXPECT_EQ(flg_read_frame(opened.get(), bytes.data(), bytes.size(), 4, floats(positions), nullptr), FLG_MISSING);
        EXPECT_EQ(flg_read_frame(opened.get(), bytes.data(), bytes.size(), 0, floats(positions), unwanted[0].data()),
                  gradients ? FLG_OK : FLG_MISSING);
        EXPECT_EQ(flg_read_frame(opened.get(), cube_file().data(), cube_file().size(), 0, floats(positions), nullptr),
                  FLG_MISMATCH);
        Forged forged(bytes);
        std::string damaged = bytes;
        damaged[forged.section("pose.pos", 2).offset] ^= 4;
        EXPECT_EQ(flg_read_frame(opened.get(), damaged.data(), damaged.size(), 2, floats(positions), nullptr),
                  FLG_DAMAGED);
        EXPECT_EQ(flg_read_frame(opened.get(), damaged.data(), damaged.size(), 1, floats(positions), nullptr), FLG_OK);
        const std::string infinite = Forged(bytes).set("pose.pos", 3, INFINITY, 1).bytes();
        const Opened other = open_model(infinite);
        EXPECT_EQ(flg_read_frame(other.get(), infinite.data(), infinite.size(), 1, floats(positions), nullptr),
                  FLG_DAMAGED);
    }
}

TEST(RuntimeFrames, AGapIsDamage) {
    const std::string bytes = moving_file(cube_model(), 3, true);
    for (const char* name : {"pose.pos", "pose.grd"}) {
        Forged gap(bytes);
        gap.section(name, 1).index = 7;
        EXPECT_EQ(open_status(gap.bytes()), FLG_DAMAGED) << name;
        Forged other(bytes);
        std::memcpy(other.section(name, 2).name, "another!", 8);
        EXPECT_EQ(open_status(other.bytes()), FLG_DAMAGED) << name;
        Forged item(bytes);
        item.section(name, 2).item_size = 4;
        EXPECT_EQ(open_status(item.bytes()), FLG_DAMAGED) << name;
    }
    EXPECT_EQ(open_status(Forged(bytes).set("pose.fps", 0, 0.0).bytes()), FLG_DAMAGED);
    EXPECT_EQ(open_status(Forged(bytes).rename("pose.fps", "fps").bytes()), FLG_DAMAGED);
}

// ---- Every status ----

TEST(RuntimeStatus, NotAModel) {
    EXPECT_EQ(open_status(""), FLG_NOT_A_MODEL);
    EXPECT_EQ(open_status("FILIGRE"), FLG_NOT_A_MODEL);
    EXPECT_EQ(open_status("solid cube\nfacet normal 0 0 1\n and so on, and so on"), FLG_NOT_A_MODEL);
}

TEST(RuntimeStatus, CutOffOrChangedIsDamaged) {
    const std::string& bytes = cube_file();
    for (std::size_t size = 8; size < bytes.size(); size += 1 + size / 7)
        ASSERT_EQ(open_status(bytes.substr(0, size)), FLG_DAMAGED) << size;
    EXPECT_EQ(open_status(bytes + '\0'), FLG_DAMAGED);
    for (std::size_t at = 12; at < 32; ++at) { // counts, size and sum of the table
        std::string changed = bytes;
        changed[at] ^= 1;
        ASSERT_EQ(open_status(changed), FLG_DAMAGED) << at;
    }
    // Of every section that is read one byte; without checksums nothing of it may be read wrongly (sanitizers).
    Forged table(bytes);
    for (const char* name : {"mesh.pos", "mesh.org", "mesh.num", "mesh.siz", "mesh.cor", "code", "levels", "lev.vert",
                             "lev.siz", "lev.cor", "bl.prec", "bl.cell", "bl.run", "bl.from", "bl.u", "bl.v"}) {
        const FileSection section = table.section(name);
        for (const std::size_t at : {std::size_t{0}, std::size_t(section.count * section.item_size - 1)}) {
            std::string changed = bytes;
            changed[section.offset + at] ^= 64;
            ASSERT_EQ(open_status(changed), FLG_DAMAGED) << name;
            open_status(changed, options_of(FLG_WITHOUT_CHECKSUMS));
        }
    }
}

/// Programs before 0.1.0 wrote records of 16 bits on demand.
TEST(RuntimeStatus, Int16RecordsAreRefusedWithAWayOut) {
    EXPECT_EQ(open_status(Forged(cube_file()).set("bl.prec", 0, 1u).bytes()), FLG_OLD_RECORDS);
    EXPECT_NE(std::string(flg_status_text(FLG_OLD_RECORDS)).find("strip the mesh again"), std::string::npos);
}

TEST(RuntimeStatus, NumbersThatContradictEachOtherAreDamage) {
    const std::string& bytes = cube_file();
    const auto expect_damage = [](std::string forged, const char* what) {
        EXPECT_EQ(open_status(forged), FLG_DAMAGED) << what;
    };
    expect_damage(Forged(bytes).set("mesh.num", 0, std::uint64_t{0xfffffffe}).bytes(), "more vertices than there are");
    expect_damage(Forged(bytes).set("mesh.num", 0, std::uint64_t{1} << 40).bytes(), "more than indices can name");
    expect_damage(Forged(bytes).set("mesh.num", 0, std::uint64_t{0}).bytes(), "no vertices");
    expect_damage(Forged(bytes).set("mesh.org", 1, std::numeric_limits<double>::quiet_NaN()).bytes(), "origin");
    expect_damage(Forged(bytes).set("mesh.pos", 4, INFINITY).bytes(), "position");
    expect_damage(Forged(bytes).set("mesh.siz", 0, 0u).bytes(), "faces of no corners");
    expect_damage(Forged(bytes).set("mesh.siz", 0, 2u).bytes(), "faces of two corners");
    expect_damage(Forged(bytes).set("mesh.siz", 0, 5u).bytes(), "faces that do not divide their corners");
    expect_damage(Forged(bytes).set("mesh.cor", 9, 0xffffffffu).bytes(), "a corner out of range");
    expect_damage(Forged(bytes).set("lev.cor", 3, 50u).bytes(), "a corner of the driver out of range");
    expect_damage(Forged(bytes).set("lev.vert", 1, 0u).bytes(), "driver vertices that do not ascend");
    expect_damage(Forged(bytes).set("levels", 0, 0u).bytes(), "no levels");
    expect_damage(Forged(bytes).set("levels", 0, 65u).bytes(), "too many levels");
    expect_damage(Forged(bytes).set("bl.prec", 0, 2u).bytes(), "records of a kind that is not known");
    expect_damage(Forged(bytes).set("bl.cell", 2, 50u).bytes(), "a cell out of range");
    expect_damage(Forged(bytes).set("bl.run", 1, 0u).bytes(), "a run of none");
    expect_damage(Forged(bytes).set("bl.run", 1, 0xffffffffu).bytes(), "a run past its block");
    expect_damage(Forged(bytes).set("bl.run", 0, 0xffffffffu).bytes(), "a run of no cell");
    expect_damage(Forged(bytes).set("bl.from", 0, std::uint16_t{0xffff}).bytes(), "a record out of range");
    Forged twice(bytes);
    expect_damage(twice.set("bl.from", 0, std::uint16_t{1}).set("bl.from", 1, std::uint16_t{1}).bytes(), "one twice");
    expect_damage(Forged(bytes).set("bl.u", 0, 1.5f).bytes(), "a weight out of range");
    expect_damage(Forged(bytes).set("bl.v", 0, NAN).bytes(), "a weight that is no number");
    for (const char* name : {"mesh.org", "mesh.num", "code", "levels", "lev.vert", "bl.prec", "bl.cell", "bl.run",
                             "bl.from", "bl.u", "bl.v", "mesh.pos", "lev.siz", "mesh.siz"})
        expect_damage(Forged(bytes).rename(name, "gone").bytes(), name);
    Forged item(bytes);
    item.section("bl.u").item_size = 2;
    expect_damage(item.bytes(), "items of another size");
    Forged large(bytes);
    large.section("bl.u").count = std::uint64_t{1} << 62; // times four is 0
    expect_damage(large.bytes(), "more bytes than 64 bits can count");
    Forged overlapping(bytes);
    overlapping.section("bl.v").offset = overlapping.section("bl.u").offset;
    expect_damage(overlapping.bytes(), "two sections at one place");
    Forged behind(bytes);
    behind.section("bl.v").offset = bytes.size() + 8;
    expect_damage(behind.bytes(), "a section behind the end");

    const std::string corners =
        write_model(stripped(with_corner_normals(make_wavy_cube({.resolution = 6})), {.base = 20}).model);
    expect_damage(Forged(corners).set("nrm.cor", 0, 100000u).bytes(), "a corner without its normal");
    expect_damage(Forged(corners).set("nrm.val", 0, NAN).bytes(), "a normal that is no number");
    Forged fewer(corners);
    fewer.section("nrm.cor").count -= 1;
    expect_damage(fewer.bytes(), "not one normal a corner");
}

TEST(RuntimeStatus, NewerAndOlder) {
    Forged newer(cube_file()), older(cube_file()), none(cube_file());
    newer.header().version = 3;
    older.header().version = 1;
    none.header().version = 0;
    EXPECT_EQ(open_status(newer.bytes()), FLG_NEWER);
    EXPECT_EQ(open_status(older.bytes()), FLG_UNSUITABLE);
    EXPECT_EQ(open_status(none.bytes()), FLG_DAMAGED);
}

TEST(RuntimeStatus, PackedAndReferenceModelsAreUnsuitable) {
    const Model& model = cube_model();
    EXPECT_EQ(open_status(packed([&](const auto& path) { return pack_model(model, {}, {}, path, kOneThread).ok(); })),
              FLG_UNSUITABLE);
    EXPECT_EQ(
        open_status(packed([&](const auto& path) { return pack_model_lossless(model, {}, path, kOneThread).ok(); })),
        FLG_UNSUITABLE);
    const Mesh cube = make_wavy_cube({.resolution = 4});
    EXPECT_EQ(open_status(write_reference_model(strip_to_reference(cube, {}, kOneThread).value())), FLG_UNSUITABLE);
}

TEST(RuntimeStatus, WrongArguments) {
    const std::string& bytes = cube_file();
    flg_model* model = nullptr;
    flg_options options = options_of();
    EXPECT_EQ(flg_open(nullptr, 100, nullptr, &model), FLG_ARGUMENT);
    EXPECT_EQ(flg_open(bytes.data(), bytes.size(), nullptr, nullptr), FLG_ARGUMENT);
    options.struct_size = 8;
    EXPECT_EQ(flg_open(bytes.data(), bytes.size(), &options, &model), FLG_ARGUMENT);
    EXPECT_EQ(open_status(bytes, options_of(1u << 20)), FLG_ARGUMENT);
    for (const std::uint32_t lanes : {2u, 3u, 5u, 32u})
        EXPECT_EQ(open_status(bytes, options_of(0, FLG_FINEST, lanes)), FLG_ARGUMENT);
    options = options_of();
    options.allocate = [](void*, std::size_t size) { return std::malloc(size); };
    EXPECT_EQ(open_status(bytes, options), FLG_ARGUMENT); // without release
    EXPECT_EQ(open_status(bytes, options_of(0, 4)), FLG_MISSING);
    EXPECT_EQ(open_status(bytes, options_of(0, FLG_FINEST - 1)), FLG_MISSING);

    const Opened opened = open_model(bytes);
    const flg_info info = info_of(opened);
    const flg_model* m = opened.get();
    Pose pose = random_pose(cube_model(), 1);
    const SetPose set(opened, pose);
    Scratch scratch(opened);
    std::vector<Vec3f> out(info.vertices);
    std::vector<char> room(flg_pose_bytes(m));
    const auto drivers = info.driver_vertices;
    flg_info other{};
    EXPECT_EQ(flg_get_info(nullptr, &other), FLG_ARGUMENT);
    EXPECT_EQ(flg_get_info(m, nullptr), FLG_ARGUMENT);
    EXPECT_EQ(flg_set_pose(nullptr, floats(pose.positions), nullptr, drivers, room.data()), FLG_ARGUMENT);
    EXPECT_EQ(flg_set_pose(m, nullptr, nullptr, drivers, room.data()), FLG_ARGUMENT);
    EXPECT_EQ(flg_set_pose(m, floats(pose.positions), nullptr, drivers, nullptr), FLG_ARGUMENT);
    EXPECT_EQ(flg_set_pose(m, floats(pose.positions), nullptr, drivers - 1, room.data()), FLG_MISMATCH);
    EXPECT_EQ(flg_set_pose(m, floats(pose.positions), nullptr, drivers + 1, room.data()), FLG_MISMATCH);
    float* gradients = pose.gradients[0].data();
    EXPECT_EQ(flg_gradients(nullptr, floats(pose.positions), drivers, 0, 1, gradients), FLG_ARGUMENT);
    EXPECT_EQ(flg_gradients(m, nullptr, drivers, 0, 1, gradients), FLG_ARGUMENT);
    EXPECT_EQ(flg_gradients(m, floats(pose.positions), drivers, 0, 1, nullptr), FLG_ARGUMENT);
    EXPECT_EQ(flg_gradients(m, floats(pose.positions), drivers + 1, 0, 1, gradients), FLG_MISMATCH);
    EXPECT_EQ(flg_gradients(m, floats(pose.positions), drivers, 1, drivers, gradients), FLG_ARGUMENT);
    EXPECT_EQ(flg_gradients(m, floats(pose.positions), drivers, 0xffffffffu, 2, gradients), FLG_ARGUMENT);
    EXPECT_EQ(flg_restore(nullptr, set.get(), floats(out), nullptr, scratch.get()), FLG_ARGUMENT);
    EXPECT_EQ(flg_restore(m, nullptr, floats(out), nullptr, scratch.get()), FLG_ARGUMENT);
    EXPECT_EQ(flg_restore(m, set.get(), floats(out), nullptr, nullptr), FLG_ARGUMENT);
    const Opened twin = open_model(bytes);
    EXPECT_EQ(flg_restore(twin.get(), set.get(), floats(out), nullptr, scratch.get()), FLG_ARGUMENT); // another's pose
    const auto parts = [&](std::uint32_t first, std::uint32_t count, std::size_t stride, std::size_t normal_stride) {
        return flg_restore_parts(m, set.get(), first, count, floats(out), stride, floats(out), normal_stride,
                                 scratch.get());
    };
    EXPECT_EQ(parts(0, info.parts + 1, 12, 12), FLG_ARGUMENT);
    EXPECT_EQ(parts(info.parts, 1, 12, 12), FLG_ARGUMENT);
    EXPECT_EQ(parts(0xffffffffu, 2, 12, 12), FLG_ARGUMENT);
    EXPECT_EQ(parts(0, 1, 8, 12), FLG_ARGUMENT);
    EXPECT_EQ(parts(0, 1, 12, 14), FLG_ARGUMENT);
    EXPECT_EQ(parts(info.parts, 0, 12, 12), FLG_OK);
    EXPECT_EQ(flg_restore_parts(nullptr, set.get(), 0, 0, floats(out), 12, nullptr, 12, scratch.get()), FLG_ARGUMENT);
    EXPECT_EQ(flg_get_part(m, info.parts, nullptr, nullptr, nullptr, nullptr), FLG_ARGUMENT);
    EXPECT_EQ(flg_get_part(nullptr, 0, nullptr, nullptr, nullptr, nullptr), FLG_ARGUMENT);
    EXPECT_EQ(flg_get_part(m, 0, nullptr, nullptr, nullptr, nullptr), FLG_OK);
    std::vector<std::uint32_t> skin_drivers(3 * std::size_t{info.vertices});
    const auto skin = [&](const flg_model* of, std::uint32_t first, std::uint32_t count) {
        return flg_skin(of, first, count, skin_drivers.data(), floats(out), floats(out));
    };
    EXPECT_EQ(skin(nullptr, 0, 0), FLG_ARGUMENT);
    EXPECT_EQ(skin(m, 1, info.vertices), FLG_ARGUMENT);
    EXPECT_EQ(skin(m, 0xffffffffu, 2), FLG_ARGUMENT);
    EXPECT_EQ(skin(m, info.vertices, 0), FLG_OK);
    EXPECT_EQ(flg_skin(m, 0, 0, nullptr, floats(out), floats(out)), FLG_ARGUMENT);
    EXPECT_EQ(flg_skin(m, 0, 0, skin_drivers.data(), nullptr, floats(out)), FLG_ARGUMENT);
    EXPECT_EQ(flg_skin(m, 0, 0, skin_drivers.data(), floats(out), nullptr), FLG_ARGUMENT);
    EXPECT_EQ(flg_skin_matrices(nullptr, set.get(), gradients), FLG_ARGUMENT);
    EXPECT_EQ(flg_skin_matrices(m, nullptr, gradients), FLG_ARGUMENT);
    EXPECT_EQ(flg_skin_matrices(m, set.get(), nullptr), FLG_ARGUMENT);
    EXPECT_EQ(flg_skin_matrices(twin.get(), set.get(), gradients), FLG_ARGUMENT); // another's pose
    EXPECT_EQ(flg_read_frame(m, bytes.data(), bytes.size(), 0, nullptr, nullptr), FLG_ARGUMENT);
    EXPECT_EQ(flg_read_frame(nullptr, bytes.data(), bytes.size(), 0, floats(out), nullptr), FLG_ARGUMENT);
    EXPECT_EQ(flg_read_frame(m, nullptr, bytes.size(), 0, floats(out), nullptr), FLG_ARGUMENT);
    EXPECT_EQ(flg_pose_bytes(nullptr), 0u);
    EXPECT_EQ(flg_scratch_bytes(nullptr), 0u);
    for (const auto* array : {flg_driver_triangles(nullptr), flg_triangles(nullptr), flg_triangle_uvs(nullptr),
                              flg_triangle_normals(nullptr), flg_triangle_faces(nullptr), flg_level_vertices(nullptr)})
        EXPECT_EQ(array, nullptr);
    EXPECT_EQ(flg_driver_rest(nullptr), nullptr);
    flg_close(nullptr);
}

/// Counts, and says no from the given call on.
struct Purse {
    std::size_t calls = 0, allowed = ~std::size_t{0}, most_bytes = ~std::size_t{0};
    std::set<void*> given;

    flg_options options(std::uint32_t flags = 0) {
        flg_options o = options_of(flags);
        o.user = this;
        o.allocate = [](void* user, std::size_t bytes) -> void* {
            Purse& purse = *static_cast<Purse*>(user);
            if (purse.calls++ >= purse.allowed || bytes > purse.most_bytes) return nullptr;
            return *purse.given.insert(std::malloc(bytes)).first;
        };
        o.release = [](void* user, void* memory) {
            EXPECT_EQ(static_cast<Purse*>(user)->given.erase(memory), 1u);
            std::free(memory);
        };
        return o;
    }
};

TEST(RuntimeStatus, NoMemoryLeavesNone) {
    const std::string bytes =
        write_model(stripped(with_corner_normals(make_wavy_cube({.resolution = 6})), {.base = 20}).model);
    Purse all;
    open_model(bytes, all.options()).reset();
    EXPECT_TRUE(all.given.empty());
    ASSERT_GT(all.calls, 30u);
    for (std::size_t allowed = 0; allowed < all.calls; ++allowed) {
        Purse purse;
        purse.allowed = allowed;
        ASSERT_EQ(open_status(bytes, purse.options()), FLG_NO_MEMORY) << allowed;
        ASSERT_TRUE(purse.given.empty()) << allowed;
    }
}

TEST(RuntimeStatus, NothingIsAllocatedAfterOpening) {
    const std::string bytes = moving_file(cube_model(), 2, true);
    Purse purse;
    const Opened opened = open_model(bytes, purse.options());
    const std::size_t before = purse.calls, kept = purse.given.size();
    Pose pose = random_pose(cube_model(), 3);
    flg_read_frame(opened.get(), bytes.data(), bytes.size(), 1, floats(pose.positions), pose.gradients[0].data());
    restore_all(opened, pose);
    restore_all(opened, without_gradients(pose));
    EXPECT_EQ(purse.calls, before);
    EXPECT_EQ(purse.given.size(), kept);
}

/// A small file does not ask for much memory, whatever it says.
TEST(RuntimeStatus, MemoryIsBoundedByTheFile) {
    Purse purse;
    purse.most_bytes = 64 * cube_file().size();
    EXPECT_EQ(open_status(Forged(cube_file()).set("mesh.num", 0, std::uint64_t{0xfffffffe}).bytes(), purse.options()),
              FLG_DAMAGED);
    EXPECT_EQ(open_status(cube_file(), purse.options()), FLG_OK);
}

// ---- Edges ----

TEST(RuntimeEdges, BytesMayBeginAnywhere) {
    const Model model = stripped(with_vertex_normals(make_wavy_cube({.resolution = 8})), {.base = 30}).model;
    const std::string bytes = write_model(model);
    const Pose pose = random_pose(model, 1);
    const RuntimeMesh wanted = restore_all(open_model(bytes), pose);
    for (std::size_t shift = 1; shift < 8; ++shift) {
        const std::string moved = std::string(shift, 'x') + bytes;
        flg_model* model_at = nullptr;
        ASSERT_EQ(flg_open(moved.data() + shift, bytes.size(), nullptr, &model_at), FLG_OK);
        EXPECT_TRUE(same_bytes(restore_all(Opened(model_at), pose).positions, wanted.positions));
    }
}

/// One driver vertex, and cells that name it three times.
TEST(RuntimeEdges, ADriverOfOneVertex) {
    Mesh single;
    single.positions = {{1, 2, 3}};
    const Model model = stripped(single, {}).model;
    const Opened opened = open_model(write_model(model));
    ASSERT_EQ(info_of(opened).driver_vertices, 1u);
    EXPECT_EQ(restore_all(opened, Pose{{{5, 6, 7}}, {}}).positions[0], Vec3f(5, 6, 7));
}

/// A driver that was made elsewhere, and a mesh without a vertex.
TEST(RuntimeEdges, AMeshWithoutVertices) {
    Model model;
    model.mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    model.driver_is_behind = true;
    Level driver;
    driver.vertices = {0, 1, 2};
    driver.face_offsets = {0, 3};
    driver.corners = {0, 1, 2};
    model.levels = {driver};
    model.detail.cells = {{0, 1, 2}};
    model.detail.cell_offsets = {0, 3};
    model.detail.order = {0, 1, 2};
    model.detail.u = {0, 1, 0};
    model.detail.v = {0, 0, 1};
    ASSERT_EQ(check_model(model), "");
    const std::string bytes = write_model(model);
    const Opened opened = open_model(bytes);
    const flg_info info = info_of(opened);
    EXPECT_EQ(info.vertices, 0u);
    EXPECT_EQ(info.parts, 0u);
    EXPECT_EQ(flg_triangles(opened.get()), nullptr);
    const SetPose set(opened, rest_pose(model));
    ASSERT_EQ(set.status, FLG_OK);
    Scratch scratch(opened);
    float nothing[3] = {7, 7, 7};
    EXPECT_EQ(flg_restore(opened.get(), set.get(), nothing, nothing, scratch.get()), FLG_OK);
    EXPECT_EQ(nothing[0], 7);
    EXPECT_EQ(restore_all(open_model(bytes, options_of(0, 0)), rest_pose(model)).positions, model.mesh.positions);
}

TEST(RuntimeEdges, OfTwoSectionsOfOneNameTheFirstCounts) {
    Mesh mesh = make_wavy_cube({.resolution = 6});
    for (const Vec3f& p : mesh.positions) mesh.colors.emplace_back(p[0], 0.5f, 0.5f, 1.0f);
    const std::string bytes = write_model(stripped(mesh, {.base = 20}).model);
    EXPECT_EQ(open_status(Forged(bytes).rename("col.val", "bl.from").bytes()), FLG_DAMAGED); // before the real one
    EXPECT_EQ(open_status(Forged(bytes).rename("col.val", "unknown").bytes()), FLG_OK);
}

TEST(RuntimeHash, IsXxh3) {
    std::string bytes(5000, '\0');
    std::mt19937 random(1);
    for (char& byte : bytes) byte = static_cast<char>(random());
    for (std::size_t size = 0; size + 3 < bytes.size(); size += size < 600 ? 1 : 37)
        for (const std::size_t shift : {0u, 3u})
            ASSERT_EQ(hash_of(reinterpret_cast<const unsigned char*>(bytes.data()) + shift, size),
                      XXH3_64bits(bytes.data() + shift, size))
                << size;
}

} // namespace
} // namespace filigree
