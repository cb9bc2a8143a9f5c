#include "filigree/io/point_cache_formats.h"

namespace filigree {

Result<PoseStream> open_gltf_poses(const std::filesystem::path& path, std::size_t, const Vec3d&, const PoseFileOptions&,
                                   const RunContext&) {
    return Error{ErrorCode::unsupported, path.string() + ": poses from glTF are not read yet."};
}

} // namespace filigree
