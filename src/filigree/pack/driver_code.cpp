#include "filigree/pack/driver_code.h"

#include "filigree/pack/face_code.h"

#include <bit>

namespace filigree {

namespace {

/// Bits that name one of `count`.
unsigned bits_to_name(std::size_t count) { return count > 1 ? unsigned(std::bit_width(count - 1)) : 0; }

} // namespace

std::string encode_driver(std::span<const Index> face_offsets, std::span<const Index> corners,
                          std::span<const Index> vertices, std::size_t mesh_vertices) {
    SymbolWriter out(kFaceContexts);
    const EncodedFaces faces = encode_faces(face_offsets, corners, vertices.size(), out);
    for (const Index i : faces.vertex) out.bits(i, bits_to_name(vertices.size()));
    for (const Index v : vertices) out.bits(v, bits_to_name(mesh_vertices));
    return out.finish();
}

std::optional<DriverFaces> decode_driver(std::string_view stream, const DriverCounts& counts) {
    SymbolReader in(stream, kFaceContexts);
    std::optional<WalkedFaces> faces = decode_faces(in, counts.vertices, counts.corners);
    if (!faces || faces->face_offsets.size() != counts.faces + 1) return std::nullopt;
    DriverFaces driver;
    std::vector<Index> vertex_of(counts.vertices); // of each number
    for (Index& i : vertex_of) {
        i = in.bits(bits_to_name(counts.vertices));
        if (i >= counts.vertices || in.is_damaged()) return std::nullopt;
    }
    driver.face_offsets = std::move(faces->face_offsets);
    for (const Index c : faces->corners) driver.corners.push_back(vertex_of[c]);
    std::vector<bool> is_used(counts.mesh_vertices);
    for (std::size_t i = 0; i < counts.vertices; ++i) {
        const Index v = in.bits(bits_to_name(counts.mesh_vertices));
        if (v >= counts.mesh_vertices || is_used[v] || in.is_damaged()) return std::nullopt;
        is_used[v] = true;
        driver.vertices.push_back(v);
    }
    return driver;
}

} // namespace filigree
