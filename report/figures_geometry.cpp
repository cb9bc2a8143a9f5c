// Figures 1.1 and 2.2 to 2.4: plane and solid geometry, from the report's equations.
#include "figures.h"
#include "figures_layout.h"

#include "filigree/reference/height_law.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <Eigen/Geometry>

#include <fmt/format.h>

namespace filigree::report {

namespace {

// --- figure 1.1 ---

/// A line P1 P2 with a detail over it: the foot's place along the line, and the height.
struct DetailOverLine {
    Point p1, p2;
    double along, height;

    double width() const { return (p2 - p1).norm(); }
    Point foot() const { return p1 + along * (p2 - p1); }
    Point detail() const {
        const Point direction = (p2 - p1) / width();
        return foot() + height * Point(-direction.y(), direction.x());
    }
};

/// Draws such lines in a panel, one model unit to `scale` page units, the line's middle at the panel's.
class LinePanel {
public:
    LinePanel(Page& page, const Panel& panel) : page_(page), origin_(panel.at(0.5, 0.79)) {}

    Point at(Point p) const { return origin_ + kScale * Point(p.x(), -p.y()); }

    void triangle(const DetailOverLine& d) {
        page_.polygon(std::array{at(d.p1), at(d.p2), at(d.detail())}, kSheet, {kBlack, 1.4});
    }
    void ghost(const DetailOverLine& d) {
        page_.polyline(std::array{at(d.p1), at(d.detail()), at(d.p2)}, {kPale, 1.2, true});
    }
    void base(const DetailOverLine& d) { page_.line(at(d.p1), at(d.p2), {kBlack, 1.8}); }
    void ends(const DetailOverLine& d, const std::string& mark) {
        dot(page_, at(d.p1), kBlue);
        dot(page_, at(d.p2), kBlue);
        label(page_, "P_1" + mark, at(d.p1), {-16, 0}, kBlue);
        label(page_, "P_2" + mark, at(d.p2), {17, 0}, kBlue);
    }
    void width(const DetailOverLine& d, const std::string& text) {
        dimension(page_, at(d.p1) + Point(0, 18), at(d.p2) + Point(0, 18), text);
    }
    void height(const DetailOverLine& d, const std::string& text) {
        page_.line(at(d.foot()), at(d.detail()), {kRed, 1.0, true});
        const double side = page_.text_width(text, {.size = 12}) / 2 + 7;
        page_.text(text, 0.34 * at(d.detail()) + 0.66 * at(d.foot()) + Point(side, 4.5),
                   {.size = 12, .ink = kRed, .align = Align::centre, .halo = true});
    }
    void detail(const DetailOverLine& d, const std::string& name) {
        dot(page_, at(d.detail()), kRed);
        label(page_, name, at(d.detail()), {0, -15}, kRed);
    }

private:
    static constexpr double kScale = 82;
    Page& page_;
    Point origin_;
};

// --- figures 2.2 to 2.4 ---

/// Eq. 2.2 to 2.5: where the ray from e through p meets the plane of a triangle.
struct PlaneHit {
    Vec3d normal, point;
    double t;
};
PlaneHit meet_plane(const std::array<Vec3d, 3>& triangle, const Vec3d& e, const Vec3d& p) {
    const Vec3d normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
    const double d = triangle[0].dot(normal);
    const double t = (d - e.dot(normal)) / (p - e).dot(normal);
    return {normal, e + (p - e) * t, t};
}

/// Eq. 2.6 for the three sides; inside when none is negative.
std::array<double, 3> side_tests(const std::array<Vec3d, 3>& triangle, const Vec3d& point) {
    std::array<double, 3> tests;
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec3d &a = triangle[i], &b = triangle[(i + 1) % 3], &c = triangle[(i + 2) % 3];
        tests[i] = (b - a).cross(point - a).dot((b - a).cross(c - a));
    }
    return tests;
}

/// Two quads of a model that meet at a ridge, and a ray through the ridge.
struct RidgeCase {
    Vec3d from, to;
    std::array<double, 2> dots; ///< the ray's direction (unit) with the unit normals
    bool penetrates() const { return dots[0] * dots[1] > 0; }
};

class Ridge {
public:
    static constexpr double kHalf = 1.15, kDepth = 0.85, kFall = 0.72, kFloor = -1.35;
    const std::array<Vec3d, 4> left{Vec3d(-kHalf, -kDepth, -kFall), Vec3d(0, -kDepth, 0), Vec3d(0, kDepth, 0),
                                    Vec3d(-kHalf, kDepth, -kFall)};
    const std::array<Vec3d, 4> right{Vec3d(0, -kDepth, 0), Vec3d(kHalf, -kDepth, -kFall), Vec3d(kHalf, kDepth, -kFall),
                                     Vec3d(0, kDepth, 0)};
    const std::array<Vec3d, 5> front{Vec3d(-kHalf, -kDepth, kFloor), Vec3d(kHalf, -kDepth, kFloor),
                                     Vec3d(kHalf, -kDepth, -kFall), Vec3d(0, -kDepth, 0),
                                     Vec3d(-kHalf, -kDepth, -kFall)};
    const std::array<Vec3d, 4> side{Vec3d(kHalf, -kDepth, kFloor), Vec3d(kHalf, kDepth, kFloor),
                                    Vec3d(kHalf, kDepth, -kFall), Vec3d(kHalf, -kDepth, -kFall)};

    static Vec3d normal(std::span<const Vec3d> face) {
        return (face[1] - face[0]).cross(face[2] - face[0]).normalized();
    }
    RidgeCase ray(const Vec3d& from, const Vec3d& to) const {
        const Vec3d direction = (to - from).normalized();
        return {from, to, {direction.dot(normal(left)), direction.dot(normal(right))}};
    }
};

void draw_ridge_case(Page& page, const Panel& panel, const Ridge& ridge, const RidgeCase& ray) {
    Projection view(28, 27);
    std::vector<Vec3d> extent(ridge.front.begin(), ridge.front.end());
    extent.insert(extent.end(), ridge.side.begin(), ridge.side.end());
    for (const Vec3d& p : {Vec3d(-1.5, -0.2, 1.25), Vec3d(1.6, 0.3, 0.5)}) extent.push_back(p); // the same in both
    view.fit(extent, panel);
    const auto face = [&](std::span<const Vec3d> corners) {
        page.polygon(view(corners), shaded(kSheet, view, Ridge::normal(corners)), {kBlack, 1.1});
    };
    const auto hatch = [&](std::span<const Vec3d> corners) { // a quad is two triangles
        page.line(view(corners[0]), view(corners[2]), {kGrey, 0.8, true});
    };
    face(ridge.front);
    face(ridge.side);
    face(ridge.left);
    face(ridge.right);
    hatch(ridge.left);
    hatch(ridge.right);
    page.line(view(ridge.left[1]), view(ridge.left[2]), {kBlack, 2.0});

    const char* names[] = {"N_1", "N_2"};
    int number = 0;
    for (const auto* quad : {&ridge.left, &ridge.right}) {
        const Vec3d outer = 0.5 * ((*quad)[number == 0 ? 0 : 1] + (*quad)[number == 0 ? 3 : 2]);
        const Vec3d foot = 0.82 * outer - Vec3d(0, 0.5, 0);
        const Vec3d tip = foot + 0.46 * Ridge::normal(*quad);
        page.arrow(view(foot), view(tip), {kGreen, 1.3});
        label(page, names[number], view(tip), {number == 0 ? -13.0 : 15.0, number == 0 ? -5.0 : 3.0}, kGreen);
        ++number;
    }

    const Point hit = view(Vec3d(0, 0, 0));
    page.line(view(ray.from), hit, {kRed, 1.6});
    if (ray.penetrates()) {
        page.line(hit, view(ray.to), {kRed, 1.6, true});
        hollow_dot(page, view(ray.to), kRed);
        label(page, "P", view(ray.to), {13, 4}, kRed);
    } else {
        page.line(hit, view(ray.to), {kRed, 1.6});
        dot(page, view(ray.to), kRed);
        label(page, "P", view(ray.to), {13, 4}, kRed);
    }
    dot(page, view(ray.from), kBlack);
    label(page, "E", view(ray.from), {-13, -3});
    dot(page, hit, kRed, 4.2);
    label(page, "I", hit, {3, -16}, kRed);
}

/// A few quads, each cut along one of its diagonals.
struct CutQuads {
    std::vector<Vec3d> positions;
    std::vector<std::array<Index, 4>> quads;
    std::vector<std::array<Index, 3>> triangles;
    std::vector<std::array<Index, 2>> diagonals;

    Index vertex(const Vec3d& p) {
        for (Index v = 0; v < positions.size(); ++v)
            if ((positions[v] - p).norm() < 1e-9) return v;
        positions.push_back(p);
        return Index(positions.size() - 1);
    }
    /// n x n quads over origin, origin + u, origin + u + v, origin + v; cut from the first corner or the second.
    void add_face(const Vec3d& origin, const Vec3d& u, const Vec3d& v, int n, bool from_second) {
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                const auto at = [&](int a, int b) { return vertex(origin + double(a) / n * u + double(b) / n * v); };
                const std::array<Index, 4> q = {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)};
                quads.push_back(q);
                const std::size_t s = from_second ? 1 : 0;
                triangles.push_back({q[s], q[s + 1], q[s + 2]});
                triangles.push_back({q[s], q[s + 2], q[(s + 3) % 4]});
                diagonals.push_back({q[s], q[s + 2]});
            }
    }
};

/// A point where a ray may meet such quads: one vertex, or two that are the ends of an edge.
struct SharedPoint {
    CutQuads mesh;
    std::vector<Index> on;
    Vec3d ray; ///< from the point towards the eye
    double yaw, pitch;

    Vec3d place() const {
        Vec3d sum = Vec3d::Zero();
        for (const Index v : on) sum += mesh.positions[v];
        return sum / double(on.size());
    }
    template <class Face>
    bool touches(const Face& face) const {
        return std::all_of(on.begin(), on.end(),
                           [&](Index v) { return std::find(face.begin(), face.end(), v) != face.end(); });
    }
    unsigned triangle_count() const {
        return unsigned(
            std::count_if(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) { return touches(t); }));
    }
    unsigned quad_count() const {
        return unsigned(std::count_if(mesh.quads.begin(), mesh.quads.end(), [&](const auto& q) { return touches(q); }));
    }
};

std::vector<SharedPoint> shared_points() {
    const Vec3d x(2, 0, 0), y(0, 2, 0), z(0, 0, 2), low(-1, -1, -1);
    std::vector<SharedPoint> cases(4);
    for (const std::size_t flat : {0u, 3u}) {
        cases[flat].mesh.add_face({-1, -1, 0}, x, y, 4, false);
        for (Vec3d& p : cases[flat].mesh.positions) // as wavy as the model
            p.z() = 0.13 * std::sin(2.1 * p.x() + 0.4) * std::sin(2.3 * p.y() + 1.1);
        cases[flat].ray = Vec3d(-0.3, 0.15, 1.4);
        cases[flat].yaw = 20;
        cases[flat].pitch = 40;
    }
    const auto nearest = [](SharedPoint& c, const Vec3d& p) {
        Index best = 0;
        const auto far = [&](Index v) {
            return (c.mesh.positions[v] - p).head<2>().norm() + std::abs(c.mesh.positions[v].z() - p.z());
        };
        for (Index v = 0; v < c.mesh.positions.size(); ++v)
            if (far(v) < far(best)) best = v;
        c.on.push_back(best);
    };
    nearest(cases[0], {0, 0, 0});
    nearest(cases[3], {-0.5, 0, 0});
    nearest(cases[3], {0, 0, 0});

    // The cube's front, left and lower side, and its front, left and upper side.
    cases[1].mesh.add_face(low, x, z, 3, false);
    cases[1].mesh.add_face(low, y, z, 3, true);
    cases[1].mesh.add_face(low, x, y, 3, false);
    nearest(cases[1], low);
    cases[1].ray = Vec3d(-1.9, -0.3, -0.75);
    cases[1].yaw = -38;
    cases[1].pitch = -30;
    cases[2].mesh.add_face(low, x, z, 3, false);
    cases[2].mesh.add_face(low, y, z, 3, true);
    cases[2].mesh.add_face({-1, -1, 1}, x, y, 3, true);
    nearest(cases[2], {-1, -1, 1});
    cases[2].ray = Vec3d(-1.9, -0.3, 0.75);
    cases[2].yaw = -38;
    cases[2].pitch = 30;
    return cases;
}

void draw_shared_point(Page& page, const Panel& panel, const SharedPoint& shared) {
    Projection view(shared.yaw, shared.pitch);
    std::vector<Vec3d> extent = shared.mesh.positions;
    const Vec3d eye = shared.place() + shared.ray;
    extent.push_back(eye + 0.15 * shared.ray); // and its name
    view.fit(extent, panel);
    const CutQuads& mesh = shared.mesh;
    for (const auto& t : mesh.triangles) {
        std::array<Vec3d, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) corners[k] = mesh.positions[t[k]];
        Vec3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        if (normal.dot(view.to_viewer()) < 0) normal = -normal;
        const Ink fill = shared.touches(t) ? Ink{0.98, 0.80, 0.66} : kSheet;
        page.polygon(view(corners), shaded(fill, view, normal), {shaded(fill, view, normal), 0.4});
    }
    for (const auto& d : mesh.diagonals)
        page.line(view(mesh.positions[d[0]]), view(mesh.positions[d[1]]), {kGrey, 0.7, true});
    for (const auto& q : mesh.quads) {
        std::vector<Vec3d> corners;
        for (const Index v : q) corners.push_back(mesh.positions[v]);
        page.polygon(view(corners), kClear, {kBlack, 1.0});
    }
    if (shared.on.size() == 2)
        page.line(view(mesh.positions[shared.on[0]]), view(mesh.positions[shared.on[1]]), {kRed, 2.2});
    const Point hit = view(shared.place()), from = view(eye);
    const Point along = (hit - from).normalized();
    page.arrow(from, hit - 4.5 * along, {kRed, 1.6});
    dot(page, hit, kRed, 4.2);
    label(page, "E", from, -11 * along, kBlack);
}

} // namespace

Figure draw_simple_triangle(FigureRenderer&) {
    constexpr double kPanelHeight = 158, kStretch = 1.6;
    const DetailOverLine rest{{-1, 0}, {1, 0}, 0.42, 1.2};
    DetailOverLine now{kStretch * rest.p1, kStretch * rest.p2, rest.along, 0};
    now.height =
        rest.height * height_law_scale(HeightLaw::inverse, rest.width() * rest.width(), now.width() * now.width());

    Page page = captioned_page(
        content_height(2, kPanelHeight), "Figure 1.1",
        fmt::format(
            "A detail taken off a line and put back after a deformation. The detail is kept as its place along "
            "*P*_1*P*_2 and its height. The line is stretched to {:.1f} times its width, so the height that returns is "
            "{:.3g} instead of {:.3g}: new height / old height = old width / new width (eq. 2.14).",
            kStretch, now.height, rest.height));
    const std::vector<Panel> panels = panels_in_rows(2, 2, kPanelHeight);

    LinePanel original(page, panels[0]);
    original.triangle(rest);
    original.height(rest, fmt::format("*h* = {:.3g}", rest.height));
    original.width(rest, fmt::format("*w* = {:.3g}", rest.width()));
    original.ends(rest, "");
    original.detail(rest, "P");
    subcaption(page, panels[0], "i", "original triangle");

    LinePanel removed(page, panels[1]);
    removed.ghost(rest);
    removed.base(rest);
    hollow_dot(page, removed.at(rest.detail()), kPale);
    removed.width(rest, fmt::format("*w* = {:.3g}", rest.width()));
    removed.ends(rest, "");
    subcaption(page, panels[1], "ii", "the detail removed");

    LinePanel stretched(page, panels[2]);
    stretched.base(now);
    hollow_dot(page, stretched.at(rest.p1), kPale);
    hollow_dot(page, stretched.at(rest.p2), kPale);
    for (const auto& [before, after] : {std::pair(rest.p1, now.p1), std::pair(rest.p2, now.p2)})
        page.arrow(stretched.at(before) - Point(0, 16), stretched.at(after) - Point(0, 16), {kBlue, 1.4});
    stretched.width(now, fmt::format("*w*′ = {:.3g}", now.width()));
    stretched.ends(now, "′");
    subcaption(page, panels[2], "iii", "the line stretched");

    LinePanel returned(page, panels[3]);
    returned.triangle(now);
    const DetailOverLine kept{now.p1, now.p2, now.along, rest.height};
    returned.ghost(kept);
    returned.height(now, fmt::format("*h*′ = {:.3g}", now.height));
    returned.width(now, fmt::format("*w*′ = {:.3g}", now.width()));
    hollow_dot(page, returned.at(kept.detail()), kPale);
    page.text("the old height", returned.at(kept.detail()) + Point(10, 1), {.size = 11, .ink = kGrey});
    returned.ends(now, "′");
    returned.detail(now, "P′");
    subcaption(page, panels[3], "iv", "the detail returned, lower");

    return {std::move(page),
            {{"old_width", rest.width()},
             {"new_width", now.width()},
             {"old_height", rest.height},
             {"new_height", now.height},
             {"p1", {rest.p1.x(), rest.p1.y()}},
             {"p2", {rest.p2.x(), rest.p2.y()}},
             {"detail", {rest.detail().x(), rest.detail().y()}},
             {"new_p1", {now.p1.x(), now.p1.y()}},
             {"new_p2", {now.p2.x(), now.p2.y()}},
             {"new_detail", {now.detail().x(), now.detail().y()}}}};
}

Figure draw_ray_and_triangle(FigureRenderer&) {
    constexpr double kPanelHeight = 330;
    const std::array<Vec3d, 3> triangle = {Vec3d(-1.25, -0.75, -0.05), Vec3d(1.25, -0.85, 0.2), Vec3d(0.25, 1.1, 0.1)};
    const Vec3d e(-1.35, -0.1, 1.75), p(1.15, 0.05, -1.15);
    const PlaneHit hit = meet_plane(triangle, e, p);
    const std::array<double, 3> tests = side_tests(triangle, hit.point);
    const bool inside = *std::min_element(tests.begin(), tests.end()) > 0;

    Page page = captioned_page(
        content_height(1, kPanelHeight) - kSubcaptionRoom, "Figure 2.2",
        fmt::format("The ray from the eye *E* to a sample *P* meets the plane of *T*_1, *T*_2 and *T*_3 in *I*, which "
                    "eq. 2.5 puts at *t*\u00a0=\u00a0{:.3f} of the way, {}. *N* is the plane’s normal (eq. 2.2). By "
                    "eq. 2.6 *I* "
                    "lies on the inner side of {} of the triangle’s three lines, so the ray {} the triangle.",
                    hit.t, hit.t < 1 ? "before *P*" : "beyond *P*", inside ? "each" : "not every one",
                    inside ? "goes through" : "passes"));
    const Panel panel{
        {kFigureMargin + 60, kFigureMargin + 8}, kFigureWidth - 2 * kFigureMargin - 120, kPanelHeight - 16};
    Projection view(24, 28);

    // a piece of the plane around the triangle
    const Vec3d normal = hit.normal.normalized();
    const Vec3d u = (Vec3d::UnitX() - normal.x() * normal).normalized(), v = normal.cross(u);
    const Vec3d middle = (triangle[0] + triangle[1] + triangle[2]) / 3 + 0.12 * v;
    std::array<Vec3d, 4> plane;
    for (std::size_t i = 0; i < 4; ++i)
        plane[i] = middle + (i == 0 || i == 3 ? -1.9 : 1.9) * u + (i < 2 ? -1.3 : 1.35) * v;
    std::vector<Vec3d> extent(plane.begin(), plane.end());
    extent.insert(extent.end(), {e, p});
    view.fit(extent, panel);

    const std::vector<Point> outline = view(plane);
    const Point i = view(hit.point);
    page.polygon(outline, {kSheet.r, kSheet.g, kSheet.b, 0.75}, {kPale, 1.1});
    page.polygon(view(triangle), {0.62, 0.73, 0.88, 0.55}, {kBlue, 1.5});
    line_behind(page, i, view(p) - 5 * (view(p) - i).normalized(), outline, {kRed, 1.7}, true);
    page.line(view(e), i, {kRed, 1.7});
    const Vec3d normal_foot = triangle[0], normal_tip = normal_foot + 0.75 * normal;
    page.arrow(view(normal_foot), view(normal_tip), {kGreen, 1.5});
    label(page, "N", view(normal_tip), {-13, 0}, kGreen);
    const Point offsets[] = {{-6, 16}, {12, 14}, {18, 3}};
    for (std::size_t k = 0; k < 3; ++k) {
        dot(page, view(triangle[k]), kBlue);
        label(page, fmt::format("T_{}", k + 1), view(triangle[k]), offsets[k], kBlue);
    }
    dot(page, view(e), kBlack);
    label(page, "E", view(e), {-14, -2});
    dot(page, view(p), kRed);
    label(page, "P", view(p), {14, 4}, kRed);
    dot(page, i, kRed, 4.2);
    label(page, "I", i, {12, -11}, kRed);
    return {std::move(page),
            {{"t", hit.t},
             {"i", listed(hit.point)},
             {"normal", listed(hit.normal)},
             {"e", listed(e)},
             {"p", listed(p)},
             {"t1", listed(triangle[0])},
             {"t2", listed(triangle[1])},
             {"t3", listed(triangle[2])},
             {"side_tests", tests},
             {"inside", inside}}};
}

Figure draw_border_cases(FigureRenderer&) {
    constexpr double kPanelHeight = 250;
    const Ridge ridge;
    const RidgeCase rays[] = {ridge.ray({-1.35, -0.35, 1.35}, {0.42, 0.1089, -0.42}),
                              ridge.ray({-1.5, -0.25, 0.42}, {1.65, 0.275, -0.462})};
    Page page = captioned_page(
        content_height(1, kPanelHeight), "Figure 2.3",
        "Rays that meet the model exactly on an edge. The ray’s direction *d* is compared with the normals of the "
        "faces "
        "that share the edge. (a) Both products have the same sign: the ray goes in and counts once. (b) The signs "
        "differ: the ray grazes the ridge, stays outside, and does not count.");
    const std::vector<Panel> panels = panels_in_rows(1, 2, kPanelHeight);
    Json values = Json::array();
    for (std::size_t k = 0; k < 2; ++k) {
        draw_ridge_case(page, panels[k], ridge, rays[k]);
        subcaption(page, panels[k], k == 0 ? "a" : "b",
                   fmt::format("{}: *d*·*N*_1 = {}, *d*·*N*_2 = {}", rays[k].penetrates() ? "penetrates" : "touches",
                               signed_number(rays[k].dots[0], 2), signed_number(rays[k].dots[1], 2)));
        values.push_back({{"dots", rays[k].dots}, {"penetrates", rays[k].penetrates()}});
    }
    return {std::move(page), {{"cases", values}}};
}

Figure draw_shared_points(FigureRenderer&) {
    constexpr double kPanelHeight = 200;
    const std::vector<SharedPoint> cases = shared_points();
    Page page = captioned_page(
        content_height(2, kPanelHeight), "Figure 2.4",
        "Where a ray goes in at a point that several faces share, every triangle there reports a hit, and all but one "
        "are taken off. The triangles that report are tinted; dashed lines are the diagonals along which quads are "
        "cut. "
        "(i) Inside a face four quads meet. (ii), (iii) At a corner of the cube three quads meet, and the diagonals "
        "that "
        "end there decide how many triangles they are. (iv) Along an edge there are two.");
    const std::vector<Panel> panels = panels_in_rows(2, 2, kPanelHeight);
    const char* numbers[] = {"i", "ii", "iii", "iv"};
    Json values = Json::array();
    for (std::size_t k = 0; k < cases.size(); ++k) {
        const unsigned hits = cases[k].triangle_count(), quads = cases[k].quad_count();
        draw_shared_point(page, panels[k], cases[k]);
        subcaption(page, panels[k], numbers[k],
                   fmt::format("{} quads, {} triangles: {} taken off", quads, hits, hits - 1));
        values.push_back({{"quads", quads}, {"triangles", hits}, {"taken_off", hits - 1}});
    }
    return {std::move(page), {{"cases", values}}};
}

} // namespace filigree::report
