#include "playback.h"

namespace filigree::studio {
struct Playback::Worker {};
Playback::Playback(QObject* parent) : QObject(parent) {}
Playback::~Playback() = default;
Result<std::shared_ptr<const MadeBody>> make_body_of(const State&, const Vec3d&, const RunContext&) {
    return std::shared_ptr<const MadeBody>();
}
void Playback::put(std::shared_ptr<const MadeBody>) {}
void Playback::remove() {}
void Playback::play() {}
void Playback::pause() {}
void Playback::step() {}
void Playback::reset() {}
void Playback::wait_for_frames(std::size_t) {}
void Playback::grab(const Vec3f&, const Vec3d&) {}
void Playback::pull(const Vec3d&) {}
void Playback::let_go() {}
void Playback::want_full(bool) {}
void Playback::deliver() {}
} // namespace filigree::studio
