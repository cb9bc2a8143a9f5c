// The smallest driver for an error, found in a few tries.
#pragma once

#include <cstddef>

namespace filigree {

/// The next size to try: where a power law through both drivers, or of the usual order through one, meets the goal.
class DriverSearch {
public:
    static constexpr std::size_t kSmallest = 12; ///< no driver has fewer vertices

    /// most: vertices of the largest driver. goal: the error to get below.
    DriverSearch(std::size_t most, double goal) : most_(double(most)), goal_(goal) {}

    std::size_t first() const;
    void add(std::size_t size, double error);
    /// Whether the smallest driver that passed is close to the largest that did not.
    bool is_done() const;
    std::size_t next() const;

private:
    struct Tried {
        double size = 0, error = 0;
    };
    Tried passed_, failed_;
    double most_, goal_;
};

} // namespace filigree
