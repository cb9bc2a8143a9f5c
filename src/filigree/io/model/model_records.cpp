#include "filigree/io/model/model_records.h"

namespace filigree {

namespace {

static_assert(sizeof(FileRun) == 8);
static_assert(sizeof(FileBox) == 24);

template <class T>
std::vector<T> pick(const std::vector<T>& from, std::span<const Index> records) {
    std::vector<T> picked;
    picked.reserve(records.size());
    for (const Index r : records) picked.push_back(from[r]);
    return picked;
}

/// What a chunk's sections hold, one item a record in the file's order, but for runs and from.
struct ChunkSections {
    std::vector<FileRun> runs;
    std::vector<std::uint16_t> from; ///< of each vertex: which record of its block is its own
    std::vector<float> u, v;
};

ChunkSections read_chunk(const SectionReader& in, std::uint32_t k, std::size_t vertices, const BlendDetail& detail) {
    ChunkSections chunk;
    chunk.runs = in.array<FileRun>("bl.run", k);
    chunk.from = in.array<std::uint16_t>("bl.from", k);
    chunk.u = in.array<float>("bl.u", k);
    chunk.v = in.array<float>("bl.v", k);
    if (chunk.from.size() != vertices || chunk.u.size() != vertices || chunk.v.size() != vertices)
        throw FileDamage{"is inconsistent: there is not one record a vertex"};
    std::size_t records = 0; // so far
    for (const FileRun& run : chunk.runs) {
        const std::size_t block_end = std::min(vertices, (records / kBlockVertices + 1) * kBlockVertices);
        if (run.cell >= detail.cells.size() || run.count == 0 || run.count > block_end - records)
            throw FileDamage{"is inconsistent: a run of records does not fit its block"};
        records += run.count;
    }
    if (records != vertices) throw FileDamage{"is inconsistent: runs do not add up to their chunk"};
    return chunk;
}

/// The vertex of each record, counted from the chunk's first.
std::vector<Index> vertices_of(const ChunkSections& chunk) {
    std::vector<Index> vertices(chunk.from.size(), kNoIndex);
    for (Index v = 0; v < vertices.size(); ++v) {
        const std::size_t record = v / kBlockVertices * kBlockVertices + chunk.from[v];
        if (record >= vertices.size() || vertices[record] != kNoIndex)
            throw FileDamage{"is inconsistent: a block's records are not one a vertex"};
        vertices[record] = v;
    }
    return vertices;
}

} // namespace

void write_chunk_records(SectionWriter& out, const BlendDetail& detail, std::span<const Vec3f> positions) {
    const std::size_t vertices = detail.order.size();
    std::vector<FileBox> boxes;
    for (std::size_t begin = 0; begin < vertices; begin += kChunkVertices) {
        Eigen::AlignedBox3f box;
        for (const Vec3f& p : positions.subspan(begin, std::min(kChunkVertices, vertices - begin))) box.extend(p);
        FileBox& kept = boxes.emplace_back();
        for (int k = 0; k < 3; ++k) {
            kept.min[std::size_t(k)] = box.min()[k];
            kept.max[std::size_t(k)] = box.max()[k];
        }
    }
    out.array("ck.box", std::move(boxes));
    std::vector<Index> cell_of(vertices), records(vertices); // records: by block, then as they are
    std::vector<std::size_t> next(vertices / kBlockVertices + 1, 0);
    for (std::size_t block = 0; block < next.size(); ++block) next[block] = block * kBlockVertices;
    for (Index c = 0; c < detail.cells.size(); ++c)
        for (Index r = detail.cell_offsets[c]; r < detail.cell_offsets[c + 1]; ++r) {
            records[next[detail.order[r] / kBlockVertices]++] = r;
            cell_of[r] = c;
        }
    for (std::uint32_t k = 0; k < chunk_count(vertices); ++k) {
        const std::size_t begin = k * kChunkVertices, count = std::min(kChunkVertices, vertices - begin);
        const std::span chosen = std::span<const Index>(records).subspan(begin, count);
        ChunkSections chunk;
        chunk.from.resize(count);
        for (std::size_t i = 0; i < count; ++i) {
            const Index r = chosen[i];
            chunk.from[detail.order[r] - begin] = static_cast<std::uint16_t>(i % kBlockVertices);
            if (i % kBlockVertices == 0 || chunk.runs.back().cell != cell_of[r]) chunk.runs.push_back({cell_of[r], 0});
            ++chunk.runs.back().count;
        }
        out.array("bl.run", std::move(chunk.runs), k);
        out.array("bl.from", std::move(chunk.from), k);
        out.array("bl.u", pick(detail.u, chosen), k);
        out.array("bl.v", pick(detail.v, chosen), k);
    }
}

void read_chunk_records(const SectionReader& in, std::size_t first, std::size_t last, std::size_t vertices, Index base,
                        BlendDetail& detail) {
    std::vector<ChunkSections> chunks;
    std::vector<Index> next(detail.cells.size() + 1, 0); // of each cell: where its next record goes
    std::size_t count = 0;
    for (std::size_t k = first; k < last; ++k) {
        const std::size_t in_chunk = std::min(kChunkVertices, vertices - k * kChunkVertices);
        chunks.push_back(read_chunk(in, static_cast<std::uint32_t>(k), in_chunk, detail));
        for (const FileRun& run : chunks.back().runs) next[run.cell + 1] += run.count;
        count += in_chunk;
    }
    for (std::size_t c = 0; c < detail.cells.size(); ++c) next[c + 1] += next[c];
    detail.cell_offsets = next;
    detail.order.resize(count);
    detail.u.resize(count);
    detail.v.resize(count);
    for (ChunkSections& chunk : chunks) {
        const std::vector<Index> vertex_of = vertices_of(chunk);
        std::size_t record = 0;
        for (const FileRun& run : chunk.runs)
            for (const std::size_t end = record + run.count; record < end; ++record) {
                const Index to = next[run.cell]++;
                detail.order[to] = base + vertex_of[record];
                detail.u[to] = chunk.u[record];
                detail.v[to] = chunk.v[record];
            }
        base += static_cast<Index>(chunk.from.size());
        chunk = {};
    }
}

} // namespace filigree
