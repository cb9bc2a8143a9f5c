// A GLB's buffer views packed by EXT_meshopt_compression, and its normals in bytes (KHR_mesh_quantization).
#pragma once

#include "filigree/result.h"

#include <span>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace filigree {

/// What is packed in place of a view's bytes: the same elements, as a filter has them.
struct FilteredView {
    std::size_t view;
    const char* filter; ///< EXPONENTIAL or QUATERNION
    std::size_t stride;
    std::string bytes;
};

/// Packs what `document` describes in `data`, its only buffer: vertices, triangles and keys, each view on its own;
/// pictures stay. filtered: views whose elements a viewer filters after unpacking. Changes the document's views,
/// buffers, accessors of normals and extensions. Returns the new data. Errors: out_of_memory. Cost O(size).
Result<std::string> compress_views(nlohmann::ordered_json& document, std::string_view data,
                                   std::span<const FilteredView> filtered);

} // namespace filigree
