#include "filigree/file.h"

#include <gtest/gtest.h>

namespace stl_test {

using namespace filigree;

namespace {

Result<MeshFile> read(const std::string& text) { return read_mesh(text, "cow.stl", RunContext(1)); }

std::string facet(const std::string& a, const std::string& b, const std::string& c) {
    return "facet normal nan 0 0\n outer loop\n  vertex " + a + "\n  vertex " + b + "\n  vertex " + c +
           "\n endloop\nendfacet\n";
}

} // namespace

TEST(Stl, WeldsInOrderOfFirstAppearance) {
    const auto file =
        read("solid\n" + facet("5 0 0", "0 0 0", "0 1 0") + facet("-0 0.0 -0", "5 0 0", "0 0 1e0") + "endsolid\n");
    EXPECT_EQ(file->mesh.corners, (std::vector<Index>{0, 1, 2, 1, 0, 3}));
    EXPECT_EQ(file->mesh.positions[0], Vec3f(5, 0, 0));
    EXPECT_TRUE(file->warnings.empty());
}

TEST(Stl, FarFromZeroNothingIsWeldedThatIsApart) {
    const auto file = read("solid\n" + facet("500000.001 0 0", "500000.002 0 0", "500000.001 0.001 0") + "endsolid\n");
    EXPECT_EQ(file->mesh.vertex_count(), 3u);
    EXPECT_NE(file->mesh.origin.x(), 0);
}

TEST(Stl, SolidsBecomeObjects) {
    const std::string text = "solid one piece\n" + facet("0 0 0", "1 0 0", "0 1 0") +
                             "endsolid one piece\nsolid two\n" + facet("0 0 0", "0 1 0", "0 0 1") + "endsolid two\n";
    const auto file = read(text);
    EXPECT_EQ(file->mesh.objects.names, (std::vector<std::string>{"one piece", "two"}));
    EXPECT_EQ(file->mesh.objects.of_face, (std::vector<Index>{0, 1}));
    std::string bytes;
    ASSERT_TRUE(write_mesh(file->mesh, MeshFormat::stl, bytes, {.ascii = true}, RunContext()).ok());
    EXPECT_EQ(read(bytes)->mesh.objects.of_face, file->mesh.objects.of_face);
}

TEST(Stl, ABinaryHeaderMayHoldAnyWords) {
    std::string bytes = "solid cube\nfacet normal\n";
    bytes.resize(84 + 50, '\0');
    bytes[80] = 1;
    for (const auto& [corner, axis] : {std::pair(1, 0), std::pair(2, 1)}) // 1 as a float
        bytes.replace(std::size_t(84 + 12 + 12 * corner + 4 * axis), 4, std::string("\0\0\x80\x3f", 4));
    const auto file = read(bytes);
    ASSERT_TRUE(file.ok()) << file.error().message;
    EXPECT_EQ(file->mesh.positions, (std::vector<Vec3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
}

TEST(Stl, ErrorsNameThePlace) {
    std::string count_lies(84 + 50, '\0');
    count_lies[80] = 2;
    std::string not_finite(84 + 100, '\0');
    not_finite[80] = 2;
    not_finite.replace(84 + 50 + 12, 4, std::string("\0\0\x80\x7f", 4));
    const std::vector<std::pair<std::string, std::string>> cases = {
        {std::string(83, '\0'), "too short"},
        {count_lies, "promises 2 facets at byte 80, but holds 1"},
        {not_finite, "facet 1 at byte 134"},
        {"solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0\nvertex 1 0 0", "cow.stl:5:"},
        {"solid\nfacet normal 0 0 0\nouter loop\nvertex 0,5 0 0", "cow.stl:4:"},
        {"solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1", "cut off"},
        {"solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\nvertex 1 1 1\nvertex 2 2 2\n",
         "more than three"},
        {"solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 1e999\n", "finite"},
    };
    for (const auto& [text, part] : cases) {
        const auto file = read(text);
        ASSERT_FALSE(file.ok()) << part;
        EXPECT_NE(file.error().message.find(part), std::string::npos) << file.error().message << " for " << part;
    }
}

} // namespace stl_test
