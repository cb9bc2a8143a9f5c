#include "filigree/pack/mesh_code.h"

#include "filigree/mesh/morton.h"
#include "filigree/pack/attribute_code.h"
#include "filigree/pack/face_code.h"
#include "filigree/pack/geometry_code.h"
#include "filigree/pack/integer_frame.h"
#include "filigree/pack/mesh_levels.h"
#include "filigree/pack/regular_code.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr unsigned kLoosePlace = std::max(kGeometryContexts, kRegularContexts), kPlaceContexts = kLoosePlace + 3;
constexpr unsigned kAllAttributeContexts = kAttributeContexts + kRestContexts;
constexpr unsigned kVertexOrder = 0, kFaceOrder = 1, kFirstCorner = 2, kOrderContexts = 3;

struct Damage {};

// --- Places -------------------------------------------------------------------------------------------------------

constexpr std::size_t kCoarsestVertices = 500;

GeometrySteps steps_of(const PackOptions& options) { return {1, options.surface ? 4 : 1}; }

/// Sixteenths of a step from the box's corner. A vertex that no face meets may lie further out than they reach.
FinePlace fine_place(const Vec3f& position, const PackedMesh& coded) {
    constexpr double kMost = kFarthest - kFine;
    FinePlace place{};
    for (int k = 0; k < 3; ++k) {
        const double fine = (double(position[k]) - coded.low[std::size_t(k)]) / coded.step * kFine;
        place[std::size_t(k)] = static_cast<std::int32_t>(std::lround(std::clamp(fine, -kMost, kMost)));
    }
    return place;
}

Vec3f position_of(const FinePlace& place, const PackedMesh& coded) {
    Vec3f position;
    for (int k = 0; k < 3; ++k)
        position[k] = static_cast<float>(coded.low[std::size_t(k)] + coded.step * place[std::size_t(k)] / kFine);
    return position;
}

std::vector<Vec3f> positions_of(std::span<const FinePlace> places, const PackedMesh& coded) {
    std::vector<Vec3f> positions;
    positions.reserve(places.size());
    for (const FinePlace& place : places) positions.push_back(position_of(place, coded));
    return positions;
}

/// A whole step, for vertices that no face meets: each from the one before.
std::int32_t whole_steps(std::int32_t fine) { return (fine + (fine < 0 ? -kFine / 2 : kFine / 2)) / kFine; }

// --- Order --------------------------------------------------------------------------------------------------------

/// The mesh in the order of its code.
struct OrderedMesh {
    Mesh mesh;
    std::vector<FinePlace> places; ///< as they will be read
    std::vector<Index> vertex, face, first_corner;
    std::size_t met = 0;   ///< vertices that faces meet: the first ones
    LevelValues in_levels; ///< which attributes are: outline and counts alone
};

template <class T>
std::vector<T> in_order(const std::vector<T>& values, std::span<const Index> order) {
    std::vector<T> moved;
    if (values.empty()) return moved;
    moved.reserve(order.size());
    for (const Index i : order) moved.push_back(values[i]);
    return moved;
}

template <class T>
CornerAttribute<T> attribute_in_order(const CornerAttribute<T>& attribute, const OrderedMesh& ordered,
                                      const Mesh& mesh) {
    if (attribute.per_vertex()) return {in_order(attribute.values, ordered.vertex), {}};
    CornerAttribute<T> moved{attribute.values, {}};
    for (std::size_t f = 0; f < ordered.face.size(); ++f) {
        const Index begin = mesh.face_offsets[ordered.face[f]], size = mesh.face_size(ordered.face[f]);
        for (Index k = 0; k < size; ++k)
            moved.corners.push_back(attribute.corners[begin + (ordered.first_corner[f] + k) % size]);
    }
    return moved;
}

/// Without positions.
void put_attributes_in_order(const Mesh& mesh, OrderedMesh& ordered) {
    Mesh& moved = ordered.mesh;
    moved.origin = mesh.origin;
    moved.uvs = attribute_in_order(mesh.uvs, ordered, mesh);
    moved.normals = attribute_in_order(mesh.normals, ordered, mesh);
    moved.colors = in_order(mesh.colors, ordered.vertex);
    moved.colors_have_alpha = mesh.colors_have_alpha;
    for (const VertexScalar& scalar : mesh.scalars)
        moved.scalars.push_back({scalar.name, in_order(scalar.values, ordered.vertex)});
    const auto labels = [&](const FaceLabels& from) {
        return FaceLabels{from.names, in_order(from.of_face, ordered.face)};
    };
    moved.objects = labels(mesh.objects);
    moved.groups = labels(mesh.groups);
    moved.materials = labels(mesh.materials);
    moved.smoothing = in_order(mesh.smoothing, ordered.face);
    moved.material_files = mesh.material_files;
    moved.embedded_materials = mesh.embedded_materials;
}

std::string write_order(const OrderedMesh& ordered) {
    SymbolWriter out(kOrderContexts);
    const auto put = [&](unsigned context, std::span<const Index> order) {
        std::uint32_t expected = 0;
        for (const Index i : order) {
            out.number_with_sign(context, std::int32_t(i - expected));
            expected = i + 1;
        }
    };
    put(kVertexOrder, ordered.vertex);
    put(kFaceOrder, ordered.face);
    for (const Index k : ordered.first_corner) out.number(kFirstCorner, k);
    return out.finish();
}

std::vector<Index> read_permutation(SymbolReader& in, unsigned context, std::size_t count) {
    std::vector<Index> order(count);
    std::vector<bool> is_named(count);
    std::uint32_t expected = 0;
    for (Index& i : order) {
        i = expected + std::uint32_t(in.number_with_sign(context));
        if (i >= count || is_named[i] || in.is_damaged()) throw Damage();
        is_named[i] = true;
        expected = i + 1;
    }
    return order;
}

/// Back into the order of the source.
Mesh put_back(const Mesh& mesh, std::string_view stream) {
    SymbolReader in(stream, kOrderContexts);
    const std::vector<Index> vertex = read_permutation(in, kVertexOrder, mesh.vertex_count()),
                             face = read_permutation(in, kFaceOrder, mesh.face_count());
    OrderedMesh back; // what it was coded from is what comes out: vertex i is the code's back.vertex[i]
    back.vertex = inverse_order(vertex);
    back.face = inverse_order(face);
    back.first_corner.resize(face.size());
    for (std::size_t f = 0; f < face.size(); ++f) { // the code's face f began with corner k of the source's
        const std::uint32_t k = in.number(kFirstCorner), size = mesh.face_size(f);
        if (k >= size || in.is_damaged()) throw Damage();
        back.first_corner[face[f]] = (size - k) % size;
    }
    put_attributes_in_order(mesh, back);
    back.mesh.positions = in_order(mesh.positions, back.vertex);
    for (std::size_t f = 0; f < back.face.size(); ++f) {
        const auto corners = mesh.face(back.face[f]);
        for (std::size_t k = 0; k < corners.size(); ++k)
            back.mesh.corners.push_back(vertex[corners[(back.first_corner[f] + k) % corners.size()]]);
        back.mesh.face_offsets.push_back(static_cast<Index>(back.mesh.corners.size()));
    }
    return std::move(back.mesh);
}

/// Those that no face meets, along Morton's curve, so that each is near the one before.
void sort_loose(const Mesh& mesh, const PackedMesh& coded, std::span<Index> loose) {
    std::vector<std::pair<std::uint64_t, Index>> keys;
    for (const Index v : loose) {
        constexpr std::uint32_t kCounted = (1u << 20) - 1; // bits of a coordinate
        const auto [x, y, z] = fine_place(mesh.positions[v], coded);
        keys.emplace_back(morton_key(x & kCounted, y & kCounted, z & kCounted), v);
    }
    std::ranges::sort(keys);
    for (std::size_t i = 0; i < loose.size(); ++i) loose[i] = keys[i].second;
}

// --- Faces and places ---------------------------------------------------------------------------------------------

/// Of a quad mesh with subdivision connectivity.
std::optional<OrderedMesh> encode_regular_shape(const Mesh& mesh, PackedMesh& coded, const RunContext& context) {
    std::vector<FinePlace> places;
    for (const Vec3f& position : mesh.positions) places.push_back(fine_place(position, coded));
    SymbolWriter faces_out(kFaceContexts), places_out(kPlaceContexts);
    faces_out.bits(true, 1);
    std::optional<EncodedRegular> encoded =
        encode_regular(mesh, places, steps_of(coded.options), faces_out, places_out, context);
    if (!encoded) return std::nullopt;
    coded.connectivity = faces_out.finish();
    coded.places = places_out.finish();
    OrderedMesh ordered;
    ordered.vertex = std::move(encoded->vertex);
    ordered.face = std::move(encoded->face);
    ordered.first_corner = std::move(encoded->first_corner);
    ordered.mesh.face_offsets = std::move(encoded->read.face_offsets);
    ordered.mesh.corners = std::move(encoded->read.corners);
    ordered.places = std::move(encoded->read.places);
    ordered.met = ordered.vertex.size();
    return ordered;
}

/// Of any mesh.
OrderedMesh encode_shape(const Mesh& mesh, PackedMesh& coded, const RunContext& context) {
    SymbolWriter faces_out(kFaceContexts), places_out(kPlaceContexts);
    faces_out.bits(false, 1);
    EncodedLevels levels;
    SurfaceAttributes attributes;
    const MapCode code_map = [&](const ClosedSurface& surface, const FaceCorner& corner_of) {
        if (!coded.options.levels) return encode_connectivity(surface.map, faces_out);
        std::vector<FinePlace> places(surface.source.size());
        for (std::size_t v = 0; v < places.size(); ++v)
            if (surface.source[v] != kNoIndex) places[v] = fine_place(mesh.positions[surface.source[v]], coded);
        attributes = surface_attributes(mesh, surface, corner_of);
        levels = encode_levels(surface.map, places, attributes, level_options(coded.options), context);
        return std::move(levels.walked);
    };
    EncodedFaces faces = encode_faces(mesh.face_offsets, mesh.corners, mesh.vertex_count(), code_map, faces_out);
    coded.levels = std::move(levels.code);
    coded.connectivity = faces_out.finish();
    OrderedMesh ordered;
    if (context.is_cancelled()) return ordered;
    const WalkedFaces& walked = faces.walked;
    if (!coded.levels.attributes.empty())
        ordered.in_levels = {
            .outline = attributes.outline, .met = walked.met, .walked_corners = walked.half_edges.size()};
    ordered.met = walked.met;
    ordered.vertex = std::move(faces.vertex);
    ordered.face = std::move(faces.face);
    ordered.first_corner = std::move(faces.first_corner);
    Mesh& moved = ordered.mesh;
    moved.face_offsets = walked.face_offsets;
    moved.corners = walked.corners;
    const bool has_odd_faces = std::ranges::any_of(moved.corners, [&](Index v) { return v >= walked.met; });
    if (!has_odd_faces) sort_loose(mesh, coded, std::span(ordered.vertex).subspan(walked.met)); // else they are named

    std::vector<FinePlace> read = std::move(levels.read);
    if (!coded.options.levels) {
        std::vector<FinePlace> places(walked.number.size());
        for (std::size_t w = 0; w < places.size(); ++w)
            if (walked.number[w] != kNoIndex)
                places[w] = fine_place(mesh.positions[ordered.vertex[walked.number[w]]], coded);
        read = encode_geometry(walked.map, places, steps_of(coded.options), 0, places_out);
    }
    for (const std::size_t w : walked.first_with_number()) ordered.places.push_back(read[w]);
    FinePlace before{};
    for (std::size_t v = walked.met; v < mesh.vertex_count(); ++v) {
        const FinePlace place = fine_place(mesh.positions[ordered.vertex[v]], coded);
        for (unsigned k = 0; k < 3; ++k) {
            const std::int32_t steps = whole_steps(place[k] - before[k]);
            places_out.number_with_sign(kLoosePlace + k, steps);
            before[k] += kFine * steps;
        }
        ordered.places.push_back(before);
    }
    coded.places = places_out.finish();
    return ordered;
}

LevelReader decode_levels(const PackedMesh& coded, const RunContext& context) {
    const LevelCodeOptions options = level_options(coded.options);
    LevelReader reader(options.steps, options.is_refined, most_triangles(coded.corners));
    if (!reader.read_coarsest(coded.levels.connectivity, coded.levels.places, coded.levels.attributes)) throw Damage();
    for (const PackedLevel& level : coded.levels.levels)
        if (context.is_cancelled() || !reader.read_level(level.splits, level.batches)) throw Damage();
    for (const PackedLevel& level : coded.levels.levels)
        if (options.is_refined && !reader.refine_level(level.refinement)) throw Damage();
    return reader;
}

/// Of any mesh, as encode_shape wrote it; and those of its attributes that its levels have. Throws Damage.
CodedShape decode_shape(const PackedMesh& coded, SymbolReader& faces_in, SymbolReader& places_in,
                        LevelValues& in_levels, const RunContext& context) {
    std::optional<WalkedFaces> walked;
    std::optional<LevelReader> levels;
    std::vector<Index> wedge_at;
    std::vector<FinePlace> places;
    if (coded.options.levels) {
        levels.emplace(decode_levels(coded, context));
        places.reserve(levels->vertex_count());
        for (Index v = 0; v < levels->vertex_count(); ++v) places.push_back(levels->place(v));
        std::vector<Triangle> triangles = levels->triangles();
        if (!levels->outline().empty()) wedge_at = levels->corner_wedges(triangles);
        walked =
            decode_faces({std::move(triangles), {}, levels->closes_hole()}, faces_in, coded.vertices, coded.corners);
    } else
        walked = decode_faces(faces_in, coded.vertices, coded.corners);
    if (!walked || context.is_cancelled()) throw Damage();
    if (!coded.options.levels) places = decode_geometry(walked->map, steps_of(coded.options), 0, places_in);
    CodedShape shape;
    for (const std::size_t w : walked->first_with_number()) shape.places.push_back(places[w]);
    FinePlace place{};
    while (shape.places.size() < coded.vertices) {
        for (unsigned k = 0; k < 3; ++k) {
            const std::int64_t next = place[k] + std::int64_t{kFine} * places_in.number_with_sign(kLoosePlace + k);
            if (std::abs(next) > kFarthest) throw Damage();
            place[k] = std::int32_t(next);
        }
        if (places_in.is_damaged()) throw Damage();
        shape.places.push_back(place);
    }
    if (levels && !levels->outline().empty())
        in_levels = level_values({levels->outline(), levels->wedges(), std::move(wedge_at), levels->colors()}, *walked,
                                 shape.places.size());
    shape.face_offsets = std::move(walked->face_offsets);
    shape.corners = std::move(walked->corners);
    return shape;
}

Mesh decode(const PackedMesh& coded, const RunContext& context) {
    if (coded.vertices >= kNoIndex || coded.corners >= kNoIndex / 4 || !(coded.step > 0) ||
        !std::isfinite(coded.step * (1 << 27)))
        throw Damage();
    SymbolReader faces_in(coded.connectivity, kFaceContexts), places_in(coded.places, kPlaceContexts);
    std::optional<CodedShape> shape;
    LevelValues in_levels;
    if (faces_in.bits(1) != 0)
        shape = decode_regular(faces_in, places_in, steps_of(coded.options), coded.vertices, coded.corners);
    else
        shape = decode_shape(coded, faces_in, places_in, in_levels, context);
    if (!shape) throw Damage();
    Mesh mesh = coded.rest;
    mesh.face_offsets = std::move(shape->face_offsets);
    mesh.corners = std::move(shape->corners);
    mesh.positions = positions_of(shape->places, coded);
    if (places_in.is_damaged() || mesh.face_count() != coded.faces ||
        std::ranges::any_of(mesh.corners, [&](Index v) { return v >= coded.vertices; }))
        throw Damage();
    SymbolReader attributes_in(coded.attributes, kAllAttributeContexts);
    if (!decode_rest(in_levels, kAttributeContexts, attributes_in)) throw Damage();
    if (!decode_attributes(mesh, shape->places, attributes_in)) throw Damage();
    if (in_levels.outline.has_uvs) mesh.uvs = std::move(in_levels.uvs);
    if (in_levels.outline.has_colors) {
        mesh.colors = std::move(in_levels.colors);
        mesh.colors_have_alpha = in_levels.outline.has_alpha;
    }
    if (coded.options.keep_order) mesh = put_back(mesh, coded.order);
    return mesh;
}

} // namespace

LevelCodeOptions level_options(const PackOptions& options) {
    const std::int32_t long_step = 4;
    return {.fewest = kCoarsestVertices,
            .steps = options.surface ? steps_of(options) : GeometrySteps{long_step, long_step},
            .is_refined = !options.surface};
}

Mesh mesh_of_levels(const LevelReader& levels, const PackedMesh& coded) {
    const std::vector<bool> closes_hole = levels.closes_hole();
    const std::vector<Triangle> triangles = levels.triangles();
    const AttributeOutline& outline = levels.outline();
    const std::span<const Wedge> wedges = levels.wedges();
    const std::vector<Index> wedge_at = outline.empty() ? std::vector<Index>() : levels.corner_wedges(triangles);
    Mesh mesh;
    mesh.origin = coded.rest.origin;
    std::vector<Index> number(closes_hole.size(), kNoIndex);
    for (Index v = 0; v < number.size(); ++v) {
        if (closes_hole[v]) continue;
        number[v] = static_cast<Index>(mesh.vertex_count());
        mesh.positions.push_back(position_of(levels.place(v), coded));
        if (outline.has_colors) mesh.colors.push_back(AttributeOutline::color(levels.colors()[v]));
    }
    mesh.colors_have_alpha = outline.has_colors && outline.has_alpha;
    mesh.materials.names = outline.has_materials ? coded.rest.materials.names : std::vector<std::string>();
    mesh.embedded_materials = outline.has_materials ? coded.rest.embedded_materials : std::vector<MeshMaterial>();
    mesh.material_files = coded.rest.material_files;
    const auto wedge_of = [&](std::size_t corner) {
        return wedge_at[corner] != kNoIndex ? wedges[wedge_at[corner]] : Wedge();
    };
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        if (std::ranges::any_of(triangles[t], [&](Index v) { return closes_hole[v]; })) continue;
        for (std::size_t k = 0; k < 3; ++k) {
            mesh.corners.push_back(number[triangles[t][k]]);
            if (outline.has_uvs)
                mesh.uvs.corners.push_back(wedge_of(3 * t + k).has_uv ? wedge_at[3 * t + k] : kNoIndex);
        }
        mesh.face_offsets.push_back(static_cast<Index>(mesh.corners.size()));
        if (mesh.materials.names.empty()) continue;
        const Index material = wedge_of(3 * t).material;
        mesh.materials.of_face.push_back(material < mesh.materials.names.size() ? material : kNoIndex);
    }
    for (const Wedge& wedge : wedges)
        if (outline.has_uvs) mesh.uvs.values.push_back(outline.uv(wedge));
    return mesh;
}

Result<PackedMesh> pack_mesh(const Mesh& mesh, const PackOptions& options, PackedMeshReport* report,
                             const RunContext& context) {
    if (options.bits < 10 || options.bits > 16)
        return Error{ErrorCode::usage,
                     "Positions are packed with 10 to 16 bits; " + std::to_string(options.bits) + " were asked for."};
    if (std::optional<Error> error = mesh_error(mesh)) return *error;
    if (mesh.vertex_count() == 0) return Error{ErrorCode::unsuitable, "The mesh has no vertices: nothing to pack."};
    if (mesh.corner_count() >= kNoIndex / 4)
        return Error{ErrorCode::unsuitable, "The mesh has more than a thousand million corners: too many to pack."};
    PackedMesh coded;
    coded.vertices = mesh.vertex_count();
    coded.faces = mesh.face_count();
    coded.corners = mesh.corner_count();
    coded.options = options;
    const Box box = bounds(mesh);
    coded.low = {box.min[0], box.min[1], box.min[2]};
    const double longest = box.size().maxCoeff();
    coded.step = (longest > 0 ? longest : 1.0) / double((1u << options.bits) - 1);

    std::optional<OrderedMesh> ordered;
    if (!options.levels) ordered = encode_regular_shape(mesh, coded, context);
    if (!ordered && !context.is_cancelled()) ordered = encode_shape(mesh, coded, context);
    if (context.is_cancelled()) return cancelled_error();
    Mesh& moved = ordered->mesh;
    moved.positions = positions_of(ordered->places, coded);
    put_attributes_in_order(mesh, *ordered);

    if (report) {
        report->vertex = ordered->vertex;
        double squares = 0, largest = 0;
        const std::size_t count = ordered->met > 0 ? ordered->met : mesh.vertex_count();
        for (std::size_t v = 0; v < count; ++v) {
            const double off =
                (moved.positions[v].cast<double>() - mesh.positions[ordered->vertex[v]].cast<double>()).squaredNorm();
            squares += off;
            largest = std::max(largest, off);
        }
        for (std::size_t v = ordered->met; v < mesh.vertex_count(); ++v) {
            const Vec3d from_low = mesh.positions[ordered->vertex[v]].cast<double>() - box.min;
            report->out_of_reach += from_low.cwiseAbs().maxCoeff() / coded.step * kFine > kFarthest;
        }
        report->rms = std::sqrt(squares / double(count));
        report->largest = std::sqrt(largest);
    }
    SymbolWriter attributes_out(kAllAttributeContexts);
    encode_rest(moved, ordered->in_levels, kAttributeContexts, attributes_out);
    if (ordered->in_levels.outline.has_uvs) moved.uvs = {};
    if (ordered->in_levels.outline.has_colors) moved.colors = {};
    encode_attributes(moved, ordered->places, attributes_out);
    coded.attributes = attributes_out.finish();
    if (options.keep_order) coded.order = write_order(*ordered);

    coded.rest.origin = mesh.origin;
    for (const VertexScalar& scalar : mesh.scalars) coded.rest.scalars.push_back({scalar.name, {}});
    coded.rest.objects.names = mesh.objects.names;
    coded.rest.groups.names = mesh.groups.names;
    coded.rest.materials.names = mesh.materials.names;
    coded.rest.material_files = mesh.material_files;
    coded.rest.embedded_materials = mesh.embedded_materials;
    return coded;
}

Result<Mesh> unpack_mesh(const PackedMesh& coded, const RunContext& context) {
    try {
        Mesh mesh = decode(coded, context);
        if (const std::string wrong = check_mesh(mesh); !wrong.empty())
            return Error{ErrorCode::bad_file, "The packed mesh is inconsistent: " + wrong};
        return mesh;
    } catch (const Damage&) {
        if (context.is_cancelled()) return cancelled_error();
        return Error{ErrorCode::bad_file, "The packed mesh is damaged."};
    }
}

} // namespace filigree
