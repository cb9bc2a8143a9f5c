// Which points of a lattice are inside a mesh: CGAL's exact test, Embree's rays, and a plain loop over all triangles,
// each on one thread and held against the answer of `filigree sample --method scan`. Their set-up is printed apart.
#include "peer.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <numeric>
#include <optional>
#include <random>
#include <span>

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>
#include <embree3/rtcore.h>
#include <nlohmann/json.hpp>

namespace {

using Vec3 = std::array<double, 3>;
using Index3 = std::array<std::size_t, 3>;

constexpr std::uint64_t kSeed = 1;
constexpr std::size_t kCgalPoints = 300'000, kRayPoints = 100'000, kPlainPoints = 200;
constexpr int kRounds = 3;
constexpr float kStep = 1e-7f; // hits closer together than this share of a row's length are one
constexpr std::array<float, 3> kAside = {0.61f, 0.53f, 0.59f}; // a direction along nothing in particular

struct Lattice {
    Index3 counts = {};
    Vec3 origin = {};
    double spacing = 0;

    double at(std::size_t axis, std::size_t index) const { return std::fma(double(index), spacing, origin[axis]); }
    Vec3 point(const Index3& index) const { return {at(0, index[0]), at(1, index[1]), at(2, index[2])}; }
    double point_count() const { return double(counts[0]) * double(counts[1]) * double(counts[2]); }
    std::size_t row_count() const { return counts[1] * counts[2]; }
    Index3 row(std::size_t number) const { return {0, number % counts[1], number / counts[1]}; }
};

Lattice read_lattice(const std::string& path) {
    std::ifstream file(path);
    const auto json = nlohmann::json::parse(file, nullptr, false);
    try {
        return {json.at("lattice"), json.at("lattice_origin"), json.at("spacing_units")};
    } catch (const nlohmann::json::exception& error) {
        peer::give_up(path + ": not what filigree sample --json prints (" + error.what() + ")");
    }
}

/// A bit a point, rows along x.
class Inside {
public:
    explicit Inside(const Lattice& lattice)
        : counts_(lattice.counts), words_((counts_[0] + 63) / 64), bits_(words_ * lattice.row_count()) {}

    std::span<std::uint64_t> row(std::size_t number) { return {&bits_[number * words_], words_}; }
    bool contains(const Index3& index) const { return bits_[word(index)] >> (index[0] & 63) & 1; }
    void insert(const Index3& index) { bits_[word(index)] |= std::uint64_t{1} << (index[0] & 63); }
    void clear() { std::fill(bits_.begin(), bits_.end(), 0); }

    std::size_t count() const {
        std::size_t result = 0;
        for (const std::uint64_t word : bits_) result += std::size_t(std::popcount(word));
        return result;
    }
    std::size_t different(const Inside& other) const {
        std::size_t result = 0;
        for (std::size_t w = 0; w < bits_.size(); ++w) result += std::size_t(std::popcount(bits_[w] ^ other.bits_[w]));
        return result;
    }

private:
    std::size_t word(const Index3& index) const {
        return (index[2] * counts_[1] + index[1]) * words_ + (index[0] >> 6);
    }
    Index3 counts_;
    std::size_t words_;
    std::vector<std::uint64_t> bits_;
};

/// A PLY of points alone, ascii or little-endian, float x y z; each has to be a point of the lattice.
Inside read_points(const std::string& path, const Lattice& lattice) {
    std::ifstream file(path, std::ios::binary);
    std::size_t points = 0;
    bool ascii = false;
    std::string line;
    while (std::getline(file, line) && line != "end_header") {
        std::istringstream words(line);
        std::string first, second;
        words >> first >> second;
        if (first == "format") ascii = second == "ascii";
        if (first == "element" && second == "vertex") words >> points;
    }
    if (!file) peer::give_up(path + ": cannot be read");
    Inside inside(lattice);
    for (std::size_t n = 0; n < points; ++n) {
        std::array<float, 3> position = {};
        if (ascii)
            file >> position[0] >> position[1] >> position[2];
        else
            file.read(reinterpret_cast<char*>(position.data()), sizeof position);
        Index3 index = {};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double step = (double(position[axis]) - lattice.origin[axis]) / lattice.spacing;
            const double nearest = std::round(step);
            if (!file || std::abs(step - nearest) > 0.25 || nearest < 0 || nearest >= double(lattice.counts[axis]))
                peer::give_up(path + ": point " + std::to_string(n) + " is not of the lattice");
            index[axis] = std::size_t(nearest);
        }
        inside.insert(index);
    }
    if (inside.count() != points) peer::give_up(path + ": some points are there twice");
    return inside;
}

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

Kernel::Point_3 exact_point(const std::array<float, 3>& p) { return {p[0], p[1], p[2]}; }

/// Vertices at one place made one, and triangles without an area left out: the same surface, and closed if it ever was.
peer::Triangles clean(const peer::Triangles& scan) {
    peer::Triangles result;
    std::map<std::array<float, 3>, std::uint32_t> vertex_at; // -0 and +0 compare equal, as they should
    std::vector<std::uint32_t> welded;
    for (const auto& position : scan.positions) {
        const auto [place, is_new] = vertex_at.try_emplace(position, std::uint32_t(result.positions.size()));
        if (is_new) result.positions.push_back(position);
        welded.push_back(place->second);
    }
    for (const auto& [a, b, c] : scan.faces) {
        const std::array<std::uint32_t, 3> face = {welded[a], welded[b], welded[c]};
        if (!CGAL::collinear(exact_point(result.positions[face[0]]), exact_point(result.positions[face[1]]),
                             exact_point(result.positions[face[2]])))
            result.faces.push_back(face);
    }
    return result;
}

/// What all peers are asked about, and our answer.
struct Question {
    peer::Triangles mesh;
    Lattice lattice;
    Inside ours;

    /// The longest side's count tells the runs apart: "inside.cgal_128".
    void report(const std::string& name, double value, const char* unit) const {
        const std::size_t n = *std::max_element(lattice.counts.begin(), lattice.counts.end());
        peer::report(("inside." + name + "_" + std::to_string(n)).c_str(), value, unit);
    }

    /// Points of whole rows, so that caches help as they would with all rows; chosen by chance, then in order.
    std::vector<Index3> some_rows(std::size_t least_points) const {
        std::vector<std::size_t> rows(lattice.row_count());
        std::iota(rows.begin(), rows.end(), std::size_t{0});
        std::shuffle(rows.begin(), rows.end(), std::mt19937_64(kSeed));
        rows.resize(std::min(rows.size(), (least_points + lattice.counts[0] - 1) / lattice.counts[0]));
        std::sort(rows.begin(), rows.end());
        std::vector<Index3> points;
        for (const std::size_t row : rows)
            for (Index3 index = lattice.row(row); index[0] < lattice.counts[0]; ++index[0]) points.push_back(index);
        return points;
    }
    std::vector<Index3> some_points(std::size_t count) const {
        std::mt19937_64 random(kSeed);
        std::vector<Index3> points(count);
        for (Index3& index : points)
            for (std::size_t axis = 0; axis < 3; ++axis) index[axis] = random() % lattice.counts[axis];
        return points;
    }
    std::size_t different(const std::vector<Index3>& points, const std::vector<char>& answers) const {
        std::size_t result = 0;
        for (std::size_t n = 0; n < points.size(); ++n) result += (answers[n] != 0) != ours.contains(points[n]);
        return result;
    }
};

// ---- CGAL

/// Surface_mesh takes no edge of three faces and no two faces that run it the same way: there orient_polygon_soup parts
/// vertices, which moves no triangle.
Mesh make_mesh(const peer::Triangles& triangles) {
    std::vector<Kernel::Point_3> points;
    std::vector<std::vector<std::size_t>> faces;
    for (const auto& position : triangles.positions) points.push_back(exact_point(position));
    for (const auto& face : triangles.faces) faces.emplace_back(face.begin(), face.end());
    CGAL::Polygon_mesh_processing::orient_polygon_soup(points, faces);
    Mesh mesh;
    CGAL::Polygon_mesh_processing::polygon_soup_to_polygon_mesh(points, faces, mesh);
    if (mesh.number_of_faces() != triangles.faces.size()) peer::give_up("CGAL left out some triangles");
    return mesh;
}

void report_cgal(const Question& question) {
    using Primitive = CGAL::AABB_face_graph_triangle_primitive<Mesh>;
    using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
    const Mesh mesh = make_mesh(question.mesh);
    Tree tree;
    question.report("cgal_build", peer::seconds([&] {
                        tree.insert(faces(mesh).first, faces(mesh).second, mesh);
                        tree.build();
                    }),
                    "s");
    const CGAL::Side_of_triangle_mesh<Mesh, Kernel> side(tree);

    const std::vector<Index3> points = question.some_rows(kCgalPoints);
    std::vector<CGAL::Bounded_side> answers(points.size());
    const double time = peer::seconds([&] {
        for (std::size_t n = 0; n < points.size(); ++n) {
            const auto [x, y, z] = question.lattice.point(points[n]);
            answers[n] = side({x, y, z});
        }
    });
    std::size_t boundary = 0, different = 0;
    for (std::size_t n = 0; n < points.size(); ++n)
        if (answers[n] == CGAL::ON_BOUNDARY)
            ++boundary;
        else
            different += (answers[n] == CGAL::ON_BOUNDED_SIDE) != question.ours.contains(points[n]);
    question.report("cgal", double(points.size()) / time, "points/s");
    question.report("cgal_tested", double(points.size()), "points");
    question.report("cgal_different", double(different), "points");
    question.report("cgal_boundary", double(boundary), "points");
}

// ---- Embree

class Scene {
public:
    explicit Scene(const peer::Triangles& mesh) : device_(rtcNewDevice("threads=1")), scene_(rtcNewScene(device_)) {
        rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
        RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        const auto fill = [&](RTCBufferType type, RTCFormat format, const auto& values) {
            const std::size_t stride = sizeof values[0];
            void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, stride, values.size());
            std::memcpy(buffer, values.data(), stride * values.size());
        };
        fill(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, mesh.positions);
        fill(RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, mesh.faces);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene_);
    }
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;
    ~Scene() {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }
    operator RTCScene() const { return scene_; }

private:
    RTCDevice device_;
    RTCScene scene_;
};

/// A filter that takes down every hit of a ray and refuses it, so that one traversal finds them all.
struct Hits {
    RTCIntersectContext context; // first, as the filter gets a pointer to it
    std::vector<float> distances;

    Hits() {
        rtcInitIntersectContext(&context);
        context.filter = [](const RTCFilterFunctionNArguments* arguments) {
            auto& hits = *reinterpret_cast<Hits*>(arguments->context);
            hits.distances.push_back(RTCRayN_tfar(arguments->ray, arguments->N, 0));
            arguments->valid[0] = 0;
        };
    }
};

RTCRayHit make_ray(const Vec3& from, const std::array<float, 3>& direction, float length) {
    RTCRayHit result = {};
    RTCRay& ray = result.ray;
    ray.org_x = float(from[0]), ray.org_y = float(from[1]), ray.org_z = float(from[2]);
    ray.dir_x = direction[0], ray.dir_y = direction[1], ray.dir_z = direction[2];
    ray.tfar = length;
    ray.mask = ~0u;
    result.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    return result;
}

/// Rows by one ray each along x, from before the lattice; hits are found in two ways.
class Rows {
public:
    Rows(const Scene& scene, const Lattice& lattice)
        : scene_(scene), lattice_(lattice), start_(lattice.origin[0] - lattice.spacing),
          length_(float(double(lattice.counts[0] + 1) * lattice.spacing)) {}

    /// The closest hit, then with a ray that starts a step behind it the next, and so on.
    void by_shooting_again(Inside& inside) const {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        for (std::size_t row = 0; row < lattice_.row_count(); ++row) {
            RTCRayHit ray = row_ray(row);
            for (rtcIntersect1(scene_, &context, &ray); ray.hit.geomID != RTC_INVALID_GEOMETRY_ID;
                 rtcIntersect1(scene_, &context, &ray)) {
                toggle(inside.row(row), ray.ray.tfar);
                ray.ray.tnear = ray.ray.tfar + kStep * length_;
                ray.ray.tfar = length_;
                ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            }
            fill(inside.row(row));
        }
    }

    /// All hits in one traversal, then sorted; those closer than a step are one.
    void by_collecting(Inside& inside) const {
        Hits hits;
        for (std::size_t row = 0; row < lattice_.row_count(); ++row) {
            hits.distances.clear();
            RTCRayHit ray = row_ray(row);
            rtcIntersect1(scene_, &hits.context, &ray);
            std::sort(hits.distances.begin(), hits.distances.end());
            float last = -length_;
            for (const float distance : hits.distances) {
                if (distance > last + kStep * length_) toggle(inside.row(row), distance);
                last = distance;
            }
            fill(inside.row(row));
        }
    }

private:
    RTCRayHit row_ray(std::size_t row) const {
        const auto [x, y, z] = lattice_.point(lattice_.row(row));
        return make_ray({start_, y, z}, {1, 0, 0}, length_);
    }
    /// From the first point behind the hit on, the row changes sides.
    void toggle(std::span<std::uint64_t> row, float distance) const {
        const double step = (double(float(start_)) + double(distance) - lattice_.origin[0]) / lattice_.spacing;
        const double first = std::max(0.0, std::ceil(step));
        if (first < double(lattice_.counts[0]))
            row[std::size_t(first) >> 6] ^= std::uint64_t{1} << (std::size_t(first) & 63);
    }
    /// Each bit becomes the parity of those up to it.
    void fill(std::span<std::uint64_t> row) const {
        std::uint64_t carry = 0;
        for (std::uint64_t& word : row) {
            for (const int shift : {1, 2, 4, 8, 16, 32}) word ^= word << shift;
            word ^= carry;
            carry = word >> 63 != 0 ? ~std::uint64_t{0} : 0;
        }
        if (const std::size_t used = lattice_.counts[0] & 63) row.back() &= (std::uint64_t{1} << used) - 1;
    }

    const Scene& scene_;
    const Lattice& lattice_;
    double start_;
    float length_;
};

void report_embree_points(const Question& question, const Scene& scene) {
    const std::vector<Index3> points = question.some_rows(kRayPoints);
    std::vector<char> answers(points.size());
    const auto& [nx, ny, nz] = question.lattice.counts;
    const float length = float(2 * question.lattice.spacing * double(nx + ny + nz));
    Hits hits;
    const double time = peer::seconds([&] {
        for (std::size_t n = 0; n < points.size(); ++n) {
            RTCRayHit ray = make_ray(question.lattice.point(points[n]), kAside, length);
            hits.distances.clear();
            rtcIntersect1(scene, &hits.context, &ray);
            answers[n] = hits.distances.size() & 1;
        }
    });
    question.report("embree_points", double(points.size()) / time, "points/s");
    question.report("embree_points_tested", double(points.size()), "points");
    question.report("embree_points_different", double(question.different(points, answers)), "points");
}

void report_embree(const Question& question) {
    std::optional<Scene> scene;
    question.report("embree_build", peer::seconds([&] { scene.emplace(question.mesh); }), "s");
    const Rows rows(*scene, question.lattice);
    Inside inside(question.lattice);
    const auto report_rows = [&](const std::string& name, const auto& work) {
        const double time = peer::median_seconds(kRounds, [&] {
            inside.clear();
            work();
        });
        question.report(name, question.lattice.point_count() / time, "points/s");
        question.report(name + "_different", double(inside.different(question.ours)), "points");
    };
    report_rows("embree_rows", [&] { rows.by_collecting(inside); });
    report_rows("embree_again", [&] { rows.by_shooting_again(inside); });
    report_embree_points(question, *scene);
}

// ---- A loop over all triangles

Vec3 minus(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec3 cross(const Vec3& a, const Vec3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Does the segment from the eye to the point cross the triangle? A plane, where the segment meets it, and on which
/// sides of the edges that is. Letters as in the report, equations 2.2 to 2.6; its rules for edges and vertices, which
/// no ray of these meets, are left out.
bool crosses(const Vec3& E, const Vec3& P, const std::array<Vec3, 3>& T) {
    const Vec3 N = cross(minus(T[1], T[0]), minus(T[2], T[0]));
    const double d = dot(T[0], N);
    const Vec3 ray = minus(P, E);
    const double t = (d - dot(E, N)) / dot(ray, N);
    if (!(t > 0 && t < 1)) return false;
    const Vec3 I = {E[0] + ray[0] * t, E[1] + ray[1] * t, E[2] + ray[2] * t};
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 edge = minus(T[(k + 1) % 3], T[k]);
        if (dot(cross(edge, minus(I, T[k])), cross(edge, minus(T[(k + 2) % 3], T[k]))) < 0) return false;
    }
    return true;
}

void report_plain(const Question& question) {
    std::vector<std::array<Vec3, 3>> triangles;
    for (const auto& face : question.mesh.faces) {
        auto& triangle = triangles.emplace_back();
        for (std::size_t k = 0; k < 3; ++k)
            std::copy_n(question.mesh.positions[face[k]].begin(), 3, triangle[k].begin());
    }
    const std::vector<Index3> points = question.some_points(kPlainPoints);
    std::vector<char> answers(points.size());
    const double size = question.lattice.spacing * double(question.lattice.counts[0]);
    Vec3 eye = question.lattice.origin;
    for (std::size_t axis = 0; axis < 3; ++axis) eye[axis] -= size * double(kAside[axis]);
    const double time = peer::seconds([&] {
        for (std::size_t n = 0; n < points.size(); ++n) {
            const Vec3 point = question.lattice.point(points[n]);
            std::size_t crossings = 0;
            for (const auto& triangle : triangles) crossings += crosses(eye, point, triangle);
            answers[n] = crossings & 1;
        }
    });
    question.report("plain", double(points.size()) / time, "points/s");
    question.report("plain_tested", double(points.size()), "points");
    question.report("plain_different", double(question.different(points, answers)), "points");
}

} // namespace

int main(int argc, char** argv) {
    if (argc != 4) peer::give_up(std::string(argv[0]) + " MESH.ply POINTS.ply LATTICE.json");
    const Lattice lattice = read_lattice(argv[3]);
    const Question question = {clean(peer::read_ply(argv[1])), lattice, read_points(argv[2], lattice)};
    question.report("points", lattice.point_count(), "points");
    report_cgal(question);
    report_embree(question);
    report_plain(question);
}
