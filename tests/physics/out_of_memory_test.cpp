// A frame that memory does not suffice for leaves the state of the frame's start.
#include "physics/simulation_scenes.h"

#include <cstdlib>
#include <new>

namespace {

/// How many more times this thread may ask for memory; below 0: as often as it likes.
thread_local long allowed = -1;

void* take(std::size_t bytes, std::size_t alignment) {
    if (allowed == 0) {
        allowed = -1;
        throw std::bad_alloc();
    }
    if (allowed > 0) --allowed;
    void* const memory = alignment > alignof(std::max_align_t)
                             ? std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment)
                             : std::malloc(bytes > 0 ? bytes : 1);
    if (!memory) throw std::bad_alloc();
    return memory;
}

} // namespace

void* operator new(std::size_t bytes) { return take(bytes, 0); }
void* operator new[](std::size_t bytes) { return take(bytes, 0); }
void* operator new(std::size_t bytes, std::align_val_t alignment) { return take(bytes, std::size_t(alignment)); }
void* operator new[](std::size_t bytes, std::align_val_t alignment) { return take(bytes, std::size_t(alignment)); }
// As std::stable_sort asks for its room: without it, the sanitizer sees its own new beside our delete.
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return std::malloc(bytes > 0 ? bytes : 1); }
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept { return std::malloc(bytes > 0 ? bytes : 1); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace filigree {
namespace {

using namespace simulation_scenes;

TEST(OutOfMemory, AFrameIsWholeOrUndone) {
    const auto soft = box(3, 3, 3, 0.1, material(MaterialModel::fem));
    const auto wax = box(3, 3, 3, 0.1, material(MaterialModel::mpm));
    Simulation one = simulation(with_ground(), {actor(soft, {0, 0.02, 0}), actor(wax, {1, 0.02, 0})},
                                {.mode = StepMode::explicit_steps});
    run(one, 3);
    const std::string before = one.save();
    std::size_t failed = 0;
    bool was_made = false;
    for (long count = 0; !was_made; count += 1 + count / 16) {
        allowed = count;
        try {
            was_made = one.advance(RunContext(1)).ok();
        } catch (const std::bad_alloc&) {
            ++failed;
        }
        allowed = -1;
        ASSERT_TRUE(was_made || one.save() == before) << count;
    }
    EXPECT_GT(failed, 20U);
}

} // namespace
} // namespace filigree
