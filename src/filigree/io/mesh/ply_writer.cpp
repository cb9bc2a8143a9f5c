// PLY, written as text or binary of either byte order.
#include "filigree/io/mesh/ply_header.h"
#include "filigree/io/system/text_writer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace filigree {

using namespace ply;

namespace {

constexpr std::size_t kMaxInt = std::numeric_limits<std::int32_t>::max(); // most readers know "int" indices best

/// A vertex property to write.
struct OutputColumn {
    std::string name;
    Type type = Type::float32;
    const float* values = nullptr; ///< of the first vertex
    std::size_t stride = 1;        ///< floats from one vertex to the next
    double origin = 0;             ///< added to each value
    float scale = 1;               ///< multiplied to each value, for colours in bytes
};

/// Whether bytes hold the colours exactly.
bool are_bytes(const std::vector<Vec4f>& colors) {
    for (const Vec4f& color : colors)
        for (const float x : color)
            if (!(x >= 0 && x <= 1) || std::round(x * 255.0f) / 255.0f != x) return false;
    return true;
}

template <class Vector>
void add_columns(std::vector<OutputColumn>& columns, std::initializer_list<const char*> names,
                 const std::vector<Vector>& values, Type type = Type::float32, float scale = 1) {
    if (values.empty()) return;
    std::size_t i = 0;
    for (const char* name : names)
        columns.push_back({name, type, values.front().data() + i++, Vector::SizeAtCompileTime, 0, scale});
}

/// One word, as a property's name must be.
std::string property_name(std::string name) {
    for (char& c : name)
        if (static_cast<unsigned char>(c) <= ' ' || c == '#' || c == '\x7f') c = '_';
    return name.empty() ? "scalar" : name;
}

class PlyWriter {
public:
    PlyWriter(const Mesh& mesh, const WriteMeshOptions& options, std::string& bytes)
        : mesh_(mesh), options_(options), bytes_(bytes), uvs_(values_per_vertex(mesh.uvs, mesh)),
          normals_(values_per_vertex(mesh.normals, mesh)) {
        collect_columns();
        const auto largest = [&] {
            std::size_t size = 0;
            for (std::size_t f = 0; f < mesh.face_count(); ++f) size = std::max<std::size_t>(size, mesh.face_size(f));
            return size;
        };
        // lists of UVs have two numbers a corner
        long_faces_ = largest() * (uvs_ ? 1 : 2) > std::numeric_limits<std::uint8_t>::max();
    }

    std::vector<std::string> write() {
        write_header();
        if (options_.ascii)
            write_ascii();
        else if (options_.big_endian)
            write_binary<true>();
        else
            write_binary<false>();
        std::vector<std::string> lost;
        if (!normals_) lost.emplace_back("normals that differ at a vertex");
        lost.insert(lost.end(), renamed_.begin(), renamed_.end());
        if (!mesh_.objects.empty()) lost.emplace_back("objects");
        add_face_label_losses(mesh_, lost);
        return lost;
    }

private:
    void collect_columns() {
        add_columns(columns_, {"x", "y", "z"}, mesh_.positions);
        for (std::size_t axis = 0; axis < columns_.size(); ++axis) {
            columns_[axis].origin = mesh_.origin[static_cast<int>(axis)];
            if (!mesh_.origin.isZero(0)) columns_[axis].type = Type::float64;
        }
        if (columns_.empty()) // no vertices, but the header names the coordinates all the same
            for (const char* name : {"x", "y", "z"}) columns_.push_back({name});
        if (normals_) add_columns(columns_, {"nx", "ny", "nz"}, *normals_);
        if (uvs_) add_columns(columns_, {"s", "t"}, *uvs_);
        const bool bytes = are_bytes(mesh_.colors);
        const Type color_type = bytes ? Type::uint8 : Type::float32;
        const float scale = bytes ? 255.0f : 1.0f;
        if (mesh_.colors_have_alpha)
            add_columns(columns_, {"red", "green", "blue", "alpha"}, mesh_.colors, color_type, scale);
        else
            add_columns(columns_, {"red", "green", "blue"}, mesh_.colors, color_type, scale);
        const std::size_t first_scalar = columns_.size();
        for (const VertexScalar& scalar : mesh_.scalars) {
            std::string name = unique_name(property_name(scalar.name));
            if (name != scalar.name)
                renamed_.push_back("the name " + in_quotes(scalar.name) + " of a scalar (now " + in_quotes(name) + ")");
            columns_.push_back({std::move(name), Type::float32, scalar.values.data()});
        }
        while (rename_color(first_scalar)) {
        }
    }

    /// Scalars that a reader would take for a colour or its opacity get a number. Returns whether there were some.
    bool rename_color(std::size_t first_scalar) {
        std::vector<std::string> names;
        for (const OutputColumn& column : columns_) names.push_back(column.name);
        bool renamed = false;
        for (const std::size_t i : find_color(names)) {
            if (i < first_scalar) continue;
            columns_[i].name = unique_name(names[i]);
            renamed_.push_back("the name " + in_quotes(names[i]) + " of a scalar (now " + in_quotes(columns_[i].name) +
                               ", as it would be read as a colour)");
            renamed = true;
        }
        return renamed;
    }

    /// The name, or with a number behind it where a column has it already.
    std::string unique_name(const std::string& name) const {
        const auto taken = [&](const std::string& candidate) {
            return std::any_of(columns_.begin(), columns_.end(), [&](const auto& c) { return c.name == candidate; });
        };
        std::string unique = name;
        for (int i = 2; taken(unique); ++i) unique = name + "_" + std::to_string(i);
        return unique;
    }

    void write_header() {
        TextWriter out(bytes_);
        out.text("ply\nformat ");
        out.text(options_.ascii        ? "ascii"
                 : options_.big_endian ? "binary_big_endian"
                                       : "binary_little_endian")
            .text(" 1.0\n");
        out.text("element vertex ").number(mesh_.vertex_count()).text("\n");
        for (const OutputColumn& column : columns_) {
            out.text(column.type == Type::float64 ? "property double "
                     : column.type == Type::uint8 ? "property uchar "
                                                  : "property float ");
            out.text(column.name).text("\n");
        }
        const char* const length = long_faces_ ? "uint" : "uchar";
        out.text("element face ")
            .number(mesh_.face_count())
            .text("\nproperty list ")
            .text(length)
            .text(mesh_.vertex_count() > kMaxInt ? " uint" : " int")
            .text(" vertex_indices\n");
        if (!uvs_) out.text("property list ").text(length).text(" float texcoord\n");
        out.text("end_header\n");
    }

    static std::uint8_t to_byte(const OutputColumn& column, float value) {
        return static_cast<std::uint8_t>(std::round(value * column.scale));
    }

    /// Whether every corner of the face has a UV.
    bool has_uvs(std::size_t face) const {
        for (std::size_t c = mesh_.face_offsets[face]; c < mesh_.face_offsets[face + 1]; ++c)
            if (mesh_.uvs.corners[c] == kNoIndex) return false;
        return true;
    }

    void write_ascii() {
        TextWriter out(bytes_);
        for (std::size_t v = 0; v < mesh_.vertex_count(); ++v) {
            for (const OutputColumn& column : columns_) {
                if (&column != columns_.data()) out.text(" ");
                const float value = column.values[v * column.stride];
                if (column.type == Type::uint8)
                    out.number(unsigned{to_byte(column, value)});
                else
                    out.coordinate(column.origin, value);
            }
            out.text("\n");
        }
        for (std::size_t f = 0; f < mesh_.face_count(); ++f) {
            out.number(mesh_.face_size(f));
            for (const Index vertex : mesh_.face(f)) out.text(" ").number(vertex);
            if (!uvs_) write_ascii_uvs(out, f);
            out.text("\n");
        }
    }

    void write_ascii_uvs(TextWriter& out, std::size_t face) {
        out.text(" ").number(has_uvs(face) ? 2 * mesh_.face_size(face) : 0);
        if (!has_uvs(face)) return;
        for (std::size_t c = mesh_.face_offsets[face]; c < mesh_.face_offsets[face + 1]; ++c)
            for (const float x : mesh_.uvs.values[mesh_.uvs.corners[c]]) out.text(" ").number(x);
    }

    template <bool Swap, class T>
    static void store(char* p, T value) {
        auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
        if constexpr (Swap) std::reverse(bytes.begin(), bytes.end());
        std::memcpy(p, bytes.data(), sizeof(T));
    }

    template <bool Swap>
    void write_binary() {
        std::size_t row_bytes = 0;
        for (const OutputColumn& column : columns_) row_bytes += size_of(column.type);
        const std::size_t header_bytes = bytes_.size(), length_bytes = long_faces_ ? 4 : 1;
        const std::size_t uv_bytes = uvs_ ? 0 : mesh_.face_count() * length_bytes + 8 * mesh_.corner_count();
        bytes_.resize(header_bytes + mesh_.vertex_count() * row_bytes + mesh_.face_count() * length_bytes +
                      4 * mesh_.corner_count() + uv_bytes);
        char* const vertices = bytes_.data() + header_bytes;
        std::size_t offset = 0;
        for (const OutputColumn& column : columns_) {
            write_column<Swap>(column, vertices + offset, row_bytes);
            offset += size_of(column.type);
        }
        char* const end = write_faces<Swap>(vertices + mesh_.vertex_count() * row_bytes);
        bytes_.resize(static_cast<std::size_t>(end - bytes_.data())); // faces without UVs need less
    }

    template <bool Swap>
    void write_column(const OutputColumn& column, char* p, std::size_t row_bytes) const {
        for (std::size_t v = 0; v < mesh_.vertex_count(); ++v, p += row_bytes) {
            const float value = column.values[v * column.stride];
            if (column.type == Type::float32)
                store<Swap>(p, value);
            else if (column.type == Type::float64)
                store<Swap>(p, column.origin + static_cast<double>(value));
            else
                store<Swap>(p, to_byte(column, value));
        }
    }

    template <bool Swap>
    char* write_faces(char* p) const {
        const auto store_length = [&](std::size_t length) {
            if (long_faces_)
                store<Swap>(p, static_cast<std::uint32_t>(length)), p += 4;
            else
                store<Swap>(p, static_cast<std::uint8_t>(length)), p += 1;
        };
        for (std::size_t f = 0; f < mesh_.face_count(); ++f) {
            store_length(mesh_.face_size(f));
            for (const Index vertex : mesh_.face(f)) store<Swap>(p, vertex), p += 4;
            if (uvs_) continue;
            store_length(has_uvs(f) ? 2 * mesh_.face_size(f) : 0);
            if (!has_uvs(f)) continue;
            for (std::size_t c = mesh_.face_offsets[f]; c < mesh_.face_offsets[f + 1]; ++c)
                for (const float x : mesh_.uvs.values[mesh_.uvs.corners[c]]) store<Swap>(p, x), p += 4;
        }
        return p;
    }

    const Mesh& mesh_;
    const WriteMeshOptions& options_;
    std::string& bytes_;
    std::optional<std::vector<Vec2f>> uvs_; // a vertex; none: a list for each face
    std::optional<std::vector<Vec3f>> normals_;
    std::vector<OutputColumn> columns_;
    bool long_faces_ = false;
    std::vector<std::string> renamed_; // for the warning
};

} // namespace

Result<WriteNotes> write_ply(const Mesh& mesh, const WriteMeshOptions& options, std::string& bytes, const RunContext&) {
    return WriteNotes{PlyWriter(mesh, options, bytes).write(), {}};
}

} // namespace filigree
