// The readers and writers behind mesh_file.h: a pair for each format, told what the dispatcher knows.
#pragma once

#include "filigree/file.h"
#include "filigree/io/losses.h"
#include "filigree/io/text_scanner.h"

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

/// Readers leave to the dispatcher: attributes that are not finite, and meshes without vertices or faces.
/// Positions are finite and every index is in range.
Result<MeshFile> read_obj(const MeshSource& source);
Result<MeshFile> read_ply(const MeshSource& source);
Result<MeshFile> read_stl(const MeshSource& source);
Result<MeshFile> read_off(const MeshSource& source);
Result<MeshFile> read_gltf(const MeshSource& source);

/// Writers append to `bytes` and return what the format cannot hold, a noun each ("materials").
/// library: the name of the .mtl that holds the embedded materials; empty: they are lost.
std::vector<std::string> write_obj(const Mesh& mesh, std::string_view library, std::string& bytes);
std::vector<std::string> write_ply(const Mesh& mesh, const WriteMeshOptions& options, std::string& bytes);
Result<std::vector<std::string>> write_stl(const Mesh& mesh, const WriteMeshOptions& options, std::string& bytes,
                                           const RunContext& context);
std::vector<std::string> write_off(const Mesh& mesh, std::string& bytes);

/// What is lost, and further sentences (textures that are not there).
struct GlbNotes {
    std::vector<std::string> lost, warnings;
};
/// In glb_writer.cpp. Errors: unsupported (4 GiB or more), cancelled.
Result<GlbNotes> write_glb(const Mesh& mesh, const WriteMeshOptions& options, std::string& bytes,
                           const RunContext& context);

/// Whether the content says so: "solid", and a facet or the end near the start.
bool is_ascii_stl(std::string_view bytes);
/// Whether the size is exactly what the facet count in the header asks for.
bool is_binary_stl(std::string_view bytes);
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
