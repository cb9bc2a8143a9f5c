// Stands in for the material point method, a tenth of the module: bodies of mpm do not travel to pages (live_world.h),
// so there are none on the grid, and all of this is called for none.
#include "filigree/physics/grid/mpm.h"
#include "web/live/serial.h"

namespace filigree {
std::string sentence_of(const void*, std::string_view) { return {}; }
} // namespace filigree

namespace filigree::mpm {

Bodies::Bodies(const World& world, std::span<const Actor> actors, std::size_t first, float spacing)
    : world_(world), laws_(world, first + actors.size()), field_of_(first + actors.size(), kNoIndex), spacing_(spacing),
      grid_(spacing), barriers_(world, spacing) {}

float Bodies::longest_step(double, const RunContext&) const { return 0; }
void Bodies::step(double, double, const RunContext&) {}
float Bodies::least_volume_ratio(std::size_t) const { return 1; }
void Bodies::read(std::size_t, Vectors&, Vectors&) const {}
void Bodies::set_positions(std::size_t, const Vectors&) {}
void Bodies::set_velocities(std::size_t, const Vectors&) {}
void Bodies::set_velocity_gradient(std::size_t, const Mat3f&) {}
void Bodies::kick(std::size_t, const Vectors&, float) {}
void Bodies::set_fixed(std::size_t, std::span<const std::uint8_t>) {}
void Bodies::move_fixed(std::size_t, const Vectors&, const Vectors&) {}
float Bodies::rest_squared_frequency(std::size_t) const { return 0; }
std::size_t Bodies::repair(std::size_t, const Vectors&, const Vectors&, std::span<const std::uint8_t>) { return 0; }
std::size_t Bodies::add_tracers(std::size_t, std::span<const Vec3f>, std::span<const Mat3f>) { return 0; }
void Bodies::read_tracers(std::size_t, std::span<Vec3f>, std::span<Mat3f>) const {}
std::string Bodies::state() const { return {}; }
bool Bodies::restore_state(std::string_view bytes) { return bytes.empty(); }

} // namespace filigree::mpm
