#include "filigree/io/temporary_file.h"

#include <random>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <sys/random.h>
#include <unistd.h>

namespace filigree {

namespace {

namespace fs = std::filesystem;

std::uint64_t random_bits() {
    std::uint64_t bits = 0;
    if (::getrandom(&bits, sizeof bits, 0) == ssize_t{sizeof bits}) return bits;
    std::random_device device; // on kernels without the call
    return std::uint64_t{device()} << 32 | device();
}

} // namespace

fs::path temporary_path(const fs::path& folder, std::string_view suffix) {
    constexpr char kDigits[] = "0123456789abcdef";
    std::string name = ".filigree-";
    std::uint64_t bits = random_bits();
    for (int i = 0; i < 16; ++i, bits >>= 4) name += kDigits[bits & 15];
    return folder / name.append(suffix);
}

fs::path follow_links(fs::path path) {
    constexpr int kLongestChain = 40; // as the kernel's
    std::error_code failed;
    for (int links = 0; links < kLongestChain && fs::is_symlink(path, failed); ++links) {
        const fs::path target = fs::read_symlink(path, failed);
        if (failed) break;
        path = target.is_absolute() ? target : path.parent_path() / target;
    }
    return path;
}

void sync_folder(const fs::path& folder) {
    const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0) return;
    ::fsync(descriptor); // best effort: some file systems cannot
    ::close(descriptor);
}

} // namespace filigree
