// From a mesh to cells. Everything here is in model units; only the finished cells are in metres.
#include "filigree/physics/body/mesh_cells.h"
#include "filigree/core/math.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/sample/closure.h"

#include "filigree/physics/body/occupied_cells.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace filigree {

using namespace mesh_cells;

namespace {

constexpr double kCountTolerance = 0.02, kFitTolerance = 0.15; // relative

/// Makes cells of one mesh with one spacing after the other.
class CellMaker {
public:
    CellMaker(const Mesh& mesh, const WeldedTriangles& welded, double scale, const RunContext& context)
        : mesh_(find_mesh_to_fill(mesh, welded)), scale_(scale), context_(context) {
        context_.progress = nullptr;
    }

    const Box& box() const { return mesh_.box; }
    Status find_volume() {
        const Result<std::optional<double>> volume = exact_volume(mesh_, context_);
        if (!volume) return volume.error();
        volume_ = *volume;
        return Success{};
    }

    /// spacing: model units.
    Result<Cells> make(double spacing, CellReport& report) const {
        const Result<Grid> grid = make_grid(mesh_.box, spacing, scale_);
        if (!grid) return grid.error();
        Result<std::vector<Draft>> drafts = sample_cells(mesh_, *grid, scale_, context_);
        if (!drafts) return drafts.error();
        add_surface_cells(mesh_, *grid, *drafts);
        if (volume_) match_volume(*drafts, *volume_ / (spacing * spacing * spacing));
        if (context_.is_cancelled()) return cancelled_error();
        if (double(drafts->size()) > kMostCells) return too_many_cells(*grid, double(drafts->size()), scale_);
        Cells cells = finish(*grid, *drafts);
        std::size_t loose = 0;
        const std::vector<std::uint8_t> kept = without_loose_parts(cells, loose);
        if (loose > 0) {
            std::size_t count = 0;
            for (std::size_t c = 0; c < kept.size(); ++c)
                if (kept[c]) (*drafts)[count++] = (*drafts)[c];
            drafts->resize(count);
            cells = finish(*grid, *drafts);
        }
        report = {};
        report.cells = drafts->size();
        report.loose_parts = loose;
        double volume = 0;
        for (const Draft& cell : *drafts) {
            report.whole_cells += cell.fraction == 1;
            report.added_cells += cell.added;
            volume += cell.fraction;
        }
        report.volume = volume * cells.spacing * cells.spacing * cells.spacing;
        return cells;
    }

private:
    Cells finish(const Grid& grid, const std::vector<Draft>& drafts) const {
        std::vector<Cells::LatticeIndex> indices(drafts.size());
        for (std::size_t c = 0; c < drafts.size(); ++c) indices[c] = drafts[c].index;
        Cells cells = lattice_cells(std::move(indices), grid.spacing * scale_, grid.origin * scale_);
        for (std::size_t c = 0; c < drafts.size(); ++c) {
            cells.fraction[c] = drafts[c].fraction;
            cells.centroid[c] = (drafts[c].centroid.cast<double>() * scale_).cast<float>();
        }
        return cells;
    }

    MeshToFill mesh_;
    double scale_;
    std::optional<double> volume_; ///< exact, model units cubed
    RunContext context_;           ///< without progress: the spacings are counted, not what each takes
};

/// What came of a spacing.
struct Trial {
    double spacing = 0;
    double particles = 0;
    Cells cells;
    CellReport report;
};

/// Spacings by the secant rule on the logarithms, then fitted to the shortest side.
Result<Trial> find_spacing(const CellMaker& maker, std::size_t count,
                           const std::function<std::size_t(const Cells&)>& count_particles, const RunContext& context) {
    const auto try_spacing = [&](double spacing) -> Result<Trial> {
        Trial trial;
        trial.spacing = spacing;
        Result<Cells> cells = maker.make(spacing, trial.report);
        if (!cells) return cells.error();
        trial.particles = double(count_particles(*cells));
        trial.cells = std::move(cells).value();
        return trial;
    };
    const auto miss = [&](const Trial& trial) { return math::log(trial.particles / double(count)); };

    constexpr int kTrials = 6;
    const Vec3d size = maker.box().size();
    double spacing = size.maxCoeff() / 24, slope = -3;
    Trial best, last;
    for (int n = 0; n < kTrials; ++n) {
        context.report("choosing a spacing", double(n) / kTrials);
        Result<Trial> trial = try_spacing(spacing);
        if (!trial) return trial.error();
        if (n > 0 && trial->particles != last.particles)
            slope = std::clamp((miss(*trial) - miss(last)) / math::log(trial->spacing / last.spacing), -3.5, -1.0);
        const bool better = n == 0 || std::abs(miss(*trial)) < std::abs(miss(best));
        last.spacing = trial->spacing;
        last.particles = trial->particles;
        if (better) best = std::move(trial).value();
        if (std::abs(miss(best)) < kCountTolerance) break;
        const double next = std::min(last.spacing * math::exp(-miss(last) / slope), size.maxCoeff());
        if (next == last.spacing) break;
        spacing = next;
    }

    const double shortest = size.minCoeff();
    std::optional<Trial> fitted;
    for (const double cells : {std::floor(shortest / best.spacing), std::ceil(shortest / best.spacing)}) {
        if (cells < 1 || std::abs(math::log(shortest / cells / best.spacing)) > 0.2) continue;
        Result<Trial> trial = try_spacing(shortest / cells);
        if (!trial) return trial.error();
        if (std::abs(trial->particles - double(count)) <= kFitTolerance * double(count) &&
            (!fitted || std::abs(miss(*trial)) < std::abs(miss(*fitted))))
            fitted = std::move(trial).value();
    }
    return fitted ? std::move(*fitted) : std::move(best);
}

std::optional<Error> check(const CellMaker& maker, double scale, const CellOptions& options) {
    if (!std::isfinite(scale) || scale <= 0)
        return Error{ErrorCode::usage, "The scale is " + number(scale) + "; give metres a model unit, above 0."};
    if (!std::isfinite(options.spacing) || options.spacing < 0)
        return Error{ErrorCode::usage,
                     "The spacing is " + number(options.spacing) + "; give metres, above 0 (or 0 to have it chosen)."};
    const double longest = maker.box().size().maxCoeff() * scale;
    if (!(longest > 0))
        return Error{ErrorCode::unsuitable, "The mesh has no extent, so there is nothing to fill with cells."};
    if (longest < 1e-9 || longest > 1e9)
        return Error{ErrorCode::usage, "With a scale of " + number(scale) + " the body is " + number(longest) +
                                           " m long; give a scale that makes it 1e-9 to 1e9 m."};
    if (options.spacing > longest)
        return Error{ErrorCode::usage, "A spacing of " + number(options.spacing) + " m is larger than the body (" +
                                           number(longest) + " m); give less."};
    if (options.spacing == 0 && options.count == 0)
        return Error{ErrorCode::usage, "A body of 0 cells was asked for; give a count of 1 or more, or a spacing."};
    if (options.spacing == 0 && double(options.count) > kMostCells)
        return Error{ErrorCode::unsuitable, "More than 2^26 cells were asked for; give a smaller count."};
    return std::nullopt;
}

} // namespace

Result<Cells> make_cells(const Mesh& mesh, const WeldedTriangles& welded, double scale, const CellOptions& options,
                         const std::function<std::size_t(const Cells&)>& count_particles, const RunContext& context,
                         CellReport* report) {
    if (welded.triangles.empty())
        return Error{ErrorCode::unsuitable, "The mesh has no faces with an area, so no body can be made of it."};
    CellMaker maker(mesh, welded, scale, context);
    if (const auto error = check(maker, scale, options)) return *error;
    if (const Status found = maker.find_volume(); !found) return found.error();
    Trial trial;
    if (options.spacing > 0) {
        Result<Cells> cells = maker.make(options.spacing / scale, trial.report);
        if (!cells) return cells.error();
        trial.cells = std::move(cells).value();
    } else {
        Result<Trial> found = find_spacing(maker, options.count, count_particles, context);
        if (!found) return found.error();
        trial = std::move(found).value();
    }
    if (report) {
        *report = trial.report;
        report->thin_cells = count_thin(trial.cells, context);
    }
    return std::move(trial.cells);
}

Result<Cells> make_cells(const Mesh& mesh, double scale, const CellOptions& options, const RunContext& context,
                         CellReport* report) {
    const Result<WeldedTriangles> welded = weld_triangles(mesh, context);
    if (!welded) return welded.error();
    return make_cells(
        mesh, *welded, scale, options, [](const Cells& cells) { return cells.cells.size(); }, context, report);
}

} // namespace filigree
