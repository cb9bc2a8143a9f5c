#include "figures_layout.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace filigree::report {

namespace {

constexpr double kCaptionSize = 12, kCaptionGap = 14;

} // namespace

std::vector<Panel> panels_in_rows(unsigned rows, unsigned columns, double panel_height) {
    const double width = (kFigureWidth - 2 * kFigureMargin - (columns - 1) * kPanelGap) / columns;
    std::vector<Panel> panels;
    for (unsigned row = 0; row < rows; ++row)
        for (unsigned column = 0; column < columns; ++column)
            panels.push_back({{kFigureMargin + column * (width + kPanelGap),
                               kFigureMargin + row * (panel_height + kSubcaptionRoom + kPanelGap)},
                              width,
                              panel_height});
    return panels;
}

double content_height(unsigned rows, double panel_height) {
    return kFigureMargin + rows * (panel_height + kSubcaptionRoom) + (rows - 1) * kPanelGap;
}

Page captioned_page(double height, const std::string& title, const std::string& caption) {
    const std::string text = "**" + title + ".** " + caption;
    const double width = kFigureWidth - 2 * kFigureMargin;
    const TextStyle style{.size = kCaptionSize};
    Page page(kFigureWidth,
              std::ceil(height + kCaptionGap + Page::paragraph_height(text, width, style) + kFigureMargin));
    page.paragraph(text, {kFigureMargin, height + kCaptionGap}, width, style);
    return page;
}

void subcaption(Page& page, const Panel& panel, const std::string& number, const std::string& text) {
    page.text("(" + number + ") " + text, {panel.centre().x(), panel.top_left.y() + panel.height + 17},
              {.size = kCaptionSize, .align = Align::centre});
}

Projection::Projection(double yaw_deg, double pitch_deg) {
    const double yaw = yaw_deg * std::numbers::pi / 180, pitch = pitch_deg * std::numbers::pi / 180;
    to_viewer_ = Vec3d(std::sin(yaw) * std::cos(pitch), -std::cos(yaw) * std::cos(pitch), std::sin(pitch));
    right_ = Vec3d(std::cos(yaw), std::sin(yaw), 0);
    up_ = to_viewer_.cross(right_);
}

void Projection::fit(std::span<const Vec3d> points, const Panel& panel) {
    scale_ = 1;
    shift_ = Point::Zero();
    Point low = Point::Constant(INFINITY), high = -low;
    for (const Vec3d& p : points) {
        low = low.cwiseMin((*this)(p));
        high = high.cwiseMax((*this)(p));
    }
    const Point size = (high - low).cwiseMax(1e-12);
    scale_ = std::min(panel.width / size.x(), panel.height / size.y());
    shift_ = panel.centre() - scale_ * 0.5 * (low + high);
}

Point Projection::operator()(const Vec3d& p) const { return shift_ + scale_ * Point(p.dot(right_), -p.dot(up_)); }

std::vector<Point> Projection::operator()(std::span<const Vec3d> points) const {
    std::vector<Point> out;
    for (const Vec3d& p : points) out.push_back((*this)(p));
    return out;
}

double Projection::shade(const Vec3d& normal) const {
    const Vec3d light = (to_viewer_ + 0.9 * up_ - 0.7 * right_).normalized();
    return 0.5 + 0.5 * normal.normalized().dot(light);
}

Ink mix(const Ink& a, const Ink& b, double t) {
    return {a.r + t * (b.r - a.r), a.g + t * (b.g - a.g), a.b + t * (b.b - a.b), a.a + t * (b.a - a.a)};
}

Ink shaded(const Ink& ink, const Projection& view, const Vec3d& normal) {
    const double t = 1 - view.shade(normal);
    return mix(ink, {0.55 * ink.r, 0.58 * ink.g, 0.63 * ink.b, ink.a}, t);
}

void dot(Page& page, Point at, const Ink& ink, double radius) { page.circle(at, radius, ink, {kWhite, 1}); }

void hollow_dot(Page& page, Point at, const Ink& ink, double radius) { page.circle(at, radius, kWhite, {ink, 1.3}); }

void label(Page& page, const std::string& name, Point at, Point offset, const Ink& ink) {
    constexpr double kSize = 15;
    page.text(name, at + offset + Point(0, 0.33 * kSize),
              {.size = kSize, .ink = ink, .align = Align::centre, .italic = true, .halo = true});
}

void dimension(Page& page, Point from, Point to, const std::string& text, const Ink& ink) {
    const TextStyle style{.size = 12, .ink = ink, .align = Align::centre};
    const Point middle = 0.5 * (from + to), along = (to - from).normalized();
    const Point gap = (0.5 * page.text_width(text, style) + 5) * along; // the line makes room for the text
    page.arrow(middle + gap, to, {ink, 0.9});
    page.arrow(middle - gap, from, {ink, 0.9});
    page.text(text, middle + Point(0, 0.36 * style.size), style);
}

std::string signed_number(double value, int decimals) {
    return (value < 0 ? "−" : "+") + fmt::format("{:.{}f}", std::abs(value), decimals);
}

bool is_inside(Point p, std::span<const Point> outline) {
    bool inside = false;
    for (std::size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++)
        if ((outline[i].y() > p.y()) != (outline[j].y() > p.y()) &&
            p.x() < (outline[j].x() - outline[i].x()) * (p.y() - outline[i].y()) / (outline[j].y() - outline[i].y()) +
                        outline[i].x())
            inside = !inside;
    return inside;
}

std::string power_text(double value) {
    if (!(value > 0)) return "0";
    int exponent = static_cast<int>(std::floor(std::log10(value)));
    double digits = value / std::pow(10.0, exponent);
    if (digits >= 9.95) {
        digits /= 10;
        ++exponent;
    }
    return fmt::format("{:.1f}\u00a0·\u00a010^{{{}{}}}", digits, exponent < 0 ? "−" : "", std::abs(exponent));
}

void line_behind(Page& page, Point from, Point to, std::span<const Point> cover, const Stroke& stroke, bool arrow) {
    double hidden = 0, visible = 1; // bisection for where it comes out
    if (is_inside(to, cover))
        hidden = 1;
    else
        for (int i = 0; i < 40; ++i) {
            const double t = 0.5 * (hidden + visible);
            (is_inside(from + t * (to - from), cover) ? hidden : visible) = t;
        }
    const Point out = from + hidden * (to - from);
    page.line(from, out, {stroke.ink, stroke.width, true});
    if (arrow && hidden < 1)
        page.arrow(out, to, stroke);
    else
        page.line(out, to, stroke);
}

} // namespace filigree::report
