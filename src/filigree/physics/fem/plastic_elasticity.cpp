// The fem material that yields: whole cells as in cell_lanes.h, one after the other, each with the shape in which it
// is at rest. With D the inverse of a cell's plastic gradient and b its bending at rest, the energy is that of
//     Xe = [X_1 X_2 X_4] D  and  Xe_k = X_k - [X_1 X_2 X_4] b_k,  k = 3, 5, 6, 7,
// so volume is as elastic as before, and turning a cell costs nothing. Once a substep strain beyond the yield stress
// goes over into D and b [Simo 1992].
#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/core/parallel_sum.h"
#include "filigree/physics/body.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/fem/cell_kernel.h"
#include "filigree/physics/fem/plastic_cells.h"
#include "filigree/physics/step/byte_stream.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace filigree {

namespace {

constexpr std::size_t kPlasticGrain = 256;

/// What the energy of a cell depends on, by its elastic sums.
struct ElasticShape {
    CellSums X;
    Mat3f cofactors; ///< of (X_1, X_2, X_4)
    float linear, bent, J;
    ElasticShape(const CellSums& sums, float size) : X(sums) {
        cofactors << X[2].cross(X[4]), X[4].cross(X[1]), X[1].cross(X[2]);
        linear = bent = 0;
        for (const int m : kLinearSums) linear += X[m].squaredNorm();
        for (const int m : kBentSums) bent += kSumShares[m] * X[m].squaredNorm();
        linear /= size * size;
        bent /= size * size;
        J = X[1].dot(cofactors.col(0)) / (size * size * size);
    }
};

/// Largest eigenvalue of a 3x3 matrix with real ones from the sums of them and of their squares; not below it.
float largest_eigenvalue(float trace, float squares) {
    return trace / 3 + std::sqrt(std::max((2.0f / 3) * (squares - trace * trace / 3), 0.0f));
}

/// cell_kernel's crush, and the first derivative of the volume's energy density over `bulk`.
float crush_of(float J) { return std::clamp(cell_kernel::kCrushFrom - J, 0.0f, cell_kernel::kCrushFrom); }
float pressure_of(const cell_kernel::CellMaterial& m, float J, float hard) {
    const float crush = crush_of(J);
    return J - m.rest_ratio - hard * crush * crush;
}

float over_bent(float I_bent) { return std::clamp(I_bent - cell_kernel::kBentFrom, 0.0f, cell_kernel::kBentMost); }

/// A bound on the second derivative of the energy density over `bulk`: cell_kernel's in the elastic sums, brought back
/// through what the cell keeps. Bending at rest couples sums of equal shear stiffness.
float stiffness_of(const cell_kernel::CellMaterial& m, const PlasticCell& cell, const ElasticShape& shape, float size,
                   float hard) {
    const float I = shape.linear + shape.bent, ratio = m.shear / m.bulk;
    constexpr float kSoon = cell_kernel::kCrushSoon;
    const float e = 1 + 2 * hard * (shape.J < -kSoon ? 0 : crush_of(shape.J - kSoon)),
                q = pressure_of(m, shape.J, hard);
    const float c2 = e * shape.cofactors.squaredNorm() / (size * size * size * size);
    const float a = 2 * ratio / ((I + 1) * (I + 1));
    const float trace = a * shape.linear + c2;
    const float squares = a * shape.linear * a * shape.linear + c2 * c2 + 2 * q * q * shape.linear +
                          a * shape.J * (18 * e * shape.J + 12 * q) + 4 * e * q * shape.J * shape.linear;
    const float along = largest_eigenvalue(trace, squares);
    const float across = std::abs(q) * std::sqrt(shape.linear);
    const float over = over_bent(shape.bent);
    const float bent =
        ratio * cell_kernel::kBentStiffness * over * (2 * over / 3 + 16 * (cell_kernel::kBentFrom + over) / 9) +
        2 * a * shape.bent / 3;
    const float both = a * (0.05f * shape.linear + 3.4f * shape.bent);
    const float shear = ratio * I / (I + 1);
    const Mat3f metric = cell.inverse * cell.inverse.transpose();
    float at_rest = 0;
    for (const Vec3f& b : cell.bent) at_rest += b.squaredNorm();
    return (shear + std::max({along, across, bent}) + both) * largest_eigenvalue(metric.trace(), metric.squaredNorm()) +
           (shear + bent + both) * (at_rest + std::sqrt(at_rest));
}

class PlasticElasticity final : public Elasticity {
public:
    explicit PlasticElasticity(const Body& body)
        : body_(body), material_(cell_kernel::cell_material(body.material, body.spacing())),
          size_(4 * float(body.spacing())), plastic_(body.cells.cells.size()), pushes_(plastic_.size()) {
        const Cells& cells = body_.cells;
        cells_at_.resize(cells.corners.size());
        for (auto& around : cells_at_) around.fill(kNoIndex);
        for (Index cell = 0; cell < cells.cells.size(); ++cell)
            for (int corner = 0; corner < 8; ++corner) cells_at_[cells.cell_corners[cell][corner]][corner] = cell;
    }

    ElasticReport forces(const Vectors& positions, Vectors& forces, const RunContext& context) override {
        std::vector<ElasticReport> found((plastic_.size() + kPlasticGrain - 1) / kPlasticGrain);
        parallel_for(context, plastic_.size(), kPlasticGrain, [&](std::size_t begin, std::size_t end) {
            ElasticReport report{0, std::numeric_limits<float>::infinity(), 0};
            for (std::size_t cell = begin; cell < end; ++cell) push(cell, positions, report);
            found[begin / kPlasticGrain] = report;
        });
        parallel_for(context, cells_at_.size(), kPlasticGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t corner = begin; corner < end; ++corner) {
                Vec3f sum = Vec3f::Zero();
                for (int side = 0; side < 8; ++side)
                    if (const Index cell = cells_at_[corner][side]; cell != kNoIndex) sum += pushes_[cell][side];
                forces.set(corner, sum);
            }
        });
        ElasticReport all{0, std::numeric_limits<float>::infinity(), 0};
        for (const ElasticReport& report : found) take_worse(all, report);
        return all;
    }

    double energy(const Vectors& positions, const RunContext& context) const override {
        return parallel_sum(context, plastic_.size(), kPlasticGrain,
                            [&](std::size_t cell) { return energy_of(cell, positions); });
    }

    void gradients(const Vectors& positions, std::span<Mat3f> gradients, const RunContext& context) const override {
        corner_gradients(body_.cells, positions, gradients, context);
    }

    void finish_substep(const Vectors& positions, float dt, const RunContext& context) override {
        const FlowLaw law = yield_law(body_.material, dt);
        const std::vector<float>& stress = body_.fields.yield_stress;
        parallel_for(context, plastic_.size(), kPlasticGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t cell = begin; cell < end; ++cell) {
                FlowLaw own = law;
                if (!stress.empty()) own.yield_strain *= stress[cell];
                if (!body_.fields.stiffness.empty()) own.yield_strain /= body_.fields.stiffness[cell];
                yield(plastic_[cell], cell_sums(positions, body_.cells.cell_corners[cell]), size_, own);
            }
        });
    }

    std::size_t flowed_out() const override {
        return std::size_t(
            std::ranges::count_if(plastic_, [](const PlasticCell& cell) { return has_flowed_out(cell.inverse); }));
    }

    std::span<const PlasticCell> plastic_cells() const override { return plastic_; }
    void take_over(std::span<const PlasticCell> of_whole, std::span<const Index> cells) override {
        for (std::size_t cell = 0; cell < cells.size(); ++cell) plastic_[cell] = of_whole[cells[cell]];
    }

    std::string state() const override {
        ByteWriter writer;
        writer.array(std::span(plastic_));
        return writer.take();
    }
    bool restore_state(std::string_view bytes) override {
        ByteReader reader(bytes);
        std::vector<PlasticCell> plastic = reader.array<PlasticCell>();
        if (!reader.ok() || !reader.at_end() || plastic.size() != plastic_.size()) return false;
        if (!std::ranges::all_of(plastic, &PlasticCell::is_sound)) return false;
        plastic_ = std::move(plastic);
        return true;
    }

private:
    /// NaN is the worst.
    static void take_worse(ElasticReport& all, const ElasticReport& report) {
        all.squared_frequency =
            report.squared_frequency <= all.squared_frequency ? all.squared_frequency : report.squared_frequency;
        all.least_volume_ratio =
            report.least_volume_ratio >= all.least_volume_ratio ? all.least_volume_ratio : report.least_volume_ratio;
        all.most_stretch = report.most_stretch <= all.most_stretch ? all.most_stretch : report.most_stretch;
    }

    ElasticShape shape_of(std::size_t cell, const Vectors& positions) const {
        return {plastic_[cell].elastic(cell_sums(positions, body_.cells.cell_corners[cell])), size_};
    }

    /// What a cell pushes its corners with.
    void push(std::size_t cell, const Vectors& positions, ElasticReport& report) {
        const ElasticShape shape = shape_of(cell, positions);
        const PlasticCell& plastic = plastic_[cell];
        const float I = shape.linear + shape.bent, h = material_.spacing;
        const BodyFields& fields = body_.fields;
        const float stiffness = fields.stiffness.empty() ? 1 : fields.stiffness[cell];
        const float volume = body_.cells.fraction[cell] * stiffness * h * h * h;
        const float hard = cell_kernel::crush_stiffness(material_, body_.cells.fraction[cell]);
        const float by_sums = volume * material_.shear * I / (I + 1) / (size_ * size_);
        const float by_volume =
            volume * material_.bulk * pressure_of(material_, shape.J, hard) / (size_ * size_ * size_);
        const float over = over_bent(shape.bent);
        const float by_bent =
            by_sums + volume * material_.shear * cell_kernel::kBentStiffness * over * over / (size_ * size_);
        CellSums P; // derivatives of the energy by the sums
        P[0] = Vec3f::Zero();
        Mat3f linear;
        for (int a = 0; a < 3; ++a)
            linear.col(a) = by_sums * shape.X[kLinearSums[a]] + by_volume * shape.cofactors.col(a);
        linear *= plastic.inverse.transpose();
        for (int b = 0; b < 4; ++b) {
            P[kBentSums[b]] = by_bent * kSumShares[kBentSums[b]] * shape.X[kBentSums[b]];
            linear -= P[kBentSums[b]] * plastic.bent[b].transpose();
        }
        for (int a = 0; a < 3; ++a) P[kLinearSums[a]] = linear.col(a);
        for (unsigned bit = 1; bit < 8; bit *= 2) // the transform's transpose
            for (unsigned i = 0; i < 8; ++i)
                if (!(i & bit)) {
                    const Vec3f even = P[i], odd = P[i | bit];
                    P[i] = even - odd;
                    P[i | bit] = even + odd;
                }
        for (int corner = 0; corner < 8; ++corner) pushes_[cell][corner] = -P[corner];
        const float density = material_.density * (fields.density.empty() ? 1 : fields.density[cell]);
        const float rate = 1.0001f * 4 * stiffness * material_.bulk / (density * h * h);
        const float frequency = rate * stiffness_of(material_, plastic, shape, size_, hard);
        take_worse(report, {frequency <= 3e38f ? frequency : std::numeric_limits<float>::infinity(), shape.J,
                            std::sqrt(I / 3)});
    }

    double energy_of(std::size_t cell, const Vectors& positions) const {
        const CellSums X = plastic_[cell].elastic(cell_sums(positions, body_.cells.cell_corners[cell]));
        const double size = double(size_), h = double(material_.spacing), g = double(material_.rest_ratio);
        const auto square = [&](int m) {
            return double(kSumShares[m]) * X[m].cast<double>().squaredNorm() / (size * size);
        };
        double I = 0, bent = 0;
        for (int m = 1; m < 8; ++m) I += square(m);
        for (const int m : kBentSums) bent += square(m);
        const double J = X[1].cast<double>().dot(X[2].cast<double>().cross(X[4].cast<double>())) / (size * size * size);
        const std::vector<float>& stiffness = body_.fields.stiffness;
        return (stiffness.empty() ? 1.0 : double(stiffness[cell])) * double(body_.cells.fraction[cell]) * h * h * h *
               (double(material_.shear) *
                    (0.5 * ((I - 3) - math::log1p((I - 3) / 4)) + cell_kernel::bent_energy(bent)) +
                double(material_.bulk) * (0.5 * (J - 1) * (J + 1 - 2 * g) +
                                          cell_kernel::crush_energy(material_, J, body_.cells.fraction[cell])));
    }

    const Body& body_;
    const cell_kernel::CellMaterial material_;
    const float size_;                           ///< m: 4 h
    std::vector<std::array<Index, 8>> cells_at_; ///< of each corner, the cell in which it is the n-th
    std::vector<PlasticCell> plastic_;           ///< state
    std::vector<std::array<Vec3f, 8>> pushes_;   ///< scratch: N, of each cell on its corners
};

} // namespace

std::unique_ptr<Elasticity> make_plastic_elasticity(const Body& body, const RunContext&) {
    return std::make_unique<PlasticElasticity>(body);
}

} // namespace filigree
