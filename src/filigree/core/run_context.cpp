#include "filigree/core/run_context.h"

#include <algorithm>
#include <thread>

namespace filigree {

RunContext::RunContext(unsigned threads)
    : threads_(threads ? threads : std::max(1u, std::thread::hardware_concurrency())),
      arena_(std::make_shared<tbb::task_arena>(static_cast<int>(threads_))),
      cancelled_(std::make_shared<std::atomic<bool>>(false)) {}

} // namespace filigree
