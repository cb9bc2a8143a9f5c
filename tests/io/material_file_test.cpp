#include "filigree/file.h"
#include "filigree/io/material_file.h"

#include <gtest/gtest.h>

#include <clocale>
#include <fstream>
#include <random>

#include <sys/stat.h>
#include <unistd.h>

using namespace filigree;
namespace fs = std::filesystem;

namespace {

/// A folder with a mesh in it.
class MaterialFile : public testing::Test {
protected:
    MaterialFile() {
        std::string name = (fs::temp_directory_path() / "filigree-XXXXXX").string();
        outside_ = ::mkdtemp(name.data());
        folder_ = outside_ / "mesh";
        fs::create_directories(folder_ / "textures");
        for (const char* const picture :
             {"wood.png", "textures/oak 1.png", "a#b.png", "2.png", "-x.png", "../secret.png"})
            write(picture, "not looked into");
    }
    ~MaterialFile() override { fs::remove_all(outside_); }

    void write(const std::string& name, const std::string& bytes) const {
        std::ofstream(folder_ / name, std::ios::binary) << bytes;
    }
    MeshMaterials read(const std::vector<std::string>& names, const std::vector<std::string>& libraries) const {
        Mesh mesh;
        mesh.materials.names = names;
        mesh.material_files = libraries;
        const MeshMaterials materials = read_materials(mesh, folder_ / "mesh.obj");
        EXPECT_EQ(materials.materials.size(), names.size());
        for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(materials.materials[i].name, names[i]);
        return materials;
    }
    /// The material "m" of a library with these lines in it.
    MeshMaterial material(const std::string& lines) {
        write("m.mtl", "newmtl m\n" + lines);
        const MeshMaterials result = read({"m"}, {"m.mtl"});
        warnings_ = result.warnings;
        return result.materials.at(0);
    }
    /// The picture of that map_Kd line, as seen from the mesh's folder.
    std::string picture(const std::string& line) {
        const fs::path path = material("map_Kd " + line + "\n").picture;
        return path.empty() ? "" : fs::relative(path, folder_).string();
    }
    void expect_warning(const std::vector<std::string>& words) const {
        ASSERT_EQ(warnings_.size(), 1u) << testing::PrintToString(warnings_);
        for (const std::string& word : words) EXPECT_NE(warnings_[0].find(word), std::string::npos) << warnings_[0];
        EXPECT_TRUE(warnings_[0].ends_with('.'));
    }

    fs::path folder_, outside_;
    std::vector<std::string> warnings_;
};

void expect_color(const MeshMaterial& material, const Vec3f& color) {
    EXPECT_LT((material.color - color).norm(), 1e-6f) << material.color.transpose();
}

} // namespace

TEST_F(MaterialFile, ColorsAndPicturesComeInTheMeshsOrder) {
    write("paint.mtl", "# made by hand\nKd 1 1 1\n\nnewmtl red paint\nNs 10\nKa 0 1 0\n\tKd\t1 0.25 0 # warm\nillum 2\n"
                       "newmtl unused\nKd 0 1 0\nmap_Kd missing.png\nnewmtl wood\nKd .5 .5 .5\nmap_Kd wood.png\n"
                       "map_Bump missing.png\nnewmtl red paint\nKd 0 0 1\n");
    const MeshMaterials result = read({"wood", "red paint"}, {"paint.mtl"});
    EXPECT_TRUE(result.warnings.empty()) << testing::PrintToString(result.warnings);
    expect_color(result.materials[0], {0.5f, 0.5f, 0.5f});
    EXPECT_EQ(result.materials[0].picture, folder_ / "wood.png");
    expect_color(result.materials[1], {1, 0.25f, 0}); // the first of two
    EXPECT_TRUE(result.materials[1].picture.empty());
}

TEST_F(MaterialFile, LineEndsOfEverySystemAreRead) {
    for (const std::string end : {"\n", "\r\n", "\r"}) {
        write("m.mtl", "newmtl m" + end + "Kd 1 0 0" + end + "map_Kd wood.png" + end);
        const MeshMaterials result = read({"m"}, {"m.mtl"});
        expect_color(result.materials[0], {1, 0, 0});
        EXPECT_EQ(result.materials[0].picture, folder_ / "wood.png");
        EXPECT_TRUE(result.warnings.empty());
    }
}

TEST_F(MaterialFile, LibrariesMayHaveBlanksOrShareALineOrAFolder) {
    write("a b.mtl", "newmtl blank\nKd 1 0 0\n");
    write("a.mtl", "newmtl a\nKd 0 1 0\n");
    write("b.mtl", "newmtl b\nKd 0 0 1\n");
    write("textures/t.mtl", "newmtl t\nmap_Kd oak 1.png\nnewmtl up\nmap_Kd ..\\wood.png\n");
    const MeshMaterials result =
        read({"blank", "b", "a", "t", "up"}, {"a b.mtl", "a.mtl \t b.mtl", "a.mtl", "\"textures\\t.mtl\""});
    EXPECT_TRUE(result.warnings.empty()) << testing::PrintToString(result.warnings);
    expect_color(result.materials[0], {1, 0, 0});
    expect_color(result.materials[1], {0, 0, 1});
    expect_color(result.materials[2], {0, 1, 0});
    EXPECT_EQ(result.materials[3].picture, folder_ / "textures/oak 1.png");
    EXPECT_EQ(result.materials[4].picture, folder_ / "wood.png");
}

TEST_F(MaterialFile, PictureNamesAreWhatProgramsWrite) {
    for (const std::string line :
         {"wood.png", "  wood.png \t", "\"wood.png\"", "./wood.png", ".\\wood.png", "textures/../wood.png",
          "wood.png # oak", "-clamp on wood.png", "-s 1 1 1 wood.png", "-s 1 wood.png",
          "-o 0 0 -s 1 1 1 -bm 0.5 wood.png", "-mm 0 1 wood.png",
          "-blendu on -blendv off -cc off -texres 512 -boost 2 -imfchan l -type sphere wood.png",
          "-CLAMP ON wood.png"}) {
        EXPECT_EQ(picture(line), "wood.png") << line;
        EXPECT_TRUE(warnings_.empty()) << testing::PrintToString(warnings_);
    }
    EXPECT_EQ(picture("textures\\oak 1.png"), "textures/oak 1.png");
    EXPECT_EQ(picture("-s 1 1 1 textures/oak 1.png"), "textures/oak 1.png");
    EXPECT_EQ(picture("a#b.png"), "a#b.png");
    EXPECT_EQ(picture("-s 1 1 1 2.png"), "2.png");
    EXPECT_EQ(picture("-x.png"), "-x.png");
    EXPECT_EQ(material("MAP_KD wood.png").picture, folder_ / "wood.png");
}

TEST_F(MaterialFile, ScaledAndMovedPicturesAreSaid) {
    for (const std::string line : {"-s 2 2 1 wood.png", "-o 0.5 wood.png", "-t 0 0.1 0 wood.png",
                                   "-o 0.0 -7.0 0.0 -s 1.0 10.0 1.0 -clamp on wood.png"}) {
        EXPECT_EQ(picture(line), "wood.png");
        expect_warning({"'m'", "scale"});
        EXPECT_EQ(warnings_[0].find("more"), std::string::npos) << warnings_[0]; // it is one texture
    }
}

TEST_F(MaterialFile, NothingOutsideOfTheFolderIsRead) {
    ASSERT_TRUE(fs::exists(folder_ / "../secret.png"));
    const std::vector<std::string> names = {"../secret.png",
                                            "..\\secret.png",
                                            "textures/../../secret.png",
                                            "-s 1 1 1 ../secret.png # comment",
                                            (outside_ / "secret.png").string(),
                                            "C:\\textures\\secret.png",
                                            "c:secret.png",
                                            "\\\\server\\secret.png",
                                            "\"../secret.png\""};
    for (const std::string& line : names) {
        EXPECT_EQ(picture(line), "") << line;
        expect_warning({"outside", "copy it"});
    }
    std::ofstream(outside_ / "m.mtl") << "newmtl m\nKd 1 0 0\n";
    for (const std::string& library : {std::string("../m.mtl"), (outside_ / "m.mtl").string()}) {
        const MeshMaterials result = read({"m"}, {library});
        expect_color(result.materials[0], {0.8f, 0.8f, 0.8f});
        EXPECT_EQ(result.warnings.size(), 2u);
    }
}

TEST_F(MaterialFile, WhatIsMissingIsSaidOnceAKind) {
    write("m.mtl", "newmtl m\nmap_Kd no 1.png\nnewmtl n\nmap_Kd no 2.png\nnewmtl folder\nmap_Kd textures\n");
    const MeshMaterials result = read({"m", "n", "folder", "x", "y"}, {"m.mtl", "gone.mtl", "gone too.mtl"});
    ASSERT_EQ(result.warnings.size(), 3u) << testing::PrintToString(result.warnings);
    EXPECT_EQ(result.warnings[0], "The material library 'gone.mtl' (and 1 more) was not found beside the mesh.");
    EXPECT_EQ(result.warnings[1], "The material 'x' (and 1 more) is in no material library; it became grey.");
    EXPECT_EQ(result.warnings[2], "The texture 'no 1.png' (and 2 more) was not found beside the mesh.");
    for (const MeshMaterial& material : result.materials) EXPECT_TRUE(material.picture.empty());
    EXPECT_EQ(picture(""), "");
    expect_warning({"texture", "not found"});
}

TEST_F(MaterialFile, NothingIsSaidWhereNoMaterialIsUsed) {
    EXPECT_TRUE(read({}, {"gone.mtl", "../m.mtl"}).warnings.empty());
}

TEST_F(MaterialFile, ColorsAreHeldInRangeAndOddOnesSaid) {
    expect_color(material("Kd 2 -1 0.5\n"), {1, 0, 0.5f});
    expect_color(material("Kd 0.3\n"), {0.3f, 0.3f, 0.3f});
    EXPECT_TRUE(warnings_.empty());
    for (const std::string line : {"Kd", "Kd 1 0", "Kd nan 0 0", "Kd 1 inf 0", "Kd spectral file.rfl", "Kd 1,0 0 0",
                                   "Kd 1 0 0 x", "Kd 1 0 0 0.5"}) {
        expect_color(material(line + "\n"), {0.8f, 0.8f, 0.8f});
        expect_warning({"'m'", "Kd"});
    }
}

TEST_F(MaterialFile, BlackOrNoColorBesideAPictureIsWhite) {
    expect_color(material("map_Kd wood.png\n"), {1, 1, 1});
    expect_color(material("Kd 0 0 0\nmap_Kd wood.png\n"), {1, 1, 1});
    expect_color(material("map_Kd wood.png\nKd 0.5 0 0\n"), {0.5f, 0, 0});
    expect_color(material("Kd 0 0 0\n"), {0, 0, 0});
}

TEST_F(MaterialFile, NumbersAreTheSameInEveryLocale) {
    const std::string before = std::setlocale(LC_NUMERIC, nullptr);
    for (const char* const name : {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8"})
        if (std::setlocale(LC_NUMERIC, name)) break;
    expect_color(material("Kd 0.5 0.25 1e-1\n"), {0.5f, 0.25f, 0.1f});
    std::setlocale(LC_NUMERIC, before.c_str());
}

TEST_F(MaterialFile, OddLibrariesAreSurvived) {
    write("long.mtl", "newmtl m\n# " + std::string(1 << 20, 'x') + "\nKd 0 1 0 #" + std::string(1 << 20, ' ') +
                          "\nmap_Kd " + std::string(100000, '/') + "\n");
    expect_color(read({"m"}, {"long.mtl"}).materials[0], {0, 1, 0});
    write("no end.mtl", "newmtl m\nKd 0 1 0");
    expect_color(read({"m"}, {"no end.mtl"}).materials[0], {0, 1, 0});
    ASSERT_EQ(::mkfifo((folder_ / "pipe.mtl").c_str(), 0600), 0); // nobody ever writes to it
    EXPECT_EQ(read({"m"}, {"pipe.mtl", "textures", "", ".", "\"\"", std::string("..\0/x", 5)}).warnings.size(), 3u);
    std::mt19937 random(1);
    const std::string alphabet = "newmtlmap_Kd -so.# \\\"\n\r\t/:0123m" + std::string(1, '\0');
    for (int i = 0; i < 300; ++i) {
        std::string bytes = "newmtl m\nmap_Kd ";
        for (int k = 0; k < 200; ++k) bytes += alphabet[random() % alphabet.size()];
        write("m.mtl", bytes);
        const fs::path found = read({"m"}, {"m.mtl"}).materials[0].picture;
        EXPECT_TRUE(found.empty() || fs::relative(found, folder_).string()[0] != '.');
    }
}

TEST_F(MaterialFile, WorksWithTheObjReader) {
    write("mesh.obj", "mtllib paint.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\nusemtl wood\nf 3 2 1\n");
    write("paint.mtl", "newmtl wood\nmap_Kd wood.png\nnewmtl red\nKd 1 0 0\n");
    const Result<MeshFile> file = read_mesh(folder_ / "mesh.obj", RunContext(1));
    ASSERT_TRUE(file.ok());
    const MeshMaterials result = read_materials(file->mesh, folder_ / "mesh.obj");
    ASSERT_EQ(result.materials.size(), 2u);
    expect_color(result.materials[0], {1, 0, 0});
    EXPECT_EQ(result.materials[1].picture, folder_ / "wood.png");
}

TEST_F(MaterialFile, OpacityAndSurfaceAreRead) {
    const MeshMaterial metal = material("Kd 1 0 0\nd 0.5\nTr 0.9\nPr 0.25\nPm 1 # all\n");
    EXPECT_EQ(metal.opacity, 0.5f); // d counts, whatever Tr says
    EXPECT_EQ(metal.roughness, 0.25f);
    EXPECT_EQ(metal.metallic, 1.0f);
    EXPECT_EQ(material("Tr 0.25\n").opacity, 0.75f);
    EXPECT_EQ(material("Tr 1\n").opacity, 1.0f); // means opaque to some programs, and nothing is to be hidden
    EXPECT_EQ(material("d -halo 0.5\n").opacity, 0.5f);
    EXPECT_EQ(material("d 7\nPr -1\nPm nan\nPm x\n").opacity, 1.0f);
    const MeshMaterial plain = material("Kd 1 0 0\n");
    EXPECT_EQ(plain.opacity, 1.0f);
    EXPECT_EQ(plain.roughness, 1.0f);
    EXPECT_EQ(plain.metallic, 0.0f);
}

namespace {

const std::string kPng = "\x89PNG\r\n\x1a\n one", kOtherPng = "\x89PNG\r\n\x1a\n two", kJpeg = "\xff\xd8\xff three";

/// A triangle for each embedded material.
Mesh mesh_with(const std::vector<std::pair<std::string, std::string>>& names_and_pictures) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.uvs.values.assign(3, Vec2f(0.5f, 0.25f));
    for (const auto& [name, picture] : names_and_pictures) {
        mesh.add_face(Triangle{0, 1, 2});
        mesh.materials.of_face.push_back(static_cast<Index>(mesh.materials.names.size()));
        mesh.materials.names.push_back(name);
        MeshMaterial& material = mesh.embedded_materials.emplace_back();
        material.name = name;
        if (!picture.empty()) material.picture_bytes = std::make_shared<const std::string>(picture);
    }
    return mesh;
}

std::string bytes_of_file(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

} // namespace

TEST_F(MaterialFile, EmbeddedMaterialsGoBeforeLibraries) {
    write("m.mtl", "newmtl m\nKd 1 0 0\n");
    Mesh mesh = mesh_with({{"m", kPng}});
    mesh.material_files = {"m.mtl", "gone.mtl"};
    const MeshMaterials result = read_materials(mesh, folder_ / "mesh.obj");
    EXPECT_TRUE(result.warnings.empty());
    ASSERT_EQ(result.materials.size(), 1u);
    expect_color(result.materials[0], {0.8f, 0.8f, 0.8f});
    EXPECT_EQ(result.materials[0].picture_bytes, mesh.embedded_materials[0].picture_bytes);
}

TEST_F(MaterialFile, EmbeddedMaterialsComeBackFromFilesBesideAnObj) {
    Mesh mesh = mesh_with({{"red paint", ""}, {"../wood #1", kPng}, {"", kJpeg}, {"", kOtherPng}});
    MeshMaterial& paint = mesh.embedded_materials[0];
    paint.color = {1, 0.1f, 0};
    paint.opacity = 0.3f;
    paint.metallic = 0.7f;
    paint.roughness = 0.1f;
    const fs::path obj = folder_ / "a b.obj";
    const Result<std::vector<std::string>> written = write_mesh(mesh, obj, {}, RunContext(1));
    ASSERT_TRUE(written.ok());
    EXPECT_TRUE(written->empty()) << testing::PrintToString(*written);
    EXPECT_TRUE(bytes_of_file(folder_ / "a_b__.._wood__1.png") == kPng) << "a name stays in the folder";
    const Result<MeshFile> file = read_mesh(obj, RunContext(1));
    ASSERT_TRUE(file.ok());
    EXPECT_EQ(file->mesh.material_files, std::vector<std::string>{"a_b.mtl"});
    const MeshMaterials back = read_materials(file->mesh, obj);
    EXPECT_TRUE(back.warnings.empty()) << testing::PrintToString(back.warnings);
    ASSERT_EQ(back.materials.size(), 4u);
    EXPECT_EQ(file->mesh.materials.names,
              (std::vector<std::string>{"red paint", "../wood #1", "material", "material_2"}));
    EXPECT_EQ(back.materials[0].color, paint.color);
    EXPECT_EQ(back.materials[0].opacity, paint.opacity);
    EXPECT_EQ(back.materials[0].metallic, paint.metallic);
    EXPECT_EQ(back.materials[0].roughness, paint.roughness);
    const std::string pictures[] = {"", kPng, kJpeg, kOtherPng};
    for (std::size_t m = 1; m < 4; ++m) EXPECT_TRUE(bytes_of_file(back.materials[m].picture) == pictures[m]);
}

TEST_F(MaterialFile, FilesOfOthersAreNotReplaced) {
    write("x.mtl", "newmtl mine\nKd 1 0 0\n");
    write("x_wood.png", "mine");
    ASSERT_TRUE(write_mesh(mesh_with({{"wood", kPng}}), folder_ / "x.obj", {}, RunContext(1)).ok());
    EXPECT_TRUE(bytes_of_file(folder_ / "x.mtl").starts_with("newmtl mine"));
    EXPECT_TRUE(bytes_of_file(folder_ / "x_wood.png") == "mine");
    EXPECT_TRUE(bytes_of_file(folder_ / "x_wood_2.png") == kPng);
    EXPECT_TRUE(bytes_of_file(folder_ / "x.obj").starts_with("mtllib x_2.mtl\n"));
    // Our own are, when the mesh is written again.
    ASSERT_TRUE(write_mesh(mesh_with({{"wood", kOtherPng}}), folder_ / "x.obj", {}, RunContext(1)).ok());
    EXPECT_TRUE(bytes_of_file(folder_ / "x_wood_2.png") == kOtherPng);
    EXPECT_FALSE(fs::exists(folder_ / "x_3.mtl"));
    EXPECT_FALSE(fs::exists(folder_ / "x_wood_3.png"));
}

TEST_F(MaterialFile, WithoutAFolderMaterialsAreLostAndSaid) {
    std::string bytes;
    const Result<std::vector<std::string>> warnings =
        write_mesh(mesh_with({{"wood", kPng}}), MeshFormat::obj, bytes, {}, RunContext());
    ASSERT_TRUE(warnings.ok());
    EXPECT_EQ(*warnings, std::vector<std::string>{"OBJ cannot hold embedded materials; left out."});
    EXPECT_EQ(bytes.find("mtllib"), std::string::npos);
    EXPECT_NE(bytes.find("usemtl wood"), std::string::npos);
}
