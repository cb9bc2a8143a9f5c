#include "filigree/io/animation/usd_layer.h"

#include "filigree/io/system/text_scanner.h"

#include <algorithm>
#include <array>
#include <optional>

namespace filigree {

namespace {

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f'; }
bool is_name(char c) {
    const auto u = static_cast<unsigned char>(c);
    return (u >= 'a' && u <= 'z') || (u >= 'A' && u <= 'Z') || is_digit(c) || u == '_' || u == ':' || u == '.' ||
           u >= 0x80;
}

constexpr std::array<std::string_view, 5> kListOperations = {"prepend", "append", "add", "delete", "reorder"};
constexpr std::array<std::string_view, 5> kArcs = {"references", "payload", "inherits", "specializes", "subLayers"};

template <std::size_t n>
bool is_one_of(std::string_view word, const std::array<std::string_view, n>& words) {
    return std::ranges::find(words, word) != words.end();
}

class LayerReader {
public:
    LayerReader(std::string_view text, const std::string& name) : text_(text), name_(name) {}

    Result<UsdLayer> read() {
        if (!text_.starts_with("#usda"))
            return Error{ErrorCode::bad_file, name_ + ": does not begin with #usda and is no USD text."};
        skip_space();
        if (peek() == '(' && !read_metadata(nullptr)) return *error_;
        while (skip_space(), at_ < text_.size()) {
            if (peek() == ';') {
                ++at_;
            } else if (peek() == '}' && !open_.empty()) {
                open_.pop_back();
                ++at_;
            } else if (!read_statement()) {
                return *error_;
            }
        }
        if (!open_.empty()) {
            fail("the file ends within prim " + in_quotes(layer_.prims[open_.back()].name) + "; it may be cut off");
            return *error_;
        }
        for (UsdPrim& prim : layer_.prims)
            for (UsdAttribute& attribute : prim.attributes)
                std::ranges::stable_sort(attribute.samples, {}, &UsdSample::time);
        return std::move(layer_);
    }

private:
    std::string_view text_;
    const std::string& name_;
    std::size_t at_ = 0, line_ = 1;
    UsdLayer layer_;
    std::vector<std::size_t> open_; ///< prims whose braces are open
    std::optional<Error> error_;

    bool fail_at(std::size_t line, const std::string& cause) {
        if (!error_) error_ = Error{ErrorCode::bad_file, name_ + ": line " + std::to_string(line) + ": " + cause + "."};
        return false;
    }
    bool fail(const std::string& cause) { return fail_at(line_, cause); }

    char peek(std::size_t ahead = 0) const { return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0'; }
    bool starts_with(std::string_view word) const { return text_.substr(at_).starts_with(word); }
    void step() {
        if (text_[at_] == '\n') ++line_;
        ++at_;
    }
    void skip_comment() {
        while (at_ < text_.size() && text_[at_] != '\n') ++at_;
    }
    void skip_space() {
        for (; at_ < text_.size(); step()) {
            if (text_[at_] == '#') skip_comment();
            if (at_ == text_.size() || !is_space(text_[at_])) return;
        }
    }

    std::string_view word() {
        const std::size_t first = at_;
        while (at_ < text_.size() && is_name(text_[at_])) ++at_;
        return text_.substr(first, at_ - first);
    }
    std::string seen() const { return at_ < text_.size() ? in_quotes(text_.substr(at_, 24)) : "the end of the file"; }
    bool expect(char c, const char* what) {
        skip_space();
        if (peek() != c) return fail(std::string(what) + " needs '" + c + "', and there is " + seen());
        ++at_;
        return true;
    }

    /// Past "...", '...', or those of three quotes, which may hold line ends.
    bool skip_quoted() {
        const char quote = peek();
        const std::size_t first_line = line_;
        const bool three = peek(1) == quote && peek(2) == quote;
        at_ += three ? 3 : 1;
        while (at_ < text_.size()) {
            if (peek() == '\\' && at_ + 1 < text_.size()) {
                step();
                step();
            } else if (peek() == quote && (!three || (peek(1) == quote && peek(2) == quote))) {
                at_ += three ? 3 : 1;
                return true;
            } else if (peek() == '\n' && !three) {
                break;
            } else {
                step();
            }
        }
        return fail_at(first_line, "a text in quotes does not end");
    }
    bool skip_until(char end, std::size_t count, const char* what) {
        const std::size_t first_line = line_;
        at_ += count;
        const std::string closing(count, end);
        while (at_ < text_.size() && !starts_with(closing)) step();
        if (at_ == text_.size()) return fail_at(first_line, std::string(what) + " does not end");
        at_ += count;
        return true;
    }
    bool skip_piece() {
        if (peek() == '"' || peek() == '\'') return skip_quoted();
        if (peek() == '@') return skip_until('@', starts_with("@@@") ? 3 : 1, "a file name between '@'");
        if (peek() == '<') {
            while (at_ < text_.size() && peek() != '>' && peek() != '\n') ++at_;
            if (peek() != '>') return fail("a path between '<' and '>' does not end");
            ++at_;
            return true;
        }
        step();
        return true;
    }
    /// Past brackets with all that is in them.
    bool skip_brackets() {
        const std::size_t first_line = line_;
        std::string closing;
        do {
            const char c = peek();
            if (at_ == text_.size()) return fail_at(first_line, "a bracket is not closed; the file may be cut off");
            if (c == '(' || c == '[' || c == '{') {
                closing.push_back(c == '(' ? ')' : c == '[' ? ']' : '}');
                ++at_;
            } else if (c == ')' || c == ']' || c == '}') {
                if (c != closing.back())
                    return fail(std::string("there is '") + c + "' where '" + closing.back() + "' is missing");
                closing.pop_back();
                ++at_;
            } else if (c == '#') {
                skip_comment();
            } else if (!skip_piece()) {
                return false;
            }
        } while (!closing.empty());
        return true;
    }
    /// Past a value: one word, text, path or bracket; of a file name also the path after it.
    bool read_value(UsdValue& value) {
        skip_space();
        value = {at_, at_, line_};
        const char c = peek();
        if (c == '(' || c == '[' || c == '{') {
            if (!skip_brackets()) return false;
        } else if (c == '"' || c == '\'' || c == '<') {
            if (!skip_piece()) return false;
        } else if (c == '@') {
            if (!skip_piece()) return false;
            if (peek() == '<' && !skip_piece()) return false;
        } else {
            while (at_ < text_.size() && !is_space(peek()) &&
                   std::string_view(",;)]}(#").find(peek()) == std::string_view::npos)
                ++at_;
        }
        value.end = at_;
        return value.empty() ? fail("a value is missing before " + seen()) : true;
    }

    void note_arc(std::string_view arc, std::size_t line) {
        if (layer_.composed_by.empty()) layer_.composed_by = arc, layer_.composed_line = line;
    }

    /// "( key = value ... )" of the layer, or of a prim.
    bool read_metadata(UsdPrim* prim) {
        ++at_;
        for (skip_space(); peek() != ')'; skip_space()) {
            if (at_ == text_.size()) return fail("a bracket is not closed; the file may be cut off");
            if (peek() == ';' || peek() == ',') {
                ++at_;
                continue;
            }
            if (peek() == '"' || peek() == '\'') { // a remark
                if (!skip_quoted()) return false;
                continue;
            }
            const std::size_t line = line_;
            std::string_view key = word();
            if (is_one_of(key, kListOperations)) {
                skip_space();
                key = word();
            }
            if (key.empty()) return fail("a name is missing before " + seen());
            UsdValue value;
            if (!expect('=', "a name in brackets") || !read_value(value)) return false;
            skip_space();
            if (peek() == '(' && !skip_brackets()) return false; // of a reference
            const std::string_view said = text_.substr(value.begin, value.end - value.begin);
            if (is_one_of(key, kArcs) && said != "None" && said != "[]") note_arc(key, line);
            if (!prim) layer_.metadata.emplace_back(key, value);
            if (prim && key == "active") prim->active = said != "false" && said != "0";
        }
        ++at_;
        return true;
    }

    bool read_prim(std::string_view specifier) {
        UsdPrim prim;
        prim.specifier = specifier;
        prim.line = line_;
        prim.parent = open_.empty() ? UsdPrim::kNone : open_.back();
        skip_space();
        prim.type = word();
        skip_space();
        if (peek() != '"' && peek() != '\'') return fail("a prim needs its name in quotes, and there is " + seen());
        const std::size_t first = at_ + 1;
        if (!skip_quoted()) return false;
        prim.name = text_.substr(first, at_ - 1 - first);
        skip_space();
        if (peek() == '(' && !read_metadata(&prim)) return false;
        if (!expect('{', "a prim")) return false;
        open_.push_back(layer_.prims.size());
        layer_.prims.push_back(std::move(prim));
        return true;
    }

    bool read_samples(UsdAttribute& attribute) {
        if (!expect('{', "time samples")) return false;
        for (skip_space(); peek() != '}'; skip_space()) {
            if (at_ == text_.size()) return fail("the time samples are not closed; the file may be cut off");
            UsdSample sample;
            const char* const first = text_.data() + at_;
            const char* const end = parse_number(first, text_.data() + text_.size(), sample.time);
            if (end == first || !(std::abs(sample.time) < 1e15))
                return fail("a time sample needs its time, and there is " + seen());
            at_ += std::size_t(end - first);
            if (!expect(':', "a time sample") || !read_value(sample.value)) return false;
            if (text_.substr(sample.value.begin, sample.value.end - sample.value.begin) != "None")
                attribute.samples.push_back(sample);
            skip_space();
            if (peek() == ',') ++at_;
        }
        ++at_;
        return true;
    }

    /// "type name = value", "type name.timeSamples = {...}", "rel name = <...>".
    bool read_property(std::string_view first_word) {
        if (open_.empty()) return fail("there is " + in_quotes(first_word) + " where a prim is expected");
        std::string_view type = first_word;
        while (type == "custom" || type == "uniform" || type == "varying" || type == "config" ||
               is_one_of(type, kListOperations)) {
            skip_space();
            type = word();
        }
        if (starts_with("[]")) at_ += 2;
        skip_space();
        UsdAttribute attribute;
        attribute.line = line_;
        attribute.name = word();
        if (type.empty() || attribute.name.empty()) return fail("a property is expected, and there is " + seen());
        const auto ends_with = [&](std::string_view ending) {
            if (!attribute.name.ends_with(ending)) return false;
            attribute.name.remove_suffix(ending.size());
            return true;
        };
        const bool sampled = ends_with(".timeSamples");
        const bool kept = type != "rel" && !ends_with(".connect") && !ends_with(".spline");
        UsdValue value;
        skip_space();
        if (peek() == '=') {
            ++at_;
            if (sampled ? !read_samples(attribute) : !read_value(value)) return false;
        }
        skip_space();
        if (peek() == '(' && !skip_brackets()) return false;
        if (!kept) return true;
        std::vector<UsdAttribute>& known = layer_.prims[open_.back()].attributes;
        const auto other = std::ranges::find(known, attribute.name, &UsdAttribute::name);
        if (!sampled && text_.substr(value.begin, value.end - value.begin) != "None") attribute.value = value;
        if (other == known.end()) {
            known.push_back(std::move(attribute));
        } else if (sampled) {
            other->samples = std::move(attribute.samples);
        } else {
            other->value = attribute.value;
        }
        return true;
    }

    bool read_statement() {
        const std::size_t line = line_;
        const std::string_view first = word();
        if (first.empty()) return fail("there is " + seen() + " where a prim or a property is expected");
        if (first == "def" || first == "over" || first == "class") return read_prim(first);
        if (first == "variantSet") {
            note_arc(first, line);
            UsdValue name;
            if (!read_value(name) || !expect('=', "a variantSet")) return false;
            skip_space();
            return peek() == '{' ? skip_brackets() : fail("a variantSet needs '{', and there is " + seen());
        }
        return read_property(first);
    }
};

} // namespace

const UsdAttribute* UsdPrim::find(std::string_view wanted) const {
    const auto found = std::ranges::find(attributes, wanted, &UsdAttribute::name);
    return found == attributes.end() ? nullptr : &*found;
}

UsdValue UsdLayer::find(std::string_view key) const {
    const auto found = std::ranges::find(metadata, key, &std::pair<std::string_view, UsdValue>::first);
    return found == metadata.end() ? UsdValue() : found->second;
}

Result<UsdLayer> read_usd_layer(std::string_view text, const std::string& name) {
    return LayerReader(text, name).read();
}

Result<std::vector<double>> usd_numbers(std::string_view text, const UsdValue& value, const std::string& name) {
    std::vector<double> numbers;
    const char *p = text.data() + value.begin, *const end = text.data() + value.end;
    std::size_t line = value.line;
    while (p < end) {
        if (is_space(*p) || *p == '(' || *p == ')' || *p == '[' || *p == ']' || *p == ',') {
            line += *p++ == '\n' ? 1 : 0;
            continue;
        }
        if (*p == '#') {
            while (p < end && *p != '\n') ++p;
            continue;
        }
        double number = 0;
        const char* const after = parse_number(p, end, number);
        if (after == p || (after < end && is_name(*after)))
            return Error{ErrorCode::bad_file, name + ": line " + std::to_string(line) + ": " +
                                                  in_quotes(std::string_view(p, std::size_t(end - p))) +
                                                  " is no number."};
        if (!(std::abs(number) < 1e30))
            return Error{ErrorCode::bad_file,
                         name + ": line " + std::to_string(line) + ": a number is not finite, or too large."};
        numbers.push_back(number);
        p = after;
    }
    return numbers;
}

std::vector<std::string_view> usd_words(std::string_view text, const UsdValue& value) {
    std::vector<std::string_view> words;
    for (std::size_t at = value.begin; at < value.end; ++at) {
        const char quote = text[at];
        if (quote != '"' && quote != '\'') continue;
        const std::size_t end = std::min(text.find(quote, at + 1), value.end);
        words.push_back(text.substr(at + 1, end - at - 1));
        at = end;
    }
    return words;
}

} // namespace filigree
