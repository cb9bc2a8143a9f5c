// Runs a target without libFuzzer: on its seeds, on small changes of them, and on the inputs that it once failed on.
//   TARGET [FILE or FOLDER...]
//   TARGET --seeds FOLDER       writes the seeds as files
#include "fuzz.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

using namespace filigree_fuzz;

namespace {

constexpr int kChanges = 40; // of each seed

void run(const std::string& bytes) {
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
}

std::string changed(std::string bytes, std::mt19937& random) {
    for (unsigned times = 1 + random() % 4; times-- > 0 && !bytes.empty();) {
        const std::size_t at = random() % bytes.size();
        switch (random() % 4) {
        case 0:
            bytes[at] = char(bytes[at] ^ (1 << random() % 8));
            break;
        case 1:
            bytes[at] = char(random());
            break;
        case 2:
            bytes.resize(at);
            break;
        default:
            bytes.insert(at, bytes.substr(random() % bytes.size(), random() % 16));
        }
    }
    return bytes;
}

std::string read(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

} // namespace

int main(int argc, char** argv) {
    if (argc == 3 && std::string(argv[1]) == "--seeds") {
        int number = 0;
        for (const std::string& seed : seeds())
            std::ofstream(std::filesystem::path(argv[2]) / ("seed_" + std::to_string(number++)), std::ios::binary)
                << seed;
        return 0;
    }
    int runs = 0;
    for (int k = 1; k < argc; ++k) {
        if (!std::filesystem::is_directory(argv[k])) {
            run(read(argv[k]));
            ++runs;
            continue;
        }
        for (const auto& entry : std::filesystem::directory_iterator(argv[k])) {
            run(read(entry.path()));
            ++runs;
        }
    }
    std::mt19937 random(1);
    for (const std::string& seed : seeds()) {
        run(seed);
        for (int k = 0; k < kChanges; ++k) run(changed(seed, random));
        runs += 1 + kChanges;
    }
    std::printf("%d inputs\n", runs);
}
