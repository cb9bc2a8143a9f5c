// Runs the live world of a page natively, by the same calls as the page's worker, and prints a hash a frame, and what a
// frame took, in processor time: the test compares them with those of WebAssembly (frames.mjs), which pulls in the same
// way.
//   live_frames MODEL.live FRAMES
#include "web/live/live.cpp"

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>

namespace {

/// FNV-1a of 32-bit words.
struct WordHash {
    std::uint32_t value = 2166136261u;
    void add(const float* numbers, std::size_t count) {
        for (std::size_t k = 0; k < count; ++k) {
            std::uint32_t word;
            std::memcpy(&word, numbers + k, sizeof word);
            value = (value ^ word) * 16777619u;
        }
    }
};

/// The part of a page's file that its JSON calls "world".
std::string world_of(const std::string& bytes) {
    std::uint64_t length = 0;
    std::memcpy(&length, bytes.data() + 8, sizeof length);
    const std::string text = bytes.substr(16, length);
    const std::size_t world = text.find("\"world\"");
    const auto number = [&](const char* key) {
        const std::size_t at = text.find(key, world);
        return std::strtoull(text.c_str() + text.find(':', at) + 1, nullptr, 10);
    };
    return bytes.substr(16 + length + number("\"at\""), number("\"bytes\""));
}

} // namespace

int main(int, char** arguments) {
    std::ifstream file(arguments[1], std::ios::binary);
    const std::string world = world_of({std::istreambuf_iterator<char>(file), {}});
    const int frames = std::atoi(arguments[2]);
    std::copy(world.begin(), world.end(), live_take(unsigned(world.size())));
    if (!live_begin()) {
        std::fprintf(stderr, "%s\n", live_text());
        return 1;
    }
    double seconds = 0;
    for (int frame = 0; frame < frames; ++frame) {
        // The same in frames.mjs: a hand from a quarter to a half of the time, and gravity to the side in the last
        // quarter.
        if (frame == frames / 4) {
            const float* p = live_positions(0);
            live_grab(0, 0.125, 0.125, 0.0625, p[0], p[1], p[2]);
        }
        if (frame > frames / 4 && frame < frames / 2) {
            const double way = double(frame - frames / 4) / 64;
            live_move(way, 0.5 + way, -0.5 * way);
        }
        if (frame == frames / 2) live_let_go();
        if (frame == 3 * frames / 4) live_set_gravity(4, -8, 2);
        const std::clock_t start = std::clock();
        if (!live_advance()) {
            std::fprintf(stderr, "%s\n", live_text());
            return 1;
        }
        seconds += double(std::clock() - start) / CLOCKS_PER_SEC;
        WordHash hash;
        for (unsigned driver = 0; driver < live_driver_count(); ++driver) {
            hash.add(live_positions(driver), 3 * std::size_t(live_driver_size(driver)));
            hash.add(live_gradients(driver), 9 * std::size_t(live_driver_size(driver)));
        }
        std::printf("%d %08x %u %u %u\n", frame, hash.value, live_substeps(), live_contacts(), live_parts());
    }
    std::fprintf(stderr, "%.3f ms a frame, %u particles\n", 1000 * seconds / frames, live_particle_count());
}
