// A page of vector drawing: lines, text and pictures, kept as they are in SVG and PDF and drawn sharp in PNG.
#pragma once

#include "filigree/render.h"

#include <Eigen/Core>

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace filigree {

using Point = Eigen::Vector2d; ///< on a page: units from its top left, y down

struct Ink {
    double r = 0, g = 0, b = 0, a = 1; ///< sRGB, 0 to 1
};

inline constexpr Ink kBlack{0.10, 0.11, 0.13}, kGrey{0.45, 0.47, 0.50}, kPale{0.82, 0.84, 0.86}, kWhite{1, 1, 1},
    kRed{0.80, 0.18, 0.16}, kBlue{0.13, 0.36, 0.72}, kGreen{0.15, 0.52, 0.30}, kClear{0, 0, 0, 0};

struct Stroke {
    Ink ink = kBlack;
    double width = 1.2;
    bool dashed = false;
};

enum class Align { left, centre, right };

struct TextStyle {
    double size = 13; ///< height of the letters' box, page units
    Ink ink = kBlack;
    Align align = Align::left;
    bool bold = false, italic = false;
    bool halo = false; ///< a white rim, so that lines behind the letters do not touch them
};

/// What the numbers of a legend are: themselves, or powers of ten of which the range has the exponents.
enum class LegendScale { linear, powers_of_ten };

/// One page. Units are CSS pixels (1/96 inch); a PNG has `scale` pixels for each.
class Page {
public:
    Page(double width, double height);
    ~Page();
    Page(Page&&) noexcept;
    Page& operator=(Page&&) noexcept;

    double width() const;
    double height() const;

    void line(Point from, Point to, const Stroke& stroke = {});
    void polyline(std::span<const Point> points, const Stroke& stroke = {});
    void polygon(std::span<const Point> points, const Ink& fill, const Stroke& stroke = {});
    void circle(Point centre, double radius, const Ink& fill, const Stroke& stroke = {kClear});
    /// A line with a head at `to`.
    void arrow(Point from, Point to, const Stroke& stroke = {});

    /// One line of text; `at` is on its base line. "P_1", "C_m" and "P_{12}" set what follows the underscore as a
    /// subscript, "10^{-3}" as a superscript; "*u*" is italic and "**u**" bold; a backslash takes the meaning off the
    /// character behind it. Text is never clipped: what would leave the page is moved in, and what is wider than the
    /// page is set smaller.
    void text(const std::string& text, Point at, const TextStyle& style = {});
    /// Width of one line of such text.
    double text_width(const std::string& text, const TextStyle& style = {}) const;
    /// Text broken into lines of at most `width`; returns the y below the last line. A word that is too long for a
    /// line is cut with an ellipsis.
    double paragraph(const std::string& text, Point top_left, double width, const TextStyle& style = {});
    /// How far down paragraph() would come, without drawing it.
    static double paragraph_height(const std::string& text, double width, const TextStyle& style = {});
    /// Text that stands for itself (a file's name), for all of these.
    static std::string plain(const std::string& text);

    /// A picture scaled into the box (its own shape kept, centred).
    void picture(const Picture& picture, Point top_left, double width, double height);

    /// A vertical bar of the map's colours with ticks, numbers and the title with its unit above it.
    void legend(ColorMap map, const ValueRange& range, const std::string& title, Point top_left, double height,
                LegendScale scale = LegendScale::linear);

    /// The page as pixels, `scale` for each unit; empty where there is no memory for that many.
    Picture pixels(double scale) const;
    /// Writes .png (with `scale`), .svg or .pdf, by the name's ending, through a temporary file and a rename. The same
    /// page gives the same bytes. Errors: unsupported, unwritable, out_of_memory.
    Status write(const std::filesystem::path& path, double scale = 2) const;

private:
    struct Content;
    std::unique_ptr<Content> content_;
};

} // namespace filigree
