// Vertices of the driver that the user holds in their places.
#pragma once

#include "document.h"

namespace filigree::studio {

/// Some of the vertices 0 .. size - 1, each once.
class VertexSet {
public:
    explicit VertexSet(std::size_t size, std::span<const Index> vertices = {}) : is_in_(size) {
        for (const Index v : vertices) add(v);
    }
    /// False: it is in already, or no vertex. Cost O(1).
    bool add(Index vertex) {
        if (vertex >= is_in_.size() || std::exchange(is_in_[vertex], 1)) return false;
        members_.push_back(vertex);
        return true;
    }
    bool contains(Index vertex) const { return vertex < is_in_.size() && is_in_[vertex]; }
    const std::vector<Index>& members() const { return members_; } ///< in the order in which they came

private:
    std::vector<char> is_in_;
    std::vector<Index> members_;
};

bool has_pins(std::span<const Handle> handles);
/// Cost O(pins log pins). Ascending.
std::vector<Index> pinned_vertices(std::span<const Handle> handles);

/// Pins those vertices of a driver that are not pinned yet, where they are. Returns how many these were. Cost
/// O(driver).
std::size_t pin(std::vector<Handle>& handles, std::span<const Index> vertices, std::span<const Vec3f> driver);
/// Takes out the pins of those vertices. Returns how many there were. Cost O(pins + vertices).
std::size_t unpin(std::vector<Handle>& handles, std::span<const Index> vertices, std::size_t driver_size);

} // namespace filigree::studio
