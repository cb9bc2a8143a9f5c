// What the figures share: pages with a caption below, panels in rows, solid things seen from the side, labels.
#pragma once

#include "figures.h"

#include "filigree/types.h"

#include <string>
#include <vector>

namespace filigree::report {

inline constexpr double kFigureMargin = 20;   ///< around it
inline constexpr double kPanelGap = 20;       ///< between panels
inline constexpr double kSubcaptionRoom = 24; ///< below a panel, for a line of text
inline constexpr Ink kSheet{0.925, 0.94, 0.96}, kSheetDark{0.83, 0.86, 0.90}, kSheetDarker{0.74, 0.78, 0.83};

/// A part of a page.
struct Panel {
    Point top_left;
    double width, height;

    Point centre() const { return top_left + 0.5 * Point(width, height); }
    Point at(double x, double y) const { return top_left + Point(x * width, y * height); } ///< fractions
};

/// Panels of one size in rows, from the page's top; below each is room for its sub-caption.
std::vector<Panel> panels_in_rows(unsigned rows, unsigned columns, double panel_height);
/// Where the last of them and its sub-caption end.
double content_height(unsigned rows, double panel_height);

/// A page with `height` units free, and the caption below it: "Figure 2.2." in bold, then the text.
Page captioned_page(double height, const std::string& title, const std::string& caption);

/// "(ii) text" centred below a panel.
void subcaption(Page& page, const Panel& panel, const std::string& number, const std::string& text);

/// A view of space, z up, without perspective.
class Projection {
public:
    /// The viewer stands before the x axis, turned by `yaw` to its right and `pitch` up.
    Projection(double yaw_deg, double pitch_deg);
    /// Chooses scale and place so that the points fill the panel.
    void fit(std::span<const Vec3d> points, const Panel& panel);
    Point operator()(const Vec3d& p) const;
    std::vector<Point> operator()(std::span<const Vec3d> points) const;
    const Vec3d& to_viewer() const { return to_viewer_; }
    /// How bright a surface with this normal looks, 0 to 1: light from the upper left.
    double shade(const Vec3d& normal) const;

private:
    Vec3d right_, up_, to_viewer_;
    double scale_ = 1;
    Point shift_ = Point::Zero();
};

/// Between two inks.
Ink mix(const Ink& a, const Ink& b, double t);
/// A surface's ink under the light of `view`.
Ink shaded(const Ink& ink, const Projection& view, const Vec3d& normal);

void dot(Page& page, Point at, const Ink& ink, double radius = 3.6);
void hollow_dot(Page& page, Point at, const Ink& ink, double radius = 3.6);
/// A name such as "P_1" in italics, its middle `offset` away from the point it names.
void label(Page& page, const std::string& name, Point at, Point offset, const Ink& ink = kBlack);
/// A level line with a head at either end and the text in its middle.
void dimension(Page& page, Point from, Point to, const std::string& text, const Ink& ink = kGrey);
/// The number with a minus instead of a hyphen.
std::string signed_number(double value, int decimals);
/// "2.3 · 10^{-4}".
std::string power_text(double value);
/// A line that is dashed where `cover` (a convex outline on the page) hides it, from the end `from` on.
void line_behind(Page& page, Point from, Point to, std::span<const Point> cover, const Stroke& stroke, bool arrow);
bool is_inside(Point p, std::span<const Point> outline);

} // namespace filigree::report
