// The readers and writers of the mesh formats. The table of formats is in mesh_file.cpp: a format is a row there.
#pragma once

#include "filigree/file.h"
#include "filigree/io/mesh/losses.h"
#include "filigree/io/system/text_scanner.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace filigree {

/// A file in memory. `name` stands in messages.
struct MeshSource {
    std::string_view bytes;
    std::string name;
    const RunContext& context;

    /// "cow.obj:214: <cause>" and "cow.ply: <cause>". `cause` is the sentence without its capital.
    Error error_at_line(std::size_t line, const std::string& cause) const {
        return {ErrorCode::bad_file, name + ":" + std::to_string(line) + ": " + cause};
    }
    Error error(const std::string& cause) const { return {ErrorCode::bad_file, name + ": " + cause}; }
    Error unsupported(const std::string& cause) const { return {ErrorCode::unsupported, name + ": " + cause}; }

    /// For progress: how far `offset` is.
    double fraction(std::size_t offset) const {
        return static_cast<double>(offset) / static_cast<double>(bytes.size());
    }
};

/// Readers of rows look at cancel and report progress every so many.
inline constexpr std::size_t kRowsBetweenReports = 1 << 16;

/// A reader leaves two things to read_mesh: attributes that are not finite, and meshes without vertices or faces. The
/// positions that it returns are finite, and every index is in range.
Result<MeshFile> read_obj(const MeshSource& source);
Result<MeshFile> read_ply(const MeshSource& source);
Result<MeshFile> read_stl(const MeshSource& source);
Result<MeshFile> read_off(const MeshSource& source);
Result<MeshFile> read_gltf(const MeshSource& source);

/// What a writer tells of the mesh that it wrote.
struct WriteNotes {
    std::vector<std::string> lost;     ///< what the format cannot hold, a noun each ("materials")
    std::vector<std::string> warnings; ///< further sentences (textures that are missing)
};

/// A writer appends to `bytes`.
Result<WriteNotes> write_obj(const Mesh& mesh, const WriteMeshOptions& options, std::string& bytes,
                             const RunContext& context);
Result<WriteNotes> write_ply(const Mesh& mesh, const WriteMeshOptions& options, std::string& bytes,
                             const RunContext& context);
/// Errors: cancelled.
Result<WriteNotes> write_stl(const Mesh& mesh, const WriteMeshOptions& options, std::string& bytes,
                             const RunContext& context);
Result<WriteNotes> write_off(const Mesh& mesh, const WriteMeshOptions& options, std::string& bytes,
                             const RunContext& context);
/// In glb_writer.cpp. Errors: unsupported (4 GiB or more), cancelled.
Result<WriteNotes> write_glb(const Mesh& mesh, const WriteMeshOptions& options, std::string& bytes,
                             const RunContext& context);

/// An OBJ that names a material library beside it. library: the name of the .mtl file; empty: embedded materials are
/// lost. Returns what is lost.
std::vector<std::string> write_obj(const Mesh& mesh, std::string_view library, std::string& bytes);

/// Whether the first line is "ply".
bool is_ply(std::string_view bytes);
/// Whether the content says so. Text: "solid", and a facet or the end near the start. Binary: the size is exactly what
/// the facet count in the header asks for.
bool is_stl(std::string_view bytes);
/// Whether the first word is one of OFF's ("OFF", "COFF", "STCNOFF" ...).
bool is_off(std::string_view bytes);
/// Whether the first statement is one of OBJ's; false for a file of comments.
bool is_obj(std::string_view bytes);

/// Whether x fits float: finite, and not too large for it.
inline bool fits_float(double x) { return std::abs(x) <= std::numeric_limits<float>::max(); }

/// Sets vectors that are not finite to zero, and returns how many there were.
template <class Vector>
std::size_t zero_not_finite(std::vector<Vector>& values) {
    std::size_t count = 0;
    for (Vector& value : values) {
        if (value.allFinite()) continue;
        value.setZero();
        ++count;
    }
    return count;
}
inline std::size_t zero_not_finite(std::vector<float>& values) {
    const auto is_bad = [](float x) { return !fits_float(static_cast<double>(x)); };
    const auto count = std::count_if(values.begin(), values.end(), is_bad);
    if (count > 0) std::replace_if(values.begin(), values.end(), is_bad, 0.0f);
    return static_cast<std::size_t>(count);
}

/// Attributes seen from a format that has one value a vertex: those values, or none when corners of one vertex differ
/// or have none.
template <class T>
std::optional<std::vector<T>> values_per_vertex(const CornerAttribute<T>& attribute, const Mesh& mesh) {
    if (attribute.per_vertex()) return attribute.values;
    constexpr Index kUnseen = kNoIndex;
    std::vector<Index> value_of(mesh.vertex_count(), kUnseen);
    for (std::size_t c = 0; c < mesh.corner_count(); ++c) {
        Index& value = value_of[mesh.corners[c]];
        const Index here = attribute.corners[c];
        if (here == kNoIndex) return {};
        if (value == kUnseen) value = here;
        if (attribute.values[value] != attribute.values[here]) return {};
    }
    std::vector<T> values(mesh.vertex_count(), T::Zero()); // stays zero for vertices in no face
    for (std::size_t v = 0; v < values.size(); ++v)
        if (value_of[v] != kUnseen) values[v] = attribute.values[value_of[v]];
    return values;
}

} // namespace filigree
