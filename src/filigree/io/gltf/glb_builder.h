// A GLB being put together: the JSON chunk, and the binary chunk whose large parts are made while they are written.
#pragma once

#include "filigree/context.h"
#include "filigree/io/gltf/glb_compression.h"
#include "filigree/io/gltf/gltf_component.h"
#include "filigree/result.h"
#include "filigree/types.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace filigree {

/// glTF's numbers for what a buffer view is for.
enum class GltfTarget { none = 0, vertices = 34962, indices = 34963 };

struct GltfAccessor {
    GltfComponent component = GltfComponent::float32;
    const char* type = "SCALAR"; ///< or VEC2, VEC3, VEC4, MAT4
    bool normalized = false;
    GltfTarget target = GltfTarget::none;
    std::size_t count = 0;
    /// Empty, or the bounds of each number: POSITION and animation times must have them.
    std::vector<double> min = {}, max = {};
};

/// Collects the parts of one file. Every accessor has a buffer view of its own, padded to four bytes (vertex attributes
/// of less than four bytes an element are the caller's to pad).
class GlbBuilder {
public:
    using Json = nlohmann::ordered_json;
    /// Hands `write` the bytes of a part, piece after piece.
    using Producer = std::function<Status(const std::function<Status(std::string_view)>& write)>;

    /// The document. `asset`, `accessors`, `bufferViews` and `buffers` are the builder's; everything else is the
    /// caller's.
    Json json = Json::object();

    /// An accessor over bytes that are kept until the file is written. Returns its number.
    std::size_t add(const GltfAccessor& accessor, std::string bytes);
    /// The same at the end of the buffer view that was added last, for many small ones (none of them vertices).
    std::size_t append(const GltfAccessor& accessor, std::string_view bytes);
    /// Over bytes that are made while the file is written; the producer must give exactly `byte_count`.
    std::size_t add(const GltfAccessor& accessor, std::size_t byte_count, Producer producer);
    /// A picture's bytes as a buffer view. Returns the view's number.
    std::size_t add_view(std::string bytes);
    /// Bytes for accessors that come later, and what compress packs in their place: the same elements of `stride` bytes
    /// as a filter of EXT_meshopt_compression has them. Returns the view's number.
    std::size_t add_filtered_view(const char* filter, std::size_t stride, std::string bytes, std::string filtered);
    /// An accessor over a part of a view. Returns its number.
    std::size_t add_accessor(const GltfAccessor& accessor, std::size_t view, std::size_t offset);

    // The usual ones.
    std::size_t add_positions(std::span<const Vec3f> positions); ///< with bounds
    std::size_t add_vectors(std::span<const Vec3f> vectors, GltfTarget target = GltfTarget::vertices);
    std::size_t add_indices(std::span<const Index> indices); ///< uint16 where every index is below 65535, else uint32
    std::size_t add_scalars(std::span<const float> values, GltfTarget target, bool with_bounds = false);

    /// Rounds the positions that come to a 2^bits-th of their box's longest side, so that compress packs them well.
    void round_positions(int bits = 17) { position_bits_ = bits; }
    /// Packs everything (glb_compression.h); only `asset` may change afterwards. Errors: as of gather.
    Status compress();

    /// Bytes of the whole file when it is written now.
    std::size_t byte_count() const;
    /// Writes it, through a temporary file and a rename. Errors: unwritable, unsupported (4 GiB or more), cancelled.
    Status write(const std::filesystem::path& path, const RunContext& context);
    /// The same into memory (not for streamed parts of gigabytes).
    Result<std::string> bytes() const;
    /// The same, with the parts given up for it one by one, so that they are in memory once. Only the document may
    /// change afterwards: writing takes the parts from here. The view is valid as long as the builder.
    Result<std::string_view> gather();

private:
    struct Part {
        std::size_t byte_count;
        std::string bytes;
        Producer producer;
    };
    std::vector<Part> parts_;
    std::size_t data_bytes_ = 0;
    int position_bits_ = 0; ///< 0: as they come
    std::vector<FilteredView> filtered_;
    std::string gathered_; ///< the file, and in its last bytes the parts; empty: they are in parts_

    std::size_t add_part(Part part, GltfTarget target);
    using Write = std::function<Status(std::string_view)>;
    std::string json_chunk() const;
    /// What stands before the parts. Errors: unsupported.
    Result<std::string> head() const;
    static Status write_part(const Part& part, const Write& write);
    Status write_to(const Write& write) const;
};

/// The bytes of plain values.
template <class T>
std::string bytes_of(std::span<const T> values) {
    return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

} // namespace filigree
