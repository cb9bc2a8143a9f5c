#include "filigree/reference/reference_plan.h"

#include "filigree/reference/reference_code.h"
#include <algorithm>
#include <cmath>

namespace filigree {

std::string check_reference(const ReferenceDetail& detail, std::size_t vertex_count) {
    const RegularPatches& patches = detail.patches;
    if (detail.references != 3 && detail.references != 4 && detail.references != 6)
        return "the number of references is not 3, 4 or 6";
    if (patches.levels < 1 || patches.levels > 16 || patches.base.empty()) return "there are no patches";
    const std::size_t points = patches.side() + 1;
    if (patches.grid.size() / points / points != patches.patch_count() || patches.grid.size() % (points * points) != 0)
        return "the patches' grids have a wrong size";
    std::vector<bool> in_patch(vertex_count, false);
    for (Index v : patches.grid) {
        if (v >= vertex_count) return "a patch names a vertex that is not there";
        in_patch[v] = true;
    }
    if (std::find(in_patch.begin(), in_patch.end(), false) != in_patch.end()) return "a vertex is in no patch";
    std::vector<bool> in_driver(vertex_count, false);
    std::size_t driver_count = 0;
    for (std::size_t p = 0; p < patches.patch_count(); ++p) {
        const std::size_t n = patches.side();
        const std::array<Index, 4> corners = {patches.at(p, 0, 0), patches.at(p, n, 0), patches.at(p, n, n),
                                              patches.at(p, 0, n)};
        if (corners != patches.base[p]) return "a patch's corners are not its base quad";
        for (Index v : corners) {
            driver_count += !in_driver[v];
            in_driver[v] = true;
        }
    }
    if (detail.rest_driver.size() != driver_count) return "there is not one rest position a driver vertex";

    const std::size_t edge_count = reference::find_base_edges(patches).halves.size();
    std::size_t records = 0;
    for (std::size_t m = 1; m < points - 1; m *= 2)
        records += edge_count * m + patches.patch_count() * (3 * m * m - 2 * m);
    if (detail.records.size() != records) return "there is not one record a removed vertex";
    for (std::size_t i = 0; i < detail.loose.size(); ++i)
        if (detail.loose[i] >= records || (i > 0 && detail.loose[i] <= detail.loose[i - 1]))
            return "the list of loose records is not ascending";
    const auto finite = [](std::span<const Vec3f> items) {
        for (const Vec3f& item : items)
            if (!item.allFinite()) return false;
        return true;
    };
    if (!std::isfinite(detail.extent) || !finite(detail.rest_driver) || !finite(detail.records))
        return "a number is not finite";
    return "";
}

} // namespace filigree
