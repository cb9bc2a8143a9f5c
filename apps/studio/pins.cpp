#include "pins.h"

#include <algorithm>

namespace filigree::studio {

bool has_pins(std::span<const Handle> handles) { return std::ranges::any_of(handles, &Handle::pinned); }

std::vector<Index> pinned_vertices(std::span<const Handle> handles) {
    std::vector<Index> result;
    for (const Handle& handle : handles)
        if (handle.pinned) result.insert(result.end(), handle.vertices.begin(), handle.vertices.end());
    std::sort(result.begin(), result.end());
    return result;
}

std::size_t pin(std::vector<Handle>& handles, std::span<const Index> vertices, std::span<const Vec3f> driver) {
    VertexSet pinned(driver.size(), pinned_vertices(handles));
    Handle pins{.pinned = true};
    for (const Index v : vertices)
        if (pinned.add(v)) pins.vertices.push_back(v);
    std::sort(pins.vertices.begin(), pins.vertices.end());
    for (const Index v : pins.vertices) pins.targets.push_back(driver[v]);
    const std::size_t count = pins.vertices.size();
    if (count > 0) handles.push_back(std::move(pins));
    return count;
}

std::size_t unpin(std::vector<Handle>& handles, std::span<const Index> vertices, std::size_t driver_size) {
    const VertexSet freed(driver_size, vertices);
    std::size_t count = 0;
    for (Handle& handle : handles) {
        if (!handle.pinned) continue;
        Handle left;
        for (std::size_t i = 0; i < handle.vertices.size(); ++i) {
            if (freed.contains(handle.vertices[i])) {
                ++count;
                continue;
            }
            left.vertices.push_back(handle.vertices[i]);
            left.targets.push_back(handle.targets[i]);
        }
        handle.vertices = std::move(left.vertices);
        handle.targets = std::move(left.targets);
    }
    std::erase_if(handles, [](const Handle& handle) { return handle.pinned && handle.vertices.empty(); });
    return count;
}

} // namespace filigree::studio
