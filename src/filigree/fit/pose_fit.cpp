// Based on: regularised least squares [Tikhonov 1963], and conjugate gradients that stop early [Hestenes 1952]. All
// sums are in double, about the centre of the rest shape and in units of its diagonal.
#include "filigree/fit/pose_fit.h"

#include "filigree/core/lists.h"
#include "filigree/core/parallel_for.h"
#include "filigree/core/parallel_sum.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <new>

namespace filigree {

namespace {

using SparseMatrix = Eigen::SparseMatrix<double>;
using Unknowns = Eigen::MatrixXd; ///< four rows a driver vertex (position, then the gradient's columns), three columns

constexpr std::size_t kCellGrain = 16, kPointGrain = 16384;
constexpr double kLeastEdge = 1e-3;  // of the diagonal: how long edges count at least, where a driver has none
constexpr double kWildGradient = 10; // times the usual one: a prior that is larger says nothing
constexpr int kMostRounds = 30;      // of refining
constexpr double kStillFalls = 0.95; // of the residual: a round that leaves more is the last
constexpr double kExact = 1e-7;      // of the diagonal, rms: floats say no more

/// What a vertex of the driver gathers of the cells around: sum b y and sum b q y^T.
struct Gathered {
    std::array<double, 12> sums{}; ///< four rows of three
};

/// One corner of a cell.
struct CellCorner {
    Index cell, corner;
};

} // namespace

struct PoseFit::Content {
    const Model* model = nullptr;
    Vec3d centre;               ///< of the rest shape, relative to the mesh's origin
    double scale = 1;           ///< 1 / diagonal
    std::vector<Vec3d> driver;  ///< at rest, scaled
    std::vector<Vec3f> q;       ///< of each record, scaled
    Lists<CellCorner> cells_of; ///< of each driver vertex
    GradientFit estimate;
    bool refines = true;
    Eigen::VectorXd prior;                      ///< R's diagonal
    SparseMatrix normal;                        ///< M^T M
    Eigen::SimplicialLDLT<SparseMatrix> factor; ///< of M^T M + R

    Content(const Model& of, const RunContext& context) : model(&of), estimate(level_mesh(of, 0), context) {}

    void prepare(const RunContext& context);
    Status factorise(const PoseFitOptions& options, const RunContext& context);
    Unknowns right_side(std::span<const Vec3f> positions, const Vec3d& middle, double& squared,
                        const RunContext& context) const;
    Unknowns from_positions(std::span<const Vec3f> driver_positions, const RunContext& context) const;
    std::vector<Vec3f> positions_of(const Unknowns& x) const;
    double squared_residual(const Unknowns& x, const Unknowns& right, double squared) const;
    void refine(Unknowns& x, double residual, const Unknowns& right, double squared, double count) const;
};

void PoseFit::Content::prepare(const RunContext& context) {
    const BlendDetail& detail = model->detail;
    const Box box = bounds(model->mesh);
    centre = box.centre();
    scale = box.diagonal() > 0 ? 1 / box.diagonal() : 1;
    const auto scaled = [&](const Vec3f& p) { return Vec3d(scale * (p.cast<double>() - centre)); };
    for (const Index v : model->driver().vertices) driver.push_back(scaled(model->mesh.positions[v]));
    q.resize(detail.order.size());
    parallel_for(context, detail.cells.size(), kCellGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) {
            const Triangle& cell = detail.cells[c];
            for (Index r = detail.cell_offsets[c]; r < detail.cell_offsets[c + 1]; ++r) {
                const double u = detail.u[r], v = detail.v[r];
                const Vec3d m = (1 - u - v) * driver[cell[0]] + u * driver[cell[1]] + v * driver[cell[2]];
                q[r] = (scaled(model->mesh.positions[detail.order[r]]) - 0.5 * m).cast<float>();
            }
        }
    });
    cells_of = make_lists<CellCorner>(driver.size(), [&](const auto& add) {
        for (Index c = 0; c < detail.cells.size(); ++c)
            for (Index k = 0; k < 3; ++k) add(detail.cells[c][k], CellCorner{c, k});
    });
}

namespace {

using Block = Eigen::Matrix4d;

/// The sums over a cell's records of b_k b_l (1, q) (1, q)^T, for corners k <= l: 00, 01, 02, 11, 12, 22.
struct CellBlocks {
    std::array<Block, 6> blocks;
};
constexpr std::array<std::array<int, 3>, 3> kBlockOf = {{{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}};

CellBlocks blocks_of_cell(const BlendDetail& detail, std::size_t cell, std::span<const Vec3f> q) {
    CellBlocks sums;
    for (Block& block : sums.blocks) block.setZero();
    for (Index r = detail.cell_offsets[cell]; r < detail.cell_offsets[cell + 1]; ++r) {
        const double u = detail.u[r], v = detail.v[r];
        const std::array<double, 3> b = {1 - u - v, u, v};
        const Eigen::Vector4d e(1, q[r][0], q[r][1], q[r][2]);
        const Block outer = e * e.transpose();
        for (std::size_t k = 0, at = 0; k < 3; ++k)
            for (std::size_t l = k; l < 3; ++l) sums.blocks[at++] += b[k] * b[l] * outer;
    }
    return sums;
}

/// Takes (1, q) to (1, d_i): d_i = q - c_i / 2.
Block to_offset(const Vec3d& driver_vertex) {
    Block to = Block::Identity();
    to.block<3, 1>(1, 0) = -0.5 * driver_vertex;
    return to;
}

/// The mean squared length of the edges at each driver vertex, scaled.
std::vector<double> squared_edges(const BlendDetail& detail, std::span<const Vec3d> driver) {
    std::vector<double> sums(driver.size(), 0);
    std::vector<std::size_t> counts(driver.size(), 0);
    for (const Triangle& cell : detail.cells)
        for (std::size_t k = 0; k < 3; ++k) {
            const Index a = cell[k], b = cell[(k + 1) % 3];
            for (const Index v : {a, b}) {
                sums[v] += (driver[a] - driver[b]).squaredNorm();
                ++counts[v];
            }
        }
    for (std::size_t i = 0; i < sums.size(); ++i)
        sums[i] = std::max(counts[i] > 0 ? sums[i] / double(counts[i]) : 0, kLeastEdge * kLeastEdge);
    return sums;
}

} // namespace

Status PoseFit::Content::factorise(const PoseFitOptions& options, const RunContext& context) {
    const BlendDetail& detail = model->detail;
    std::vector<CellBlocks> cells(detail.cells.size());
    parallel_for(context, cells.size(), kCellGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) cells[c] = blocks_of_cell(detail, c, q);
    });
    if (context.is_cancelled()) return cancelled_error();

    // Row by row: the blocks of a driver vertex with itself and with those it shares cells with.
    std::vector<Eigen::Triplet<double>> entries;
    std::vector<double> weights(driver.size(), 0);
    std::vector<std::pair<Index, Block>> row;
    for (Index i = 0; i < driver.size(); ++i) {
        row.clear();
        for (const CellCorner& at : cells_of[i])
            for (std::size_t l = 0; l < 3; ++l) {
                const Index j = detail.cells[at.cell][l];
                auto found = std::ranges::find(row, j, &std::pair<Index, Block>::first);
                if (found == row.end()) found = row.insert(row.end(), {j, Block::Zero()});
                found->second += cells[at.cell].blocks[static_cast<std::size_t>(kBlockOf[at.corner][l])];
            }
        std::ranges::sort(row, {}, &std::pair<Index, Block>::first);
        const Block from = to_offset(driver[i]);
        for (const auto& [j, sum] : row) {
            weights[i] += sum(0, 0); // over j: sum b_i
            const Block block = from * sum * to_offset(driver[j]).transpose();
            for (int a = 0; a < 4; ++a)
                for (int b = 0; b < 4; ++b) entries.emplace_back(int(4 * i) + a, int(4 * j) + b, block(a, b));
        }
    }
    const auto size = static_cast<Eigen::Index>(4 * driver.size());
    normal.resize(size, size);
    normal.setFromTriplets(entries.begin(), entries.end());
    entries = {};

    refines = options.refine;
    prior.resize(size);
    const std::vector<double> edges = squared_edges(detail, driver);
    for (std::size_t i = 0; i < driver.size(); ++i) {
        const double weight = options.prior * std::max(weights[i], 1.0);
        prior[Eigen::Index(4 * i)] = weight * options.hold;
        for (int k = 1; k < 4; ++k) prior[Eigen::Index(4 * i) + k] = weight * edges[i];
    }
    SparseMatrix sum = normal;
    sum.diagonal() += prior;
    factor.compute(sum);
    if (factor.info() != Eigen::Success)
        return Error{ErrorCode::unsuitable, "The poses cannot be solved for: a number of the mesh is not finite."};
    return Success{};
}

/// M^T (positions - middle), and the sum of the squares of what is fitted.
Unknowns PoseFit::Content::right_side(std::span<const Vec3f> positions, const Vec3d& middle, double& squared,
                                      const RunContext& context) const {
    const BlendDetail& detail = model->detail;
    std::vector<std::array<Gathered, 3>> cells(detail.cells.size());
    std::vector<double> squares(detail.cells.size(), 0);
    parallel_for(context, cells.size(), kCellGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) {
            std::array<Gathered, 3>& sums = cells[c];
            for (Index r = detail.cell_offsets[c]; r < detail.cell_offsets[c + 1]; ++r) {
                const double u = detail.u[r], v = detail.v[r];
                const std::array<double, 3> b = {1 - u - v, u, v};
                const Vec3f& position = positions[detail.order[r]];
                std::array<double, 12> terms;
                for (int k = 0; k < 3; ++k) {
                    const double y = scale * (double(position[k]) - middle[k]);
                    squares[c] += y * y;
                    terms[std::size_t(k)] = y;
                    for (int row = 0; row < 3; ++row) terms[std::size_t(3 + 3 * row + k)] = double(q[r][row]) * y;
                }
                for (std::size_t corner = 0; corner < 3; ++corner)
                    for (std::size_t t = 0; t < terms.size(); ++t) sums[corner].sums[t] += b[corner] * terms[t];
            }
        }
    });
    squared = 0;
    for (const double square : squares) squared += square;
    Unknowns right(Eigen::Index(4 * driver.size()), 3);
    for (std::size_t i = 0; i < driver.size(); ++i) {
        Gathered sum;
        for (const CellCorner& at : cells_of[i])
            for (std::size_t t = 0; t < sum.sums.size(); ++t) sum.sums[t] += cells[at.cell][at.corner].sums[t];
        for (int row = 0; row < 4; ++row)
            for (int k = 0; k < 3; ++k) {
                double value = sum.sums[std::size_t(3 * row + k)];
                if (row > 0) value -= 0.5 * driver[i][row - 1] * sum.sums[std::size_t(k)];
                right(Eigen::Index(4 * i) + row, k) = value;
            }
    }
    return right;
}

/// Positions of the driver, scaled, with the gradients that are estimated from them. Where parts that lie side by side
/// at rest come apart, an estimate may be beyond all measure: the driver's mean gradient then stands for it.
Unknowns PoseFit::Content::from_positions(std::span<const Vec3f> driver_positions, const RunContext& context) const {
    std::vector<Vec3f> in_units(driver_positions.size()); // of the rest shape, as gradients have no unit
    for (std::size_t i = 0; i < in_units.size(); ++i) in_units[i] = driver_positions[i] / float(scale);
    const std::vector<Mat3f> gradients = estimate.fit(in_units, context);
    std::vector<float> norms;
    for (const Mat3f& a : gradients) norms.push_back(a.norm());
    std::vector<float> sorted = norms;
    std::ranges::nth_element(sorted, sorted.begin() + std::ptrdiff_t(sorted.size() / 2));
    const double most = kWildGradient * double(sorted[sorted.size() / 2]);
    const auto is_sound = [&](std::size_t i) { return double(norms[i]) <= most; }; // false for what is not finite
    Mat3d mean = Mat3d::Zero();
    std::size_t sound = 0;
    for (std::size_t i = 0; i < gradients.size(); ++i)
        if (is_sound(i)) {
            mean += gradients[i].cast<double>();
            ++sound;
        }
    if (sound > 0) mean /= double(sound);

    Unknowns x(Eigen::Index(4 * driver_positions.size()), 3);
    for (std::size_t i = 0; i < driver_positions.size(); ++i) {
        const auto at = Eigen::Index(4 * i);
        x.row(at) = driver_positions[i].cast<double>().transpose();
        x.middleRows(at + 1, 3) = (is_sound(i) ? Mat3d(gradients[i].cast<double>()) : mean).transpose();
    }
    return x;
}

std::vector<Vec3f> PoseFit::Content::positions_of(const Unknowns& x) const {
    std::vector<Vec3f> positions(driver.size());
    for (std::size_t i = 0; i < positions.size(); ++i)
        positions[i] = x.row(Eigen::Index(4 * i)).transpose().cast<float>();
    return positions;
}

double PoseFit::Content::squared_residual(const Unknowns& x, const Unknowns& right, double squared) const {
    const Unknowns moved = normal * x;
    return squared - 2 * x.cwiseProduct(right).sum() + x.cwiseProduct(moved).sum();
}

/// The prior holds x back a little. Conjugate gradients on M^T M x = right, with the factor as preconditioner, take x
/// on from there as long as each round takes a twentieth of the residual: to the end where the animation is one of this
/// driver, four rounds on clean animations, none on noise.
void PoseFit::Content::refine(Unknowns& x, double residual, const Unknowns& right, double squared, double count) const {
    Unknowns left = right - normal * x, direction = factor.solve(left);
    double falls = left.cwiseProduct(direction).sum();
    for (int round = 0; round < kMostRounds && residual > kExact * kExact * count; ++round) {
        const Unknowns moved = normal * direction;
        const double curvature = direction.cwiseProduct(moved).sum();
        if (!(curvature > 0)) return;
        Unknowns next = x + falls / curvature * direction;
        const double of_it = squared_residual(next, right, squared);
        if (!(of_it < residual)) return;
        x = std::move(next);
        if (of_it > kStillFalls * kStillFalls * residual) return;
        residual = of_it;
        left -= falls / curvature * moved;
        const Unknowns scaled = factor.solve(left);
        const double again = left.cwiseProduct(scaled).sum();
        direction = scaled + again / falls * direction;
        falls = again;
    }
}

PoseFit::PoseFit(std::unique_ptr<Content> content) : content_(std::move(content)) {}
PoseFit::PoseFit(PoseFit&&) noexcept = default;
PoseFit& PoseFit::operator=(PoseFit&&) noexcept = default;
PoseFit::~PoseFit() = default;

Result<PoseFit> PoseFit::create(const Model& model, const PoseFitOptions& options, const RunContext& context) {
    auto content = std::make_unique<Content>(model, context);
    if (context.is_cancelled()) return cancelled_error();
    content->prepare(context);
    if (Status made = content->factorise(options, context); !made) return made.error();
    if (context.is_cancelled()) return cancelled_error();
    return PoseFit(std::move(content));
}

Result<Pose> PoseFit::fit(std::span<const Vec3f> positions, const RunContext& context) const {
    const Content& content = *content_;
    const std::size_t count = positions.size();
    Vec3d middle; // of the frame: a walk across the world costs no digits
    for (int k = 0; k < 3; ++k)
        middle[k] = parallel_sum(context, count, kPointGrain, [&](std::size_t v) { return double(positions[v][k]); }) /
                    double(std::max<std::size_t>(count, 1));
    double squared = 0;
    const Unknowns right = content.right_side(positions, middle, squared, context);
    if (context.is_cancelled()) return cancelled_error();

    std::vector<Vec3f> own; // the driver, where the animation has it
    for (const Index v : content.model->driver().vertices)
        own.push_back((content.scale * (positions[v].cast<double>() - middle)).cast<float>());
    const auto solved = [&](const Unknowns& drawn_to) -> Unknowns {
        return content.factor.solve(right + content.prior.asDiagonal() * drawn_to);
    };
    Unknowns x = solved(content.from_positions(own, context));
    double residual = content.squared_residual(x, right, squared);
    // Gradients estimated from the fitted positions are a smoother prior than those from the animation's own.
    Unknowns again = solved(content.from_positions(content.positions_of(x), context));
    if (const double of_it = content.squared_residual(again, right, squared); of_it <= residual) {
        x = std::move(again);
        residual = of_it;
    }
    if (content.refines) content.refine(x, residual, right, squared, double(count));
    if (context.is_cancelled()) return cancelled_error();

    Pose pose;
    for (std::size_t i = 0; i < content.driver.size(); ++i) {
        const auto at = Eigen::Index(4 * i);
        pose.positions.push_back((middle + x.row(at).transpose() / content.scale).cast<float>());
        pose.gradients.push_back(x.middleRows(at + 1, 3).transpose().cast<float>());
    }
    return pose;
}

} // namespace filigree
