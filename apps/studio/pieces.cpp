#include "pieces.h"

#include "words.h"
#include "workbench_impl.h"

namespace filigree::studio {

namespace {

constexpr const char* kInPieces = ", in pieces";

double mean_edge(const std::vector<Vec3f>& places, const Level& level) {
    double sum = 0;
    std::size_t edges = 0;
    for (std::size_t f = 0; f < level.face_count(); ++f) {
        const Index begin = level.face_offsets[f], end = level.face_offsets[f + 1];
        for (Index c = begin; c < end; ++c, ++edges)
            sum += (places[level.corners[c]] - places[level.corners[c + 1 < end ? c + 1 : begin]]).norm();
    }
    return edges > 0 ? sum / double(edges) : 0;
}

/// From the middle of all to the middle of each one's piece.
std::vector<Vec3f> ways_of(const std::vector<Vec3f>& places, std::span<const Index> pieces) {
    std::vector<Vec3f> middles;
    std::vector<float> counts;
    Vec3f middle = Vec3f::Zero();
    for (std::size_t d = 0; d < places.size(); ++d) {
        if (pieces[d] >= middles.size()) {
            middles.resize(pieces[d] + 1, Vec3f::Zero());
            counts.resize(pieces[d] + 1);
        }
        middles[pieces[d]] += places[d];
        ++counts[pieces[d]];
        middle += places[d] / float(places.size());
    }
    std::vector<Vec3f> ways;
    for (const Index piece : pieces) ways.emplace_back(middles[piece] / counts[piece] - middle);
    return ways;
}

} // namespace

std::shared_ptr<const Source> whole_source(std::shared_ptr<const Source> source) {
    return source && source->pieces ? source->pieces->input : source;
}

Result<State> state_made_whole(State state, const RunContext& context) {
    if (state.source->pieces) {
        state.shape = state.source->pieces->shape;
        state.source = whole_source(state.source);
    }
    return stripped_state(std::move(state), context);
}

Result<State> state_in_pieces(State state, const PieceOptions& options, const RunContext& context) {
    Result<State> whole = state_made_whole(std::move(state), context);
    if (!whole) return whole.error();
    state = std::move(*whole);
    const auto begin = std::chrono::steady_clock::now();
    RunContext seeded = context;
    seeded.seed = options.seed;
    Result<FractureCells> cells = make_fracture_cells(state.source->mesh, options.pattern, seeded);
    if (!cells) return cells.error();
    const double edge = mean_edge(driver_positions(*state.model), state.model->driver());
    Result<ModelInPieces> cut = cut_model(*state.model, *cells, edge, context);
    if (!cut) return cut.error();

    auto breaking = std::make_shared<BreakingModel>();
    breaking->whole = std::shared_ptr<const Mesh>(state.source, &state.source->mesh);
    breaking->cells = std::make_shared<const FractureCells>(std::move(*cells));
    breaking->carried = std::move(cut->carried);
    auto pieces = std::make_shared<MadePieces>();
    pieces->options = options;
    pieces->report = cut->report;
    pieces->ways = ways_of(driver_positions(cut->model), breaking->carried.driver);
    pieces->breaking = std::move(breaking);
    pieces->input = state.source;
    pieces->shape = state.shape;
    auto source = source_of(cut->model.mesh, pieces->input->path, pieces->input->name + kInPieces, context);
    pieces->seconds = 1e-3 * milliseconds_since(begin);
    source->pieces = std::move(pieces);
    state.source = std::move(source);
    state.shape.reset();
    state.model = std::make_shared<const Model>(std::move(cut->model));
    state.restore.level = state.model->finest_level();
    if (context.is_cancelled()) return cancelled_error();
    return state;
}

void move_apart(const MadePieces& pieces, double apart, Pose& pose) {
    for (std::size_t d = 0; d < pose.positions.size(); ++d) pose.positions[d] += float(apart) * pieces.ways[d];
}

QString pieces_summary(const MadePieces& pieces) {
    return QStringLiteral("%1, cut in %2 s. Animate lets it fall and break.")
        .arg(counted(pieces.report.cells, "piece", "pieces"), number_text(pieces.seconds, 2));
}

QString pieces_table(const MadePieces& pieces) {
    const CutReport& report = pieces.report;
    const double median = report.median > 0 ? report.median : 1;
    return rich_table({{"Pieces", with_commas(report.cells)},
                       {"Smallest, of the median", number_text(report.smallest / median, 2)},
                       {"Largest, of the median", number_text(report.largest / median, 2)},
                       {"Inner faces", with_commas(report.inside_faces)},
                       {"Open edges", with_commas(report.open_edges)},
                       {"Seconds", number_text(pieces.seconds, 2)}});
}

} // namespace filigree::studio
