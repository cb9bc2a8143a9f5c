// OFF, text: plain, and with normals, colours and UVs a vertex (NOFF, COFF, STOFF and their combinations).
#include "filigree/io/mesh/mesh_formats.h"
#include "filigree/io/system/text_scanner.h"
#include "filigree/io/system/text_writer.h"

namespace filigree {

namespace {

/// What the first word says: [ST][C][N][4][n]OFF.
struct OffHeader {
    bool uvs = false, colors = false, normals = false, four_dimensions = false, n_dimensions = false;
};

/// Takes the keyword off the front of `word`: the counts may follow without a blank ("OFF8 6 12").
std::optional<OffHeader> take_header(std::string_view& word) {
    OffHeader header;
    std::string_view rest = word;
    const auto take = [&](std::string_view prefix) {
        if (!rest.starts_with(prefix)) return false;
        rest.remove_prefix(prefix.size());
        return true;
    };
    header.uvs = take("ST");
    header.colors = take("C");
    header.normals = take("N");
    header.four_dimensions = take("4");
    header.n_dimensions = take("n");
    if (!take("OFF") || (!rest.empty() && !is_digit(rest.front()))) return {};
    word = rest;
    return header;
}

class OffReader {
public:
    explicit OffReader(const MeshSource& source) : source_(source), text_(source.bytes) {}

    Result<MeshFile> read() {
        if (!read_header() || !read_counts() || !read_vertices() || !read_faces()) return *error_;
        split_origin(world_, file_.mesh);
        collect_warnings();
        return std::move(file_);
    }

private:
    bool fail(const std::string& cause) {
        error_ = source_.error_at_line(text_.line(), cause);
        return false;
    }
    bool fail_unsupported(const std::string& cause) {
        error_ = source_.unsupported(cause);
        return false;
    }

    bool read_header() {
        text_.skip_space();
        TextScanner after = text_;
        std::string_view word = after.word();
        const std::size_t length = word.size();
        const std::optional<OffHeader> header = take_header(word);
        if (!header) {
            const bool bare = is_digit(text_.peek()); // the keyword may be missing
            return bare || fail("expected 'OFF', found " + in_quotes(word) + ".");
        }
        header_ = *header;
        if (header_.four_dimensions || header_.n_dimensions)
            return fail_unsupported("is OFF of another dimension than three, which is not read.");
        for (std::size_t i = 0; i < length - word.size(); ++i) text_.advance();
        after = text_;
        after.skip_space();
        if (after.word() == "BINARY")
            return fail_unsupported("is binary OFF, which is not read; save it as text or as PLY.");
        return true;
    }

    bool read_count(std::size_t& count, const char* what) {
        text_.skip_space();
        std::int64_t n = 0;
        if (!text_.integer(n) || !text_.at_word_end())
            return fail("expected the number of " + std::string(what) + ", found " + in_quotes(text_.word()) + ".");
        if (n < 0) return fail("the number of " + std::string(what) + " is negative.");
        count = static_cast<std::size_t>(n);
        return true;
    }

    bool read_counts() {
        if (!read_count(vertex_count_, "vertices") || !read_count(face_count_, "faces")) return false;
        text_.skip_blanks();
        std::size_t edges = 0; // nobody needs it, and some files have none
        if (!text_.at_line_end() && !read_count(edges, "edges")) return false;
        skip_edges_on_their_own_line();
        // every row has at least two bytes
        if (vertex_count_ / 2 > text_.bytes_left() || face_count_ / 2 > text_.bytes_left())
            return fail("the counts " + std::to_string(vertex_count_) + " and " + std::to_string(face_count_) +
                        " are more than the file can hold.");
        return vertex_count_ < kNoIndex || fail_unsupported("has more vertices than 32-bit indices can count.");
    }

    /// Where the counts went over lines. No row has one number.
    void skip_edges_on_their_own_line() {
        TextScanner after = text_;
        after.skip_space();
        std::int64_t edges = 0;
        if (!after.integer(edges) || !after.at_word_end()) return;
        after.skip_blanks();
        if (after.at_line_end()) text_ = after;
    }

    bool report_progress(std::size_t row) {
        if (row % kRowsBetweenReports != 0) return true;
        source_.context.report("Reading", source_.fraction(text_.offset()));
        if (!source_.context.is_cancelled()) return true;
        error_ = cancelled_error();
        return false;
    }

    bool read_number(double& x, const char* what) {
        text_.skip_space();
        if (text_.number(x)) return true;
        if (text_.at_end()) return fail_cut_off();
        const std::string_view found = text_.word();
        return fail("expected " + std::string(what) + ", found " + in_quotes(found) +
                    (found.find(',') != std::string_view::npos ? "; write decimals with a point, not a comma." : "."));
    }
    bool fail_cut_off() {
        return fail("the file ends after " + std::to_string(world_.size()) + " of " + std::to_string(vertex_count_) +
                    " vertices and " + std::to_string(faces_read_) + " of " + std::to_string(face_count_) +
                    " faces; it is cut off.");
    }

    template <class Vector>
    bool read_vector(Vector& v, const char* what) {
        for (auto& component : v) {
            double x = 0;
            if (!read_number(x, what)) return false;
            component = static_cast<typename Vector::Scalar>(x);
        }
        return true;
    }

    bool read_vertices() {
        Mesh& mesh = file_.mesh;
        world_.reserve(vertex_count_);
        for (std::size_t v = 0; v < vertex_count_; ++v) {
            Vec3d p;
            if (!report_progress(v) || !read_vector(p, "a coordinate")) return false;
            if (!fits_float(p.cwiseAbs().maxCoeff()) || !p.allFinite())
                return fail("a coordinate is not a finite number that fits 32-bit float.");
            world_.push_back(p);
            if (header_.normals && !read_vector(mesh.normals.values.emplace_back(), "a normal")) return false;
            if (header_.colors && !read_color()) return false;
            if (header_.uvs && !read_vector(mesh.uvs.values.emplace_back(), "a UV")) return false;
            text_.skip_blanks();
            if (!text_.at_line_end() && !TextScanner(text_).number(p.x()))
                return fail("expected the end of the line, found " + in_quotes(text_.word()) + ".");
            if (!text_.at_line_end()) ++longer_rows_, text_.next_line();
        }
        return true;
    }

    /// Three numbers, and a fourth unless the line, or what must follow in it, says otherwise.
    bool read_color() {
        Vec3f rgb;
        if (!read_vector(rgb, "a colour")) return false;
        Vec4f color(rgb.x(), rgb.y(), rgb.z(), 1);
        if (numbers_left_in_line() > (header_.uvs ? 2 : 0)) {
            double alpha = 1;
            if (!read_number(alpha, "a colour")) return false;
            color.w() = static_cast<float>(alpha);
            file_.mesh.colors_have_alpha = true;
        }
        file_.mesh.colors.push_back(color);
        return true;
    }

    int numbers_left_in_line() const {
        TextScanner ahead = text_;
        int count = 0;
        double x = 0;
        for (ahead.skip_blanks(); ahead.number(x); ahead.skip_blanks()) ++count;
        return count;
    }

    bool read_faces() {
        Mesh& mesh = file_.mesh;
        mesh.face_offsets.reserve(face_count_ + 1);
        for (; faces_read_ < face_count_; ++faces_read_) {
            std::size_t corners = 0;
            text_.skip_space();
            if (text_.at_end()) return fail_cut_off();
            if (!report_progress(faces_read_) || !read_count(corners, "corners")) return false;
            const std::size_t first = mesh.corners.size();
            for (std::size_t c = 0; c < corners; ++c)
                if (!read_corner()) return false;
            if (corners < 3) {
                ++short_faces_;
                mesh.corners.resize(first);
            } else {
                mesh.face_offsets.push_back(static_cast<Index>(mesh.corners.size()));
            }
            text_.skip_blanks();
            if (!text_.at_line_end()) ++coloured_faces_; // or whatever stands there
            text_.next_line();
        }
        return true;
    }

    bool read_corner() {
        text_.skip_space();
        std::int64_t vertex = 0;
        if (text_.at_end()) return fail_cut_off();
        if (!text_.integer(vertex) || !text_.at_word_end())
            return fail("expected a vertex index, found " + in_quotes(text_.word()) + ".");
        if (vertex < 0 || vertex >= static_cast<std::int64_t>(vertex_count_))
            return fail("a corner refers to vertex " + std::to_string(vertex) + "; they go from 0 to " +
                        std::to_string(static_cast<std::int64_t>(vertex_count_) - 1) + ".");
        if (file_.mesh.corners.size() >= kNoIndex - 1)
            return fail_unsupported("has more corners than 32-bit indices can count.");
        file_.mesh.corners.push_back(static_cast<Index>(vertex));
        return true;
    }

    void collect_warnings() {
        const auto warn = [&](std::size_t count, const std::string& what) {
            if (count > 0) file_.warnings.push_back(std::to_string(count) + " " + what);
        };
        warn(longer_rows_, "vertices have more numbers than the header says, which were left out.");
        warn(short_faces_, "faces with fewer than three corners were left out.");
        warn(coloured_faces_, "faces have a colour, which was left out.");
    }

    const MeshSource& source_;
    TextScanner text_;
    std::optional<Error> error_;
    OffHeader header_;
    MeshFile file_;
    std::vector<Vec3d> world_;
    std::size_t vertex_count_ = 0, face_count_ = 0, faces_read_ = 0;
    std::size_t longer_rows_ = 0, short_faces_ = 0, coloured_faces_ = 0;
};

template <class Vector>
void write_vector(TextWriter& out, const Vector& v, int count = Vector::SizeAtCompileTime) {
    for (int i = 0; i < count; ++i) out.text(" ").number(v[i]);
}

} // namespace

bool is_off(std::string_view bytes) {
    TextScanner text(bytes);
    text.skip_space();
    std::string_view word = text.word();
    return take_header(word).has_value();
}

Result<MeshFile> read_off(const MeshSource& source) { return OffReader(source).read(); }

Result<WriteNotes> write_off(const Mesh& mesh, const WriteMeshOptions&, std::string& bytes, const RunContext&) {
    const auto uvs = values_per_vertex(mesh.uvs, mesh);
    const auto normals = values_per_vertex(mesh.normals, mesh);
    const bool has_uvs = uvs && !uvs->empty(), has_normals = normals && !normals->empty(),
               has_colors = !mesh.colors.empty();
    TextWriter out(bytes);
    out.text(has_uvs ? "ST" : "").text(has_colors ? "C" : "").text(has_normals ? "N" : "").text("OFF\n");
    out.number(mesh.vertex_count()).text(" ").number(mesh.face_count()).text(" 0\n");
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        out.position(mesh.origin, mesh.positions[v]);
        if (has_normals) write_vector(out, (*normals)[v]);
        if (has_colors) write_vector(out, mesh.colors[v], mesh.colors_have_alpha ? 4 : 3);
        if (has_uvs) write_vector(out, (*uvs)[v]);
        out.text("\n");
    }
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        out.number(mesh.face_size(f));
        for (const Index vertex : mesh.face(f)) out.text(" ").number(vertex);
        out.text("\n");
    }
    std::vector<std::string> lost;
    if (!uvs) lost.emplace_back("UVs that differ at a vertex");
    if (!normals) lost.emplace_back("normals that differ at a vertex");
    if (!mesh.objects.empty()) lost.emplace_back("objects");
    add_face_label_losses(mesh, lost);
    add_scalar_losses(mesh, lost);
    return WriteNotes{std::move(lost), {}};
}

} // namespace filigree
