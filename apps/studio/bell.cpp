// An event counter of the kernel instead of Qt's posted events: nothing of Qt's is touched outside the main thread, so
// the thread sanitizer, which cannot see inside Qt, sees every hand-over.
#include "bell.h"

#include <cstdint>
#include <sys/eventfd.h>
#include <unistd.h>

namespace filigree::studio {

Bell::Bell(QObject* parent)
    : QObject(parent), descriptor_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      notifier_(descriptor_, QSocketNotifier::Read) {
    connect(&notifier_, &QSocketNotifier::activated, this, [this] {
        std::uint64_t rings = 0;
        if (read(descriptor_, &rings, sizeof(rings)) > 0) Q_EMIT rung();
    });
}

Bell::~Bell() {
    notifier_.setEnabled(false);
    close(descriptor_);
}

void Bell::ring() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = write(descriptor_, &one, sizeof(one)); // fails only when 2^64 - 1 wait
}

} // namespace filigree::studio
