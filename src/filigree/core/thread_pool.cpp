// One pool a process: helpers wait for loops that callers open, and take pieces from them by a counter. A caller works
// on its own loop until no piece is left and then waits for the helpers inside, so a loop inside a loop cannot
// deadlock.
#include "filigree/core/thread_pool.h"

#if defined(__wasi__) // one thread

namespace filigree {

unsigned processors() { return 1; }
void run_on_pool(std::size_t pieces, unsigned, std::atomic<unsigned>&, const LoopBody& body) { body(0, pieces); }

} // namespace filigree

#else

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <new>
#include <thread>

#if defined(__linux__)
#include <sched.h>
#endif
#if defined(__unix__) || defined(__APPLE__)
#include <pthread.h>
#endif

namespace filigree {

namespace {

constexpr std::size_t kShares = 32; // of a thread: how even the load can be
constexpr int kLooks = 2000;        // that an idle helper takes at the counter before it sleeps: some 50 microseconds

void wait_a_moment() {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
}

class Loop {
public:
    Loop(std::size_t pieces, unsigned most_helpers, std::atomic<unsigned>& helpers, const LoopBody& body)
        : pieces_(pieces), at_once_(std::max<std::size_t>(1, pieces / (kShares * (most_helpers + 1)))),
          most_helpers_(most_helpers), helpers_(helpers), body_(body) {}

    void work() {
        for (;;) {
            const std::size_t piece = next_.fetch_add(at_once_);
            if (piece >= pieces_) return;
            try {
                body_(piece, std::min(piece + at_once_, pieces_));
            } catch (...) {
                next_ = pieces_;
                const std::scoped_lock lock(error_mutex_);
                if (!error_) error_ = std::current_exception();
            }
        }
    }

    bool has_pieces() const { return next_.load(std::memory_order_relaxed) < pieces_; }
    /// Whether one more helper may come in; it is counted. Under the pool's lock.
    bool admit() {
        if (!has_pieces()) return false;
        unsigned present = helpers_.load(std::memory_order_relaxed);
        while (present < most_helpers_)
            if (helpers_.compare_exchange_weak(present, present + 1)) {
                ++inside_;
                return true;
            }
        return false;
    }
    /// The last thing that a helper does with it: the caller may then destroy it.
    void leave() {
        helpers_.fetch_sub(1);
        inside_.fetch_sub(1, std::memory_order_release);
    }
    void wait_for_helpers() const {
        for (int look = 0; inside_.load(std::memory_order_acquire) != 0; ++look)
            if (look < kLooks)
                wait_a_moment();
            else
                std::this_thread::yield();
    }
    void rethrow() const {
        if (error_) std::rethrow_exception(error_);
    }

    Loop* after = nullptr; ///< the next one in the pool's list

private:
    std::size_t pieces_, at_once_; ///< at_once_: taken together, so that many small pieces cost little
    unsigned most_helpers_;
    std::atomic<unsigned>& helpers_;
    const LoopBody& body_;
    std::atomic<std::size_t> next_ = 0;
    std::atomic<unsigned> inside_ = 0;
    std::mutex error_mutex_;
    std::exception_ptr error_;
};

class Pool {
public:
    /// Never destroyed, as helpers outlive static objects. Made without memory: a loop then runs on its caller alone. A
    /// child of fork() has no helpers, and begins anew.
    static Pool& instance() {
        alignas(Pool) static std::byte room[sizeof(Pool)];
        [[maybe_unused]] static const bool made = [] {
#if defined(__unix__) || defined(__APPLE__)
            ::pthread_atfork(nullptr, nullptr, [] { new (room) Pool; });
#endif
            new (room) Pool;
            return true;
        }();
        return *std::launder(reinterpret_cast<Pool*>(room));
    }

    void open(Loop& loop, unsigned helpers) {
        {
            const std::scoped_lock lock(mutex_);
            loop.after = first_;
            first_ = &loop;
            start(helpers);
            opened_.fetch_add(1);
        }
        if (sleeping_.load() != 0) wake_.notify_all();
    }
    /// Afterwards no helper is inside or will come.
    void close(Loop& loop) {
        {
            const std::scoped_lock lock(mutex_);
            Loop** link = &first_;
            while (*link != &loop) link = &(*link)->after;
            *link = loop.after;
        }
        loop.wait_for_helpers();
    }

private:
    /// Until there are so many. Where the system gives no more threads, there are fewer.
    void start(unsigned helpers) {
        try {
            for (; started_ < helpers; ++started_) std::thread([this] { help(); }).detach();
        } catch (const std::exception&) {
            started_ = helpers;
        }
    }

    void help() {
        for (;;) {
            const unsigned seen = opened_.load();
            if (Loop* const loop = enter()) {
                loop->work();
                loop->leave();
            } else {
                wait_for_more_than(seen);
            }
        }
    }
    Loop* enter() {
        const std::scoped_lock lock(mutex_);
        for (Loop* loop = first_; loop; loop = loop->after)
            if (loop->admit()) return loop;
        return nullptr;
    }
    void wait_for_more_than(unsigned seen) {
        for (int look = 0; look < kLooks; ++look) {
            if (opened_.load(std::memory_order_relaxed) != seen) return;
            wait_a_moment();
        }
        std::unique_lock lock(mutex_);
        sleeping_.fetch_add(1);
        wake_.wait(lock, [&] { return opened_.load() != seen; });
        sleeping_.fetch_sub(1);
    }

    std::mutex mutex_;
    std::condition_variable wake_;
    Loop* first_ = nullptr; ///< the loop that was opened last
    unsigned started_ = 0;
    std::atomic<unsigned> opened_ = 0, sleeping_ = 0;
};

} // namespace

unsigned processors() {
#if defined(__linux__)
    cpu_set_t allowed;
    if (::sched_getaffinity(0, sizeof allowed, &allowed) == 0) return static_cast<unsigned>(CPU_COUNT(&allowed));
#endif
    return std::max(1u, std::thread::hardware_concurrency());
}

void run_on_pool(std::size_t pieces, unsigned threads, std::atomic<unsigned>& helpers, const LoopBody& body) {
    Loop loop(pieces, threads - 1, helpers, body);
    Pool& pool = Pool::instance();
    pool.open(loop, threads - 1);
    loop.work();
    pool.close(loop);
    loop.rethrow();
}

} // namespace filigree

#endif
