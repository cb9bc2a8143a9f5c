// The window's icons, drawn when they are needed: crisp at every scale, in the palette's colours.
#pragma once

#include <QIcon>

#include <vector>

namespace filigree::studio {

enum class Icon {
    open,
    save,
    undo,
    redo,
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

/// What a stroke's numbers are, in a square of 16 by 16, y down. Angles in degrees, counter-clockwise, 0: right.
enum class StrokeKind {
    line,    ///< x, y of two points or more
    polygon, ///< the same, closed
    solid,   ///< the same, filled
    ellipse, ///< x, y of the middle, radius
    arc,     ///< x, y, width, height of the whole ellipse's box, first angle, angle from there
    box,     ///< x, y, width, height
    bar,     ///< the same, filled
    dot,     ///< x, y
    curve,   ///< x, y of the start, then of three points for each cubic
    head,    ///< of an arrow: x, y of its tip, the angle it points along, length
    cube,    ///< x, y of the middle, radius
};
struct Stroke {
    StrokeKind kind;
    std::vector<double> numbers;
};

QIcon icon(Icon kind);
QIcon icon(const std::vector<Stroke>& strokes); ///< which must stay where they are

} // namespace filigree::studio
