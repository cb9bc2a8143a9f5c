// Numbers of the mesh's vertices as colours: one row a colouring.
#pragma once

#include "overlay.h"
#include "shown_model.h"
#include "workbench.h"

namespace filigree::studio {

/// What there is to be coloured.
struct Seen {
    Workbench& workbench;
    std::shared_ptr<const Model> model; ///< of the mesh shown
    std::shared_ptr<const Mesh> melt;   ///< shown in its place; null: nothing is
    const Pose& pose;
    std::uint64_t pose_number = 0;   ///< another one with each pose; 0: at rest
    std::uint64_t moment_number = 0; ///< another one with each moment of the body
    bool knows_full = false;         ///< workbench.full() is of the pose
    std::string patches_problem;     ///< why patches are not seen; "" when they are
};

/// What colours are made of, and a number: they are made again when another key is wanted.
using ColorKey = std::pair<std::shared_ptr<const void>, std::uint64_t>;

struct ColorWork {
    std::function<Result<VertexColors>(const RunContext&)> work;
    bool is_slow = false; ///< goes to the background
};

/// What is to be found out, or drawn in place of the mesh, while a colouring is chosen.
struct ColoringNeeds {
    bool full = false, temperatures = false, expected_error = false, patches = false;
};

struct LegendWords {
    const char *title = nullptr, *unit = ""; ///< no title: no legend
    double per_value = 1;                    ///< what is written: the value times this
    bool whole = false;                      ///< whole numbers
};

/// A row: in the menu, the panel View, the legend and docs/studio.md.
struct Coloring {
    const char* name; ///< of its action, after "view.color_"
    const char *text, *tip, *keys;
    const char* choice; ///< in the panel
    /// None: there are no colours now. Null: there never are.
    std::optional<ColorKey> (*key)(const Seen& seen) = nullptr;
    ColorWork (*work)(const Seen& seen) = nullptr; ///< called when there is a key
    LegendWords legend = {};
    ColoringNeeds needs = {};
    QString (*why_not)(const Seen& seen) = nullptr; ///< a sentence while the colours are not there; "" while they are
};

extern const Coloring kOwnColors, kErrorColors, kLevelColors, kPatchColors, kExpectedErrorColors, kPieceColors,
    kHeatColors, kSoftnessColors;

/// In the order of the menu: the program's own, then those that tools bring.
const std::vector<const Coloring*>& colorings();

} // namespace filigree::studio
