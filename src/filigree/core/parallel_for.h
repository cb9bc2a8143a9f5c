// Loops over index ranges on all threads of a RunContext.
#pragma once

#include "filigree/context.h"

#include <cstddef>

namespace filigree {

/// A loop's body, called through one pointer, so that the loop itself is compiled once.
class LoopBody {
public:
    template <class Body>
    explicit LoopBody(const Body& body)
        : body_(&body), call_([](const void* of, std::size_t begin, std::size_t end) {
              (*static_cast<const Body*>(of))(begin, end);
          }) {}
    void operator()(std::size_t begin, std::size_t end) const { call_(body_, begin, end); }

private:
    const void* body_;
    void (*call_)(const void*, std::size_t, std::size_t);
};

void run_pieces(const RunContext& context, std::size_t count, std::size_t grain, const LoopBody& body);

/// Calls body(begin, end) for consecutive pieces of [0, count), each of `grain` indices (the last may be shorter).
/// Pieces run in any order and at the same time, so a body writes only what its own indices own; the pieces
/// themselves do not depend on the number of threads. A loop of one piece runs inline. The first exception of a body
/// stops the loop and is thrown again. Loops inside loops share the context's threads.
template <class Body>
void parallel_for(const RunContext& context, std::size_t count, std::size_t grain, const Body& body) {
    run_pieces(context, count, grain, LoopBody(body));
}

} // namespace filigree
