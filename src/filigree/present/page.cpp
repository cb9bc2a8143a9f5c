// What is drawn is kept as a list of commands and replayed on each kind of surface, so that text and lines stay what
// they are in SVG and PDF. (A recording surface would do the same, but puts a group and a clip around it all.)
#include "filigree/present/page.h"

#include "filigree/core/text.h"
#include "filigree/io/system/file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>
#include <fmt/format.h>

namespace filigree {

namespace {

constexpr const char* kFont = "DejaVu Sans";
constexpr double kAscent = 0.80, kDescent = 0.24; // of the font's size: letters and digits, not accents on capitals
constexpr double kLineHeight = 1.42;              // of the font's size, from base line to base line
constexpr double kScriptSize = 0.70, kSubscriptDrop = 0.20, kSuperscriptRise = 0.36; // of the letter before it
constexpr double kPageMargin = 2;                                                    // nearest text to the page's edge

struct SurfaceDeleter {
    void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
struct DrawingDeleter {
    void operator()(cairo_t* drawing) const { cairo_destroy(drawing); }
};
using CairoSurface = std::unique_ptr<cairo_surface_t, SurfaceDeleter>;
using Drawing = std::unique_ptr<cairo_t, DrawingDeleter>;

/// A drawing whose letters are as wide on every kind of surface.
Drawing begin_drawing(cairo_surface_t* surface) {
    Drawing drawing(cairo_create(surface));
    cairo_font_options_t* options = cairo_font_options_create();
    cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
    cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
    cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
    cairo_set_font_options(drawing.get(), options);
    cairo_font_options_destroy(options);
    cairo_set_line_cap(drawing.get(), CAIRO_LINE_CAP_ROUND);
    cairo_set_line_join(drawing.get(), CAIRO_LINE_JOIN_ROUND);
    return drawing;
}

// --- text ---

enum class Script { none, sub, super };

/// Letters of one look.
struct Run {
    std::string letters;
    bool bold = false, italic = false;
    Script script = Script::none;
};
using Runs = std::vector<Run>;

/// Takes the marks out of a text (see Page::text).
Runs parse(const std::string& text, const TextStyle& style) {
    Runs runs;
    bool bold = style.bold, italic = style.italic, in_braces = false;
    Script script = Script::none;
    const auto add = [&](const std::string& letters) {
        // letters of a subscript lean as their base does, its digits stand upright
        const bool upright = script != Script::none && letters.size() == 1 && !std::isalpha(letters[0]);
        const Run run{letters, bold, italic && !upright, script};
        if (!runs.empty() && runs.back().bold == run.bold && runs.back().italic == run.italic &&
            runs.back().script == run.script)
            runs.back().letters += letters;
        else
            runs.push_back(run);
        if (!in_braces) script = Script::none;
    };
    for (std::size_t at = 0; at < text.size();) {
        const char c = text[at];
        const char next = at + 1 < text.size() ? text[at + 1] : '\0';
        if (c == '\\' && next != '\0') {
            const std::size_t behind = std::max<std::size_t>(1, utf8_length(text, at + 1));
            add(text.substr(at + 1, behind));
            at += 1 + behind;
        } else if (c == '*') {
            bool& flag = next == '*' ? bold : italic;
            flag = !flag;
            at += next == '*' ? 2 : 1;
        } else if ((c == '_' || c == '^') && next != '\0' && next != ' ') {
            script = c == '_' ? Script::sub : Script::super;
            in_braces = next == '{';
            at += in_braces ? 2 : 1;
        } else if (c == '}' && in_braces) {
            in_braces = false;
            script = Script::none;
            ++at;
        } else if (const std::size_t length = utf8_length(text, at); length > 0 && (c < 0 || c >= ' ')) {
            add(text.substr(at, length));
            at += length;
        } else {
            add("?"); // no character
            ++at;
        }
    }
    return runs;
}

void choose_font(cairo_t* drawing, const Run& run, double size) {
    cairo_select_font_face(drawing, kFont, run.italic ? CAIRO_FONT_SLANT_OBLIQUE : CAIRO_FONT_SLANT_NORMAL,
                           run.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(drawing, run.script == Script::none ? size : kScriptSize * size);
}

double width_of(cairo_t* drawing, const Runs& runs, double size) {
    double width = 0;
    for (const Run& run : runs) {
        choose_font(drawing, run, size);
        cairo_text_extents_t extents;
        cairo_text_extents(drawing, run.letters.c_str(), &extents);
        width += extents.x_advance;
    }
    return width;
}

double script_shift(Script script, double size) {
    return script == Script::sub ? kSubscriptDrop * size : script == Script::super ? -kSuperscriptRise * size : 0;
}

/// What measures text: a drawing on nothing.
Drawing measuring_drawing() {
    const CairoSurface surface(cairo_image_surface_create(CAIRO_FORMAT_A8, 1, 1));
    return begin_drawing(surface.get());
}

/// Where words end: at spaces.
std::vector<Runs> words_of(const Runs& runs) {
    std::vector<Runs> words(1);
    for (const Run& run : runs) {
        std::size_t begin = 0;
        for (;;) {
            const std::size_t space = run.letters.find(' ', begin);
            const std::string part = run.letters.substr(begin, space == std::string::npos ? space : space - begin);
            if (!part.empty()) words.back().push_back({part, run.bold, run.italic, run.script});
            if (space == std::string::npos) break;
            if (!words.back().empty()) words.emplace_back();
            begin = space + 1;
        }
    }
    if (words.back().empty()) words.pop_back();
    return words;
}

/// The word without its last character.
void drop_last(Runs& word) {
    std::string& letters = word.back().letters;
    while (!letters.empty() && (static_cast<unsigned char>(letters.back()) & 0xc0) == 0x80) letters.pop_back();
    if (!letters.empty()) letters.pop_back();
    if (letters.empty()) word.pop_back();
}

struct TextLine {
    Runs runs;
    double width = 0;
};

std::vector<TextLine> break_lines(cairo_t* drawing, const Runs& runs, double width, double size) {
    const double space = width_of(drawing, {{" "}}, size);
    std::vector<TextLine> lines;
    for (Runs& word : words_of(runs)) {
        double word_width = width_of(drawing, word, size);
        if (word_width > width) {
            while (!word.empty()) {
                drop_last(word);
                Runs shortened = word;
                shortened.push_back({"…"});
                word_width = width_of(drawing, shortened, size);
                if (word_width > width && !word.empty()) continue;
                word = std::move(shortened);
                break;
            }
        }
        if (lines.empty() || lines.back().width + space + word_width > width) {
            lines.push_back({std::move(word), word_width});
            continue;
        }
        lines.back().runs.push_back({" "});
        lines.back().runs.insert(lines.back().runs.end(), word.begin(), word.end());
        lines.back().width += space + word_width;
    }
    return lines;
}

/// Text on a surface, from its left end on the base line.
void draw_runs(cairo_t* drawing, const Runs& runs, Point at, const TextStyle& style) {
    const auto each = [&](const auto& draw) {
        double x = at.x();
        for (const Run& run : runs) {
            choose_font(drawing, run, style.size);
            cairo_text_extents_t extents;
            cairo_text_extents(drawing, run.letters.c_str(), &extents);
            cairo_move_to(drawing, x, at.y() + script_shift(run.script, style.size));
            draw(run.letters.c_str());
            x += extents.x_advance;
        }
    };
    if (style.halo) {
        each([&](const char* letters) { cairo_text_path(drawing, letters); });
        cairo_set_source_rgba(drawing, 1, 1, 1, 0.9);
        cairo_set_line_width(drawing, 0.26 * style.size);
        cairo_set_dash(drawing, nullptr, 0, 0);
        cairo_stroke(drawing);
    }
    cairo_set_source_rgba(drawing, style.ink.r, style.ink.g, style.ink.b, style.ink.a);
    each([&](const char* letters) { cairo_show_text(drawing, letters); });
    cairo_new_path(drawing);
}

// --- lines and areas ---

void use(cairo_t* drawing, const Stroke& stroke) {
    cairo_set_source_rgba(drawing, stroke.ink.r, stroke.ink.g, stroke.ink.b, stroke.ink.a);
    cairo_set_line_width(drawing, stroke.width);
    const double dashes[] = {3 * stroke.width + 1, 2.4 * stroke.width + 1.6};
    cairo_set_dash(drawing, dashes, stroke.dashed ? 2 : 0, 0);
}

void trace(cairo_t* drawing, std::span<const Point> points, bool closed) {
    cairo_new_path(drawing);
    for (const Point& p : points) cairo_line_to(drawing, p.x(), p.y());
    if (closed) cairo_close_path(drawing);
}

/// Fills and strokes the path; either may be clear.
void paint_path(cairo_t* drawing, const Ink& fill, const Stroke& stroke) {
    if (fill.a > 0) {
        cairo_set_source_rgba(drawing, fill.r, fill.g, fill.b, fill.a);
        cairo_fill_preserve(drawing);
    }
    if (stroke.ink.a > 0 && stroke.width > 0) {
        use(drawing, stroke);
        cairo_stroke_preserve(drawing);
    }
    cairo_new_path(drawing);
}

// --- pictures ---

/// A picture as cairo holds it: native words with the colours multiplied by alpha.
CairoSurface image_surface(const Picture& picture) {
    CairoSurface surface(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, int(picture.width), int(picture.height)));
    if (cairo_surface_status(surface.get()) != CAIRO_STATUS_SUCCESS) return surface;
    unsigned char* data = cairo_image_surface_get_data(surface.get());
    const std::size_t stride = std::size_t(cairo_image_surface_get_stride(surface.get()));
    for (unsigned y = 0; y < picture.height; ++y) {
        auto* row = reinterpret_cast<std::uint32_t*>(data + y * stride);
        for (unsigned x = 0; x < picture.width; ++x) {
            const std::uint8_t* p = picture.pixel(x, y);
            const auto multiplied = [&](int c) { return (std::uint32_t{p[c]} * p[3] + 127) / 255; };
            row[x] = std::uint32_t{p[3]} << 24 | multiplied(0) << 16 | multiplied(1) << 8 | multiplied(2);
        }
    }
    cairo_surface_mark_dirty(surface.get());
    return surface;
}

Picture picture_of(cairo_surface_t* surface) {
    cairo_surface_flush(surface);
    Picture picture(unsigned(cairo_image_surface_get_width(surface)),
                    unsigned(cairo_image_surface_get_height(surface)));
    const unsigned char* data = cairo_image_surface_get_data(surface);
    const std::size_t stride = std::size_t(cairo_image_surface_get_stride(surface));
    for (unsigned y = 0; y < picture.height; ++y) {
        const auto* row = reinterpret_cast<const std::uint32_t*>(data + y * stride);
        for (unsigned x = 0; x < picture.width; ++x) { // the page is white below all, so alpha is full
            std::uint8_t* p = picture.pixel(x, y);
            p[0] = std::uint8_t(row[x] >> 16);
            p[1] = std::uint8_t(row[x] >> 8);
            p[2] = std::uint8_t(row[x]);
            p[3] = 255;
        }
    }
    return picture;
}

// --- legends ---

/// 0.05 as "0.05", -3 with a minus instead of a hyphen.
std::string number_text(double number) {
    std::string text = fmt::format("{:.6g}", number + 0.0); // no "-0"
    if (text.starts_with('-')) text.replace(0, 1, "−");
    return text;
}

cairo_status_t append(void* bytes, const unsigned char* data, unsigned length) {
    static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), length);
    return CAIRO_STATUS_SUCCESS;
}

/// Cairo numbers pictures over all pages of a run: numbers them anew from 0, so that a page has the same bytes always.
std::string with_own_numbers(const std::string& svg) {
    static constexpr std::string_view kPrefixes[] = {"\"image",    "\"#image", "\"surface",
                                                     "\"#surface", "#surface", "#image"};
    std::map<std::string, std::string> numbers;
    std::string out;
    out.reserve(svg.size());
    for (std::size_t at = 0; at < svg.size();) {
        std::string_view found;
        if (svg[at] == '"' || svg[at] == '#')
            for (const std::string_view prefix : kPrefixes)
                if (svg.compare(at, prefix.size(), prefix) == 0) {
                    found = prefix;
                    break;
                }
        std::size_t end = at + found.size();
        while (!found.empty() && end < svg.size() && std::isdigit(static_cast<unsigned char>(svg[end]))) ++end;
        if (end == at + found.size()) {
            out += svg[at++];
            continue;
        }
        const std::string old = svg.substr(at + found.size(), end - at - found.size());
        out.append(found).append(numbers.try_emplace(old, std::to_string(numbers.size())).first->second);
        at = end;
    }
    return out;
}

} // namespace

struct Page::Content {
    double width, height;
    std::vector<std::function<void(cairo_t*)>> commands;
    Drawing measure = measuring_drawing();

    void draw(std::function<void(cairo_t*)> command) { commands.push_back(std::move(command)); }

    void replay(cairo_t* drawing) const {
        cairo_set_source_rgb(drawing, 1, 1, 1);
        cairo_paint(drawing); // all of it: the last row of pixels may reach beyond the page
        for (const auto& command : commands) command(drawing);
    }

    /// The page on a surface that streams into a string.
    Result<std::string> streamed(bool as_pdf) const {
        std::string bytes;
        {
            const CairoSurface surface(
                as_pdf ? cairo_pdf_surface_create_for_stream(append, &bytes, 0.75 * width, 0.75 * height)
                       : cairo_svg_surface_create_for_stream(append, &bytes, width, height));
            if (as_pdf) // else the time of writing stands there
                cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE, "2000-01-01T00:00:00Z");
            else
                cairo_svg_surface_set_document_unit(surface.get(), CAIRO_SVG_UNIT_PX);
            const Drawing drawing = begin_drawing(surface.get());
            if (as_pdf) cairo_scale(drawing.get(), 0.75, 0.75); // points
            replay(drawing.get());
            cairo_show_page(drawing.get());
            cairo_surface_finish(surface.get());
            for (const cairo_status_t status : {cairo_status(drawing.get()), cairo_surface_status(surface.get())})
                if (status != CAIRO_STATUS_SUCCESS)
                    return Error{ErrorCode::out_of_memory,
                                 fmt::format("The page cannot be drawn ({}); close other programs or draw it smaller.",
                                             cairo_status_to_string(status))};
        }
        return as_pdf ? std::move(bytes) : with_own_numbers(bytes);
    }
};

Page::Page(double width, double height) : content_(new Content{width, height, {}, measuring_drawing()}) {}
Page::~Page() = default;
Page::Page(Page&&) noexcept = default;
Page& Page::operator=(Page&&) noexcept = default;

double Page::width() const { return content_->width; }
double Page::height() const { return content_->height; }

void Page::line(Point from, Point to, const Stroke& stroke) { polyline(std::array{from, to}, stroke); }

void Page::polyline(std::span<const Point> points, const Stroke& stroke) {
    content_->draw([points = std::vector<Point>(points.begin(), points.end()), stroke](cairo_t* drawing) {
        trace(drawing, points, false);
        paint_path(drawing, kClear, stroke);
    });
}

void Page::polygon(std::span<const Point> points, const Ink& fill, const Stroke& stroke) {
    content_->draw([points = std::vector<Point>(points.begin(), points.end()), fill, stroke](cairo_t* drawing) {
        trace(drawing, points, true);
        paint_path(drawing, fill, stroke);
    });
}

void Page::circle(Point centre, double radius, const Ink& fill, const Stroke& stroke) {
    content_->draw([=](cairo_t* drawing) {
        cairo_new_path(drawing);
        cairo_arc(drawing, centre.x(), centre.y(), radius, 0, 2 * std::numbers::pi);
        cairo_close_path(drawing);
        paint_path(drawing, fill, stroke);
    });
}

void Page::arrow(Point from, Point to, const Stroke& stroke) {
    const double length = (to - from).norm();
    if (!(length > 0)) return;
    const Point along = (to - from) / length, across(-along.y(), along.x());
    const double head = std::min(5 + 3 * stroke.width, 0.7 * length), half = 0.36 * head;
    const Point neck = to - 0.8 * head * along; // the line ends inside the head, whose back is notched
    line(from, neck, stroke);
    const Point barb = to - head * along;
    polygon(std::array<Point, 4>{to, barb + half * across, neck, barb - half * across}, stroke.ink, {kClear});
}

void Page::text(const std::string& text, Point at, const TextStyle& style) {
    const Runs runs = parse(text, style);
    TextStyle fitted = style;
    const double room = std::max(1.0, width() - 2 * kPageMargin);
    double length = width_of(content_->measure.get(), runs, style.size);
    if (length > room) {
        fitted.size *= room / length;
        length = room;
    }
    const double before = style.align == Align::left ? 0 : style.align == Align::centre ? 0.5 * length : length;
    const auto held = [](double value, double least, double most) { return std::max(least, std::min(value, most)); };
    const Point start(held(at.x() - before, kPageMargin, width() - kPageMargin - length),
                      held(at.y(), kAscent * fitted.size, height() - kDescent * fitted.size));
    content_->draw([=](cairo_t* drawing) { draw_runs(drawing, runs, start, fitted); });
}

double Page::text_width(const std::string& text, const TextStyle& style) const {
    return width_of(content_->measure.get(), parse(text, style), style.size);
}

double Page::paragraph(const std::string& text, Point top_left, double width, const TextStyle& style) {
    double base = top_left.y() + kAscent * style.size;
    for (const TextLine& text_line : break_lines(content_->measure.get(), parse(text, style), width, style.size)) {
        const double left = style.align == Align::left     ? 0
                            : style.align == Align::centre ? 0.5 * (width - text_line.width)
                                                           : width - text_line.width;
        const Point start(top_left.x() + left, base);
        content_->draw([=, runs = text_line.runs](cairo_t* drawing) { draw_runs(drawing, runs, start, style); });
        base += kLineHeight * style.size;
    }
    return top_left.y() + paragraph_height(text, width, style);
}

double Page::paragraph_height(const std::string& text, double width, const TextStyle& style) {
    const Drawing measure = measuring_drawing();
    const std::size_t lines = break_lines(measure.get(), parse(text, style), width, style.size).size();
    return lines == 0 ? 0 : (double(lines - 1) * kLineHeight + kAscent + kDescent) * style.size;
}

std::string Page::plain(const std::string& text) {
    std::string escaped;
    for (const char c : text) {
        if (c == '_' || c == '^' || c == '*' || c == '\\') escaped += '\\';
        escaped += c;
    }
    return escaped;
}

void Page::picture(const Picture& picture, Point top_left, double width, double height) {
    if (picture.width == 0 || picture.height == 0) return;
    const std::shared_ptr<cairo_surface_t> surface(image_surface(picture).release(), SurfaceDeleter{});
    const double scale = std::min(width / picture.width, height / picture.height);
    const Point corner = top_left + 0.5 * Point(width - scale * picture.width, height - scale * picture.height);
    const double w = picture.width, h = picture.height;
    content_->draw([=](cairo_t* drawing) {
        cairo_save(drawing);
        cairo_translate(drawing, corner.x(), corner.y());
        cairo_scale(drawing, scale, scale);
        cairo_rectangle(drawing, 0, 0, w, h); // the filter must not blend in what is beyond the edges
        cairo_clip(drawing);
        cairo_set_source_surface(drawing, surface.get(), 0, 0);
        cairo_pattern_set_filter(cairo_get_source(drawing), CAIRO_FILTER_BEST);
        if (cairo_surface_get_type(cairo_get_target(drawing)) == CAIRO_SURFACE_TYPE_IMAGE) // others keep it as it is
            cairo_pattern_set_extend(cairo_get_source(drawing), CAIRO_EXTEND_PAD);
        cairo_paint(drawing);
        cairo_restore(drawing);
    });
}

void Page::legend(ColorMap map, const ValueRange& range, const std::string& title, Point top_left, double height,
                  LegendScale scale) {
    constexpr double kBarWidth = 14, kTick = 4, kTitleHeight = 20;
    constexpr unsigned kStops = 64;
    const TextStyle small{.size = 11};
    text(title, top_left + Point(0, kAscent * small.size), small);
    const Point top = top_left + Point(0, kTitleHeight);
    const double length = height - kTitleHeight;
    content_->draw([=](cairo_t* drawing) {
        cairo_pattern_t* colors = cairo_pattern_create_linear(0, top.y() + length, 0, top.y());
        for (unsigned i = 0; i <= kStops; ++i) {
            const Vec3f c = color_at(map, float(i) / kStops);
            cairo_pattern_add_color_stop_rgb(colors, double(i) / kStops, double(c.x()), double(c.y()), double(c.z()));
        }
        cairo_rectangle(drawing, top.x(), top.y(), kBarWidth, length);
        cairo_set_source(drawing, colors);
        cairo_fill(drawing);
        cairo_pattern_destroy(colors);
    });
    polygon(
        std::array<Point, 4>{top, top + Point(kBarWidth, 0), top + Point(kBarWidth, length), top + Point(0, length)},
        kClear, {kGrey, 0.7});

    const double least = double(range.least), span = double(range.most) - least;
    const double slack = 1e-6 * std::abs(span);
    const auto tick = [&](double value, double tick_length) {
        if (!(span > 0) || value < least - slack || value > least + span + slack) return Point(-1, -1);
        const Point at = top + Point(kBarWidth, length * (1 - (value - least) / span));
        line(at, at + Point(tick_length, 0), {kGrey, 0.7});
        return at;
    };
    const auto number = [&](double value, const std::string& shown) {
        const Point at = tick(value, kTick);
        if (at.x() >= 0) text(shown, at + Point(kTick + 3, 0.36 * small.size), small);
    };
    if (scale == LegendScale::linear) {
        for (const double value : legend_ticks(range, 5)) number(value, number_text(value));
        return;
    }
    for (double decade = std::floor(least); decade <= least + span + slack; ++decade) {
        number(decade, fmt::format("10^{{{}}}", number_text(decade)));
        for (int digit = 2; digit < 10; ++digit) tick(decade + std::log10(digit), 0.5 * kTick);
    }
}

Picture Page::pixels(double scale) const {
    const CairoSurface surface(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, int(std::lround(scale * width())),
                                                          int(std::lround(scale * height()))));
    if (cairo_surface_status(surface.get()) != CAIRO_STATUS_SUCCESS) return {};
    const Drawing drawing = begin_drawing(surface.get());
    cairo_scale(drawing.get(), scale, scale);
    content_->replay(drawing.get());
    return picture_of(surface.get());
}

Status Page::write(const std::filesystem::path& path, double scale) const {
    const std::string ending = lower_case(path.extension().string());
    std::string bytes;
    if (ending == ".png") {
        const Picture picture = pixels(scale);
        if (picture.width == 0)
            return Error{ErrorCode::out_of_memory,
                         path.string() + ": a picture of that size cannot be drawn; make it smaller."};
        bytes = encode_png(picture);
    } else if (ending == ".svg" || ending == ".pdf") {
        Result<std::string> streamed = content_->streamed(ending == ".pdf");
        if (!streamed) return streamed.error();
        bytes = *std::move(streamed);
    } else
        return Error{ErrorCode::unsupported,
                     path.string() + ": pages are written as .png, .svg or .pdf; choose one of these endings."};
    return write_file(path, bytes);
}

} // namespace filigree
