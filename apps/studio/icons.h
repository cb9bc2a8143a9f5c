// The window's icons, drawn when they are needed: crisp at every scale, in the palette's colours.
#pragma once

#include <QIcon>

namespace filigree::studio {

enum class Icon {
    open,
    save,
    undo,
    redo,
    pull,
    pin,
    turn,
    torch,
    play,
    pause,
    step,
    reset,
    minus,
    plus,
    deform,
    animate,
    film,
    meshes,
    show_all,
    close,
    warning,
    good,
    folded,
    unfolded,
    logo,
};

QIcon icon(Icon kind);

} // namespace filigree::studio
