// Windows and WASM: arrays stay in memory, and the system's page file takes what does not fit.
#include "spill.h"

namespace filigree::cli {

bool can_spill() { return false; }
void spill_beyond(std::uint64_t, const std::filesystem::path&) {}
std::uint64_t most_spilled() { return 0; }

} // namespace filigree::cli
