#include "filigree/io/mesh/ply_header.h"
#include "filigree/io/system/extension.h"

#include <array>

namespace filigree::ply {

namespace {

class HeaderReader {
public:
    explicit HeaderReader(const MeshSource& source) : source_(source), text_(source.bytes) {}

    Result<HeaderAndBody> read() {
        if (text_.word() != "ply") return source_.error_at_line(1, "does not start with 'ply', as PLY files do.");
        skip_first_line();
        for (;;) {
            text_.skip_blanks();
            if (text_.at_end())
                return source_.error_at_line(text_.line(), "the header has no 'end_header'; the file is cut off.");
            const std::string_view keyword = text_.word();
            if (keyword == "end_header") break;
            if (!read_line(keyword)) return *error_;
            text_.next_line();
        }
        skip_last_line();
        if (!has_format_) return source_.error("the header has no 'format' line.");
        return HeaderAndBody{std::move(header_), text_};
    }

private:
    bool fail(const std::string& cause) {
        error_ = source_.error_at_line(text_.line(), cause);
        return false;
    }

    std::string_view next_word() {
        text_.skip_blanks();
        return text_.word();
    }

    void skip_first_line() {
        while (!text_.at_end() && !TextScanner::is_line_end(text_.peek())) text_.advance();
        TextScanner after = text_;
        if (after.peek() == '\r') after.advance();
        lines_end_in_cr_ = text_.peek() == '\r' && after.peek() != '\n';
        text_.next_line();
    }

    /// A binary body may begin with the byte of a line feed: only what ends the other lines is taken.
    void skip_last_line() {
        while (!text_.at_end() && !TextScanner::is_line_end(text_.peek())) text_.advance();
        if (!lines_end_in_cr_ || header_.encoding == Encoding::ascii)
            text_.next_line();
        else if (!text_.at_end())
            text_.advance();
    }

    bool read_line(std::string_view keyword) {
        if (keyword == "format") return read_format();
        if (keyword == "element") return read_element();
        if (keyword == "property") return read_property();
        if (keyword.empty() || keyword == "comment" || keyword == "obj_info") return true;
        return fail("found " + in_quotes(keyword) + " where the header wants 'element', 'property' or 'end_header'.");
    }

    bool read_format() {
        const std::string_view format = next_word();
        has_format_ = true;
        if (format == "ascii")
            header_.encoding = Encoding::ascii;
        else if (format == "binary_little_endian")
            header_.encoding = Encoding::little_endian;
        else if (format == "binary_big_endian")
            header_.encoding = Encoding::big_endian;
        else
            return fail("the format " + in_quotes(format) +
                        " is not one of ascii, binary_little_endian and binary_big_endian.");
        return true;
    }

    bool read_element() {
        Element element{std::string(next_word()), 0, {}};
        if (header_.find(element.name)) return fail("the element " + in_quotes(element.name) + " is declared twice.");
        text_.skip_blanks();
        std::int64_t count = 0;
        if (!text_.integer(count) || !text_.at_word_end() || count < 0)
            return fail("the element " + in_quotes(element.name) + " needs a count of zero or more.");
        element.count = static_cast<std::size_t>(count);
        header_.elements.push_back(std::move(element));
        return true;
    }

    bool read_property() {
        if (header_.elements.empty()) return fail("a property stands before the first element.");
        Element& element = header_.elements.back();
        Property property;
        std::string_view type = next_word();
        if (type == "list") {
            property.list_count.emplace();
            if (!read_type(next_word(), *property.list_count)) return false;
            type = next_word();
        }
        if (!read_type(type, property.type)) return false;
        property.name = next_word();
        if (property.name.empty()) return fail("a property has no name.");
        if (element.has(property.name)) return fail("the property " + in_quotes(property.name) + " is declared twice.");
        element.properties.push_back(std::move(property));
        return true;
    }

    bool read_type(std::string_view word, Type& type) {
        static constexpr std::array<std::array<std::string_view, 2>, 8> kNames = {{{"char", "int8"},
                                                                                   {"uchar", "uint8"},
                                                                                   {"short", "int16"},
                                                                                   {"ushort", "uint16"},
                                                                                   {"int", "int32"},
                                                                                   {"uint", "uint32"},
                                                                                   {"float", "float32"},
                                                                                   {"double", "float64"}}};
        for (std::size_t i = 0; i < kNames.size(); ++i) {
            if (word != kNames[i][0] && word != kNames[i][1]) continue;
            type = static_cast<Type>(i);
            return true;
        }
        return fail("the type " + in_quotes(word) + " is not one of PLY's, such as float, int or uchar.");
    }

    const MeshSource& source_;
    TextScanner text_;
    std::optional<Error> error_;
    Header header_;
    bool has_format_ = false, lines_end_in_cr_ = false;
};

} // namespace

Result<HeaderAndBody> read_header(const MeshSource& source) { return HeaderReader(source).read(); }

std::vector<std::size_t> find_color(const std::vector<std::string>& names) {
    std::vector<std::string> lower;
    for (const std::string& name : names) lower.push_back(lower_case(name));
    const auto find = [&](const std::string& name) {
        return static_cast<std::size_t>(std::find(lower.begin(), lower.end(), name) - lower.begin());
    };
    static constexpr std::array<std::array<const char*, 3>, 2> kColors = {{{"red", "green", "blue"}, {"r", "g", "b"}}};
    for (const auto& color : kColors)
        for (const std::string prefix : {"", "diffuse_", "color_", "colour_"}) {
            std::vector<std::size_t> found;
            for (const char* name : color)
                if (const std::size_t i = find(prefix + name); i < lower.size()) found.push_back(i);
            if (found.size() < 3) continue;
            for (const std::string& alpha : {prefix + "alpha", prefix + "a", std::string("alpha"), std::string("a")})
                if (const std::size_t i = find(alpha); i < lower.size() && found.size() == 3) found.push_back(i);
            return found;
        }
    return {};
}

} // namespace filigree::ply
