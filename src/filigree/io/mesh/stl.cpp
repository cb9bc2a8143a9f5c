// STL, text and binary. Facets are welded on reading: corners at the same place become one vertex.
#include "filigree/io/mesh/mesh_formats.h"
#include "filigree/io/system/text_scanner.h"
#include "filigree/io/system/text_writer.h"
#include "filigree/mesh.h"
#include "filigree/mesh/weld.h"

#include <bit>
#include <cstring>

#include <Eigen/Geometry>

namespace filigree {

namespace {

constexpr std::size_t kHeaderBytes = 80, kCountBytes = 4, kFacetBytes = 50;
constexpr std::size_t kFacetsBetweenReports = 1 << 16;
static_assert(std::endian::native == std::endian::little, "numbers are copied as the file has them");

/// `word` in lower case equals `keyword`.
bool is_keyword(std::string_view word, std::string_view keyword) {
    if (word.size() != keyword.size()) return false;
    for (std::size_t i = 0; i < word.size(); ++i) {
        const char c = word[i] >= 'A' && word[i] <= 'Z' ? static_cast<char>(word[i] | 32) : word[i];
        if (c != keyword[i]) return false;
    }
    return true;
}

/// Makes corners at the same place one vertex, in the order of their first appearance.
void weld(std::vector<Vec3f>&& corner_positions, Mesh& mesh) {
    std::vector<Index> vertex = weld_map(corner_positions);
    mesh.corners.resize(corner_positions.size());
    for (std::size_t c = 0; c < vertex.size(); ++c) {
        if (vertex[c] == c) { // the first here
            vertex[c] = static_cast<Index>(mesh.positions.size());
            mesh.positions.push_back(corner_positions[c]);
        } else {
            vertex[c] = vertex[vertex[c]]; // the first has its new number already
        }
        mesh.corners[c] = vertex[c];
    }
    mesh.face_offsets.resize(vertex.size() / 3 + 1);
    for (std::size_t f = 0; f < mesh.face_offsets.size(); ++f) mesh.face_offsets[f] = static_cast<Index>(3 * f);
}

std::uint32_t facet_count(std::string_view bytes) {
    std::uint32_t count = 0;
    std::memcpy(&count, bytes.data() + kHeaderBytes, kCountBytes);
    return count;
}

Result<MeshFile> read_binary(const MeshSource& source) {
    const std::string_view bytes = source.bytes;
    if (bytes.size() < kHeaderBytes + kCountBytes)
        return source.error("is too short for STL: " + std::to_string(bytes.size()) +
                            " bytes, and its header alone has 84.");
    const std::size_t count = facet_count(bytes), room = (bytes.size() - kHeaderBytes - kCountBytes) / kFacetBytes;
    if (count > room)
        return source.error("promises " + std::to_string(count) + " facets at byte 80, but holds " +
                            std::to_string(room) + "; it is cut off or not an STL file.");
    if (3 * count >= kNoIndex) return source.unsupported("has more corners than 32-bit indices can count.");
    MeshFile file;
    std::vector<Vec3f> positions(3 * count);
    bool has_attributes = false;
    for (std::size_t f = 0; f < count; ++f) {
        const char* const facet = bytes.data() + kHeaderBytes + kCountBytes + f * kFacetBytes;
        std::memcpy(positions[3 * f].data(), facet + 12, 36); // after the normal
        has_attributes |= facet[48] != 0 || facet[49] != 0;
        for (std::size_t c = 3 * f; c < 3 * f + 3; ++c)
            if (!positions[c].allFinite())
                return source.error("facet " + std::to_string(f) + " at byte " + std::to_string(facet - bytes.data()) +
                                    " has a coordinate that is not a finite number.");
        if (f % kFacetsBetweenReports == 0 && source.context.is_cancelled()) return cancelled_error();
    }
    weld(std::move(positions), file.mesh);
    split_origin(file.mesh);
    if (bytes.starts_with("solid"))
        file.warnings.emplace_back(
            "The file is binary, but begins with 'solid' as text does; other programs may stumble.");
    if (has_attributes) file.warnings.emplace_back("The facets' attribute bytes (colours, perhaps) were left out.");
    const std::size_t rest = bytes.size() - kHeaderBytes - kCountBytes - count * kFacetBytes;
    if (rest > 0) file.warnings.push_back(std::to_string(rest) + " bytes after the last facet were left out.");
    return file;
}

class AsciiReader {
public:
    explicit AsciiReader(const MeshSource& source) : source_(source), text_(source.bytes) {}

    Result<MeshFile> read() {
        for (text_.skip_space(); !text_.at_end(); text_.skip_space()) {
            if (!read_solid()) return *error_;
            if (source_.context.is_cancelled()) return cancelled_error();
        }
        split_origin(corners_, file_.mesh);
        weld(std::exchange(file_.mesh.positions, {}), file_.mesh);
        // one solid without a name says nothing
        if (file_.mesh.objects.names.size() > 1 || !file_.mesh.objects.names.front().empty())
            file_.mesh.objects.of_face = solids_;
        else
            file_.mesh.objects.names.clear();
        return std::move(file_);
    }

private:
    bool fail(const std::string& cause) {
        error_ = source_.error_at_line(text_.line(), cause);
        return false;
    }

    /// The next word is `keyword`.
    bool expect(std::string_view keyword) {
        text_.skip_space();
        const std::string_view word = text_.word();
        if (is_keyword(word, keyword)) return true;
        if (text_.at_end() && word.empty()) return fail("the file ends inside a facet; it is cut off.");
        return fail("expected '" + std::string(keyword) + "', found " + in_quotes(word) + ".");
    }

    /// "solid name", facets, and "endsolid name".
    bool read_solid() {
        if (!expect("solid")) return false;
        const auto solid = static_cast<Index>(file_.mesh.objects.names.size());
        file_.mesh.objects.names.push_back(read_solid_name());
        for (;;) {
            text_.skip_space();
            if (text_.at_end()) {
                file_.warnings.emplace_back("The file ends without 'endsolid'; it may be cut off.");
                return true;
            }
            const std::string_view word = text_.word();
            if (is_keyword(word, "facet")) {
                if (!read_facet()) return false;
                solids_.push_back(solid);
            } else if (is_keyword(word, "endsolid") || is_keyword(word, "end")) {
                text_.next_line();
                return true;
            } else {
                return fail("expected 'facet' or 'endsolid', found " + in_quotes(word) + ".");
            }
            if (solids_.size() % kFacetsBetweenReports == 0) {
                if (source_.context.is_cancelled()) return error_ = cancelled_error(), false;
                source_.context.report("Reading", source_.fraction(text_.offset()));
            }
        }
    }

    /// The rest of the line, up to "facet" when all is on one line.
    std::string read_solid_name() {
        std::string name;
        for (text_.skip_blanks(); !text_.at_end() && !TextScanner::is_line_end(text_.peek()); text_.skip_blanks()) {
            const TextScanner before = text_;
            std::string_view word = text_.word();
            if (word.empty()) text_.advance(), word = "#"; // no comment here
            if (is_keyword(word, "facet") || is_keyword(word, "endsolid")) {
                text_ = before;
                break;
            }
            if (!name.empty()) name += ' ';
            name += word;
        }
        return name;
    }

    bool read_facet() {
        skip_normal();
        if (!expect("loop")) return false;
        for (int i = 0; i < 3; ++i) {
            Vec3d p;
            if (!expect("vertex")) return false;
            for (double& x : p)
                if (!read_coordinate(x)) return false;
            corners_.push_back(p);
        }
        if (corners_.size() >= kNoIndex) return fail("there are more corners than 32-bit indices can count.");
        text_.skip_space();
        const TextScanner before = text_;
        if (is_keyword(text_.word(), "vertex"))
            return fail("a facet has more than three vertices; save the mesh as OBJ or PLY.");
        text_ = before;
        return expect("endloop") && expect("endfacet");
    }

    /// Normals follow from the vertices; files have all kinds here ("nan", nothing). Past "outer".
    void skip_normal() {
        constexpr int kMostWords = 5; // normal x y z outer
        for (int i = 0; i < kMostWords; ++i) {
            text_.skip_space();
            if (is_keyword(text_.word(), "outer")) return;
        }
    }

    bool read_coordinate(double& x) {
        text_.skip_space();
        if (!text_.number(x)) return fail("expected a coordinate, found " + in_quotes(text_.word()) + ".");
        return fits_float(x) || fail("a coordinate is not a finite number that fits 32-bit float.");
    }

    const MeshSource& source_;
    TextScanner text_;
    std::optional<Error> error_;
    MeshFile file_;
    std::vector<Vec3d> corners_;
    std::vector<Index> solids_; // of each facet
};

struct Facet {
    Vec3f normal;
    std::array<Vec3f, 3> corners;
};

Facet make_facet(const Mesh& mesh, const Triangle& triangle) {
    Facet facet;
    for (std::size_t i = 0; i < 3; ++i) facet.corners[i] = mesh.positions[triangle[i]];
    const Vec3d a = facet.corners[0].cast<double>();
    const Vec3d n = (facet.corners[1].cast<double>() - a).cross(facet.corners[2].cast<double>() - a);
    facet.normal = n.squaredNorm() > 0 ? Vec3f(n.normalized().cast<float>()) : Vec3f::Zero();
    return facet;
}

void write_binary(const Mesh& mesh, const std::vector<Triangle>& triangles, std::string& bytes) {
    constexpr std::string_view kHeader = "binary STL by filigree"; // must not begin with "solid"
    bytes.assign(kHeaderBytes + kCountBytes + triangles.size() * kFacetBytes, '\0');
    kHeader.copy(bytes.data(), kHeaderBytes);
    const auto count = static_cast<std::uint32_t>(triangles.size());
    std::memcpy(bytes.data() + kHeaderBytes, &count, kCountBytes);
    char* out = bytes.data() + kHeaderBytes + kCountBytes;
    for (const Triangle& triangle : triangles) {
        Facet facet = make_facet(mesh, triangle);
        for (Vec3f& p : facet.corners) p = (mesh.origin + p.cast<double>()).cast<float>();
        std::memcpy(out, facet.normal.data(), 12);
        for (std::size_t i = 0; i < 3; ++i) std::memcpy(out + 12 + 12 * i, facet.corners[i].data(), 12);
        out += kFacetBytes;
    }
}

void write_ascii(const Mesh& mesh, const Triangulation& faces, std::string& bytes) {
    TextWriter out(bytes);
    const auto object_of = [&](Index face) { return mesh.objects.empty() ? kNoIndex : mesh.objects.of_face[face]; };
    const auto name_solid = [&](std::string_view keyword, Index object) {
        out.text(keyword);
        if (object != kNoIndex) out.text(" ").name(mesh.objects.names[object]);
        out.text("\n");
    };
    Index object = faces.source_face.empty() ? kNoIndex : object_of(faces.source_face.front());
    name_solid("solid", object);
    for (std::size_t t = 0; t < faces.triangles.size(); ++t) {
        if (const Index here = object_of(faces.source_face[t]); here != object) {
            name_solid("endsolid", object);
            name_solid("solid", here);
            object = here;
        }
        const Facet facet = make_facet(mesh, faces.triangles[t]);
        out.text("facet normal ").position(Vec3d::Zero(), facet.normal).text("\nouter loop\n");
        for (const Vec3f& p : facet.corners) out.text("vertex ").position(mesh.origin, p).text("\n");
        out.text("endloop\nendfacet\n");
    }
    name_solid("endsolid", object);
}

bool is_ascii_stl(std::string_view bytes) {
    constexpr std::size_t kNameBytes = 2048; // names are short; binary headers have 80 bytes
    TextScanner text(bytes.substr(0, kNameBytes));
    text.skip_space();
    if (!is_keyword(text.word(), "solid")) return false;
    for (text.skip_blanks(); !text.at_end();) {
        const std::string_view word = text.word();
        if (is_keyword(word, "facet") || is_keyword(word, "endsolid")) return true;
        if (word.find('\0') != std::string_view::npos) return false;
        if (word.empty()) text.advance();
    }
    return false;
}

bool is_binary_stl(std::string_view bytes) {
    return bytes.size() >= kHeaderBytes + kCountBytes &&
           bytes.size() == kHeaderBytes + kCountBytes + std::size_t{facet_count(bytes)} * kFacetBytes;
}

} // namespace

bool is_stl(std::string_view bytes) { return is_ascii_stl(bytes) || is_binary_stl(bytes); }

Result<MeshFile> read_stl(const MeshSource& source) {
    // A binary file's header may hold any words; the count behind it does not fit the size of a text.
    const bool is_binary = is_binary_stl(source.bytes) || !is_ascii_stl(source.bytes);
    return is_binary ? read_binary(source) : AsciiReader(source).read();
}

Result<WriteNotes> write_stl(const Mesh& mesh, const WriteMeshOptions& options, std::string& bytes,
                             const RunContext& context) {
    const Result<Triangulation> cut = triangulate(mesh, context);
    if (!cut) return cut.error();
    const Triangulation& faces = *cut;
    if (options.ascii)
        write_ascii(mesh, faces, bytes);
    else
        write_binary(mesh, faces.triangles, bytes);
    std::vector<std::string> lost;
    if (faces.triangles.size() != mesh.face_count()) lost.emplace_back(kPolygonLoss);
    if (!options.ascii && !mesh.origin.isZero(0)) lost.emplace_back("all digits of positions this far from zero");
    if (!mesh.uvs.empty()) lost.emplace_back("UVs");
    if (!mesh.normals.empty()) lost.emplace_back("vertex normals");
    if (!mesh.colors.empty()) lost.emplace_back("colours");
    if (!options.ascii && !mesh.objects.empty()) lost.emplace_back("objects");
    add_face_label_losses(mesh, lost);
    add_scalar_losses(mesh, lost);
    return WriteNotes{std::move(lost), {}};
}

} // namespace filigree
