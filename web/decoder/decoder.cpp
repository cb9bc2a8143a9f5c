// What the page calls: a stream's sections in, levels, skins and poses out. Compiled to WebAssembly from the library's
// own decoder, so both read the same integers. Sections lie where take() says; results lie in memory that stays valid
// until the next call that changes them.
#include "filigree/mesh/triangle_point.h"
#include "filigree/pack/clip_code.h"
#include "filigree/pack/driver_code.h"
#include "filigree/pack/level_reader.h"

#include <cmath>
#include <memory>

using namespace filigree;

#define EXPORTED(name) __attribute__((export_name(#name))) name

namespace {

/// How a vertex follows the driver: three of its vertices, and how much it follows each.
struct Skin {
    std::array<std::uint16_t, 4> joints;
    std::array<std::uint16_t, 4> weights; ///< shares of 65535
};

/// Corners of triangles with one material that lie in one region, or on the borders of several: kNoIndex.
struct Run {
    Index material, region, corners;
};

struct Stream {
    std::unique_ptr<LevelReader> levels;
    std::array<double, 3> low{};
    double step = 0;

    DriverFaces driver;
    ClipOrder order;
    ClipFrames clip; ///< the driver at rest, then its poses
    std::vector<Triangle> driver_triangles;
    std::vector<std::vector<Index>> triangles_at; ///< of each of the driver's vertices

    std::vector<float> positions, shifted, matrices; ///< shifted: what matrices are for, see shift_rest
    std::vector<std::int8_t> normals;                ///< four a vertex, the last one nothing
    std::vector<Skin> skins;
    std::vector<Index> corners, near; ///< near: of each vertex, the driver's triangle that it follows

    // Where there are attributes, a vertex that is drawn is a wedge: all of the above once more, a wedge each.
    std::vector<float> wedge_positions, uvs;
    std::vector<std::int8_t> wedge_normals;
    std::vector<Skin> wedge_skins;
    std::vector<std::uint8_t> colors; ///< four a wedge

    // A region is what came out of one of the coarsest level's vertices.
    std::vector<Index> region_of; ///< of each of the surface's vertices
    std::vector<std::uint8_t> level_of;
    unsigned level_count = 0;
    std::vector<float> reaches; ///< of each region: how far its vertices lie from its first one
    std::vector<Run> runs;      ///< of corners, one behind the other
    std::vector<Index> parents; ///< of vertices that are drawn
    std::vector<std::uint8_t> drawn_levels;
    std::vector<Index> drawn_regions;
};

std::vector<char> input;
Stream stream;

std::string_view part(std::uint32_t begin, std::uint32_t size) { return {input.data() + begin, size}; }

constexpr std::size_t kNumbers = 12; // of a driver's vertex: a position, and a gradient's columns

Vec3f rest(Index vertex) {
    const float* p = &stream.clip[0][vertex * kNumbers];
    return {p[0], p[1], p[2]};
}
std::array<Vec3d, 3> driver_corners(Index triangle) {
    const Triangle& t = stream.driver_triangles[triangle];
    return {rest(t[0]).cast<double>(), rest(t[1]).cast<double>(), rest(t[2]).cast<double>()};
}
Vec3f position(std::size_t v) {
    return {stream.positions[3 * v], stream.positions[3 * v + 1], stream.positions[3 * v + 2]};
}

/// The driver's triangle nearest to a point: from a near one on, to whichever beside it is nearer.
ClosestTrianglePoint nearest(const Vec3d& p, Index& triangle) {
    ClosestTrianglePoint best = closest_on_triangle(p, driver_corners(triangle));
    for (bool is_better = true; is_better;) {
        is_better = false;
        const Triangle around = stream.driver_triangles[triangle];
        for (const Index corner : around)
            for (const Index other : stream.triangles_at[corner]) {
                const ClosestTrianglePoint point = closest_on_triangle(p, driver_corners(other));
                if (point.squared_distance >= best.squared_distance) continue;
                best = point;
                triangle = other;
                is_better = true;
            }
    }
    return best;
}

void follow_driver(std::size_t v) {
    const Index parent = stream.levels->parents()[v];
    Index triangle = 0;
    ClosestTrianglePoint point;
    const Vec3d p = position(v).cast<double>();
    if (parent != v)
        triangle = stream.near[parent];
    else
        for (Index t = 0; t < stream.driver_triangles.size(); ++t)
            if (const ClosestTrianglePoint there = closest_on_triangle(p, driver_corners(t));
                there.squared_distance < point.squared_distance) {
                point = there;
                triangle = t;
            }
    point = nearest(p, triangle);
    stream.near.push_back(triangle);
    Skin skin{};
    std::uint32_t left = 65535;
    for (std::size_t k = 0; k < 3; ++k) {
        const auto weight =
            k == 2 ? left : std::min(left, std::uint32_t(std::lround(point.barycentric[int(k)] * 65535)));
        skin.joints[k] = std::uint16_t(stream.driver_triangles[triangle][k]);
        skin.weights[k] = std::uint16_t(weight);
        left -= weight;
    }
    stream.skins.push_back(skin);
}

/// The blend code is a skin of a shifted rest shape, x = 2 p - m, where m is the point of the driver that p follows;
/// its matrices are halved gradients (docs/exchange.md).
void shift_rest() {
    stream.shifted.resize(stream.positions.size());
    for (std::size_t v = 0; v < stream.skins.size(); ++v) {
        Vec3f m = Vec3f::Zero();
        for (std::size_t k = 0; k < 3; ++k)
            m += float(stream.skins[v].weights[k]) / 65535 * rest(stream.skins[v].joints[k]);
        const Vec3f x = 2 * position(v) - m;
        for (int k = 0; k < 3; ++k) stream.shifted[3 * v + std::size_t(k)] = x[k];
    }
}

void make_normals(std::span<const Triangle> triangles) {
    const std::size_t count = stream.levels->vertex_count();
    const std::vector<bool> closes_hole = stream.levels->closes_hole();
    std::vector<Vec3f> sums(count, Vec3f::Zero());
    for (const auto& [a, b, c] : triangles) {
        if (closes_hole[a] || closes_hole[b] || closes_hole[c]) continue;
        const Vec3f normal = (position(b) - position(a)).cross(position(c) - position(a));
        for (const Index v : {a, b, c}) sums[v] += normal;
    }
    stream.normals.assign(4 * count, 0);
    for (std::size_t v = 0; v < count; ++v) {
        const float length = sums[v].norm();
        for (int k = 0; k < 3 && length > 0; ++k)
            stream.normals[4 * v + std::size_t(k)] = std::int8_t(std::lround(127 * sums[v][k] / length));
    }
}

bool has_wedges() { return !stream.levels->outline().empty(); }

/// Regions of vertices that are new, and how far they reach.
void grow_regions() {
    const std::span<const Index> parents = stream.levels->parents();
    const auto level = std::uint8_t(stream.level_count);
    for (auto v = static_cast<Index>(stream.region_of.size()); v < parents.size(); ++v) {
        stream.region_of.push_back(parents[v] == v ? v : stream.region_of[parents[v]]);
        stream.level_of.push_back(level);
    }
    if (stream.reaches.empty()) stream.reaches.resize(parents.size());
    for (Index v = 0; v < parents.size(); ++v) {
        float& reach = stream.reaches[stream.region_of[v]];
        reach = std::max(reach, (position(v) - position(stream.region_of[v])).norm());
    }
    ++stream.level_count;
}

/// Triangles material by material, those of none last, and there region by region, those on borders last.
void sort_triangles(std::span<const Triangle> triangles) {
    const std::vector<bool> closes_hole = stream.levels->closes_hole();
    const std::vector<Index> wedge_at = has_wedges() ? stream.levels->corner_wedges(triangles) : std::vector<Index>();
    const std::span<const Wedge> wedges = stream.levels->wedges();
    struct Sorted {
        Index material, region, triangle;
        auto operator<=>(const Sorted&) const = default;
    };
    std::vector<Sorted> order;
    order.reserve(triangles.size());
    for (Index t = 0; t < triangles.size(); ++t) {
        const Triangle& corners = triangles[t];
        if (closes_hole[corners[0]] || closes_hole[corners[1]] || closes_hole[corners[2]]) continue;
        if (has_wedges() && std::ranges::count(wedge_at.begin() + 3 * t, wedge_at.begin() + 3 * t + 3, kNoIndex) > 0)
            continue;
        const Index region = stream.region_of[corners[0]];
        const bool is_inside = stream.region_of[corners[1]] == region && stream.region_of[corners[2]] == region;
        order.push_back({has_wedges() ? wedges[wedge_at[3 * t]].material : kNoIndex, is_inside ? region : kNoIndex, t});
    }
    std::ranges::sort(order);
    stream.corners.clear();
    stream.runs.clear();
    for (const Sorted& next : order) {
        if (stream.runs.empty() || stream.runs.back().material != next.material ||
            stream.runs.back().region != next.region)
            stream.runs.push_back({next.material, next.region, 0});
        stream.runs.back().corners += 3;
        for (Index k = 0; k < 3; ++k)
            stream.corners.push_back(has_wedges() ? wedge_at[3 * next.triangle + k] : triangles[next.triangle][k]);
    }
}

/// How coarser levels come out of vertices that are drawn.
void note_parents() {
    const std::span<const Wedge> wedges = stream.levels->wedges();
    const std::span<const Index> parents = stream.levels->parents();
    const std::size_t count = has_wedges() ? wedges.size() : parents.size();
    for (std::size_t i = stream.parents.size(); i < count; ++i) {
        const Index v = has_wedges() ? wedges[i].vertex : Index(i);
        stream.parents.push_back(has_wedges() ? wedges[i].parent : parents[i]);
        stream.drawn_levels.push_back(stream.level_of[v]);
        stream.drawn_regions.push_back(stream.region_of[v]);
    }
}

/// What vertices have, for each of their wedges.
void spread_over_wedges(std::span<const float> positions) {
    const std::span<const Wedge> wedges = stream.levels->wedges();
    const AttributeOutline& outline = stream.levels->outline();
    const auto spread = [&](auto from, auto& to, std::size_t numbers) {
        to.clear();
        to.reserve(numbers * wedges.size());
        for (const Wedge& wedge : wedges)
            to.insert(to.end(), from.begin() + std::ptrdiff_t(numbers * wedge.vertex),
                      from.begin() + std::ptrdiff_t(numbers * (wedge.vertex + 1)));
    };
    spread(positions, stream.wedge_positions, 3);
    spread(std::span<const std::int8_t>(stream.normals), stream.wedge_normals, 4);
    if (!stream.skins.empty()) spread(std::span<const Skin>(stream.skins), stream.wedge_skins, 1);
    stream.uvs.clear();
    stream.colors.clear();
    for (const Wedge& wedge : wedges) {
        const Vec2f uv = outline.uv(wedge);
        if (outline.has_uvs) stream.uvs.insert(stream.uvs.end(), uv.data(), uv.data() + 2);
        if (!outline.has_colors) continue;
        const ByteColor& color = stream.levels->colors()[wedge.vertex];
        stream.colors.insert(stream.colors.end(), color.begin(), color.end());
    }
}

void make_arrays() {
    const std::size_t count = stream.levels->vertex_count();
    stream.positions.resize(3 * count);
    for (Index v = 0; v < count; ++v) {
        const FinePlace place = stream.levels->place(v);
        for (std::size_t k = 0; k < 3; ++k)
            stream.positions[3 * v + k] = float(stream.low[k] + stream.step * place[k] / kFine);
    }
    const std::vector<Triangle> triangles = stream.levels->triangles();
    make_normals(triangles);
    grow_regions();
    note_parents();
    sort_triangles(triangles);
    if (!stream.driver_triangles.empty()) {
        for (std::size_t v = stream.skins.size(); v < count; ++v) follow_driver(v);
        shift_rest();
    }
    if (has_wedges()) spread_over_wedges(stream.driver_triangles.empty() ? stream.positions : stream.shifted);
}

} // namespace

extern "C" {

/// Room for so many bytes of sections.
char* EXPORTED(take)(std::uint32_t size) {
    input.resize(size);
    return input.data();
}

void EXPORTED(begin)(std::int32_t normal_step, std::int32_t tangential_step, std::uint32_t is_refined,
                     std::uint32_t most_triangles, double x, double y, double z, double step) {
    stream = Stream();
    stream.levels =
        std::make_unique<LevelReader>(GeometrySteps{normal_step, tangential_step}, is_refined != 0, most_triangles);
    stream.low = {x, y, z};
    stream.step = step;
}

/// 0, of each: it is damaged.
std::uint32_t EXPORTED(read_driver)(std::uint32_t size, std::uint32_t vertices, std::uint32_t faces,
                                    std::uint32_t corners, std::uint32_t mesh_vertices) {
    std::optional<DriverFaces> driver = decode_driver(part(0, size), {vertices, faces, corners, mesh_vertices});
    if (!driver || vertices > 65535) return 0;
    stream.driver = std::move(*driver);
    stream.order = clip_order(stream.driver.face_offsets, stream.driver.corners, vertices);
    return 1;
}

std::uint32_t EXPORTED(read_clip)(std::uint32_t size, std::uint32_t numbers) {
    if (numbers != kNumbers) return 0;
    std::optional<ClipFrames> frames = decode_clip(part(0, size), numbers, stream.order);
    if (!frames) return 0;
    stream.clip.insert(stream.clip.end(), frames->begin() + (stream.clip.empty() ? 0 : 1), frames->end());
    if (!stream.driver_triangles.empty()) return 1;
    const DriverFaces& driver = stream.driver;
    stream.triangles_at.resize(driver.vertices.size());
    for (std::size_t f = 0; f + 1 < driver.face_offsets.size(); ++f)
        for (Index c = driver.face_offsets[f] + 1; c + 1 < driver.face_offsets[f + 1]; ++c) {
            const auto t = static_cast<Index>(stream.driver_triangles.size());
            stream.driver_triangles.push_back(
                {driver.corners[driver.face_offsets[f]], driver.corners[c], driver.corners[c + 1]});
            for (const Index v : stream.driver_triangles.back()) stream.triangles_at[v].push_back(t);
        }
    return 1;
}

/// attributes: 0 bytes where levels have none.
std::uint32_t EXPORTED(read_coarsest)(std::uint32_t connectivity, std::uint32_t places, std::uint32_t attributes) {
    if (!stream.levels->read_coarsest(part(0, connectivity), part(connectivity, places),
                                      part(connectivity + places, attributes)))
        return 0;
    make_arrays();
    return 1;
}
std::uint32_t EXPORTED(read_level)(std::uint32_t size, std::uint32_t batches) {
    if (!stream.levels->read_level(part(0, size), batches)) return 0;
    make_arrays();
    return 1;
}
/// The last one makes the arrays.
std::uint32_t EXPORTED(read_refinement)(std::uint32_t size, std::uint32_t is_last) {
    if (!stream.levels->refine_level(part(0, size))) return 0;
    if (is_last) make_arrays();
    return 1;
}

std::uint32_t EXPORTED(surface_vertex_count)() { return std::uint32_t(stream.levels->vertex_count()); }
/// Those that are drawn: where there are attributes, one for each wedge.
std::uint32_t EXPORTED(vertex_count)() {
    return std::uint32_t(has_wedges() ? stream.levels->wedges().size() : stream.levels->vertex_count());
}
std::uint32_t EXPORTED(corner_count)() { return std::uint32_t(stream.corners.size()); }
std::uint32_t EXPORTED(frame_count)() { return std::uint32_t(stream.clip.empty() ? 0 : stream.clip.size() - 1); }
/// Of a model that moves, the shifted rest shape.
const float* EXPORTED(positions)() {
    if (has_wedges()) return stream.wedge_positions.data();
    return stream.driver_triangles.empty() ? stream.positions.data() : stream.shifted.data();
}
const std::int8_t* EXPORTED(normals)() { return (has_wedges() ? stream.wedge_normals : stream.normals).data(); }
const Index* EXPORTED(corners)() { return stream.corners.data(); }
const Skin* EXPORTED(skins)() { return (has_wedges() ? stream.wedge_skins : stream.skins).data(); }
/// Two a vertex, or none: nullptr.
const float* EXPORTED(uvs)() { return stream.uvs.empty() ? nullptr : stream.uvs.data(); }
/// Four bytes a vertex, sRGB, or none: nullptr.
const std::uint8_t* EXPORTED(colors)() { return stream.colors.empty() ? nullptr : stream.colors.data(); }
std::uint32_t EXPORTED(run_count)() { return std::uint32_t(stream.runs.size()); }
const Run* EXPORTED(runs)() { return stream.runs.data(); }
/// Of each vertex the one of a coarser level that it came from, or itself; and its level and region.
const Index* EXPORTED(parents)() { return stream.parents.data(); }
const std::uint8_t* EXPORTED(levels)() { return stream.drawn_levels.data(); }
const Index* EXPORTED(regions)() { return stream.drawn_regions.data(); }
/// Of each region, of which each has the surface's vertex of its number as its first.
std::uint32_t EXPORTED(region_count)() { return std::uint32_t(stream.reaches.size()); }
const float* EXPORTED(reaches)() { return stream.reaches.data(); }
std::uint32_t EXPORTED(driver_triangle_count)() { return std::uint32_t(stream.driver_triangles.size()); }
const Index* EXPORTED(driver_triangles)() { return stream.driver_triangles.data()->data(); }

/// Positions of the driver's vertices at rest.
const float* EXPORTED(driver_rest)() {
    stream.matrices.clear();
    for (Index v = 0; v < stream.driver.vertices.size(); ++v) {
        const Vec3f p = rest(v);
        stream.matrices.insert(stream.matrices.end(), p.data(), p.data() + 3);
    }
    return stream.matrices.data();
}

/// A matrix for each of the driver's vertices, columns of four, for points of the shifted rest shape: where they are
/// `between` one frame and the next, frame -1 being the driver at rest.
const float* EXPORTED(pose)(std::int32_t frame, float between) {
    const std::size_t a = std::size_t(frame + 1), b = std::min(a + 1, stream.clip.size() - 1);
    const std::size_t count = stream.driver.vertices.size();
    stream.matrices.resize(16 * count);
    for (std::size_t v = 0; v < count; ++v) {
        const auto number = [&](std::size_t k) {
            const std::size_t at = v * kNumbers + k;
            return (1 - between) * stream.clip[a][at] + between * stream.clip[b][at];
        };
        Mat3f gradient;
        for (int k = 0; k < 9; ++k) gradient.data()[k] = number(3 + std::size_t(k)) / 2;
        const Vec3f moved = Vec3f(number(0), number(1), number(2)) - gradient * rest(Index(v));
        float* m = &stream.matrices[16 * v];
        for (int column = 0; column < 3; ++column) {
            for (int row = 0; row < 3; ++row) m[4 * column + row] = gradient(row, column);
            m[4 * column + 3] = 0;
        }
        for (int row = 0; row < 3; ++row) m[12 + row] = moved[row];
        m[15] = 1;
    }
    return stream.matrices.data();
}

} // extern "C"
