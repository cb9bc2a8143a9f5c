// Wavefront OBJ, polygons only.
#include "filigree/core/large_memory.h"
#include "filigree/io/mesh/material_file.h"
#include "filigree/io/mesh/mesh_formats.h"
#include "filigree/io/system/text_scanner.h"
#include "filigree/io/system/text_writer.h"

#include <algorithm>
#include <unordered_map>

namespace filigree {

namespace {

constexpr std::size_t kLinesBetweenReports = 1 << 16;

/// A label that holds from one face to the next change.
class LabelRuns {
public:
    void set(Index label, std::size_t first_face) { runs_.push_back({first_face, label}); }

    /// One label a face, `none` before the first run; empty when there are no runs.
    std::vector<Index> expand(std::size_t face_count, Index none) const {
        if (runs_.empty()) return {};
        std::vector<Index> labels(face_count, none);
        for (std::size_t r = 0; r < runs_.size(); ++r) {
            const std::size_t end = r + 1 < runs_.size() ? runs_[r + 1].first_face : face_count;
            std::fill(labels.begin() + runs_[r].first_face, labels.begin() + end, runs_[r].label);
        }
        return labels;
    }

private:
    struct Run {
        std::size_t first_face;
        Index label;
    };
    std::vector<Run> runs_;
};

/// Runs of names. An empty name is none.
class NameRuns {
public:
    void set(std::string_view name, std::size_t first_face) {
        if (name.empty()) return runs_.set(kNoIndex, first_face);
        const auto [entry, is_new] = index_of_.try_emplace(std::string(name), static_cast<Index>(names_.size()));
        if (is_new) names_.emplace_back(name);
        runs_.set(entry->second, first_face);
    }

    FaceLabels labels(std::size_t face_count) const {
        if (names_.empty()) return {};
        return {names_, runs_.expand(face_count, kNoIndex)};
    }

private:
    std::vector<std::string> names_;
    std::unordered_map<std::string, Index> index_of_;
    LabelRuns runs_;
};

/// Values, and which of them each corner has.
template <class T>
struct CornerValues {
    std::vector<T> values;
    std::vector<Index> corners; // shorter than the mesh's until a corner has one

    void set(std::size_t corner, Index value) {
        corners.resize(corner, kNoIndex);
        corners.push_back(value);
    }

    CornerAttribute<T> attribute(const Mesh& mesh) {
        if (corners.empty() && values.size() == mesh.vertex_count() && mesh.face_count() == 0)
            return {std::move(values), {}};
        if (corners.empty()) return {};
        corners.resize(mesh.corner_count(), kNoIndex);
        if (values.size() == mesh.vertex_count() && corners == mesh.corners) corners.clear(); // one a vertex, in order
        return {std::move(values), std::move(corners)};
    }
};

/// The highest index of a kind and where it stood: elements may come after the faces that refer to them.
struct HighestIndex {
    std::uint64_t count = 0; // the index itself counts from 1
    std::size_t line = 0;
    std::size_t line_before_first = 0; // of the first index that counted back from nothing; 0: none
};

class ObjReader {
public:
    explicit ObjReader(const MeshSource& source) : source_(source), text_(without_end_mark(source.bytes)) {
        has_end_mark_ = text_.bytes_left() < source.bytes.size();
    }

    Result<MeshFile> read() {
        reserve();
        while (!text_.at_end()) {
            if (!read_statement()) return *error_;
            text_.next_line();
            if (++lines_read_ % kLinesBetweenReports == 0) {
                if (source_.context.is_cancelled()) return cancelled_error();
                source_.context.report("Reading", source_.fraction(text_.offset()));
            }
        }
        if (!check_ranges()) return *error_;
        return finish();
    }

private:
    bool fail(const std::string& cause) { return fail_at(text_.line(), cause); }
    bool fail_at(std::size_t line, const std::string& cause) {
        error_ = source_.error_at_line(line, cause);
        return false;
    }

    /// Without the Ctrl-Z that old programs end a text with.
    static std::string_view without_end_mark(std::string_view text) {
        constexpr std::string_view kBlanks(" \t\r\n\0", 5), kMarkAndBlanks(" \t\r\n\0\x1a", 6);
        const std::size_t last = text.find_last_not_of(kBlanks);
        if (last == std::string_view::npos || text[last] != '\x1a') return text;
        return text.substr(0, text.find_last_not_of(kMarkAndBlanks) + 1);
    }

    /// Guesses from the file's size (a scan has 70 bytes a vertex and 35 a face); memory that is not touched is free.
    void reserve() {
        reserve_large(world_, source_.bytes.size() / 70);
        reserve_large(mesh_.face_offsets, source_.bytes.size() / 35 + 1);
        reserve_large(mesh_.corners, source_.bytes.size() / 35 * 3);
    }

    bool read_statement() {
        text_.skip_blanks();
        if (text_.at_line_end()) return true;
        const std::string_view keyword = text_.word();
        if (keyword == "v") return read_vertex();
        if (keyword == "f" || keyword == "fo") return read_face();
        if (keyword == "vn") return read_value(normals_, "a normal", 3);
        if (keyword == "vt") return read_value(uvs_, "a UV", 1);
        if (keyword == "o") return objects_.set(text_.rest_of_line(), mesh_.face_count()), true;
        if (keyword == "g") return groups_.set(text_.rest_of_line(), mesh_.face_count()), true;
        if (keyword == "usemtl") return materials_.set(text_.rest_of_line(), mesh_.face_count()), true;
        if (keyword == "s") return read_smoothing();
        if (keyword == "mtllib") return read_material_file();
        if (keyword == "l" || keyword == "p") return ++lines_and_points_, true;
        return skip_unknown(keyword);
    }

    /// The numbers of the line, at most `max`; what follows is an error.
    bool read_numbers(double* numbers, int max, int& count, const char* what) {
        count = 0;
        for (text_.skip_blanks(); !text_.at_line_end(); text_.skip_blanks()) {
            if (count == max) return fail("too many numbers for " + std::string(what) + ".");
            if (!text_.number(numbers[count])) return fail_number();
            ++count;
        }
        return true;
    }

    bool fail_number() {
        const std::string_view found = text_.word();
        const bool comma = found.find(',') != std::string_view::npos;
        return fail("expected a number, found " + in_quotes(found) +
                    (comma ? "; write decimals with a point, not a comma." : "; mend or delete the line."));
    }

    bool read_vertex() {
        double n[7];
        int count = 0;
        if (!read_numbers(n, 7, count, "a vertex")) return false;
        if (count < 3) return fail("a vertex has three coordinates, here are " + std::to_string(count) + ".");
        if (count == 5)
            return fail("a vertex has three coordinates and perhaps a weight or a colour, here are 5 numbers.");
        for (int i = 0; i < 3; ++i)
            if (!fits_float(n[i])) return fail("a coordinate is not a finite number that fits 32-bit float.");
        if (world_.size() == kNoIndex - 1) return fail("there are more vertices than 32-bit indices can count.");
        world_.emplace_back(n[0], n[1], n[2]);
        if (count == 4 && n[3] != 1) ++weights_;
        if (count >= 6) add_color(Vec3d(n[3], n[4], n[5]), count == 7 ? &n[6] : nullptr);
        seven_numbers_ += count == 7;
        return true;
    }

    void add_color(const Vec3d& rgb, const double* alpha) {
        mesh_.colors.resize(world_.size() - 1, Vec4f::Ones());
        mesh_.colors.push_back(Vec4f(static_cast<float>(rgb.x()), static_cast<float>(rgb.y()),
                                     static_cast<float>(rgb.z()), alpha ? static_cast<float>(*alpha) : 1.0f));
        mesh_.colors_have_alpha |= alpha != nullptr;
        ++colored_vertices_;
    }

    template <class T>
    bool read_value(CornerValues<T>& attribute, const char* what, int least) {
        double n[3] = {0, 0, 0};
        int count = 0;
        if (!read_numbers(n, 3, count, what)) return false;
        if (count < least) return fail("the line has too few numbers for " + std::string(what) + ".");
        if (attribute.values.size() == kNoIndex - 1)
            return fail("there are more lines with " + std::string(what) + " than 32-bit indices can count.");
        T value;
        for (int i = 0; i < T::SizeAtCompileTime; ++i) value[i] = static_cast<float>(n[i]);
        attribute.values.push_back(value);
        if (T::SizeAtCompileTime == 2 && n[2] != 0) ++third_uvs_;
        return true;
    }

    /// An index as the file has it, from 1 or backwards from -1, into one that counts from 0.
    bool read_index(std::size_t count_so_far, HighestIndex& highest, Index& index) {
        std::int64_t n = 0;
        if (!text_.integer(n)) return fail_corner();
        if (n < 0) n += static_cast<std::int64_t>(count_so_far) + 1;
        if (n <= 0) return fail_index(text_.line());
        if (static_cast<std::uint64_t>(n) > highest.count) highest = {static_cast<std::uint64_t>(n), text_.line()};
        index = static_cast<Index>(n - 1); // one too large for 32 bits is found by check_ranges
        return true;
    }

    bool fail_corner() { return fail("expected a corner such as 3 or 3/1/2, found " + in_quotes(text_.word()) + "."); }
    bool fail_index(std::size_t line) {
        return fail_at(line, "a corner refers to an element before the first; indices count from 1, or back from -1.");
    }

    /// The UV or normal of a corner. A file may have none of what its faces refer to (check_optional).
    template <class T>
    bool read_optional_index(CornerValues<T>& attribute, HighestIndex& highest, std::size_t corner) {
        Index value = 0;
        if (attribute.values.empty() && text_.peek() == '-') { // counts back from nothing
            std::int64_t n = 0;
            if (!text_.integer(n)) return fail_corner();
            if (highest.line_before_first == 0) highest.line_before_first = text_.line();
        } else if (!read_index(attribute.values.size(), highest, value)) {
            return false;
        }
        attribute.set(corner, value);
        return true;
    }

    bool has_index() const { return is_digit(text_.peek()) || text_.peek() == '-'; }

    /// v, v/t, v//n or v/t/n; "v/" and "v//" happen too.
    bool read_corner() {
        const std::size_t corner = mesh_.corners.size();
        Index vertex = 0;
        if (!read_index(world_.size(), highest_vertex_, vertex)) return false;
        mesh_.corners.push_back(vertex);
        if (text_.peek() == '/') {
            text_.advance();
            if (has_index() && !read_optional_index(uvs_, highest_uv_, corner)) return false;
            if (text_.peek() == '/') {
                text_.advance();
                if (has_index() && !read_optional_index(normals_, highest_normal_, corner)) return false;
            }
        }
        return text_.at_word_end() || fail_corner();
    }

    bool read_face() {
        const std::size_t first = mesh_.corners.size();
        const HighestIndex before[3] = {highest_vertex_, highest_uv_, highest_normal_};
        for (text_.skip_blanks(); !text_.at_line_end(); text_.skip_blanks())
            if (!read_corner()) return false;
        if (mesh_.corners.size() >= kNoIndex) return fail("there are more corners than 32-bit indices can count.");
        if (mesh_.corners.size() - first < 3) {
            ++short_faces_;
            mesh_.corners.resize(first);
            if (uvs_.corners.size() > first) uvs_.corners.resize(first);
            if (normals_.corners.size() > first) normals_.corners.resize(first);
            highest_vertex_ = before[0], highest_uv_ = before[1], highest_normal_ = before[2];
            return true;
        }
        mesh_.face_offsets.push_back(static_cast<Index>(mesh_.corners.size()));
        return true;
    }

    bool read_smoothing() {
        text_.skip_blanks();
        std::int64_t group = 0;
        const std::string_view word = text_.word();
        if (word == "on")
            group = 1;
        else if (word != "off" && !TextScanner(word).integer(group))
            return true; // "s" alone, or something odd: nothing
        smoothing_.set(static_cast<Index>(std::clamp<std::int64_t>(group, 0, kNoIndex - 1)), mesh_.face_count());
        return true;
    }

    bool read_material_file() {
        const std::string_view file = text_.rest_of_line();
        if (!file.empty()) mesh_.material_files.emplace_back(file);
        return true;
    }

    bool skip_unknown(std::string_view keyword) {
        const bool is_word = std::all_of(keyword.begin(), keyword.end(), [](char c) {
            return is_digit(c) || c == '_' || c == '.' || (static_cast<unsigned char>((c | 32) - 'a') < 26);
        });
        if (!is_word) return fail("found " + in_quotes(keyword) + ", which starts no statement of an OBJ file.");
        if (unknown_statements_++ == 0)
            first_unknown_ = in_quotes(keyword) + " in line " + std::to_string(text_.line());
        return true;
    }

    bool check_range(const HighestIndex& highest, std::size_t count, const char* what) {
        if (highest.count <= count) return true;
        return fail_at(highest.line, "a corner refers to " + std::string(what) + " " + std::to_string(highest.count) +
                                         ", but the file has " + std::to_string(count) + "; the file may be cut off.");
    }
    /// Where the file has none at all, as exports of positions alone, what the faces refer to is left out.
    template <class T>
    bool check_optional(CornerValues<T>& attribute, const HighestIndex& highest, const char* what, bool& is_missing) {
        if (attribute.values.empty()) {
            is_missing = !attribute.corners.empty();
            attribute.corners.clear();
            return true;
        }
        if (highest.line_before_first != 0) return fail_index(highest.line_before_first);
        return check_range(highest, attribute.values.size(), what);
    }

    bool check_ranges() {
        return check_range(highest_vertex_, world_.size(), "vertex") &&
               check_optional(uvs_, highest_uv_, "UV", has_missing_uvs_) &&
               check_optional(normals_, highest_normal_, "normal", has_missing_normals_);
    }

    /// Seven numbers are x y z r g b a, or x y z w r g b: the latter where all reds would be 1 and the alphas differ.
    bool takes_reds_for_weights() {
        const auto is_one = [](int channel) { return [channel](const Vec4f& c) { return c[channel] == 1; }; };
        if (seven_numbers_ == 0 || seven_numbers_ < colored_vertices_ || colored_vertices_ < world_.size() ||
            !std::ranges::all_of(mesh_.colors, is_one(0)) || std::ranges::all_of(mesh_.colors, is_one(3)))
            return false;
        for (Vec4f& color : mesh_.colors) color = Vec4f(color[1], color[2], color[3], 1);
        mesh_.colors_have_alpha = false;
        return true;
    }

    MeshFile finish() {
        has_weights_before_colors_ = takes_reds_for_weights();
        split_origin(world_, mesh_);
        mesh_.uvs = uvs_.attribute(mesh_);
        mesh_.normals = normals_.attribute(mesh_);
        mesh_.objects = objects_.labels(mesh_.face_count());
        mesh_.groups = groups_.labels(mesh_.face_count());
        mesh_.materials = materials_.labels(mesh_.face_count());
        mesh_.smoothing = smoothing_.expand(mesh_.face_count(), 0);
        if (!mesh_.colors.empty()) mesh_.colors.resize(world_.size(), Vec4f::Ones());
        std::vector<std::string> warnings = collect_warnings();
        return {std::move(mesh_), std::move(warnings)};
    }

    std::vector<std::string> collect_warnings() const {
        std::vector<std::string> warnings;
        const auto warn = [&](std::size_t count, const std::string& what) {
            if (count > 0) warnings.push_back(std::to_string(count) + " " + what);
        };
        warn(short_faces_, "faces with fewer than three corners were left out.");
        warn(lines_and_points_, "line and point elements were left out.");
        warn(unknown_statements_, "statements of other kinds were left out (the first: " + first_unknown_ + ").");
        warn(weights_, "vertices have a fourth coordinate, a weight, which was left out.");
        if (has_weights_before_colors_)
            warn(seven_numbers_, "vertices have seven numbers, the fourth always 1: read as x y z w r g b.");
        warn(third_uvs_, "UVs have a third number, which was left out.");
        if (has_missing_uvs_) warnings.emplace_back("The faces refer to UVs, but the file has none; left out.");
        if (has_missing_normals_) warnings.emplace_back("The faces refer to normals, but the file has none; left out.");
        if (has_end_mark_) warnings.emplace_back("The file ends in a Ctrl-Z, an old end mark, which was left out.");
        if (colored_vertices_ > 0) warn(world_.size() - colored_vertices_, "vertices have no colour and became white.");
        return warnings;
    }

    const MeshSource& source_;
    TextScanner text_;
    std::optional<Error> error_;
    Mesh mesh_;
    std::vector<Vec3d> world_;
    CornerValues<Vec2f> uvs_;
    CornerValues<Vec3f> normals_;
    NameRuns objects_, groups_, materials_;
    LabelRuns smoothing_;
    HighestIndex highest_vertex_, highest_uv_, highest_normal_;
    std::size_t lines_read_ = 0, short_faces_ = 0, lines_and_points_ = 0, third_uvs_ = 0, colored_vertices_ = 0,
                seven_numbers_ = 0;
    bool has_weights_before_colors_ = false;
    std::size_t unknown_statements_ = 0, weights_ = 0;
    std::string first_unknown_;
    bool has_missing_uvs_ = false, has_missing_normals_ = false, has_end_mark_ = false;
};

template <class T>
void write_values(TextWriter& out, std::string_view keyword, const std::vector<T>& values) {
    for (const T& value : values) {
        out.text(keyword);
        for (const float x : value) out.text(" ").number(x);
        out.text("\n");
    }
}

/// Writes "keyword name" where the label changes.
class LabelWriter {
public:
    LabelWriter(std::string_view keyword, const FaceLabels& labels) : LabelWriter(keyword, labels, labels.names) {}
    LabelWriter(std::string_view keyword, const FaceLabels& labels, const std::vector<std::string>& names)
        : keyword_(keyword), labels_(labels), names_(names) {}
    void start_face(TextWriter& out, std::size_t face) {
        if (labels_.empty() || labels_.of_face[face] == current_) return;
        current_ = labels_.of_face[face];
        out.text(keyword_);
        if (current_ != kNoIndex) out.text(" ").name(names_[current_]);
        out.text("\n");
    }

private:
    std::string_view keyword_;
    const FaceLabels& labels_;
    const std::vector<std::string>& names_;
    Index current_ = kNoIndex;
};

/// The value of a corner counted from 1, or 0 for none.
template <class T>
std::uint64_t value_number(const CornerAttribute<T>& attribute, const Mesh& mesh, std::size_t corner) {
    if (attribute.empty()) return 0;
    const Index value = attribute.per_vertex() ? mesh.corners[corner] : attribute.corners[corner];
    return value == kNoIndex ? 0 : std::uint64_t{value} + 1;
}

void write_corner(TextWriter& out, const Mesh& mesh, std::size_t corner) {
    out.text(" ").number(std::uint64_t{mesh.corners[corner]} + 1);
    const std::uint64_t uv = value_number(mesh.uvs, mesh, corner), normal = value_number(mesh.normals, mesh, corner);
    if (uv || normal) out.text("/");
    if (uv) out.number(uv);
    if (normal) out.text("/").number(normal);
}

void write_faces(TextWriter& out, const Mesh& mesh) {
    const std::vector<std::string> names =
        mesh.embedded_materials.empty() ? mesh.materials.names : obj_material_names(mesh); // as the library has them
    LabelWriter objects("o", mesh.objects), groups("g", mesh.groups), materials("usemtl", mesh.materials, names);
    Index smoothing = 0;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        objects.start_face(out, f);
        groups.start_face(out, f);
        materials.start_face(out, f);
        if (!mesh.smoothing.empty() && (f == 0 || mesh.smoothing[f] != smoothing)) {
            smoothing = mesh.smoothing[f];
            out.text("s ").number(smoothing).text("\n");
        }
        out.text("f");
        for (std::size_t c = mesh.face_offsets[f]; c < mesh.face_offsets[f + 1]; ++c) write_corner(out, mesh, c);
        out.text("\n");
    }
}

} // namespace

Result<MeshFile> read_obj(const MeshSource& source) { return ObjReader(source).read(); }

std::vector<std::string> write_obj(const Mesh& mesh, std::string_view library, std::string& bytes) {
    TextWriter out(bytes);
    if (!library.empty()) out.text("mtllib ").name(library).text("\n");
    for (const std::string& file : mesh.material_files)
        if (library.empty()) out.text("mtllib ").name(file).text("\n");
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        out.text("v ").position(mesh.origin, mesh.positions[v]);
        for (int i = 0; i < 3 && !mesh.colors.empty(); ++i) out.text(" ").number(mesh.colors[v][i]);
        out.text("\n");
    }
    write_values(out, "vt", mesh.uvs.values);
    write_values(out, "vn", mesh.normals.values);
    write_faces(out, mesh);
    std::vector<std::string> lost;
    if (library.empty() && !mesh.embedded_materials.empty()) lost.push_back("embedded materials");
    if (!mesh.colors.empty() && mesh.colors_have_alpha) lost.push_back("the colours' alpha");
    add_scalar_losses(mesh, lost);
    return lost;
}

Result<WriteNotes> write_obj(const Mesh& mesh, const WriteMeshOptions&, std::string& bytes, const RunContext&) {
    return WriteNotes{write_obj(mesh, "", bytes), {}};
}

bool is_obj(std::string_view bytes) {
    TextScanner text(bytes);
    text.skip_space();
    const std::string_view keyword = text.word();
    static constexpr std::string_view kKeywords[] = {"v", "vn", "vt", "f", "o", "g", "s", "usemtl", "mtllib"};
    return std::find(std::begin(kKeywords), std::end(kKeywords), keyword) != std::end(kKeywords);
}

} // namespace filigree
