#include "filigree/io/gltf/glb_builder.h"

#include "filigree/io/system/file.h"

#include <gtest/gtest.h>

#include <fstream>

#include <sys/wait.h>
#include <unistd.h>

using namespace filigree;

namespace {

std::string part(char letter, std::size_t count) { return std::string(count, letter); }

void add_parts(GlbBuilder& builder, std::size_t count, std::size_t bytes) {
    for (std::size_t i = 0; i < count; ++i)
        builder.add({.component = GltfComponent::uint8, .count = bytes}, part(char('a' + i % 26), bytes));
}

/// The largest memory that this process has had, in bytes.
std::size_t peak_memory() {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;)
        if (std::size_t kilobytes = 0; word == "VmHWM:" && status >> kilobytes) return kilobytes * 1024;
    return 0;
}

} // namespace

TEST(GlbBuilder, GatheredPartsAreTheSameFile) {
    GlbBuilder builder, same;
    for (GlbBuilder* b : {&builder, &same}) {
        add_parts(*b, 3, 5); // padded to 8
        b->add({.component = GltfComponent::uint8, .count = 3}, 3, [](const auto& write) { return write("xyz"); });
        b->json["scene"] = 0;
    }
    const std::string expected = *same.bytes();
    EXPECT_EQ(*builder.gather(), expected);
    EXPECT_EQ(*builder.bytes(), expected);
    EXPECT_EQ(builder.byte_count(), expected.size());
    for (GlbBuilder* b : {&builder, &same}) b->json["asset"]["extras"] = "what was measured";
    EXPECT_EQ(*builder.bytes(), *same.bytes());
    EXPECT_EQ(builder.byte_count(), same.byte_count());
}

TEST(GlbBuilder, GatheredPartsAreInMemoryOnce) {
#if defined(__SANITIZE_ADDRESS__)
    GTEST_SKIP() << "the address sanitizer keeps what is freed for a while";
#endif
    constexpr std::size_t kParts = 16, kBytes = std::size_t{8} << 20, kAll = kParts * kBytes;
    const pid_t child = ::fork(); // a process of its own, as the peak is of all tests
    if (child == 0) {
        const std::size_t before = peak_memory();
        GlbBuilder builder;
        add_parts(builder, kParts, kBytes);
        const bool is_whole = builder.gather()->size() > kAll;
        const std::size_t used = peak_memory() - before;
        ::_exit(is_whole && used < kAll + kAll / 2 ? 0 : 1);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
}
