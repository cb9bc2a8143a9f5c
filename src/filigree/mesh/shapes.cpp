// Based on:
//   the report, eq. 2.1 (the wavy cube)
//   [Shirley 1997] (the cylinder's caps; we use their map for the whole cross-section)
#include "filigree/mesh.h"

#include "filigree/core/math.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace filigree {
namespace {

constexpr unsigned kMaxResolution = 8192;
constexpr unsigned kMinTorusResolution = 3; // two quads around a tube would share both their edges
constexpr double kMaxCorners = 4294967295.0;

/// sin(2 pi t). Reduced exactly first, so that half turns give 0 and mirrored arguments give the same bits.
double sin_turns(double t) {
    double r = t - std::nearbyint(t);
    if (std::abs(r) > 0.25) r = std::copysign(0.5, r) - r;
    return math::sin(2 * std::numbers::pi * r);
}
double cos_turns(double t) {
    const double r = std::abs(t - std::nearbyint(t)); // the cosine is even
    if (r > 0.125 && r < 0.375) return sin_turns(0.25 - r);
    return r > 0.25 ? -math::cos(2 * std::numbers::pi * (0.5 - r)) : math::cos(2 * std::numbers::pi * r);
}

/// Where lattice line i of n lies in -1 to 1; mirrored lines have opposite bits.
double centred(std::size_t i, std::size_t n) { return (2 * double(i) - double(n)) / double(n); }

using Lattice = std::array<std::size_t, 3>; ///< a point of a box's lattice, or its counts of quads

/// The surface of a box of counts[0] x counts[1] x counts[2] cells, as quads whose vertices are the lattice points on
/// it. Points are numbered slice by slice along x: a full slice at either end, rings around between them.
class BoxSurface {
public:
    explicit BoxSurface(const Lattice& counts)
        : counts_(counts), cap_((counts[1] + 1) * (counts[2] + 1)), ring_(2 * (counts[1] + counts[2])) {}

    std::size_t vertex_count() const { return 2 * cap_ + (counts_[0] - 1) * ring_; }
    std::size_t face_count() const { return counts_[0] * ring_ + 2 * counts_[1] * counts_[2]; }

    Index vertex(const Lattice& p) const {
        const auto [nx, ny, nz] = counts_;
        const auto [x, y, z] = p;
        if (x == 0) return static_cast<Index>(z * (ny + 1) + y);
        if (x == nx) return static_cast<Index>(cap_ + (nx - 1) * ring_ + z * (ny + 1) + y);
        std::size_t around = 0;
        if (z == 0)
            around = y;
        else if (y == ny)
            around = ny + z;
        else if (z == nz)
            around = ny + nz + (ny - y);
        else
            around = 2 * ny + nz + (nz - z);
        return static_cast<Index>(cap_ + (x - 1) * ring_ + around);
    }

    /// The mesh, with place(lattice point) as positions.
    template <class Place>
    Mesh mesh(const Place& place) const {
        Mesh mesh;
        mesh.positions.resize(vertex_count());
        mesh.face_offsets.reserve(face_count() + 1);
        mesh.corners.reserve(4 * face_count());
        for (std::size_t axis = 0; axis < 3; ++axis) {
            add_side(mesh, axis, false, place);
            add_side(mesh, axis, true, place);
        }
        return mesh;
    }

private:
    template <class Place>
    void add_side(Mesh& mesh, std::size_t axis, bool upper, const Place& place) const {
        const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
        Lattice p;
        p[axis] = upper ? counts_[axis] : 0;
        // points shared by sides are placed more than once, at the same spot: the place depends on the point alone
        for (p[v] = 0; p[v] <= counts_[v]; ++p[v])
            for (p[u] = 0; p[u] <= counts_[u]; ++p[u]) mesh.positions[vertex(p)] = place(p).template cast<float>();
        const auto at = [&](std::size_t i, std::size_t j) {
            p[u] = i;
            p[v] = j;
            return vertex(p);
        };
        for (std::size_t j = 0; j < counts_[v]; ++j)
            for (std::size_t i = 0; i < counts_[u]; ++i) {
                std::array<Index, 4> quad = {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)};
                if (!upper) std::swap(quad[1], quad[3]);
                mesh.add_face(quad);
            }
    }

    Lattice counts_;
    std::size_t cap_, ring_; ///< points of an end slice, and of one between
};

/// One sine wave at the lattice lines 0 .. n of a side.
std::vector<double> wave(std::size_t n, double frequency) {
    std::vector<double> heights(n + 1);
    for (std::size_t i = 0; i <= n; ++i) heights[i] = sin_turns(frequency * double(i) / double(n));
    return heights;
}

/// Quads along a side of `times` times the length that has `resolution` of them.
std::size_t scaled_count(unsigned resolution, double times) {
    return static_cast<std::size_t>(std::max(1.0, std::round(resolution * times)));
}

/// The square [-1, 1]^2 to the unit disc: rings to rings, equally spaced along them.
Eigen::Vector2d square_to_disc(double x, double y) {
    if (x == 0 && y == 0) return {0, 0};
    const bool swapped = std::abs(y) > std::abs(x);
    if (swapped) std::swap(x, y);
    const double turns = y / x / 8; // -1/8 to 1/8
    const Eigen::Vector2d p(x * cos_turns(turns), x * sin_turns(turns));
    return swapped ? Eigen::Vector2d(p.y(), p.x()) : p;
}

/// A box along x; place_across maps the cross-section, both coordinates in -1 to 1.
template <class PlaceAcross>
Mesh make_prism(const ShapeOptions& options, const PlaceAcross& place_across) {
    const std::size_t n = options.resolution, along = scaled_count(options.resolution, options.length);
    const double half = 0.5 * options.size;
    return BoxSurface({along, n, n}).mesh([&](const Lattice& p) {
        const Eigen::Vector2d across = place_across(centred(p[1], n), centred(p[2], n));
        return Vec3d(half * options.length * centred(p[0], along), half * across.x(), half * across.y());
    });
}

} // namespace

Mesh make_wavy_cube(const ShapeOptions& options) {
    const std::size_t n = options.resolution;
    std::vector<double> waves = wave(n, options.frequency);
    // the flat rim: zero on a side's two outermost rows, hence on everything that sides share
    for (const std::size_t i : {std::size_t{0}, std::min<std::size_t>(1, n)}) waves[i] = waves[n - i] = 0;
    return BoxSurface({n, n, n}).mesh([&](const Lattice& p) {
        Vec3d position(centred(p[0], n), centred(p[1], n), centred(p[2], n));
        position *= 0.5 * options.size;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (p[axis] != 0 && p[axis] != n) continue;
            const double both =
                waves[p[(axis + 1) % 3]] * waves[p[(axis + 2) % 3]]; // first: the same bits on every side
            const double height = options.amplitude * options.size * both;
            position[Eigen::Index(axis)] += p[axis] == 0 ? -height : height;
        }
        return position;
    });
}

Mesh make_wavy_sphere(const ShapeOptions& options) {
    const std::size_t n = options.resolution;
    std::vector<double> spread(n + 1); // equal angles rather than equal steps: quads of about the same size
    for (std::size_t i = 0; i <= n; ++i) spread[i] = math::tan(std::numbers::pi / 4 * centred(i, n));
    return BoxSurface({n, n, n}).mesh([&](const Lattice& p) {
        const Vec3d d = Vec3d(spread[p[0]], spread[p[1]], spread[p[2]]).normalized();
        // the gyroid's field: smooth all over the sphere for every frequency, and within -1.5 to 1.5
        const Vec3d t = options.frequency / 4 * d; // a way around covers 4 units of a coordinate
        const double gyroid = sin_turns(t.x()) * cos_turns(t.y()) + sin_turns(t.y()) * cos_turns(t.z()) +
                              sin_turns(t.z()) * cos_turns(t.x());
        return Vec3d(0.5 * options.size * (1 + options.amplitude * gyroid / 1.5) * d);
    });
}

Mesh make_wavy_plate(const ShapeOptions& options) {
    const std::size_t n = options.resolution, through = scaled_count(options.resolution, options.thickness);
    const std::vector<double> waves = wave(n, options.frequency);
    return BoxSurface({n, n, through}).mesh([&](const Lattice& p) {
        const double height = 0.5 * options.thickness * centred(p[2], through);
        const double waved = height + options.amplitude * waves[p[0]] * waves[p[1]];
        return Vec3d(options.size * Vec3d(0.5 * centred(p[0], n), 0.5 * centred(p[1], n), waved));
    });
}

Mesh make_wavy_plane(const ShapeOptions& options) {
    const std::size_t n = options.resolution;
    const std::vector<double> waves = wave(n, options.frequency);
    Mesh mesh;
    mesh.positions.reserve((n + 1) * (n + 1));
    mesh.uvs.values.reserve((n + 1) * (n + 1));
    for (std::size_t j = 0; j <= n; ++j)
        for (std::size_t i = 0; i <= n; ++i) {
            const Vec3d p(0.5 * centred(i, n), 0.5 * centred(j, n), options.amplitude * waves[i] * waves[j]);
            mesh.positions.push_back((options.size * p).cast<float>());
            mesh.uvs.values.emplace_back(float(double(i) / double(n)), float(double(j) / double(n)));
        }
    const auto at = [&](std::size_t i, std::size_t j) { return static_cast<Index>(j * (n + 1) + i); };
    mesh.face_offsets.reserve(n * n + 1);
    mesh.corners.reserve(4 * n * n);
    for (std::size_t j = 0; j < n; ++j)
        for (std::size_t i = 0; i < n; ++i)
            mesh.add_face(std::array{at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    return mesh;
}

Mesh make_bar(const ShapeOptions& options) {
    return make_prism(options, [](double y, double z) { return Eigen::Vector2d(y, z); });
}

Mesh make_cylinder(const ShapeOptions& options) { return make_prism(options, square_to_disc); }

Mesh make_torus(const ShapeOptions& options) {
    const std::size_t around_ring = 2 * std::size_t{options.resolution}, around_tube = options.resolution;
    const double ring = 0.5 * options.size, tube = options.thickness * ring, height = options.amplitude * ring;
    const double frequency = std::round(options.frequency); // whole waves, so that they meet themselves
    const std::vector<double> ring_wave = wave(around_ring, frequency), tube_wave = wave(around_tube, frequency);
    Mesh mesh;
    mesh.positions.reserve(around_ring * around_tube);
    for (std::size_t j = 0; j < around_tube; ++j)
        for (std::size_t i = 0; i < around_ring; ++i) {
            const double u = double(i) / double(around_ring), v = double(j) / double(around_tube);
            const double r = tube + height * ring_wave[i] * tube_wave[j];
            const double from_axis = ring + r * cos_turns(v);
            const Vec3d p(from_axis * cos_turns(u), from_axis * sin_turns(u), r * sin_turns(v));
            mesh.positions.push_back(p.cast<float>());
        }
    const auto at = [&](std::size_t i, std::size_t j) {
        return static_cast<Index>(j % around_tube * around_ring + i % around_ring);
    };
    mesh.face_offsets.reserve(mesh.positions.size() + 1);
    mesh.corners.reserve(4 * mesh.positions.size());
    for (std::size_t j = 0; j < around_tube; ++j)
        for (std::size_t i = 0; i < around_ring; ++i)
            mesh.add_face(std::array{at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    return mesh;
}

namespace {

struct NamedShape {
    std::string_view name;
    Mesh (*make)(const ShapeOptions&);
};
constexpr NamedShape kShapes[] = {{"wavy-cube", make_wavy_cube},
                                  {"wavy-sphere", make_wavy_sphere},
                                  {"wavy-plane", make_wavy_plane},
                                  {"wavy-plate", make_wavy_plate},
                                  {"bar", make_bar},
                                  {"cylinder", make_cylinder},
                                  {"torus", make_torus}};
constexpr auto kShapeNames = [] {
    std::array<std::string_view, std::size(kShapes)> names;
    for (std::size_t i = 0; i < names.size(); ++i) names[i] = kShapes[i].name;
    return names;
}();

bool is_in(double value, double low, double high) { return value >= low && value <= high; } // false for NaN

/// What is wrong with the options, or "".
std::string check_options(std::string_view name, const ShapeOptions& options) {
    constexpr double kMaxSize = 1e30; // times every other limit it still fits a float
    if (options.resolution < 1 || options.resolution > kMaxResolution)
        return "The resolution must be 1 to " + std::to_string(kMaxResolution) + ".";
    if (name == "torus" && options.resolution < kMinTorusResolution)
        return "A torus needs a resolution of at least " + std::to_string(kMinTorusResolution) + ".";
    if (!is_in(options.frequency, 0, 1e6)) return "The frequency must be 0 to 1000000.";
    if (!is_in(options.amplitude, -10, 10)) return "The amplitude must be -10 to 10.";
    if (!is_in(options.size, 1e-30, kMaxSize)) return "The size must be 1e-30 to 1e30.";
    if (!is_in(options.length, 1e-3, 1e6)) return "The length must be 0.001 to 1000000.";
    if (!is_in(options.thickness, 1e-6, 1)) return "The thickness must be 0.000001 to 1.";
    const double n = options.resolution;
    if ((name == "bar" || name == "cylinder") && 4 * (4 * n * std::round(n * options.length) + 2 * n * n) > kMaxCorners)
        return "The shape would have more corners than 32 bits can count: lower the resolution or the length.";
    return {};
}

} // namespace

Mesh make_box(const Vec3d& centre, const Vec3d& size) {
    Mesh mesh;
    for (int k = 0; k < 8; ++k)
        mesh.positions.push_back(
            (centre + 0.5 * size.cwiseProduct(Vec3d(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1))).cast<float>());
    for (const std::array<Index, 4>& face :
         {std::array<Index, 4>{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}})
        mesh.add_face(face);
    return mesh;
}

Mesh make_ball(const Vec3d& centre, double radius) {
    Mesh mesh = make_wavy_sphere({.resolution = 48, .amplitude = 0, .size = 2 * radius});
    for (Vec3f& p : mesh.positions) p += centre.cast<float>();
    return mesh;
}

Result<Mesh> make_shape(std::string_view name, const ShapeOptions& options) {
    const auto shape = std::ranges::find(kShapes, name, &NamedShape::name);
    if (shape == std::end(kShapes)) {
        std::string message = "There is no shape called \"" + std::string(name) + "\"; there are";
        for (const std::string_view known : kShapeNames) message.append(" ").append(known);
        return Error{ErrorCode::usage, message + "."};
    }
    if (std::string problem = check_options(name, options); !problem.empty())
        return Error{ErrorCode::usage, std::move(problem)};
    return shape->make(options);
}

std::span<const std::string_view> shape_names() { return kShapeNames; }

} // namespace filigree
