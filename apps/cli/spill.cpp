#include "spill.h"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <new>
#include <unordered_map>
#include <utility>

#include <fcntl.h>
#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

namespace filigree::cli {

namespace {

constexpr std::size_t kLarge = std::size_t{4} << 20;
constexpr std::size_t kRoom = std::size_t{8} << 40; // addresses and file offsets, none used twice
constexpr std::size_t kPage = 4096;

/// The file and its place in memory: byte k of one is byte k of the other. Made when something is first spilled.
struct Spill {
    std::mutex mutex;
    std::filesystem::path folder;
    bool is_tried = false;
    std::atomic<char*> begin = nullptr; ///< null: there is none
    int file = -1;
    std::size_t end = 0;                                ///< of what was ever given out
    std::unordered_map<std::size_t, std::size_t> sizes; ///< of the arrays in the file, by their offsets
    std::uint64_t now = 0, most = 0;
};

std::atomic<std::int64_t> memory_limit{0}; // 0: nothing is spilled
std::atomic<std::int64_t> large_bytes{0};  // in memory, of arrays of kLarge and more

Spill& spill() {
    static auto* const only = new Spill; // never deleted: arrays may go after it
    return *only;
}

/// A file without a name.
int make_file(const std::filesystem::path& folder) {
    const int file = open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (file >= 0) return file;
    std::string name = (folder / ".filigree-spill-XXXXXX").string(); // a file system that has none without names
    const int named = mkostemp(name.data(), O_CLOEXEC);
    if (named >= 0) unlink(name.c_str());
    return named;
}

/// Whether there is one now; tried once.
bool make_spill(Spill& s) {
    if (std::exchange(s.is_tried, true)) return s.begin;
    s.file = make_file(s.folder);
    if (s.file < 0) return false;
    void* const room = mmap(nullptr, kRoom, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (room == MAP_FAILED)
        close(std::exchange(s.file, -1));
    else
        s.begin = static_cast<char*>(room);
    return s.begin;
}

/// Null: the disk is full.
void* allocate_in_file(Spill& s, std::size_t bytes) {
    const std::size_t size = (bytes + kPage - 1) / kPage * kPage;
    if (s.end + size > kRoom || posix_fallocate(s.file, off_t(s.end), off_t(size)) != 0) return nullptr;
    char* const wanted = s.begin.load() + s.end;
    if (mmap(wanted, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_FIXED, s.file, off_t(s.end)) != wanted)
        return nullptr;
    s.sizes.emplace(s.end, size);
    s.end += size;
    s.now += size;
    s.most = std::max(s.most, s.now);
    return wanted;
}

void free_in_file(char* array) {
    Spill& s = spill();
    const std::scoped_lock lock(s.mutex);
    const auto found = s.sizes.find(std::size_t(array - s.begin));
    if (found == s.sizes.end()) std::abort(); // never given out
    const auto [offset, size] = *found;
    // Where one of these fails, the place stays mapped or its bytes stay in the file; nothing else.
    [[maybe_unused]] const void* const left =
        mmap(array, size, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_FIXED, -1, 0);
    [[maybe_unused]] const int unused =
        fallocate(s.file, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, off_t(offset), off_t(size));
    s.sizes.erase(found);
    s.now -= size;
}

bool is_in_file(const void* array) {
    const char* const begin = spill().begin;
    return begin && array >= begin && array < begin + kRoom;
}

[[maybe_unused]] void* allocate(std::size_t bytes, std::size_t alignment) {
    const std::int64_t limit = memory_limit.load(std::memory_order_relaxed);
    if (limit > 0 && bytes >= kLarge && alignment <= kPage &&
        large_bytes.load(std::memory_order_relaxed) + std::int64_t(bytes) > limit) {
        Spill& s = spill();
        const std::scoped_lock lock(s.mutex);
        if (make_spill(s)) return allocate_in_file(s, bytes);
    }
    const std::size_t size = std::max<std::size_t>(bytes, 1);
    void* const array = alignment <= alignof(std::max_align_t)
                            ? std::malloc(size)
                            : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
    if (limit > 0 && bytes >= kLarge && array) large_bytes += std::int64_t(malloc_usable_size(array));
    return array;
}

[[maybe_unused]] void deallocate(void* array) {
    if (!array) return;
    if (memory_limit.load(std::memory_order_relaxed) > 0) {
        if (is_in_file(array)) return free_in_file(static_cast<char*>(array));
        const std::size_t size = malloc_usable_size(array);
        if (size >= kLarge) large_bytes -= std::int64_t(size);
    }
    std::free(array);
}

} // namespace

bool can_spill() {
    Spill& s = spill();
    const std::scoped_lock lock(s.mutex);
    return make_spill(s);
}

void spill_beyond(std::uint64_t limit, const std::filesystem::path& folder) {
    Spill& s = spill();
    const std::scoped_lock lock(s.mutex);
    s.folder = folder.empty() ? std::filesystem::path(".") : folder;
    memory_limit = std::int64_t(std::clamp<std::uint64_t>(limit, 1, std::uint64_t{1} << 62));
}

std::uint64_t most_spilled() {
    Spill& s = spill();
    const std::scoped_lock lock(s.mutex);
    return s.most;
}

} // namespace filigree::cli

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) // whose own these would replace

void* operator new(std::size_t size) {
    if (void* const array = filigree::cli::allocate(size, 1)) return array;
    throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment) {
    if (void* const array = filigree::cli::allocate(size, static_cast<std::size_t>(alignment))) return array;
    throw std::bad_alloc();
}
void* operator new[](std::size_t size) { return operator new(size); }
void* operator new[](std::size_t size, std::align_val_t alignment) { return operator new(size, alignment); }
void operator delete(void* array) noexcept { filigree::cli::deallocate(array); }
void operator delete(void* array, std::size_t) noexcept { filigree::cli::deallocate(array); }
void operator delete(void* array, std::align_val_t) noexcept { filigree::cli::deallocate(array); }
void operator delete(void* array, std::size_t, std::align_val_t) noexcept { filigree::cli::deallocate(array); }
void operator delete[](void* array) noexcept { filigree::cli::deallocate(array); }
void operator delete[](void* array, std::size_t) noexcept { filigree::cli::deallocate(array); }
void operator delete[](void* array, std::align_val_t) noexcept { filigree::cli::deallocate(array); }
void operator delete[](void* array, std::size_t, std::align_val_t) noexcept { filigree::cli::deallocate(array); }

#endif
