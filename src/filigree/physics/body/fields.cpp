#include "filigree/physics/body/fields.h"

#include "filigree/core/parallel_for.h"
#include "filigree/core/parallel_sum.h"
#include "filigree/physics/body/occupied_cells.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr std::size_t kFieldGrain = 4096;
constexpr double kFieldSampling = 1.0 / 3; ///< spacings, at most, between samples of a triangle
constexpr double kMostAlongEdge = 512;     ///< samples

Error field_error(std::string sentence) { return {ErrorCode::usage, std::move(sentence)}; }

/// Calls visit(point, weights of the corners, share of the triangle's area) for the middles of the parts of a triangle
/// that is cut into n^2 alike ones.
template <class Visit>
void each_part(unsigned n, const Visit& visit) {
    const double share = 1.0 / (double(n) * n);
    for (unsigned i = 0; i < n; ++i)
        for (unsigned j = 0; i + j < n; ++j) {
            const auto at = [&](double third) {
                const double u = (i + third) / n, v = (j + third) / n;
                visit(Vec3d(1 - u - v, u, v), share);
            };
            at(1.0 / 3);
            if (i + j + 1 < n) at(2.0 / 3);
        }
}

/// What the surface says of each cell.
struct SurfaceMeans {
    std::vector<double> sum, area; ///< of each cell; area 0: the surface is elsewhere
};

SurfaceMeans surface_means(const Body& body, const Mesh& mesh, std::span<const Triangle> triangles,
                           std::span<const float> at_vertices) {
    const Cells& cells = body.cells;
    SurfaceMeans means{std::vector<double>(cells.cells.size()), std::vector<double>(cells.cells.size())};
    for (const Triangle& triangle : triangles) {
        std::array<Vec3d, 3> p; // spacings, from the lattice's origin
        for (int k = 0; k < 3; ++k)
            p[k] = (body.scale * mesh.positions[triangle[k]].cast<double>() - cells.origin) / cells.spacing;
        const double area = (p[1] - p[0]).cross(p[2] - p[0]).norm() / 2;
        if (!(area > 0)) continue;
        const double longest = std::max({(p[1] - p[0]).norm(), (p[2] - p[1]).norm(), (p[0] - p[2]).norm()});
        each_part(unsigned(std::clamp(std::ceil(longest / kFieldSampling), 1.0, kMostAlongEdge)),
                  [&](const Vec3d& weights, double share) {
                      const Index cell =
                          cells.find_cell(Vec3d(weights[0] * p[0] + weights[1] * p[1] + weights[2] * p[2]));
                      if (cell == kNoIndex) return;
                      double value = 0;
                      for (int k = 0; k < 3; ++k) value += weights[k] * double(at_vertices[triangle[k]]);
                      means.sum[cell] += share * area * value;
                      means.area[cell] += share * area;
                  });
    }
    return means;
}

/// The cells that share a face with each cell; kNoIndex: none there.
std::vector<std::array<Index, 6>> cells_beside(const Cells& cells, const RunContext& context) {
    std::vector<std::array<Index, 6>> beside(cells.cells.size());
    parallel_for(context, beside.size(), kFieldGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c)
            for (int side = 0; side < 6; ++side) {
                std::array<int, 3> at = {cells.cells[c][0], cells.cells[c][1], cells.cells[c][2]};
                at[side / 2] += side % 2 ? 1 : -1;
                const Index cell = cells.find_cell(at[0], at[1], at[2]);
                beside[c][side] = cell != kNoIndex && cells.are_joined(Index(c), cell) ? cell : kNoIndex;
            }
    });
    return beside;
}

/// Conjugate gradients for the graph's Laplacian; `values` are kept where `known`, and are the first guess elsewhere.
class HarmonicFill {
public:
    HarmonicFill(const Cells& cells, const std::vector<std::uint8_t>& known, const RunContext& context)
        : known_(known), beside_(cells_beside(cells, context)), context_(context) {}

    Status run(std::vector<double>& values) {
        constexpr double kConverged = 1e-6; // of the first residual
        const std::size_t count = values.size();
        std::vector<double> residual(count), way(count), image(count);
        apply(values, residual);
        each([&](std::size_t c) { way[c] = residual[c] = -residual[c]; });
        double squares = dot(residual, residual);
        const double enough = kConverged * kConverged * squares;
        for (std::size_t step = 0; step < count && squares > enough; ++step) {
            if (context_.is_cancelled()) return cancelled_error();
            apply(way, image);
            const double curvature = dot(way, image);
            if (!(curvature > 0)) break; // a part that no surface bounds
            const double length = squares / curvature;
            each([&](std::size_t c) {
                values[c] += length * way[c];
                residual[c] -= length * image[c];
            });
            const double before = std::exchange(squares, dot(residual, residual));
            each([&](std::size_t c) { way[c] = residual[c] + squares / before * way[c]; });
        }
        return Success{};
    }

private:
    template <class Visit>
    void each(const Visit& visit) const {
        parallel_for(context_, beside_.size(), kFieldGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t c = begin; c < end; ++c) visit(c);
        });
    }
    /// Of what is not known: each cell's value less its neighbours'. `values` of known cells count as neighbours.
    void apply(const std::vector<double>& values, std::vector<double>& result) const {
        each([&](std::size_t c) {
            double sum = 0;
            if (!known_[c])
                for (const Index other : beside_[c])
                    if (other != kNoIndex) sum += values[c] - values[other];
            result[c] = sum;
        });
    }
    double dot(const std::vector<double>& a, const std::vector<double>& b) const {
        return parallel_sum(context_, a.size(), kFieldGrain, [&](std::size_t c) { return a[c] * b[c]; });
    }

    const std::vector<std::uint8_t>& known_;
    const std::vector<std::array<Index, 6>> beside_;
    const RunContext& context_;
};

std::string wrong_field(const Body& body, FieldOf of) {
    const std::vector<float>& field = body.fields.of(of);
    if (field.empty()) return "";
    const std::string name(name_of(of));
    if (field.size() != body.cells.cells.size())
        return "The field of " + name + " has " + std::to_string(field.size()) + " values, and the body has " +
               std::to_string(body.cells.cells.size()) + " cells.";
    for (std::size_t c = 0; c < field.size(); ++c)
        if (!(field[c] >= BodyFields::kLeast && field[c] <= BodyFields::kMost))
            return "The field of " + name + " is " + mesh_cells::number(double(field[c])) + " in cell " +
                   std::to_string(c) + "; it multiplies the material's value, from " +
                   mesh_cells::number(double(BodyFields::kLeast)) + " to " +
                   mesh_cells::number(double(BodyFields::kMost)) + ".";
    return "";
}

} // namespace

std::string_view name_of(FieldOf field) {
    constexpr std::array<std::string_view, kFields.size()> kNames = {"stiffness", "density", "damping", "yield_stress",
                                                                     "strength"};
    return kNames[std::size_t(field)];
}

const std::vector<float>& BodyFields::of(FieldOf quantity) const {
    switch (quantity) {
    case FieldOf::stiffness:
        return stiffness;
    case FieldOf::density:
        return density;
    case FieldOf::damping:
        return damping;
    case FieldOf::yield_stress:
        return yield_stress;
    case FieldOf::strength:
        break;
    }
    return strength;
}
std::vector<float>& BodyFields::of(FieldOf quantity) {
    return const_cast<std::vector<float>&>(std::as_const(*this).of(quantity));
}

void set_masses(Body& body) {
    body.mass.resize(body.volume.size());
    for (std::size_t p = 0; p < body.mass.size(); ++p) body.mass[p] = float(body.material.density * body.volume[p]);
    if (body.fields.density.empty()) return;
    const std::vector<float> density = at_corners(body.cells, body.fields.density);
    for (std::size_t p = 0; p < body.mass.size(); ++p) body.mass[p] *= density[p];
}

std::vector<float> at_corners(const Cells& cells, std::span<const float> field) {
    std::vector<double> sum(cells.corners.size()), held(cells.corners.size());
    for (std::size_t c = 0; c < cells.cells.size(); ++c)
        for (const Index corner : cells.cell_corners[c]) {
            sum[corner] += double(cells.fraction[c]) * double(field[c]);
            held[corner] += double(cells.fraction[c]);
        }
    std::vector<float> means(sum.size());
    for (std::size_t corner = 0; corner < sum.size(); ++corner) means[corner] = float(sum[corner] / held[corner]);
    return means;
}

double mean_at(std::span<const float> values, std::span<const float> weights) {
    double sum = 0, all = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
        sum += double(weights[i]) * double(values[i]);
        all += double(weights[i]);
    }
    return sum / all;
}

BodyFields part_of(const BodyFields& whole, std::span<const Index> cells) {
    BodyFields part;
    for (const FieldOf of : kFields)
        if (const std::vector<float>& from = whole.of(of); !from.empty())
            for (const Index cell : cells) part.of(of).push_back(from[cell]);
    return part;
}

Result<std::vector<float>> spread_inwards(const Body& body, const Mesh& mesh, std::span<const float> at_vertices,
                                          const RunContext& context) {
    if (std::optional<Error> wrong = mesh_error(mesh)) return *wrong;
    if (at_vertices.size() != mesh.vertex_count())
        return field_error("There are " + std::to_string(at_vertices.size()) + " values, and the mesh has " +
                           std::to_string(mesh.vertex_count()) + " vertices; give one value a vertex.");
    for (std::size_t v = 0; v < at_vertices.size(); ++v)
        if (!std::isfinite(at_vertices[v]))
            return field_error("The value of vertex " + std::to_string(v) + " is not finite.");
    const Result<Triangulation> triangulation = triangulate(mesh, context);
    if (!triangulation) return triangulation.error();
    const SurfaceMeans means = surface_means(body, mesh, triangulation->triangles, at_vertices);
    const std::size_t count = body.cells.cells.size();
    std::vector<std::uint8_t> known(count);
    double sum = 0, area = 0, least = 0, most = 0;
    for (std::size_t c = 0; c < count; ++c) {
        if (!(means.area[c] > 0)) continue;
        known[c] = 1;
        const double mean = means.sum[c] / means.area[c];
        least = area > 0 ? std::min(least, mean) : mean;
        most = area > 0 ? std::max(most, mean) : mean;
        sum += means.sum[c];
        area += means.area[c];
    }
    if (!(area > 0))
        return Error{ErrorCode::unsuitable, "The surface of the mesh meets no cell of the body, so its values cannot "
                                            "be carried inwards; give the mesh that the body was made of."};
    std::vector<double> values(count, sum / area);
    for (std::size_t c = 0; c < count; ++c)
        if (known[c]) values[c] = means.sum[c] / means.area[c];
    if (Status filled = HarmonicFill(body.cells, known, context).run(values); !filled) return filled.error();
    std::vector<float> field(count);
    for (std::size_t c = 0; c < count; ++c) field[c] = float(std::clamp(values[c], least, most));
    return field;
}

Status set_fields(Body& body, BodyFields fields) {
    const MaterialModel model = body.material.model;
    if (!fields.empty() && model != MaterialModel::fem && model != MaterialModel::rigid)
        return field_error(
            "Only bodies of the models fem and rigid have fields; what varies needs cells that keep their "
            "shape.");
    std::swap(body.fields, fields);
    for (const FieldOf of : kFields)
        if (std::string wrong = wrong_field(body, of); !wrong.empty()) {
            std::swap(body.fields, fields);
            return field_error(std::move(wrong));
        }
    if (!body.fields.density.empty() || !fields.density.empty()) set_masses(body);
    return Success{};
}

std::string fields_warning(const Body& body) {
    const std::vector<float>& stiffness = body.fields.stiffness;
    if (stiffness.empty() || body.material.model == MaterialModel::rigid) return "";
    const auto [least, most] = std::ranges::minmax(stiffness);
    const float usual = BodyFields::kMostUsual;
    if (least >= 1 / usual && most <= usual) return "";
    const auto said = [](float value) { return mesh_cells::number(double(value)); };
    return "The stiffness varies from " + said(least) + " to " + said(most) + " times the material's; beyond " +
           said(1 / usual) + " to " + said(usual) +
           " the stiffest cells take many substeps and the softest ones are crushed. Pin hard parts, or change "
           "young_modulus.";
}

Status add_vertex_fields(Body& body, const Mesh& mesh, std::span<const VertexField> fields, const RunContext& context) {
    if (fields.empty()) return Success{};
    BodyFields spread;
    for (const VertexField& field : fields) {
        if (!spread.of(field.of).empty())
            return field_error("There are two fields of " + std::string(name_of(field.of)) + "; give one.");
        Result<std::vector<float>> inside = spread_inwards(body, mesh, field.values, context);
        if (!inside) return inside.error();
        spread.of(field.of) = std::move(*inside);
    }
    return set_fields(body, std::move(spread));
}

} // namespace filigree
