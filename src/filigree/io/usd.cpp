#include "filigree/io/usd.h"

namespace filigree {

Result<std::vector<std::string>> write_usda(const MeshAnimation&, const std::filesystem::path& path,
                                            const RunContext&) {
    return Error{ErrorCode::unsupported, path.string() + ": USD is not written yet."};
}

} // namespace filigree
