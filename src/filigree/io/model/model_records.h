// The blend code's records as model files hold them: in chunks of vertices, so that each can be restored alone.
#pragma once

#include "filigree/blend/blend_code.h"
#include "filigree/io/model/model_sections.h"

namespace filigree {

/// Vertices of a chunk, and of a block in it. A chunk's records come block by block, and in a block by cell.
inline constexpr std::size_t kChunkVertices = std::size_t{1} << 18, kBlockVertices = std::size_t{1} << 15;

inline std::size_t chunk_count(std::size_t vertices) { return (vertices + kChunkVertices - 1) / kChunkVertices; }

/// Records of one cell, end to end.
struct FileRun {
    Index cell, count;
};

/// Smallest and largest coordinates of a chunk's vertices at rest.
struct FileBox {
    std::array<float, 3> min, max;
};

/// Writes every chunk's box and records. Cost O(vertices); memory: the records once more.
void write_chunk_records(SectionWriter& out, const BlendDetail& detail, std::span<const Vec3f> positions);

/// The records of the chunks first to last - 1 as a detail of their vertices alone: the first of them is vertex `base`
/// there. Cells are detail's already. Throws FileDamage where they do not fit together.
/// vertices: of the whole model.
void read_chunk_records(const SectionReader& in, std::size_t first, std::size_t last, std::size_t vertices, Index base,
                        BlendDetail& detail);

} // namespace filigree
