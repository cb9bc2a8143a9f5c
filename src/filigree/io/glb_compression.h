// A GLB's buffer views packed by EXT_meshopt_compression, and its normals in bytes (KHR_mesh_quantization).
#pragma once

#include "filigree/result.h"

#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace filigree {

/// Packs what `document` describes in `data`, its only buffer: vertices, triangles and keys, each view on its own;
/// pictures stay. Changes the document's views, buffers, accessors of normals and extensions. Returns the new data.
/// Errors: out_of_memory. Cost O(size).
Result<std::string> compress_views(nlohmann::ordered_json& document, std::string_view data);

} // namespace filigree
