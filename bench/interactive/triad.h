// The rival of everything that streams: a = b + 3 c over arrays far larger than the caches.
#pragma once

#include "filigree/core/parallel_for.h"

#include <vector>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace filigree {

class Triad {
public:
    /// One pass. streams: store past the caches; else each line is read before it is written.
    void run(const RunContext& context, bool streams) {
        parallel_for(context, kFloats, kGrain, [&](std::size_t begin, std::size_t end) {
#if defined(__SSE2__)
            if (streams) {
                for (std::size_t i = begin; i < end; i += 4)
                    _mm_stream_ps(&a_[i],
                                  _mm_add_ps(_mm_loadu_ps(&b_[i]), _mm_mul_ps(_mm_set1_ps(3), _mm_loadu_ps(&c_[i]))));
                _mm_sfence();
                return;
            }
#endif
            for (std::size_t i = begin; i < end; ++i) a_[i] = b_[i] + 3 * c_[i];
        });
    }
    /// Moved in a pass: two reads and a write, and for plain stores the read before the write.
    static constexpr std::size_t bytes(bool streams) { return (streams ? 12 : 16) * kFloats; }

private:
    static constexpr std::size_t kFloats = std::size_t{16} << 20; // three arrays of 64 MiB
    static constexpr std::size_t kGrain = std::size_t{1} << 16;   // a multiple of four: pieces start aligned
    std::vector<float> a_ = std::vector<float>(kFloats, 1), b_ = a_, c_ = a_;
};

} // namespace filigree
