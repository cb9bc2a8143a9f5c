// filigree figures: the files, the numbers in them, and what they are made of.
#include "apps/program.h"
#include "cases.h"

#include <algorithm>
#include <cmath>

using namespace filigree_test;

namespace {

const std::vector<std::string> kDiagrams = {"1.1", "2.2", "2.3", "2.4", "2.6", "2.7", "2.8"};
const std::vector<std::string> kQuick = {"--width", "180", "--passes", "1"};

std::vector<std::string> command(const std::vector<std::string>& only, std::vector<std::string> further = kQuick) {
    std::vector<std::string> words = {"figures", "-o", "out"};
    if (!only.empty()) words.push_back("--only");
    words.insert(words.end(), only.begin(), only.end());
    words.insert(words.end(), further.begin(), further.end());
    return words;
}

std::string file_of(const std::string& name, const std::string& format) {
    std::string file = "out/figure_" + name + "." + format;
    std::replace(file.begin() + 4, file.end() - std::ptrdiff_t(format.size()) - 1, '.', '_');
    return file;
}

std::size_t count(const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
    return found;
}

using Point = std::vector<double>;

double distance(const Point& a, const Point& b) { return std::hypot(b[0] - a[0], b[1] - a[1]); }

/// How far p is from the line through a and b.
double height_over(const Point& a, const Point& b, const Point& p) {
    return ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])) / distance(a, b);
}

Point cross(const Point& a, const Point& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

class Figures : public Program {
protected:
    /// The numbers of one figure.
    Json values(const std::string& name) const {
        std::vector<std::string> words = command({name});
        const Json result = json(words);
        EXPECT_EQ(result.at("figures").size(), 1u);
        EXPECT_EQ(result.at("figures")[0].at("name"), name);
        return result.at("figures")[0].at("values");
    }
    /// Whether the program has an OpenGL to draw with.
    bool can_render() const { return run(command({"2.9"})).code == 0; }
};

} // namespace

TEST_F(Figures, EveryFigureBecomesAFile) {
    if (!can_render()) GTEST_SKIP() << "no OpenGL";
    std::vector<std::string> names,
        in_order = {"1.1", "2.1",  "2.2", "2.3",    "2.4",   "2.5",     "2.6",    "2.7", "2.8",
                    "2.9", "2.10", "3.1", "border", "codes", "surfels", "broken", "scan"};
    std::vector<std::string> asked; // all
    if (!all_cases()) {             // a body falls and breaks for "broken"
        std::erase(in_order, "broken");
        asked = in_order;
    }
    const Json result = json(command(asked));
    for (const Json& figure : result.at("figures")) {
        names.push_back(figure.at("name"));
        const std::string bytes = bytes_of(path(figure.at("file")));
        EXPECT_TRUE(bytes.starts_with("\x89PNG")) << figure.at("name");
        EXPECT_EQ(figure.at("file"), file_of(figure.at("name"), "png"));
        // the width in the header: 180, big-endian
        EXPECT_EQ(bytes.substr(16, 4), std::string("\0\0\0\xb4", 4)) << figure.at("name");
    }
    EXPECT_EQ(names, in_order);
    EXPECT_EQ(std::size_t(std::distance(std::filesystem::directory_iterator(path("out")), {})), in_order.size());
}

TEST_F(Figures, SimpleTriangleObeysTheInverseLaw) {
    const Json v = values("1.1");
    const Point p1 = v.at("p1"), p2 = v.at("p2"), detail = v.at("detail");
    const Point new_p1 = v.at("new_p1"), new_p2 = v.at("new_p2"), new_detail = v.at("new_detail");
    const double width = distance(p1, p2), new_width = distance(new_p1, new_p2);
    const double height = height_over(p1, p2, detail), new_height = height_over(new_p1, new_p2, new_detail);
    EXPECT_GT(new_width, 1.2 * width);
    EXPECT_NEAR(new_height / height, width / new_width, 1e-12); // eq. 2.14
    EXPECT_NEAR(v.at("new_height").get<double>(), new_height, 1e-12);
    // and its foot is as far along the line as before
    const double along = (detail[0] - p1[0]) / (p2[0] - p1[0]);
    EXPECT_NEAR((new_detail[0] - new_p1[0]) / (new_p2[0] - new_p1[0]), along, 1e-12);
}

TEST_F(Figures, RayMeetsThePlane) {
    const Json v = values("2.2");
    const Point e = v.at("e"), p = v.at("p"), i = v.at("i"), n = v.at("normal");
    for (const char* corner : {"t1", "t2", "t3"}) EXPECT_NEAR(dot(minus(i, v.at(corner)), n), 0, 1e-12) << corner;
    const Point off_the_ray = cross(minus(i, e), minus(p, e));
    EXPECT_NEAR(dot(off_the_ray, off_the_ray), 0, 1e-20);
    EXPECT_TRUE(v.at("inside"));
}

TEST_F(Figures, BorderCasesCountAsTheReportSays) {
    const Json rays = values("2.3").at("cases");
    for (const Json& ray : rays)
        EXPECT_EQ(ray.at("dots")[0].get<double>() * ray.at("dots")[1].get<double>() > 0, ray.at("penetrates"));
    EXPECT_NE(rays[0].at("penetrates"), rays[1].at("penetrates"));

    const unsigned quads[] = {4, 3, 3, 2}, taken_off[] = {5, 4, 3, 1};
    const Json cases = values("2.4").at("cases");
    ASSERT_EQ(cases.size(), 4u);
    for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_EQ(cases[k].at("quads"), quads[k]) << k;
        EXPECT_EQ(cases[k].at("taken_off"), taken_off[k]) << k;
    }
}

/// u C1 + v C2 + w Cm + h n, from the numbers of a stored point alone.
TEST_F(Figures, StoredPointsAreTheirRecords) {
    const Json removed = values("2.6"), areas = values("2.7");
    for (const Json& point : {removed.at("p"), removed.at("c_c"), areas.at("point")}) {
        const Point c1 = point.at("c1"), c2 = point.at("c2"), cm = point.at("cm"), p = point.at("point");
        const double u = point.at("u"), v = point.at("v"), w = point.at("w"), h = point.at("height");
        EXPECT_NEAR(u + v + w, 1, 1e-12);
        Point n = cross(minus(c2, c1), minus(cm, c1));
        const double length = std::sqrt(dot(n, n));
        for (std::size_t k = 0; k < 3; ++k)
            EXPECT_NEAR(u * c1[k] + v * c2[k] + w * cm[k] + h * n[k] / length, p[k], 1e-12) << point;
        EXPECT_GT(std::abs(h), 0.01) << "a height that can be seen";
    }
    EXPECT_LT(removed.at("largest_error"), 1e-6); // every record leads back to its vertex of the sheet
    EXPECT_EQ(removed.at("p").at("c1"), removed.at("c_c").at("c1"));
    const Json levels = values("2.8").at("levels");
    EXPECT_EQ(levels[0].at("stored"), 9 * 9 - 5 * 5);
    EXPECT_EQ(levels[1].at("stored"), 5 * 5 - 3 * 3);
}

TEST_F(Figures, DeformedCubesKeepWhatTheCaptionsSay) {
    if (!can_render()) GTEST_SKIP() << "no OpenGL";
    const Json process = values("2.10");
    const double rest = process.at("mean_height");
    EXPECT_LT(process.at("mean_height_returned"), 0.85 * rest);
    EXPECT_NEAR(process.at("mean_height_of_ends"), rest, 1e-4 * rest);
    EXPECT_EQ(values("3.1").at("moved_vertices"), 4);
    const Json methods = values("codes").at("methods");
    EXPECT_LT(methods.at("blend code").at("rms"), 0.1 * methods.at("wrap deformer").at("rms").get<double>());
    EXPECT_LT(methods.at("blend code").at("rms"), 0.1 * methods.at("reference code").at("rms").get<double>());
}

TEST_F(Figures, CarriedSurfelsKeepWhatDrawnOnesLose) {
    if (!can_render()) GTEST_SKIP() << "no OpenGL";
    const Json v = values("surfels");
    EXPECT_LT(v.at("carried_rms").get<double>(), 0.02 * v.at("drawn_rms").get<double>());
    EXPECT_GT(v.at("surfels_split"), v.at("surfels"));
}

TEST_F(Figures, ScansGoThroughTheReportsProcess) {
    if (!can_render()) GTEST_SKIP() << "no OpenGL";
    const auto check = [](const Json& v) {
        EXPECT_EQ(v.at("quads").get<int>(), v.at("patches").get<int>() << 2 * v.at("levels").get<int>());
        EXPECT_GE(v.at("levels"), 2);
        EXPECT_GT(v.at("vertices")[0], v.at("vertices")[1]);
        EXPECT_GT(v.at("vertices")[1], v.at("vertices")[2]);
        EXPECT_GT(v.at("min_scaled_jacobian"), 0);
        EXPECT_LT(v.at("rms_from_input"), 1e-3);
        const Json twisted = v.at("rms_twisted");
        EXPECT_LT(twisted.at("blend code").get<double>(), twisted.at("reference code").get<double>());
    };
    const Json own = values("scan");
    check(own);
    EXPECT_GT(own.at("input_faces"), 40'000);
    ok({"make", "torus", "-o", "torus.ply", "--resolution", "40", "--quiet"});
    const Json result =
        json(command({"scan"}, {"--width", "180", "--passes", "1", "--scan", "torus.ply", "--up", "z"}));
    check(result.at("figures")[0].at("values"));
    EXPECT_EQ(result.at("figures")[0].at("values").at("input_faces"), 3200);
    fails(3, command({"scan"}, {"--scan", "missing.ply"}), {"missing.ply"});
}

TEST_F(Figures, RaysAtTheBorderAreAnsweredRight) {
    if (!can_render()) GTEST_SKIP() << "no OpenGL";
    const Json cases = values("border").at("cases");
    ASSERT_EQ(cases.size(), 6u);
    for (const Json& shown : cases) {
        EXPECT_EQ(shown.at("wrong"), 0) << shown.at("case");
        const std::string name = shown.at("case");
        const bool touches = name.ends_with("touched") || name.starts_with("along");
        EXPECT_EQ(shown.at("inside").get<int>() == 0, touches) << name;
    }
}

TEST_F(Figures, VectorFormatsHoldTextAndPaths) {
    ok(command(kDiagrams, {"--format", "svg"}));
    for (const std::string& name : kDiagrams) {
        const std::string svg = bytes_of(path(file_of(name, "svg")));
        EXPECT_NE(svg.find("</svg>"), std::string::npos) << name;
        EXPECT_EQ(count(svg, "<image"), 0u) << name;
        EXPECT_GT(count(svg, "<path"), 50u) << name;
        EXPECT_GT(count(svg, "<use xlink:href=\"#glyph"), 100u) << name; // a letter each
    }
    ok(command(kDiagrams, {"--format", "pdf"}));
    for (const std::string& name : kDiagrams) {
        const std::string pdf = bytes_of(path(file_of(name, "pdf")));
        EXPECT_TRUE(pdf.starts_with("%PDF-")) << name;
        EXPECT_NE(pdf.find("/FontFile"), std::string::npos) << name;
        EXPECT_EQ(count(pdf, "/Subtype /Image"), 0u) << name;
    }
}

TEST_F(Figures, RenderedFiguresKeepTheirTextInVectorFormats) {
    if (!can_render()) GTEST_SKIP() << "no OpenGL";
    ok(command({"2.9"}, {"--format", "svg", "--width", "180", "--passes", "1"}));
    const std::string svg = bytes_of(path(file_of("2.9", "svg")));
    EXPECT_EQ(count(svg, "<image"), 2u);
    EXPECT_GT(count(svg, "<use xlink:href=\"#glyph"), 100u);
}

TEST_F(Figures, SameCommandSameBytes) {
    for (const std::string format : {"png", "svg", "pdf"}) {
        ok(command(kDiagrams, {"--format", format, "--width", "360"}));
        std::vector<std::string> before;
        for (const std::string& name : kDiagrams) before.push_back(bytes_of(path(file_of(name, format))));
        ok(command(kDiagrams, {"--format", format, "--width", "360", "--threads", "1"}));
        for (std::size_t k = 0; k < kDiagrams.size(); ++k)
            EXPECT_TRUE(bytes_of(path(file_of(kDiagrams[k], format))) == before[k]) << kDiagrams[k] << ' ' << format;
    }
}

TEST_F(Figures, FigureDoesNotDependOnThoseBeforeIt) {
    if (!can_render()) GTEST_SKIP() << "no OpenGL";
    const std::vector<std::string> svg = {"--format", "svg", "--width", "180", "--passes", "1"};
    ok(command({"2.9", "3.1"}, svg));
    const std::string after_another = bytes_of(path(file_of("3.1", "svg")));
    ok(command({"3.1"}, svg));
    EXPECT_TRUE(bytes_of(path(file_of("3.1", "svg"))) == after_another);
}

TEST_F(Figures, BadArgumentsAreRefusedAndNothingIsWritten) {
    fails(2, command({"1.1", "9.9"}), {"no figure '9.9'", "--only", "1.1", "2.10", "codes"});
    fails(2, {"figures", "-o", "out", "--format", "gif"}, {"--format", "gif"});
    fails(2, {"figures", "-o", "out", "--width", "10"}, {"--width"});
    EXPECT_TRUE(files().empty());
    write("taken", "");
    fails(6, {"figures", "-o", "taken", "--only", "1.1"}, {"taken"});
    EXPECT_EQ(files(), std::vector<std::string>{"taken"});
}

TEST_F(Figures, CancelLeavesTheFolderAsItWas) {
    std::filesystem::create_directory(path("out"));
    write("out/figure_1_1.png", "mine");
    const Ran ran = run({"figures", "-o", "out"}, "/dev/null", 0.3);
    if (ran.code == 0 || ran.code == 5) GTEST_SKIP() << "too quick to cancel, or no OpenGL";
    EXPECT_EQ(ran.code, 130);
    EXPECT_EQ(bytes_of(path("out/figure_1_1.png")), "mine");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(path("out")), {}), 1);
}
