// The mesh as quads: making them, and what is said of them.
#pragma once

#include "document.h"

#include "filigree/remesh.h"

#include <QString>

namespace filigree::studio {

/// How the quads of a source came about.
struct MadeQuads {
    QuadRemeshReport report;
    double seconds = 0;                  ///< of all of it
    std::shared_ptr<const Source> input; ///< the mesh before; other quads are made of it, not of these
};

/// What quads are made of: the source, or the input of its quads.
std::shared_ptr<const Source> input_of_quads(std::shared_ptr<const Source> source);
/// A source with the input's quads. Errors: those of quad_remesh, said of quads.
Result<std::shared_ptr<const Source>> make_quads_of(std::shared_ptr<const Source> input,
                                                    const QuadRemeshOptions& options, const RunContext& context);

QString quads_summary(const Source& source); ///< in a sentence, for the message bar
QString quads_table(const MadeQuads& quads); ///< the figures, as rich text
/// What was changed before and how it went, a line each; "" when there is nothing to say.
QString quads_remarks(const MadeQuads& quads);

} // namespace filigree::studio
