// Sums over many elements on all threads.
#pragma once

#include "filigree/core/parallel_for.h"

#include <vector>

namespace filigree {

/// The sum of value(i), a double, for i below count. Same bytes for any number of threads: pieces of `grain` elements
/// are added in order.
template <class Value>
double parallel_sum(const RunContext& context, std::size_t count, std::size_t grain, const Value& value) {
    std::vector<double> pieces((count + grain - 1) / grain);
    parallel_for(context, count, grain, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += value(i);
        pieces[begin / grain] = sum;
    });
    double sum = 0;
    for (const double piece : pieces) sum += piece;
    return sum;
}

} // namespace filigree
