// The mesh in pieces: cutting it, and what is said of them.
#pragma once

#include "document.h"

#include "filigree/fracture.h"

#include <QString>

namespace filigree::studio {

struct PieceOptions {
    FracturePattern pattern;
    std::uint64_t seed = 1;
};

/// How the pieces of a source came about.
struct MadePieces {
    PieceOptions options;
    CutReport report;
    double seconds = 0; ///< of all of it
    std::shared_ptr<const BreakingModel> breaking;
    std::vector<Vec3f> ways; ///< of each driver vertex: from the mesh's middle to that of its piece, model units
    std::shared_ptr<const Source> input; ///< the whole mesh
    std::optional<Shape> shape;          ///< when that is a built-in shape
};

/// The source, or what its pieces were cut from.
std::shared_ptr<const Source> whole_source(std::shared_ptr<const Source> source);
/// The state with its whole source again. Errors: as of stripped_state.
Result<State> state_made_whole(State state, const RunContext& context);
/// The state with its whole source in pieces, stripped before it is cut. Errors: those of stripped_state,
/// make_fracture_cells and cut_model.
Result<State> state_in_pieces(State state, const PieceOptions& options, const RunContext& context);

/// The pose with each piece moved away from the middle by `apart` times its way there. pose: of the source's driver.
void move_apart(const MadePieces& pieces, double apart, Pose& pose);

QString pieces_summary(const MadePieces& pieces); ///< in a sentence, for the message bar
QString pieces_table(const MadePieces& pieces);   ///< the figures, as rich text

} // namespace filigree::studio
