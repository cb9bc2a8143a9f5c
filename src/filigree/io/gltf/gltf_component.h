// glTF's numbers for the types of what lies in an accessor.
#pragma once

namespace filigree {

enum class GltfComponent { int8 = 5120, uint8 = 5121, int16 = 5122, uint16 = 5123, uint32 = 5125, float32 = 5126 };

} // namespace filigree
