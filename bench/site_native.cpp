// What the standing page's module takes natively, on one thread, to be seen beside WebAssembly: scripts/bench-site.
//   site_native MESH...        prints for each: processor ms to read it, and to make body, model and page
#include "web/site/site.cpp"

#include <cstdio>
#include <ctime>
#include <fstream>
#include <iterator>

extern "C" void page_progress(const char*, unsigned, double) {}

namespace {

double now() { return 1000.0 * double(std::clock()) / CLOCKS_PER_SEC; } // of the processor: one thread works

void give(const std::string& bytes) { std::copy(bytes.begin(), bytes.end(), site_take(unsigned(bytes.size()))); }

bool time(const char* path) {
    std::ifstream file(path, std::ios::binary);
    const std::string name = path, bytes{std::istreambuf_iterator<char>(file), {}}, material = "soft-rubber";
    give(name + bytes);
    const double start = now();
    if (!site_read(unsigned(name.size()))) return false;
    const double read = now();
    give(material);
    if (!site_make(unsigned(material.size()), 0, 2500, 0, 12)) return false;
    std::printf("%.0f %.0f\n", read - start, now() - read);
    return true;
}

} // namespace

int main(int count, char** arguments) {
    for (int k = 1; k < count; ++k)
        if (!time(arguments[k])) return std::fprintf(stderr, "%s\n", site_text()), 1;
}
