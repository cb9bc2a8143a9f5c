#include "filigree/physics/contact/matter.h"

#include "filigree/physics/body/embedding.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace filigree {

namespace {

constexpr float kLeastVolume = 1e-3f;             ///< of a cell at rest: flatter ones have no inside
constexpr float kMostDepthStretch = 3;            ///< of depth, and 1 over it: more is the noise of a crushed cell
constexpr float kConverged = 1e-3f, kFar = 0.5f;  ///< cells
constexpr int kNewtonSteps = 4, kLongestWalk = 6; ///< that a walk may go
constexpr int kNewtonStepsInCell = 8;
constexpr float kTurned = -0.2f; ///< cosine between the entry and a normal that is not its side's
constexpr int kTraceSteps = 12;

/// Position in a cell and its derivative by local coordinates.
struct CellMap {
    Vec3f point;
    Mat3f slope;
};

CellMap map_cell(const Vectors& x, const std::array<Index, 8>& corners, const Vec3f& t) {
    std::array<Vec3f, 8> p;
    for (int c = 0; c < 8; ++c) p[c] = x[corners[c]];
    const Vec3f d00 = p[1] - p[0], d10 = p[3] - p[2], d01 = p[5] - p[4], d11 = p[7] - p[6]; // along x
    const Vec3f a00 = p[0] + t[0] * d00, a10 = p[2] + t[0] * d10, a01 = p[4] + t[0] * d01, a11 = p[6] + t[0] * d11;
    const Vec3f b0 = a00 + t[1] * (a10 - a00), b1 = a01 + t[1] * (a11 - a01);
    CellMap map;
    map.point = b0 + t[2] * (b1 - b0);
    map.slope.col(0) = (1 - t[2]) * (d00 + t[1] * (d10 - d00)) + t[2] * (d01 + t[1] * (d11 - d01));
    map.slope.col(1) = a10 - a00 + t[2] * (a11 - a01 - a10 + a00);
    map.slope.col(2) = b1 - b0;
    return map;
}

} // namespace

Matter::Matter(const Body& body) : body_(body), is_rigid_(body.material.model == MaterialModel::rigid) {
    const Cells& cells = body.cells;
    for (const auto& cell : cells.cells)
        for (int axis = 0; axis < 3; ++axis) counts_[axis] = std::max(counts_[axis], int(cell[axis]) + 1);
    grid_.assign(std::size_t(counts_[0]) * counts_[1] * counts_[2], kNoIndex);
    for (Index c = 0; c < cells.cells.size(); ++c) {
        const auto& at = cells.cells[c];
        grid_[(std::size_t(at[2]) * counts_[1] + at[1]) * counts_[0] + at[0]] = c;
    }
    if (is_rigid_) find_rigid_box();
    find_together();
    find_cells_of_points();
}

/// Cells, and surface points of parts that have none; a sheet is matter as far as its field's radius from it.
void Matter::find_rigid_box() {
    const Cells& cells = body_.cells;
    const auto& first = cells.cells[0];
    Box box;
    for (const auto& cell : cells.cells)
        for (const int more : {0, 1}) box.extend(Vec3d(cell[0] + more, cell[1] + more, cell[2] + more));
    for (const Vec3f& point : body_.surface.points.rest)
        box.extend((point.cast<double>() - cells.origin) / cells.spacing);
    const Vec3d from(first[0], first[1], first[2]);
    const double around = double(body_.field_radius) / cells.spacing;
    rigid_low_ = (box.min - from).cast<float>().array() - float(around);
    rigid_high_ = (box.max - from).cast<float>().array() + float(around);
}

Index Matter::cell_at(int i, int j, int k) const {
    if (i < 0 || j < 0 || k < 0 || i >= counts_[0] || j >= counts_[1] || k >= counts_[2]) return kNoIndex;
    return grid_[(std::size_t(k) * counts_[1] + j) * counts_[0] + i];
}

void Matter::find_together() {
    const Cells& cells = body_.cells;
    together_.resize(cells.cells.size());
    for (Index c = 0; c < cells.cells.size(); ++c) {
        const auto& at = cells.cells[c];
        std::array<bool, 125> exists, reached = {};
        for (int n = 0; n < 125; ++n)
            exists[n] = cell_at(at[0] + n % 5 - 2, at[1] + n / 5 % 5 - 2, at[2] + n / 25 - 2) != kNoIndex;
        const auto spread = [&](int n) { // to all neighbours
            const int i = n % 5, j = n / 5 % 5, k = n / 25;
            if (cells.is_parted()) return spread_joined(c, n, exists, reached);
            for (int z = std::max(0, k - 1); z <= std::min(4, k + 1); ++z)
                for (int y = std::max(0, j - 1); y <= std::min(4, j + 1); ++y)
                    for (int x = std::max(0, i - 1); x <= std::min(4, i + 1); ++x)
                        reached[x + 5 * y + 25 * z] |= exists[x + 5 * y + 25 * z];
        };
        spread(62);
        const std::array<bool, 125> near = reached;
        for (int n = 0; n < 125; ++n)
            if (near[n]) spread(n);
        for (int n = 0; n < 125; ++n)
            if (reached[n]) together_[c][n / 64] |= std::uint64_t(1) << (n % 64);
    }
}

/// find_together's `spread` where neighbours may be of different parts.
void Matter::spread_joined(Index middle, int n, const std::array<bool, 125>& exists,
                           std::array<bool, 125>& reached) const {
    const auto& at = body_.cells.cells[middle];
    const auto cell = [&](int m) { return cell_at(at[0] + m % 5 - 2, at[1] + m / 5 % 5 - 2, at[2] + m / 25 - 2); };
    for (int m = 0; m < 125; ++m) {
        const bool is_beside =
            std::abs(n % 5 - m % 5) <= 1 && std::abs(n / 5 % 5 - m / 5 % 5) <= 1 && std::abs(n / 25 - m / 25) <= 1;
        if (exists[m] && is_beside && body_.cells.are_joined(cell(n), cell(m))) reached[m] = true;
    }
}

void Matter::find_cells_of_points() {
    const Cells& cells = body_.cells;
    const std::vector<Vec3f>& points = body_.surface.points.rest;
    cell_of_point_.assign(points.size(), kNoIndex);
    is_loose_.assign(points.size(), 0);
    for (std::size_t s = 0; s < points.size(); ++s) {
        const Vec3d at = (points[s].cast<double>() - cells.origin) / cells.spacing;
        const Vec3d low = at.array().floor();
        double least = std::numeric_limits<double>::infinity();
        for (int n = 0; n < 27; ++n) {
            const Vec3d index = low + Vec3d(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
            const Index cell = cell_at(int(index[0]), int(index[1]), int(index[2]));
            const double away = (at - index - Vec3d::Constant(0.5)).cwiseAbs().maxCoeff();
            if (cell == kNoIndex || away >= least) continue;
            least = away;
            cell_of_point_[s] = cell;
        }
        if (cell_of_point_[s] != kNoIndex) {
            if (cells.is_parted()) cell_of_point_[s] = nearest_cell(cells, at);
            continue;
        }
        is_loose_[s] = 1;
        cell_of_point_[s] = carrying_cell(s);
    }
}

/// By the particles that the point is embedded in: the corners of a cell, or of meshfree bodies in cells around.
Index Matter::carrying_cell(std::size_t surface_point) const {
    const Embedding& points = body_.surface.points;
    const Index first = points.offsets[surface_point], last = points.offsets[surface_point + 1];
    if (first == last) return 0;
    const Cells& cells = body_.cells;
    const Index particle = points.particles[first];
    std::array<int, 3> at;
    if (body_.rest.size() == cells.corners.size() && last - first == 8) {
        for (int axis = 0; axis < 3; ++axis) at[axis] = int(cells.corners[particle][axis]);
    } else {
        const Vec3d rest = (body_.rest[particle].cast<double>() - cells.origin) / cells.spacing;
        for (int axis = 0; axis < 3; ++axis) at[axis] = int(std::floor(rest[axis]));
    }
    const Index cell = cell_at(at[0], at[1], at[2]);
    return cell == kNoIndex ? 0 : cell;
}

bool Matter::are_together(Index a, Index b) const {
    const auto &from = body_.cells.cells[a], &to = body_.cells.cells[b];
    const int i = int(to[0]) - from[0] + 2, j = int(to[1]) - from[1] + 2, k = int(to[2]) - from[2] + 2;
    if (std::min({i, j, k}) < 0 || std::max({i, j, k}) > 4) return false;
    const int n = i + 5 * j + 25 * k;
    return together_[a][n / 64] >> (n % 64) & 1;
}

bool Matter::are_in_three_steps(Index a, Index b) const {
    if (are_together(a, b)) return true;
    const auto &from = body_.cells.cells[a], &to = body_.cells.cells[b];
    int apart = 0;
    for (int axis = 0; axis < 3; ++axis) apart = std::max(apart, std::abs(int(from[axis]) - int(to[axis])));
    if (apart != 3) return false;
    for (int n = 0; n < 27; ++n) {
        const Index between = cell_at(to[0] + n % 3 - 1, to[1] + n / 3 % 3 - 1, to[2] + n / 9 - 1);
        if (between != kNoIndex && are_together(a, between) && body_.cells.are_joined(between, b)) return true;
    }
    return false;
}

Matter::Weights Matter::weights(const Place& place) const {
    const Vec3f& t = place.local;
    if (is_rigid()) return {1 - t.sum(), t[0], t[1], 0, t[2], 0, 0, 0};
    Weights w;
    for (int c = 0; c < 8; ++c)
        w[c] = (c & 1 ? t[0] : 1 - t[0]) * (c & 2 ? t[1] : 1 - t[1]) * (c & 4 ? t[2] : 1 - t[2]);
    return w;
}

Vec3f Matter::mean(const Place& place, const Vectors& values) const {
    const std::array<Index, 8>& corner = corners(place.cell);
    const Vec3f& t = place.local;
    if (is_rigid())
        return (1 - t.sum()) * values[corner[0]] + t[0] * values[corner[1]] + t[1] * values[corner[2]] +
               t[2] * values[corner[4]];
    const Weights w = weights(place);
    Vec3f sum = Vec3f::Zero();
    for (int c = 0; c < 8; ++c) sum += w[c] * values[corner[c]];
    return sum;
}

void Matter::add(const Place& place, const Vec3f& value, Vectors& values) const {
    const std::array<Index, 8>& corner = corners(place.cell);
    const Weights w = weights(place);
    for (int c = 0; c < 8; ++c)
        if (w[c] != 0) values.add(corner[c], w[c] * value);
}

/// The cell beyond the side that `local` is furthest outside of and that has a neighbour; local coordinates become that
/// cell's.
std::optional<Index> Matter::neighbour(Index cell, Vec3f& local) const {
    const auto& at = body_.cells.cells[cell];
    std::array<int, 3> order = {0, 1, 2};
    const auto outside = [&](int axis) { return std::max(-local[axis], local[axis] - 1); };
    std::ranges::stable_sort(order, std::greater{}, outside);
    for (const int axis : order) {
        if (!(outside(axis) > 0)) break;
        std::array<int, 3> next = {at[0], at[1], at[2]};
        const int side = local[axis] < 0 ? -1 : 1;
        next[axis] += side;
        if (const Index found = cell_at(next[0], next[1], next[2]);
            found != kNoIndex && body_.cells.are_joined(cell, found)) {
            local[axis] -= float(side);
            return found;
        }
    }
    return std::nullopt;
}

/// One step of Newton's method in place.cell. False where the cell is inverted or flat.
bool Matter::newton_step(const Vectors& positions, const Vec3f& point, Place& place, Mat3f& inverse,
                         bool& converged) const {
    const auto spacing = float(body_.spacing());
    const float least = kLeastVolume * spacing * spacing * spacing;
    const Vec3f from = place.local.cwiseMax(-kFar).cwiseMin(1 + kFar);
    const CellMap map = map_cell(positions, corners(place.cell), from);
    if (!(map.slope.determinant() > least)) return false;
    inverse = map.slope.inverse();
    const Vec3f next = from + inverse * (point - map.point);
    converged = (next - place.local).cwiseAbs().maxCoeff() < kConverged;
    place.local = next;
    return true;
}

bool Matter::locate(const Vectors& positions, const Vec3f& point, Place& place, Mat3f& inverse) const {
    if (is_rigid()) {
        place.cell = 0;
        place.local.setZero();
        inverse = inverse_derivative(positions, place);
        place.local = inverse * (point - positions[corners(0)[0]]);
        return place.local.allFinite();
    }
    for (int walked = 0; walked < kLongestWalk; ++walked) {
        bool converged = false;
        for (int step = 0; step < kNewtonSteps && !converged; ++step) {
            if (!newton_step(positions, point, place, inverse, converged)) return false;
            if (!(place.local.cwiseAbs().maxCoeff() < 4)) break; // the cells on the way come closer
        }
        const std::optional<Index> next = neighbour(place.cell, place.local);
        if (!next) return converged && place.local.allFinite();
        place.cell = *next;
    }
    return false;
}

bool Matter::locate_in_cell(const Vectors& positions, const Vec3f& point, Place& place, float around) const {
    place.local.setConstant(0.5f);
    Mat3f inverse;
    bool converged = false;
    for (int step = 0; step < kNewtonStepsInCell && !converged; ++step)
        if (!newton_step(positions, point, place, inverse, converged)) return false;
    return converged && place.local.minCoeff() >= -around && place.local.maxCoeff() <= 1 + around;
}

Matter::Linear Matter::linear(const Vectors& positions, Index cell) const {
    const CellMap map = map_cell(positions, corners(cell), Vec3f::Constant(0.5f));
    return {map.point, map.slope.inverse()};
}

Mat3f Matter::inverse_derivative(const Vectors& positions, const Place& place) const {
    if (is_rigid()) { // the derivative is the spacing times a rotation
        const std::array<Index, 8>& corner = corners(0);
        const Vec3f first = positions[corner[0]];
        Mat3f inverse;
        for (int axis = 0; axis < 3; ++axis) inverse.row(axis) = (positions[corner[1 << axis]] - first).transpose();
        return inverse / float(body_.spacing() * body_.spacing());
    }
    return map_cell(positions, corners(place.cell), place.local).slope.inverse();
}

float Matter::volume_ratio(const Vectors& positions, Index cell) const {
    const auto spacing = float(body_.spacing());
    return map_cell(positions, corners(cell), Vec3f::Constant(0.5f)).slope.determinant() /
           (spacing * spacing * spacing);
}

Vec3f Matter::rest_position(const Place& place) const {
    const auto& at = body_.cells.cells[place.cell];
    const Vec3d lattice = Vec3d(at[0], at[1], at[2]) + place.local.cast<double>();
    return (body_.cells.origin + body_.spacing() * lattice).cast<float>();
}

std::optional<Matter::Depth> Matter::depth(const Place& place, const Mat3f& inverse, const Vec3f& entry) const {
    const Vec3f rest = rest_position(place);
    if (body_.cells.is_parted()) { // what is there at rest may be of another part, which the field does not tell
        const auto& at = body_.cells.cells[place.cell];
        const Index there = body_.cells.find_cell(Vec3d(Vec3d(at[0], at[1], at[2]) + place.local.cast<double>()));
        if (there != kNoIndex && there != place.cell && !body_.cells.are_joined(place.cell, there)) return std::nullopt;
    }
    DistanceField::Sample surface = body_.field->at(rest);
    surface.distance -= body_.field_radius;
    if (surface.distance < 0 && surface.normal.dot(entry) < kTurned) {
        float way = 0;
        for (int step = 0; step < kTraceSteps; ++step) {
            const float left = -(body_.field->at(rest + way * entry).distance - body_.field_radius);
            if (!(left > 1e-3f * float(body_.spacing()))) break;
            way += left;
        }
        surface = {-way, entry};
    }
    const Vec3f slope = inverse.transpose() * surface.normal * float(body_.spacing()); // F^-T n: of the distance
    const float length = slope.norm();
    if (!(length > 1e-6f) || !std::isfinite(length)) return std::nullopt;
    return Depth{-surface.distance / std::clamp(length, 1 / kMostDepthStretch, kMostDepthStretch), slope / length,
                 surface.normal};
}

} // namespace filigree
