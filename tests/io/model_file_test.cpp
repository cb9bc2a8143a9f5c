// Model files: they come back as they were, and whatever happens to their bytes ends in a sound model or a sentence.
#include "filigree/io/model/model_file.h"

#include "filigree/io/model/model_sections.h"
#include "filigree/io/model/reference_file.h"
#include "filigree/io/system/file.h"
#include "filigree/mesh.h"
#include "filigree/restore.h"
#include "filigree/strip.h"
#include "io/sample_meshes.h"
#include "new_folder.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <fstream>
#include <random>

namespace model_file_test {

using namespace filigree;
using namespace filigree_test;
namespace fs = std::filesystem;

namespace {

Model stripped(Mesh mesh, const StripOptions& options = {}) {
    Result<Stripped> result = strip(std::move(mesh), options, kOneThread);
    EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().message);
    return result.ok() ? std::move(result->model) : Model{};
}

/// A dozen kilobytes at most, so that every byte can be damaged.
std::vector<Model> small_models() {
    std::vector<Model> models;
    Mesh decorated = make_wavy_plane({.resolution = 6});
    decorated.origin = {500000, 0, -3};
    for (const Vec3f& p : decorated.positions) {
        decorated.normals.values.emplace_back(0, 0, 1);
        decorated.colors.emplace_back(p.x(), p.y(), 0, 1);
    }
    decorated.scalars = {{"quality", std::vector<float>(decorated.vertex_count(), 0.5f)}};
    models.push_back(stripped(decorated, {.base = 9}));
    models.push_back(stripped(make_corner_attribute_mesh(), {.base = 4}));
    return models;
}

std::vector<Vec3f> bent(const Model& model) {
    Pose pose = rest_pose(model);
    for (Vec3f& p : pose.positions) p += Vec3f(0.1f * p.y() * p.y(), 0.2f * p.x(), 0.3f * p.x() * p.y());
    const Result<Restorer> restorer = Restorer::create(model, {}, kOneThread);
    return *restorer->positions(pose, kOneThread);
}

bool same_bytes(std::span<const Vec3f> a, std::span<const Vec3f> b) {
    return std::ranges::equal(std::as_bytes(a), std::as_bytes(b));
}

Result<Model> read(const std::string& bytes) { return read_model(bytes, "a.fil", kOneThread); }

std::string error_of(const std::string& bytes) {
    const Result<Model> model = read(bytes);
    EXPECT_FALSE(model.ok());
    if (model.ok()) return "";
    EXPECT_EQ(model.error().code, ErrorCode::bad_file);
    return model.error().message;
}

/// A damaged file is refused with a sentence, or what it gives is sound and can be restored at every level.
void expect_sound_or_refused(const std::string& bytes) {
    const Result<Model> model = read(bytes);
    if (!model.ok()) {
        const bool is_old = model.error().message.find("int16 records") != std::string::npos;
        ASSERT_EQ(model.error().code, is_old ? ErrorCode::unsuitable : ErrorCode::bad_file) << model.error().message;
        ASSERT_TRUE(model.error().message.ends_with(".")) << model.error().message;
        ASSERT_LT(model.error().message.size(), 300u);
        return;
    }
    ASSERT_EQ(check_model(*model), "");
    for (unsigned level = 0; level <= model->finest_level(); ++level) {
        const Result<Restorer> restorer = Restorer::create(*model, {.level = level}, kOneThread);
        ASSERT_TRUE(restorer.ok());
        ASSERT_TRUE(restorer->mesh(rest_pose(*model), kOneThread).ok());
    }
    std::ignore = write_model(*model);
}

// What docs/fil-format.md says, a second time: the tests do not trust the source file's own structs.
struct TestHeader {
    char magic[8];
    std::uint32_t version, section_count;
    std::uint64_t file_size, table_hash;
};
struct TestSection {
    char name[8];
    std::uint32_t index, item_size;
    std::uint64_t offset, count, hash;
};

/// Changes a file and makes every checksum right again.
class Patcher {
public:
    explicit Patcher(std::string bytes) : bytes_(std::move(bytes)) {
        std::memcpy(&header, bytes_.data(), sizeof header);
        sections.resize(header.section_count);
        std::memcpy(sections.data(), bytes_.data() + sizeof header, sections.size() * sizeof(TestSection));
    }

    TestHeader header;
    std::vector<TestSection> sections;

    bool has(std::string_view name) const {
        for (const TestSection& s : sections)
            if (name == std::string_view(s.name, strnlen(s.name, 8))) return true;
        return false;
    }
    TestSection& section(std::string_view name) {
        for (TestSection& s : sections)
            if (name == std::string_view(s.name, strnlen(s.name, 8))) return s;
        ADD_FAILURE() << "no section " << name;
        return sections[0];
    }
    template <class T>
    void set(std::string_view name, std::size_t item, const T& value) {
        const TestSection& s = section(name);
        ASSERT_LE((item + 1) * sizeof(T), s.count * s.item_size);
        std::memcpy(bytes_.data() + s.offset + item * sizeof(T), &value, sizeof(T));
    }
    template <class T>
    T get(std::string_view name, std::size_t item) {
        T value;
        std::memcpy(&value, bytes_.data() + section(name).offset + item * sizeof(T), sizeof(T));
        return value;
    }
    void rename(std::string_view name, std::string_view to) {
        TestSection& s = section(name);
        std::memset(s.name, 0, 8);
        std::memcpy(s.name, to.data(), to.size());
    }
    void flip(std::size_t at, unsigned bit) {
        if (at < bytes_.size()) bytes_[at] = static_cast<char>(bytes_[at] ^ (1 << bit));
    }

    std::string bytes() {
        for (TestSection& s : sections)
            if (s.offset <= bytes_.size() && s.item_size > 0 && s.count <= (bytes_.size() - s.offset) / s.item_size)
                s.hash = XXH3_64bits(bytes_.data() + s.offset, s.count * s.item_size);
        header.table_hash = XXH3_64bits(sections.data(), sections.size() * sizeof(TestSection));
        std::string out = bytes_;
        std::memcpy(out.data(), &header, sizeof header);
        std::memcpy(out.data() + sizeof header, sections.data(), sections.size() * sizeof(TestSection));
        return out;
    }

private:
    std::string bytes_;
};

} // namespace

TEST(ModelFile, ComesBackToTheByte) {
    for (const Model& model : small_models()) {
        const std::string bytes = write_model(model);
        EXPECT_TRUE(is_model_file(bytes));
        const Result<Model> back = read(bytes);
        ASSERT_TRUE(back.ok()) << back.error().message;
        EXPECT_EQ(write_model(*back), bytes);
        EXPECT_EQ(back->mesh.corners, model.mesh.corners);
        EXPECT_EQ(back->mesh.origin, model.mesh.origin);
        EXPECT_EQ(back->mesh.groups.names, model.mesh.groups.names);
        EXPECT_EQ(back->mesh.material_files, model.mesh.material_files);
        ASSERT_EQ(back->levels.size(), model.levels.size());
        EXPECT_TRUE(same_bytes(driver_positions(*back), driver_positions(model)));
        EXPECT_TRUE(same_bytes(bent(*back), bent(model)));
        EXPECT_TRUE(same_bytes(back->mesh.positions, model.mesh.positions));
    }
}

/// Programs before 0.1.0 wrote records of 16 bits on demand.
TEST(ModelFile, Int16RecordsAreRefusedWithAWayOut) {
    Patcher patcher(write_model(small_models()[0]));
    patcher.set("bl.prec", 0, 1u);
    const std::string bytes = patcher.bytes();
    const FileReader file{std::string_view(bytes)};
    const std::vector<Error> errors = {read(bytes).error(), read_model_outline(file, "a.fil", kOneThread).error(),
                                       read_model_level(file, 0, "a.fil", kOneThread).error(),
                                       read_model_level(file, 1, "a.fil", kOneThread).error()};
    for (const Error& error : errors) {
        EXPECT_EQ(error.code, ErrorCode::unsuitable);
        EXPECT_EQ(error.message,
                  "a.fil has int16 records, which are no longer read; strip the mesh again, and pack it for "
                  "the runtime to make it small.");
    }
}

TEST(ModelFile, IsWhatTheManualShows) {
    std::string shown;
    std::ifstream manual(FILIGREE_ROOT "/docs/fil-format.md");
    for (std::string line; std::getline(manual, line);) {
        if (line.size() < 15 || line.find_first_not_of("0123456789abcdef", 4) != 12 || line[12] != ':') continue;
        const std::string digits = line.substr(13, 37);
        for (std::size_t i = 0, high = 16; i < digits.size(); ++i) {
            if (!std::isxdigit(static_cast<unsigned char>(digits[i]))) continue;
            const std::size_t digit = std::string("0123456789abcdef").find(digits[i]);
            if (high < 16) shown += static_cast<char>(high * 16 + digit);
            high = high < 16 ? 16 : digit;
        }
    }
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.25f, 0.25f, 0.5f}};
    for (const Triangle& t : {Triangle{0, 1, 3}, Triangle{1, 2, 3}, Triangle{2, 0, 3}}) mesh.add_face(t);
    EXPECT_EQ(shown, write_model(stripped(mesh, {.base = 3})));
}

TEST(ModelFile, NamesWithAZeroByteEndThere) {
    Mesh mesh = make_wavy_plane({.resolution = 2});
    mesh.scalars = {{std::string("a\0b", 3), std::vector<float>(9, 1.0f)}, {"", std::vector<float>(9, 2.0f)}};
    const Result<Model> back = read(write_model(stripped(mesh)));
    ASSERT_TRUE(back.ok()) << back.error().message;
    ASSERT_EQ(back->mesh.scalars.size(), 2u);
    EXPECT_EQ(back->mesh.scalars[0].name, "a");
    EXPECT_EQ(back->mesh.scalars[1].values[8], 2.0f);
}

TEST(ModelFile, EveryCutIsRefused) {
    for (const Model& model : small_models()) {
        const std::string bytes = write_model(model);
        for (std::size_t size = 0; size < bytes.size(); ++size) {
            const Result<Model> cut = read(bytes.substr(0, size));
            ASSERT_FALSE(cut.ok()) << size;
            ASSERT_EQ(cut.error().code, ErrorCode::bad_file);
        }
        EXPECT_NE(error_of(bytes + '\0').find("added to"), std::string::npos);
    }
}

TEST(ModelFile, EveryFlippedBitIsSeenOrHarmless) {
    for (const Model& model : small_models()) {
        const std::string bytes = write_model(model);
        for (std::size_t at = 0; at < bytes.size(); ++at) {
            std::string damaged = bytes;
            damaged[at] = static_cast<char>(damaged[at] ^ (1 << at % 8));
            const Result<Model> back = read(damaged);
            if (!back.ok()) continue;
            ASSERT_EQ(write_model(*back), bytes) << at; // only what lies between sections has no checksum
        }
    }
}

TEST(ModelFile, SectionsOfLaterProgramsArePassedOver) {
    const Model model = small_models()[0];
    Patcher patcher(write_model(model));
    patcher.rename("col.val", "later.on");
    const Result<Model> back = read(patcher.bytes());
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_TRUE(back->mesh.colors.empty());
    EXPECT_TRUE(same_bytes(bent(*back), bent(model)));
}

TEST(ModelFile, OtherVersionsAreRefusedWithASentence) {
    for (const std::uint32_t version : {0u, 3u, 0xffffffffu}) {
        Patcher patcher(write_model(small_models()[0]));
        patcher.header.version = version;
        const std::string message = error_of(patcher.bytes());
        EXPECT_NE(message.find("version " + std::to_string(version)), std::string::npos) << message;
        EXPECT_NE(message.find("use a newer program"), std::string::npos) << message;
    }
    EXPECT_NE(error_of("ply\n").find("not a Filigree model"), std::string::npos);
    EXPECT_NE(error_of("").find("not a Filigree model"), std::string::npos);
}

TEST(ModelFile, HostileTables) {
    const std::string bytes = write_model(small_models()[0]);
    const std::uint64_t huge[] = {~std::uint64_t{0},      ~std::uint64_t{0} / 12 + 1,
                                  std::uint64_t{1} << 63, std::uint64_t{1} << 32,
                                  bytes.size(),           (std::uint64_t{1} << 62) + 1};
    for (const std::uint64_t value : huge)
        for (std::size_t s = 0; s < Patcher(bytes).sections.size(); ++s) {
            Patcher count(bytes), offset(bytes);
            count.sections[s].count = value;
            offset.sections[s].offset = value;
            error_of(count.bytes());
            error_of(offset.bytes());
        }
    for (std::size_t s = 0; s < Patcher(bytes).sections.size(); ++s) {
        Patcher size(bytes), overlap(bytes);
        size.sections[s].item_size = 0;
        error_of(size.bytes());
        overlap.sections[s].offset -= 8; // the section before, or the table
        if (s == 0 || overlap.sections[s - 1].count * overlap.sections[s - 1].item_size > 0) error_of(overlap.bytes());
    }
    Patcher many(bytes);
    many.header.section_count = 0xffffffff;
    std::string damaged = many.bytes();
    EXPECT_NE(error_of(damaged).find("more sections"), std::string::npos);
}

TEST(ModelFile, NothingMissingIsRestored) {
    for (const Model& model : small_models()) {
        const std::string bytes = write_model(model);
        for (std::size_t s = 0; s < Patcher(bytes).sections.size(); ++s) {
            Patcher patcher(bytes);
            patcher.rename(std::string(patcher.sections[s].name, strnlen(patcher.sections[s].name, 8)), "gone");
            ASSERT_NO_FATAL_FAILURE(expect_sound_or_refused(patcher.bytes()));
        }
    }
}

TEST(ModelFile, HostileNumbers) {
    const std::string blend = write_model(small_models()[0]);
    const auto refuses = [](const std::string& bytes, std::string_view name, auto value, std::size_t item = 1) {
        Patcher patcher(bytes);
        patcher.set(name, item, value);
        EXPECT_NE(error_of(patcher.bytes()), "") << name;
    };
    for (const char* name : {"mesh.cor", "lev.vert", "lev.cor", "bl.cell", "bl.run"})
        for (const Index id : {49u, 1000000u, kNoIndex}) refuses(blend, name, id);
    for (const char* name : {"mesh.pos", "bl.u", "bl.v", "nrm.val", "scal.val"})
        for (const float x : {NAN, INFINITY}) refuses(blend, name, x);
    for (const double x : {double{NAN}, double{INFINITY}}) refuses(blend, "mesh.org", x);
    refuses(blend, "bl.u", 1e30f);
    refuses(blend, "mesh.siz", 0u, 0);
    refuses(blend, "mesh.siz", 2u, 0);
    refuses(blend, "mesh.num", std::uint64_t{48}, 0);
    refuses(blend, "levels", 65u, 0);
    refuses(blend, "levels", 0u, 0);
    refuses(blend, "code", 2u, 0);
    refuses(blend, "code", 1000u, 0);
    refuses(blend, "bl.prec", 7u, 0);
    for (const Index count : {0u, 50u, 1u << 31, 0xffffffffu})
        refuses(blend, "bl.run", std::array<Index, 2>{0, count}, 0);
    refuses(blend, "bl.from", Patcher(blend).get<std::uint16_t>("bl.from", 0)); // twice: no permutation
    for (const int record : {49, 32767, 32768, 65535}) refuses(blend, "bl.from", static_cast<std::uint16_t>(record));
    refuses(blend, "lev.vert", Patcher(blend).get<Index>("lev.vert", 0)); // not ascending

    refuses(blend, "mesh.num", std::uint64_t{1} << 60, 0);
}

/// What is read in part is sound or refused, like the whole.
void expect_sound_parts(const std::string& bytes) {
    const FileReader file{std::string_view(bytes)};
    const Result<ModelOutline> outline = read_model_outline(file, "a.fil", kOneThread);
    if (!outline) return;
    for (unsigned k = 0; k < outline->levels.size(); ++k) {
        const Result<Mesh> level = read_model_level(file, k, "a.fil", kOneThread);
        EXPECT_EQ(level ? check_mesh(*level) : "", "");
    }
}

TEST(ModelFile, FuzzedFilesAreSoundOrRefused) {
    std::vector<std::string> seeds;
    for (const Model& model : small_models()) seeds.push_back(write_model(model));
    static const std::uint64_t kNumbers[] = {0,          1,          2,          3,          0x7fffffff,
                                             0x80000000, 0xffffffff, 0x7fc00000, 0x7f800000, 65536};
    std::mt19937 random(1);
    const auto below = [&](std::size_t n) { return random() % std::max<std::size_t>(n, 1); };
    const auto start = std::chrono::steady_clock::now();
    std::size_t rounds = 0;
    for (; rounds < 200'000 && std::chrono::steady_clock::now() - start < std::chrono::seconds(2); ++rounds) {
        Patcher patcher(seeds[rounds % seeds.size()]);
        for (std::size_t damages = 1 + below(3); damages > 0; --damages) {
            TestSection& section = patcher.sections[below(patcher.sections.size())];
            const std::size_t bytes = section.count * section.item_size;
            switch (below(6)) {
            case 0:
                section.count = below(2) ? kNumbers[below(std::size(kNumbers))] : below(section.count + 2);
                break;
            case 1:
                section.index = static_cast<std::uint32_t>(below(4));
                break;
            case 2:
                std::swap(section.name, patcher.sections[below(patcher.sections.size())].name);
                break;
            default: // bits of the content, most of them in one number
                for (std::size_t bits = 1 + below(3); bits > 0; --bits)
                    if (bytes > 0) patcher.flip(section.offset + below(bytes), static_cast<unsigned>(below(8)));
            }
        }
        std::string bytes = patcher.bytes(); // checksums are right; sometimes damaged once more
        if (below(8) == 0) bytes.resize(below(bytes.size()));
        ASSERT_NO_FATAL_FAILURE(expect_sound_or_refused(bytes)) << "round " << rounds;
        ASSERT_NO_FATAL_FAILURE(expect_sound_parts(bytes)) << "round " << rounds;
    }
    EXPECT_GT(rounds, 100u);
}

bool same_mesh(const Mesh& a, const Mesh& b) {
    if (a.scalars.size() != b.scalars.size()) return false;
    for (std::size_t i = 0; i < a.scalars.size(); ++i)
        if (a.scalars[i].name != b.scalars[i].name || a.scalars[i].values != b.scalars[i].values) return false;
    return a.origin == b.origin && same_bytes(a.positions, b.positions) && a.corners == b.corners &&
           a.face_offsets == b.face_offsets && same_bytes(a.normals.values, b.normals.values) &&
           a.normals.corners == b.normals.corners && a.uvs.values == b.uvs.values && a.colors == b.colors;
}

bool same_detail(const BlendDetail& a, const BlendDetail& b) {
    return a.cells == b.cells && a.cell_offsets == b.cell_offsets && a.order == b.order && a.u == b.u && a.v == b.v &&
           a.across_gap == b.across_gap && a.facing_away == b.facing_away;
}

TEST(ModelFile, ManyChunksComeBack) {
    const Model written = stripped(make_wavy_cube({.resolution = 220}), {.base = 200});
    ASSERT_GT(written.mesh.vertex_count(), std::size_t{1} << 18);
    const std::string bytes = write_model(written);
    const Result<Model> model = read(bytes);
    ASSERT_TRUE(model.ok()) << model.error().message;
    EXPECT_TRUE(same_detail(model->detail, written.detail));
    EXPECT_EQ(write_model(*model), bytes);
    const FileReader file{std::string_view(bytes)};
    for (unsigned k = 0; k <= model->finest_level(); ++k)
        EXPECT_TRUE(same_mesh(*read_model_level(file, k, "a.fil", kOneThread), level_mesh(*model, k))) << k;
}

/// A file of the reference code: the same mesh and levels, and detail that read_model does not take.
TEST(ModelFile, ReferenceModelsHaveTheirOwnReader) {
    const ReferenceModel model = *strip_to_reference(make_wavy_plane({.resolution = 4}), {}, kOneThread);
    const std::string bytes = write_reference_model(model);
    const FileReader file{std::string_view(bytes)};
    const auto again = [](const std::string& given) {
        return read_reference_model(FileReader(std::string_view(given)), "it", kOneThread);
    };
    EXPECT_EQ(write_reference_model(*again(bytes)), bytes);
    const Error refused = read(bytes).error();
    EXPECT_EQ(refused.code, ErrorCode::unsuitable);
    EXPECT_NE(refused.message.find("reference code"), std::string::npos) << refused.message;
    EXPECT_EQ(again(write_model(small_models()[0])).error().code, ErrorCode::unsuitable);

    const ModelOutline outline = *read_model_outline(file, "it", kOneThread);
    EXPECT_EQ(outline.references, 3u);
    EXPECT_EQ(outline.patches, model.detail.patches.patch_count());
    ASSERT_EQ(outline.levels.size(), model.finest_level() + 1);
    for (unsigned k = 0; k <= model.finest_level(); ++k) {
        EXPECT_EQ(outline.levels[k].vertices, level_mesh(model, k).vertex_count());
        EXPECT_TRUE(same_mesh(*read_model_level(file, k, "it", kOneThread), level_mesh(model, k))) << k;
    }

    const auto refuses = [&](std::string_view name, auto value, std::size_t item = 1) {
        Patcher patcher(bytes);
        patcher.set(name, item, value);
        EXPECT_FALSE(again(patcher.bytes()).ok()) << name;
    };
    for (const char* name : {"rf.base", "rf.grid"})
        for (const Index id : {25u, kNoIndex}) refuses(name, id);
    for (const std::uint32_t x : {0u, 1u, 17u, 0xffffffffu}) refuses("rf.par", x, 0);
    refuses("rf.par", 5u, 1);
    for (const char* name : {"rf.ext", "rf.drv", "rf.rec"}) refuses(name, NAN, 0);
    for (std::size_t end = 0; end < bytes.size(); end += 37) EXPECT_FALSE(again(bytes.substr(0, end)).ok()) << end;
    for (std::size_t k = 0; k < bytes.size(); k += 11) {
        std::string damaged = bytes;
        damaged[k] = char(damaged[k] ^ 4);
        const Result<ReferenceModel> found = again(damaged);
        if (found.ok()) {
            EXPECT_EQ(check_model(*found), "") << k;
        }
    }
}

TEST(ModelFile, ALevelIsReadAlone) {
    for (const Model& written : small_models()) {
        const std::string bytes = write_model(written);
        const Model model = *read(bytes);
        const FileReader file{std::string_view(bytes)};
        for (unsigned k = 0; k <= model.finest_level(); ++k) {
            const Result<Mesh> level = read_model_level(file, k, "a.fil", kOneThread);
            ASSERT_TRUE(level.ok()) << level.error().message;
            EXPECT_TRUE(same_mesh(*level, level_mesh(model, k))) << k;
        }
        EXPECT_EQ(read_model_level(file, model.finest_level() + 1, "a.fil", kOneThread).error().code, ErrorCode::usage);
    }
}

TEST(ModelFile, AnOutlineSaysWhatTheModelIs) {
    for (const Model& model : small_models()) {
        PoseSequence poses{25, {}};
        poses.frames.assign(3, rest_pose(model));
        const std::string bytes = write_model(model, poses);
        const Result<ModelOutline> outline = read_model_outline(FileReader(bytes), "a.fil", kOneThread);
        ASSERT_TRUE(outline.ok()) << outline.error().message;
        EXPECT_EQ(outline->references, 0u);
        ASSERT_EQ(outline->levels.size(), model.finest_level() + 1);
        for (unsigned k = 0; k <= model.finest_level(); ++k) {
            EXPECT_EQ(outline->levels[k].vertices, level_counts(model, k).vertices);
            EXPECT_EQ(outline->levels[k].faces, level_counts(model, k).faces);
            EXPECT_EQ(outline->levels[k].corners, level_counts(model, k).corners);
        }
        EXPECT_EQ(outline->bytes, bytes.size());
        EXPECT_EQ(outline->frames, poses.frames.size());
        EXPECT_EQ(outline->frames_per_second, poses.frames.empty() ? 0 : 25);
        EXPECT_EQ(outline->facing_away, model.detail.facing_away);
    }
}

TEST(ModelFile, AnOutlineReadsNothingElse) {
    const Model model = stripped(make_wavy_cube({.resolution = 200}), {.base = 100});
    std::string bytes = write_model(model);
    const std::size_t positions = bytes.find(std::string(reinterpret_cast<const char*>(&model.mesh.positions[0]), 24));
    ASSERT_NE(positions, std::string::npos);
    bytes[positions + 7] ^= 1; // seen by who reads all of it
    EXPECT_FALSE(read(bytes).ok());
    EXPECT_TRUE(read_model_outline(FileReader(bytes), "a.fil", kOneThread).ok());
}

TEST(ModelFile, WritingFailsWithoutHarm) {
    const fs::path folder = new_folder();
    const Model model = small_models()[0];
    ASSERT_TRUE(write_file(folder / "a.fil", "old").ok());
    for (const fs::path& path : {folder / "missing" / "a.fil", folder}) {
        const Status status = write_model(model, path, kOneThread);
        ASSERT_FALSE(status.ok());
        EXPECT_EQ(status.error().code, ErrorCode::unwritable);
    }
    const RunContext cancelled(1);
    cancelled.cancel();
    EXPECT_EQ(write_model(model, folder / "a.fil", cancelled).error().code, ErrorCode::cancelled);
    EXPECT_EQ(*read_file(folder / "a.fil"), "old");
    EXPECT_EQ(read_model(folder / "a.fil", kOneThread).error().code, ErrorCode::bad_file);
    EXPECT_EQ(read_model(folder / "missing.fil", kOneThread).error().code, ErrorCode::not_found);

    ASSERT_TRUE(write_model(model, folder / "a.fil", kOneThread).ok());
    EXPECT_EQ(*read_file(folder / "a.fil"), write_model(model));
    EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1); // nothing temporary stays
    ASSERT_TRUE(read_model(folder / "a.fil", kOneThread).ok());
    fs::remove_all(folder);
}

namespace {

/// A model of the sample mesh whose two materials came inside the file; both have the same picture.
Model model_with_materials() {
    Mesh mesh = filigree_test::make_corner_attribute_mesh();
    mesh.material_files.clear();
    mesh.embedded_materials.resize(2);
    mesh.embedded_materials[0].name = "stone";
    mesh.embedded_materials[0].color = {0.1f, 0.5f, 1};
    mesh.embedded_materials[0].picture_bytes = std::make_shared<const std::string>(std::string("a\0picture", 9));
    mesh.embedded_materials[1].name = "wood";
    mesh.embedded_materials[1].opacity = 0.25f;
    mesh.embedded_materials[1].metallic = 0.5f;
    mesh.embedded_materials[1].roughness = 0.75f;
    mesh.embedded_materials[1].double_sided = false;
    mesh.embedded_materials[1].picture_bytes = mesh.embedded_materials[0].picture_bytes;
    return stripped(mesh);
}

} // namespace

TEST(ModelFile, MaterialsThatCameInsideTheMeshsFileAreKept) {
    const Model model = model_with_materials();
    const Result<Model> back = read(write_model(model));
    ASSERT_TRUE(back.ok());
    ASSERT_EQ(back->mesh.embedded_materials.size(), 2u);
    for (std::size_t m = 0; m < 2; ++m) {
        const MeshMaterial &a = model.mesh.embedded_materials[m], &b = back->mesh.embedded_materials[m];
        EXPECT_EQ(b.name, a.name);
        EXPECT_EQ(b.color, a.color);
        EXPECT_EQ(b.opacity, a.opacity);
        EXPECT_EQ(b.metallic, a.metallic);
        EXPECT_EQ(b.roughness, a.roughness);
        EXPECT_EQ(b.double_sided, a.double_sided);
        ASSERT_TRUE(b.picture_bytes);
        EXPECT_TRUE(*b.picture_bytes == *a.picture_bytes);
    }
    EXPECT_EQ(back->mesh.embedded_materials[0].picture_bytes, back->mesh.embedded_materials[1].picture_bytes);
}

TEST(ModelFile, MaterialsAreNotTrusted) {
    const std::string bytes = write_model(model_with_materials());
    for (const float number : {-1.0f, 2.0f, std::numeric_limits<float>::quiet_NaN()}) {
        Patcher patcher(bytes);
        patcher.set("mat.emb", 3, number); // opacity
        EXPECT_NE(error_of(patcher.bytes()).find("from 0 to 1"), std::string::npos);
    }
    Patcher picture(bytes);
    picture.set("mat.emb", 7, std::uint32_t{5});
    EXPECT_NE(error_of(picture.bytes()).find("lacks the picture"), std::string::npos);
    Patcher names(bytes);
    names.set("mat.nam", 5, '+'); // two names become one
    EXPECT_NE(error_of(names.bytes()).find("number of materials"), std::string::npos);
}

TEST(ModelFile, PackedPartsThatWouldComeToAnySizeAreRefused) {
    const std::filesystem::path path = std::filesystem::temp_directory_path() / "filigree_any_size.fil";
    const Model model = strip(make_wavy_sphere({.resolution = 8}), {.base = 60}, RunContext()).value().model;
    PoseSequence poses{24, {rest_pose(model), rest_pose(model)}};
    const auto refused = [&](std::string bytes, bool has_a_mesh, const std::string& words = "would come to more than") {
        const auto as_poses = read_poses(bytes, "hostile.fil", RunContext());
        EXPECT_FALSE(as_poses.ok());
        if (!as_poses.ok()) {
            EXPECT_NE(as_poses.error().message.find(words), std::string::npos) << as_poses.error().message;
        }
        if (!has_a_mesh) return;
        const auto as_model = read_model(bytes, "hostile.fil", RunContext());
        ASSERT_FALSE(as_model.ok());
        EXPECT_EQ(as_model.error().code, ErrorCode::bad_file);
        EXPECT_NE(as_model.error().message.find(words), std::string::npos) << as_model.error().message;
    };
    ASSERT_TRUE(pack_model(model, poses, {}, path, RunContext()).ok());
    const std::string coded = FileReader::open(path)->read_all().value();
    Patcher frames(coded); // 4,294,967,295 poses
    frames.set<std::uint32_t>("cd.pose", 0, ~0u);
    refused(frames.bytes(), false);
    Patcher vertices(coded); // a thousand million vertices
    vertices.set<std::uint64_t>("cd.par", 0, 1'000'000'000);
    refused(vertices.bytes(), true);

    ASSERT_TRUE(pack_model_lossless(model, poses, path, RunContext()).ok());
    Patcher sections(FileReader::open(path)->read_all().value());
    TestSection plain = sections.get<TestSection>("ll.tab", 0);
    plain.count = std::uint64_t{1} << 40;
    sections.set("ll.tab", 0, plain);
    refused(sections.bytes(), true);
    std::filesystem::remove(path);
}

TEST(ModelFile, WhatReadersWouldRefuseIsNotPacked) {
    const std::vector<std::string_view> small = {"a few", " bytes"};
    EXPECT_FALSE(too_plain_to_pack(1e8, small));
    const std::optional<Error> error = too_plain_to_pack(1e9, small);
    ASSERT_TRUE(error);
    EXPECT_EQ(error->code, ErrorCode::unsuitable);
    const std::string large(2 << 20, ' ');
    EXPECT_FALSE(too_plain_to_pack(1e9, std::vector<std::string_view>{large}));
}

} // namespace model_file_test
