// Figures 2.6 to 2.8: the reference code at work on a wavy sheet. Everything drawn is read back from its records.
#include "figures.h"
#include "figures_layout.h"

#include "filigree/mesh.h"
#include "filigree/reference/reference_code.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include <fmt/format.h>

namespace filigree::report {

namespace {

constexpr Ink kTintC1{0.62, 0.75, 0.92}, kTintC2{0.70, 0.86, 0.72}, kTintCm{0.97, 0.80, 0.66};

/// Column and row on a sheet's grid.
using Cell = std::array<std::size_t, 2>;

/// A removed point: where it is on the grid, what it refers to, and its record.
struct StoredPoint {
    Cell place;
    unsigned level; ///< that it belongs to; its references are coarser
    bool is_centre;
    std::array<Cell, 4> corners; ///< C1, C2, then C3 next to C2 and C4 next to C1
    Vec3f record;                ///< v, w, h
};

/// A stored point in space.
struct Reconstruction {
    Vec3d c1, c2, c3, c4, cm; ///< the references
    double u, v, w, height;
    Vec3d foot, normal, point;
};

/// A wavy sheet, stripped to its four corners.
class StrippedSheet {
public:
    static constexpr unsigned kSide = 8; // quads
    explicit StrippedSheet(const RunContext& context)
        : mesh_(make_wavy_plane({.resolution = kSide, .frequency = 1.3, .amplitude = 0.13})),
          detail_(encode_reference(mesh_, {}, context).value()) {
        read_records();
    }

    unsigned levels() const { return detail_.patches.levels; }
    /// Grid steps between neighbours of a level.
    std::size_t step(unsigned level) const { return kSide >> level; }
    Vec3d at(const Cell& c) const { return mesh_.positions[detail_.patches.at(0, c[0], c[1])].cast<double>(); }
    const std::vector<StoredPoint>& stored() const { return stored_; }
    const StoredPoint& stored_at(const Cell& place) const {
        return *std::find_if(stored_.begin(), stored_.end(), [&](const StoredPoint& s) { return s.place == place; });
    }

    /// Eq. 2.7 with the height put back.
    Reconstruction reconstruct(const StoredPoint& s) const {
        Reconstruction r;
        r.c1 = at(s.corners[0]);
        r.c2 = at(s.corners[1]);
        r.c3 = at(s.corners[2]);
        r.c4 = at(s.corners[3]);
        r.cm = 0.5 * (r.c3 + r.c4);
        r.v = double(s.record.x());
        r.w = double(s.record.y());
        r.u = 1 - r.v - r.w;
        r.height = double(s.record.z());
        r.foot = r.u * r.c1 + r.v * r.c2 + r.w * r.cm;
        r.normal = (r.c2 - r.c1).cross(r.cm - r.c1).normalized();
        r.point = r.foot + r.height * r.normal;
        return r;
    }
    /// How far the worst reconstruction is from the sheet, model units.
    double largest_error() const {
        double largest = 0;
        for (const StoredPoint& s : stored_) largest = std::max(largest, (reconstruct(s).point - at(s.place)).norm());
        return largest;
    }

private:
    /// The order of ReferenceDetail::records, for one patch.
    void read_records() {
        std::size_t record = 0;
        const std::size_t n = kSide;
        const auto add = [&](unsigned level, const std::array<Cell, 4>& corners, const Cell& place, bool is_centre) {
            stored_.push_back({place, level, is_centre, corners, detail_.records[record++]});
        };
        for (unsigned level = 1; level <= levels(); ++level) {
            const std::size_t fine = step(level), coarse = 2 * fine;
            for (unsigned side = 0; side < 4; ++side) // the patch's border
                for (std::size_t k = 0; k < n; k += coarse) {
                    const auto on_side = [&](std::size_t along, std::size_t inwards) -> Cell {
                        if (side == 0) return {along, inwards};
                        if (side == 1) return {n - inwards, along};
                        if (side == 2) return {n - along, n - inwards};
                        return {inwards, n - along};
                    };
                    add(level, {on_side(k, 0), on_side(k + coarse, 0), on_side(k + coarse, coarse), on_side(k, coarse)},
                        on_side(k + fine, 0), false);
                }
            for (std::size_t j = 0; j < n; j += coarse)
                for (std::size_t i = 0; i < n; i += coarse) {
                    const Cell a{i, j}, b{i + coarse, j}, c{i + coarse, j + coarse}, d{i, j + coarse};
                    if (j > 0) add(level, {a, b, c, d}, {i + fine, j}, false);
                    if (i > 0) add(level, {d, a, b, c}, {i, j + fine}, false);
                    add(level, {a, b, c, d}, {i + fine, j + fine}, true);
                }
        }
    }

    Mesh mesh_;
    ReferenceDetail detail_;
    std::vector<StoredPoint> stored_;
};

Json numbers_of(const StoredPoint& s, const Reconstruction& r) {
    return {
        {"column", s.place[0]},    {"row", s.place[1]}, {"level", s.level}, {"c1", listed(r.c1)}, {"c2", listed(r.c2)},
        {"cm", listed(r.cm)},      {"u", r.u},          {"v", r.v},         {"w", r.w},           {"height", r.height},
        {"point", listed(r.point)}};
}

/// A part of the sheet’s grid.
struct Window {
    Cell low, high;
    bool holds(const Cell& c) const { return c[0] >= low[0] && c[0] <= high[0] && c[1] >= low[1] && c[1] <= high[1]; }
};

/// The quads of one level, back to front, under the view's light.
void draw_level(Page& page, const StrippedSheet& sheet, const Projection& view, const Window& window, unsigned level,
                const Stroke& stroke) {
    const std::size_t s = sheet.step(level);
    for (std::size_t j = window.high[1]; j > window.low[1]; j -= s)
        for (std::size_t i = window.low[0]; i < window.high[0]; i += s) {
            const std::array<Vec3d, 4> quad = {sheet.at({i, j - s}), sheet.at({i + s, j - s}), sheet.at({i + s, j}),
                                               sheet.at({i, j})};
            const Vec3d normal = (quad[2] - quad[0]).cross(quad[3] - quad[1]);
            page.polygon(view(quad), shaded(kSheet, view, normal), stroke);
        }
}

std::vector<Vec3d> points_of(const StrippedSheet& sheet, const Window& window) {
    std::vector<Vec3d> points;
    for (std::size_t j = window.low[1]; j <= window.high[1]; ++j)
        for (std::size_t i = window.low[0]; i <= window.high[0]; ++i) points.push_back(sheet.at({i, j}));
    return points;
}

void draw_reference_triangle(Page& page, const Projection& view, const Reconstruction& r, const Ink& ink) {
    page.polygon(view(std::array{r.c1, r.c2, r.cm}), {ink.r, ink.g, ink.b, 0.20}, {ink, 1.3});
}

void draw_middle(Page& page, const Projection& view, const Reconstruction& r, const Ink& ink) {
    page.circle(view(r.cm), 3.2, kWhite, {ink, 1.3});
}

} // namespace

Figure draw_removed_level(FigureRenderer& renderer) {
    constexpr double kPanelHeight = 236;
    const StrippedSheet sheet(renderer.context());
    const unsigned fine = sheet.levels(), coarse = fine - 1;
    const Window window{{2, 2}, {8, 8}};
    const StoredPoint &p = sheet.stored_at({5, 4}), &c = sheet.stored_at({5, 5});
    const Reconstruction rp = sheet.reconstruct(p), rc = sheet.reconstruct(c);

    Page page = captioned_page(
        content_height(1, kPanelHeight), "Figure 2.6",
        fmt::format("Part of a quad mesh before and after one level is removed: every second row and column goes. The "
                    "removed points are red. *P* lies on a coarse edge and refers to the ends of that edge, *C*_1 and "
                    "*C*_2, and to *C_m*, the middle of *C*_3 and *C*_4; the centre *C_c* has the same references. "
                    "Both are kept as a place in the plane of the three and a height over it, here {} and {} "
                    "of the sheet’s side.",
                    signed_number(rp.height, 3), signed_number(rc.height, 3)));
    const std::vector<Panel> panels = panels_in_rows(1, 2, kPanelHeight);
    for (std::size_t k = 0; k < 2; ++k) {
        Projection view(-14, 60);
        view.fit(points_of(sheet, window), panels[k]);
        draw_level(page, sheet, view, window, k == 0 ? fine : coarse, {kGrey, 1.0});
        if (k == 1) draw_reference_triangle(page, view, rp, kBlue);
        for (std::size_t j = window.low[1]; j <= window.high[1]; ++j)
            for (std::size_t i = window.low[0]; i <= window.high[0]; ++i) {
                const bool kept = i % 2 == 0 && j % 2 == 0;
                if (kept || k == 0) dot(page, view(sheet.at({i, j})), kept ? kBlack : kRed, kept ? 3.4 : 2.8);
            }
        if (k == 1)
            for (const Reconstruction& r : {rp, rc}) {
                page.line(view(r.foot), view(r.point), {kRed, 1.3});
                hollow_dot(page, view(r.point), kRed, 3.2);
            }
        draw_middle(page, view, rp, kBlue);
        for (const Vec3d& corner : {rp.c1, rp.c2, rp.c3, rp.c4}) dot(page, view(corner), kBlue, 4.2);
        label(page, "C_1", view(rp.c1), {-13, 9}, kBlue);
        label(page, "C_2", view(rp.c2), {13, 10}, kBlue);
        label(page, "C_3", view(rp.c3), {14, -9}, kBlue);
        label(page, "C_4", view(rp.c4), {-18, -3}, kBlue);
        label(page, "C_m", view(rp.cm), {-13, 13}, kBlue);
        label(page, "P", view(rp.point), {k == 0 ? 2.0 : -12.0, k == 0 ? 15.0 : 5.0}, kRed);
        label(page, "C_c", view(rc.point), {15, 7}, kRed);
        subcaption(page, panels[k], k == 0 ? "i" : "ii", k == 0 ? "original" : "one level removed");
    }
    return {std::move(page),
            {{"p", numbers_of(p, rp)}, {"c_c", numbers_of(c, rc)}, {"largest_error", sheet.largest_error()}}};
}

Figure draw_barycentric_areas(FigureRenderer& renderer) {
    constexpr double kPanelHeight = 262;
    const StrippedSheet sheet(renderer.context());
    const StoredPoint& stored = sheet.stored_at({5, 5}); // a centre: its foot lies inside the triangle
    const Reconstruction r = sheet.reconstruct(stored);
    Page page = captioned_page(
        content_height(1, kPanelHeight), "Figure 2.7",
        fmt::format("A removed point’s record. (i) The point is projected onto the plane of its references; *h* is its "
                    "height over the plane. (ii) The plane seen from above: the areas *A*_1, *A*_2 and *A*_3 opposite "
                    "*C*_1, *C*_2 and *C_m*, divided by the whole, are the projection’s barycentric coordinates "
                    "(eq. 2.8). Here *h*\u00a0=\u00a0{:.3f} of the sheet’s side.",
                    r.height));
    const std::vector<Panel> panels = panels_in_rows(1, 2, kPanelHeight);

    const Panel left{panels[0].at(0.05, 0.04), 0.9 * panels[0].width, 0.92 * panels[0].height};
    Projection view(-20, 42);
    const std::size_t s = sheet.step(stored.level);
    const Window window{{stored.place[0] - s, stored.place[1] - s}, {stored.place[0] + s, stored.place[1] + s}};
    view.fit(points_of(sheet, window), left);
    draw_level(page, sheet, view, window, sheet.levels(), {kPale, 0.9});
    draw_reference_triangle(page, view, r, kBlue);
    page.line(view(r.c3), view(r.c4), {kBlue, 1.0, true});
    for (const auto& [corner, name, offset] : {std::tuple(r.c1, "C_1", Point(-14, 6)), {r.c2, "C_2", Point(8, 15)}}) {
        dot(page, view(corner), kBlue, 4.2);
        label(page, name, view(corner), offset, kBlue);
    }
    for (const Vec3d& corner : {r.c3, r.c4}) dot(page, view(corner), kGrey);
    draw_middle(page, view, r, kBlue);
    label(page, "C_m", view(r.cm), {3, -16}, kBlue);
    page.line(view(r.foot), view(r.point), {kRed, 1.5});
    dot(page, view(r.foot), kBlack);
    label(page, "P", view(r.foot), {12, 8});
    dot(page, view(r.point), kRed);
    label(page, "h", 0.5 * (view(r.foot) + view(r.point)), {-10, 0}, kRed);
    subcaption(page, panels[0], "i", "the point over the plane of its references");

    // the plane without foreshortening: x along C1 C2, y towards Cm
    const Vec3d x = (r.c2 - r.c1).normalized(), y = r.normal.cross(x);
    const auto flat = [&](const Vec3d& p) { return Vec3d((p - r.c1).dot(x), 0, (p - r.c1).dot(y)); };
    Projection plane(0, 0);
    const std::array<Vec3d, 3> triangle = {flat(r.c1), flat(r.c2), flat(r.cm)};
    plane.fit(triangle, {panels[1].at(0.06, 0.10), 0.50 * panels[1].width, 0.78 * panels[1].height});
    const Point c1 = plane(triangle[0]), c2 = plane(triangle[1]), cm = plane(triangle[2]), p = plane(flat(r.foot));
    page.polygon(std::array{p, c2, cm}, kTintC1);
    page.polygon(std::array{p, c1, cm}, kTintC2);
    page.polygon(std::array{p, c1, c2}, kTintCm);
    for (const Point& corner : {c1, c2, cm}) page.line(p, corner, {kBlack, 1.1});
    page.polygon(std::array{c1, c2, cm}, kClear, {kBlack, 1.5});
    double line = panels[1].at(0, 0.16).y();
    const auto area = [&](const std::string& number, const Point& a, const Point& b, const Ink& tint,
                          const std::string& share, double value) {
        label(page, "A_" + number, (p + a + b) / 3, {0, 0});
        const Point key(panels[1].at(0.61, 0).x(), line);
        page.polygon(std::array{key, Point(key + Point(12, 0)), Point(key + Point(12, 12)), Point(key + Point(0, 12))},
                     tint, {kBlack, 0.8});
        page.text(fmt::format("*{}* = *A*_{} / *A* = {:.3f}", share, number, value), key + Point(18, 11), {.size = 12});
        line += 24;
    };
    area("1", c2, cm, kTintC1, "u", r.u);
    area("2", c1, cm, kTintC2, "v", r.v);
    area("3", c1, c2, kTintCm, "w", r.w);
    dot(page, c1, kBlue, 4.2);
    dot(page, c2, kBlue, 4.2);
    page.circle(cm, 3.6, kWhite, {kBlue, 1.4});
    dot(page, p, kBlack, 4.2);
    label(page, "C_1", c1, {-13, 9}, kBlue);
    label(page, "C_2", c2, {14, 9}, kBlue);
    label(page, "C_m", cm, {0, -15}, kBlue);
    label(page, "P", p, {13, -4});
    subcaption(page, panels[1], "ii", "three areas in that plane");
    return {std::move(page), {{"point", numbers_of(stored, r)}, {"largest_error", sheet.largest_error()}}};
}

Figure draw_recursive_storing(FigureRenderer& renderer) {
    constexpr double kPanelHeight = 250;
    const StrippedSheet sheet(renderer.context());
    const unsigned finest = sheet.levels();
    Page page = captioned_page(
        content_height(1, kPanelHeight), "Figure 2.8",
        "Detail is stored level after level. (i) The finest points, red, are heights over triangles of blue and black "
        "points. (ii) When they are gone, the blue points are heights over triangles of black points, and so on down "
        "to "
        "the sheet’s corners. Each line goes from the place that the stored barycentric coordinates give to the point "
        "itself; one triangle of references is filled in each picture.");
    const std::vector<Panel> panels = panels_in_rows(1, 2, kPanelHeight);
    const Window all{{0, 0}, {StrippedSheet::kSide, StrippedSheet::kSide}};
    const Cell examples[] = {{5, 5}, {2, 4}};
    Json values = Json::array();
    for (unsigned k = 0; k < 2; ++k) {
        const unsigned level = finest - k; // what is stored
        const Ink ink = k == 0 ? kRed : kBlue;
        Projection view(-20, 38);
        view.fit(points_of(sheet, all), panels[k]);
        draw_level(page, sheet, view, all, level - 1, {k == 0 ? mix(kBlue, kWhite, 0.25) : kBlack, 1.1});
        const Reconstruction example = sheet.reconstruct(sheet.stored_at(examples[k]));
        draw_reference_triangle(page, view, example, ink);
        draw_middle(page, view, example, ink);
        std::size_t count = 0;
        for (const StoredPoint& s : sheet.stored()) {
            if (s.level != level) continue;
            const Reconstruction r = sheet.reconstruct(s);
            page.line(view(r.foot), view(r.point), {ink, 1.3});
            dot(page, view(r.point), ink, 2.8);
            ++count;
        }
        for (std::size_t j = 0; j <= StrippedSheet::kSide; j += sheet.step(level - 1))
            for (std::size_t i = 0; i <= StrippedSheet::kSide; i += sheet.step(level - 1)) {
                const bool coarser = i % sheet.step(finest - 2) == 0 && j % sheet.step(finest - 2) == 0;
                dot(page, view(sheet.at({i, j})), coarser ? kBlack : kBlue, 3.6);
            }
        subcaption(page, panels[k], k == 0 ? "i" : "ii",
                   k == 0 ? fmt::format("{} red points stored over blue and black", count)
                          : fmt::format("{} blue points stored over black", count));
        values.push_back({{"level", level}, {"stored", count}});
    }
    return {std::move(page), {{"levels", values}, {"largest_error", sheet.largest_error()}}};
}

} // namespace filigree::report
