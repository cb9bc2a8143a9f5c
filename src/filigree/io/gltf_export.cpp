#include "filigree/io/gltf_export.h"

namespace filigree {

Result<ExportReport> write_skin_glb(const Model&, const PoseStream&, const SkinOptions&,
                                    const std::filesystem::path& path, const RunContext&) {
    return Error{ErrorCode::unsupported, path.string() + ": skins are not written yet."};
}

Result<ExportReport> write_morph_glb(const MeshAnimation&, const MorphOptions&, const std::filesystem::path& path,
                                     const RunContext&) {
    return Error{ErrorCode::unsupported, path.string() + ": morph targets are not written yet."};
}

} // namespace filigree
