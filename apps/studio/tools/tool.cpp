#include "tools/tool.h"

namespace filigree::studio {

Qt::CursorShape Tool::cursor(bool) const { return Qt::CrossCursor; }

void Tool::draw(OverlayContent&, bool) const {}

double Tool::grip() const {
    const auto& source = workbench().state().source;
    return source ? settings().grip * source->box.diagonal() : 0;
}

} // namespace filigree::studio
