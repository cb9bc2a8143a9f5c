// Models whose levels arrive one after the other: what `pack --profile stream` writes, read while it comes.
#pragma once

#include "filigree/core/result.h"
#include "filigree/io/model_file.h"

#include <memory>
#include <string>

namespace filigree {

/// Takes the file's bytes in order, as many at a time as there are, and has at any time the best mesh so far.
class ModelStream {
public:
    /// name: stands in messages. most_bytes: a file that says it has more is refused.
    explicit ModelStream(std::string name, std::uint64_t most_bytes = std::uint64_t{1} << 36);
    ~ModelStream();
    ModelStream(ModelStream&&) noexcept;
    ModelStream& operator=(ModelStream&&) noexcept;

    /// Errors: bad_file (damaged), unsuitable (no stream: a plain model, one coded in one piece), out_of_memory.
    /// Cost O(bytes) in all, however few of them come at a time, about
    /// 0.5 processor seconds a million vertices.
    Status feed(std::string_view bytes);

    /// Levels that are whole, the coarsest counted; refinements come behind the last of them, as one more.
    std::size_t level_count() const;
    /// rms distance from the whole mesh's surface, model units; infinity before the coarsest is there.
    double error() const;
    /// Levels as triangles, with texture coordinates, colours and materials where they have any, without normals and
    /// pictures; empty before the coarsest is there. Cost O(size).
    Mesh mesh() const;
    /// Bytes of the file until the next level is whole: what to ask a server for next. The file's size when all levels
    /// are there, 0 before its table is.
    std::uint64_t next_level_end() const;

private:
    class Arrival;
    std::unique_ptr<Arrival> arrival_;
};

} // namespace filigree
