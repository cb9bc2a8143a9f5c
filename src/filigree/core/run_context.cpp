#include "filigree/context.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <new>
#include <vector>

#include <oneapi/tbb/info.h>
#include <oneapi/tbb/task_arena.h>

namespace filigree {

namespace {

/// More workers than processors only wait for each other (and oneTBB would print that they do).
unsigned clamp_threads(unsigned wanted) {
    const unsigned processors = static_cast<unsigned>(tbb::info::default_concurrency()); // those we may run on
    return wanted == 0 ? processors : std::min(wanted, processors);
}

/// Arenas of contexts that are gone, for those to come: where processors are busy, oneTBB never gives back what an
/// arena took whose workers came too late (9 KB each).
class FreeArenas {
public:
    static FreeArenas& instance() {
        static FreeArenas* const kept = new FreeArenas; // outlives contexts of any lifetime
        return *kept;
    }
    std::unique_ptr<tbb::task_arena> take(unsigned threads) {
        const std::scoped_lock lock(mutex_);
        std::vector<std::unique_ptr<tbb::task_arena>>& free = free_[threads];
        if (free.empty()) return std::make_unique<tbb::task_arena>(static_cast<int>(threads));
        std::unique_ptr<tbb::task_arena> arena = std::move(free.back());
        free.pop_back();
        return arena;
    }
    /// Never fails: an arena that there is no memory to keep is given up.
    void give_back(unsigned threads, std::unique_ptr<tbb::task_arena> arena) noexcept {
        const std::scoped_lock lock(mutex_);
        try {
            free_[threads].push_back(std::move(arena));
        } catch (const std::bad_alloc&) { // a vector that cannot grow leaves its new item where it was
            arena.reset();
        }
    }

private:
    std::mutex mutex_;
    std::map<unsigned, std::vector<std::unique_ptr<tbb::task_arena>>> free_; ///< by threads
};

} // namespace

struct RunContext::Arena {
    explicit Arena(unsigned of_threads) : threads(of_threads), arena(FreeArenas::instance().take(of_threads)) {}
    ~Arena() { FreeArenas::instance().give_back(threads, std::move(arena)); }
    Arena(const Arena&) = delete;
    Arena& operator=(const Arena&) = delete;

    unsigned threads;
    std::unique_ptr<tbb::task_arena> arena;
};

RunContext::RunContext(unsigned threads)
    : threads_(clamp_threads(threads)), arena_(std::make_shared<Arena>(threads_)),
      cancelled_(std::make_shared<std::atomic<bool>>(false)) {}

void RunContext::execute(const std::function<void()>& work) const { arena_->arena->execute(work); }

} // namespace filigree
