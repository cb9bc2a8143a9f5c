#include "filigree/io/model/runtime_code.h"

#include "filigree/io/model/mesh_sections.h"
#include "filigree/pack/symbols.h"

#include "runtime/rt_code.h"

#include <bit>
#include <cmath>
#include <limits>
#include <new>

namespace filigree {

namespace {

constexpr int kUvSteps = 4095, kColorSteps = 255, kNormalSteps = 1023;
constexpr double kFarthestStep = 1 << 28;

double squared_number(double x) { return x * x; }

/// The faces around each vertex, so that the face on the other side of an edge is found.
class FaceFinder {
public:
    FaceFinder(std::span<const Index> offsets, std::span<const Index> corners, std::size_t vertices)
        : offsets_(offsets), corners_(corners), starts_(vertices + 1), face_of_(corners.size()),
          is_taken_(offsets.empty() ? 0 : offsets.size() - 1) {
        for (const Index v : corners) ++starts_[v + 1];
        for (std::size_t v = 0; v < vertices; ++v) starts_[v + 1] += starts_[v];
        at_.resize(corners.size());
        std::vector<Index> next(starts_.begin(), starts_.end() - 1);
        for (Index f = 0; f < is_taken_.size(); ++f)
            for (Index c = offsets[f]; c < offsets[f + 1]; ++c) {
                face_of_[c] = f;
                at_[next[corners[c]]++] = c;
            }
    }

    /// The corner of `from` in a face that was not taken yet and has the edge; kNoIndex: none. from kNoIndex: any face.
    Index take(Index from, Index to) {
        if (from == kNoIndex) {
            while (first_ < is_taken_.size() && is_taken_[first_]) ++first_;
            return first_ < is_taken_.size() ? taken(offsets_[first_]) : kNoIndex;
        }
        for (Index k = starts_[from]; k < starts_[from + 1]; ++k) {
            const Index c = at_[k], f = face_of_[c];
            if (!is_taken_[f] && corners_[c + 1 < offsets_[f + 1] ? c + 1 : offsets_[f]] == to) return taken(c);
        }
        return kNoIndex;
    }
    Index face_of(Index corner) const { return face_of_[corner]; }

private:
    Index taken(Index corner) {
        is_taken_[face_of_[corner]] = true;
        return corner;
    }
    std::span<const Index> offsets_, corners_;
    std::vector<Index> starts_, face_of_, at_;
    std::vector<bool> is_taken_;
    std::size_t first_ = 0;
};

/// What the runtime's code writes to, and where it asks.
struct Writing {
    SymbolWriter out;
    FaceFinder mesh, driver;
    std::vector<std::unique_ptr<std::byte[]>> memory = {};
};

Writing& writing_of(void* user) { return *static_cast<Writing*>(user); }

flg_code_source source_of(Writing& writing) {
    flg_code_source source{};
    source.user = &writing;
    source.symbol = [](void* user, std::uint32_t context, std::uint32_t symbol) {
        writing_of(user).out.symbol(context, symbol);
    };
    source.number = [](void* user, std::uint32_t context, std::uint32_t value) {
        writing_of(user).out.number(context, value);
    };
    source.bits = [](void* user, std::uint32_t value, std::uint32_t count) { writing_of(user).out.bits(value, count); };
    source.face_at = [](void* user, int of_driver, std::uint32_t from, std::uint32_t to, std::uint32_t* corner) {
        FaceFinder& finder = of_driver != 0 ? writing_of(user).driver : writing_of(user).mesh;
        *corner = finder.take(from, to);
        return *corner == kNoIndex ? kNoIndex : finder.face_of(*corner);
    };
    return source;
}

flg_code_input memory_of(Writing& writing) {
    return {&writing, nullptr,
            [](void* user, std::uint64_t count, std::size_t item) -> void* {
                std::byte* made = new (std::nothrow) std::byte[count * item + 1];
                if (made) writing_of(user).memory.emplace_back(made);
                return made;
            },
            std::numeric_limits<double>::infinity()};
}

/// The numbers that faces have, or 0.
Index size_of_all(std::span<const Index> offsets) {
    if (offsets.size() < 2) return 3;
    const Index size = offsets[1];
    for (std::size_t f = 0; f + 1 < offsets.size(); ++f)
        if (offsets[f + 1] - offsets[f] != size) return 0;
    return size;
}

void require_written(flg_status status) {
    if (status == FLG_NO_MEMORY) throw std::bad_alloc();
    if (status != FLG_OK)
        throw Error{ErrorCode::unsuitable,
                    "The model cannot be packed for the runtime: it has too many faces, or sizes "
                    "that are no floats; the profile lossless takes it."};
}

/// A place on an octahedron [Meyer et al. 2010].
std::array<std::int32_t, 2> fold_normal(const Vec3f& normal) {
    const Vec3d n = normal.cast<double>();
    const double sum = n.cwiseAbs().sum();
    if (!(sum > 0)) return {kNormalSteps + 1, 0};
    double x = n[0] / sum, y = n[1] / sum;
    if (n[2] < 0) {
        const double folded = (1 - std::abs(y)) * (x < 0 ? -1 : 1);
        y = (1 - std::abs(x)) * (y < 0 ? -1 : 1);
        x = folded;
    }
    return {std::int32_t(std::lround(x * kNormalSteps)), std::int32_t(std::lround(y * kNormalSteps))};
}

/// Codes a model's attributes one after the other.
class AttributeWriter {
public:
    AttributeWriter(const Mesh& mesh, const flg_code_sizes& sizes, const flg_code_source& source, Writing& writing,
                    RuntimeCode& coded)
        : mesh_(mesh), sizes_(sizes), source_(source), writing_(writing), coded_(coded) {
        faces_ = {source.read_corners, sizes.face_size == 0 ? source.read_offsets : nullptr, std::size_t(sizes.faces)};
    }

    void add_all() {
        add_uvs();
        add_normals();
        add_colors();
        for (std::uint32_t i = 0; i < mesh_.scalars.size(); ++i) {
            std::vector<std::int32_t> items(sizes_.vertices);
            for (std::size_t v = 0; v < items.size(); ++v)
                items[source_.number_of[v]] = std::bit_cast<std::int32_t>(mesh_.scalars[i].values[v]);
            write(named("scal.val", FLG_WORDS_OF_VERTICES, 1, items.size(), i), items);
        }
        add_numbers("obj.fac", mesh_.objects.of_face);
        add_numbers("grp.fac", mesh_.groups.of_face);
        add_numbers("mat.fac", mesh_.materials.of_face);
        add_numbers("smooth", mesh_.smoothing);
        coded_.attributes.assign(reinterpret_cast<const char*>(all_.data()), all_.size() * sizeof all_[0]);
    }

private:
    flg_code_values named(std::string_view name, std::uint32_t kind, std::uint32_t columns, std::size_t count,
                          std::uint32_t index = 0) const {
        flg_code_values values{};
        std::copy(name.begin(), name.end(), values.name);
        values.index = index;
        values.kind = kind;
        values.columns = columns;
        values.count = static_cast<std::uint32_t>(count);
        return values;
    }

    void write(const flg_code_values& values, const std::vector<std::int32_t>& items,
               const std::vector<Index>& item_of = {}) {
        writing_.out = SymbolWriter(FLG_VALUE_CONTEXTS);
        const flg_code_input memory = memory_of(writing_);
        require_written(flg_write_values(&sizes_, &values, &source_, &faces_, items.data(), item_of.data(), &memory));
        all_.push_back(values);
        coded_.values.push_back(writing_.out.finish());
        coded_.report.bytes.attributes += coded_.values.back().size();
    }

    /// Items of vertices or corners. of: an item's integers.
    template <class T, class Steps>
    void add(flg_code_values values, const CornerAttribute<T>& attribute, const Steps& of) {
        const std::size_t columns = values.columns;
        std::vector<std::int32_t> items;
        const auto put = [&](std::size_t at, const auto& steps) {
            items.resize(std::max(items.size(), (at + 1) * columns));
            std::copy(steps.begin(), steps.end(), items.begin() + std::ptrdiff_t(at * columns));
        };
        if (attribute.corners.empty()) {
            for (std::size_t v = 0; v < attribute.values.size(); ++v)
                put(source_.number_of[v], of(attribute.values[v]));
            values.count = static_cast<std::uint32_t>(attribute.values.size());
            return write(values, items);
        }
        ++values.kind; // those that a corner has, and of corners as they are read
        std::vector<Index> number(attribute.values.size(), kNoIndex), item_of(sizes_.corners, kNoIndex);
        for (std::size_t c = 0; c < item_of.size(); ++c) {
            const Index item = attribute.corners[source_.corner_order[c]];
            if (item == kNoIndex) continue;
            if (number[item] == kNoIndex) {
                number[item] = values.count++;
                put(number[item], of(attribute.values[item]));
            }
            item_of[c] = number[item];
        }
        write(values, items, item_of);
    }

    void add_uvs() {
        if (mesh_.uvs.empty()) return;
        flg_code_values values = named("uv.val", FLG_VALUES_OF_VERTICES, 2, 0);
        Eigen::AlignedBox2d box;
        for (const Vec2f& uv : mesh_.uvs.values) box.extend(uv.cast<double>());
        for (int k = 0; k < 2; ++k) {
            values.low[k] = box.min()[k];
            values.step[k] = box.sizes()[k] > 0 ? box.sizes()[k] / kUvSteps : 1;
        }
        add(values, mesh_.uvs, [&](const Vec2f& uv) {
            std::array<std::int32_t, 2> steps{};
            for (std::size_t k = 0; k < 2; ++k)
                steps[k] = std::int32_t(std::lround((double(uv[Eigen::Index(k)]) - values.low[k]) / values.step[k]));
            return steps;
        });
    }

    void add_normals() {
        if (mesh_.normals.empty()) return;
        add(named("nrm.val", FLG_NORMALS_OF_VERTICES, 2, 0), mesh_.normals, fold_normal);
    }

    void add_colors() {
        if (mesh_.colors.empty()) return;
        flg_code_values values = named("col.val", FLG_VALUES_OF_VERTICES, 4, 0);
        for (double& step : values.step) step = 1.0 / kColorSteps;
        add(values, CornerAttribute<Vec4f>{mesh_.colors, {}}, [](const Vec4f& color) {
            std::array<std::int32_t, 4> steps{};
            for (std::size_t k = 0; k < 4; ++k)
                steps[k] = std::int32_t(std::lround(std::clamp(color[Eigen::Index(k)], 0.0f, 1.0f) * kColorSteps));
            return steps;
        });
    }

    void add_numbers(std::string_view name, const std::vector<Index>& of_face) {
        if (of_face.empty()) return;
        std::vector<std::int32_t> items;
        for (std::size_t f = 0; f < sizes_.faces; ++f) items.push_back(std::int32_t(of_face[source_.face_order[f]]));
        write(named(name, FLG_NUMBERS_OF_FACES, 1, items.size()), items);
    }

    const Mesh& mesh_;
    const flg_code_sizes& sizes_;
    const flg_code_source& source_;
    Writing& writing_;
    RuntimeCode& coded_;
    flg_faces faces_{};
    std::vector<flg_code_values> all_;
};

/// What of the mesh is not coded.
Mesh rest_of(const Mesh& mesh) {
    Mesh rest;
    rest.origin = mesh.origin;
    rest.face_offsets.clear();
    rest.colors_have_alpha = mesh.colors_have_alpha;
    for (const VertexScalar& scalar : mesh.scalars) rest.scalars.push_back({scalar.name, {}});
    rest.objects.names = mesh.objects.names;
    rest.groups.names = mesh.groups.names;
    rest.materials.names = mesh.materials.names;
    rest.material_files = mesh.material_files;
    rest.embedded_materials = mesh.embedded_materials;
    return rest;
}

/// How finely weights have to be kept for poses to be off by less than a third of the error through them (rms).
std::uint32_t weight_bits_for(const Model& model, const PoseSequence& poses, double error) {
    constexpr std::uint32_t kFewest = 4;
    constexpr std::size_t kFrames = 8;
    const BlendDetail& detail = model.detail;
    if (poses.empty() || poses.frames[0].gradients.empty()) return FLG_WEIGHT_BITS;
    std::vector<Vec3d> rest;
    for (const Vec3f& p : driver_positions(model)) rest.push_back(p.cast<double>());
    double squares = 0; // of what a whole step of both weights moves
    std::size_t count = 0;
    for (std::size_t k = 0; k < std::min(kFrames, poses.frames.size()); ++k) {
        const Pose& pose =
            poses.frames[(2 * k + 1) * poses.frames.size() / (2 * std::min(kFrames, poses.frames.size()))];
        std::vector<Mat3d> gradients;
        std::vector<Vec3d> shifts;
        for (std::size_t i = 0; i < rest.size(); ++i) {
            gradients.push_back(pose.gradients[i].cast<double>());
            shifts.push_back(pose.positions[i].cast<double>() - 0.5 * (gradients[i] * rest[i]));
        }
        for (std::size_t c = 0; c < detail.cells.size(); ++c)
            for (Index r = detail.cell_offsets[c]; r < detail.cell_offsets[c + 1]; ++r) {
                const Triangle& cell = detail.cells[c];
                const std::array<double, 3> b = {1 - double(detail.u[r]) - double(detail.v[r]), double(detail.u[r]),
                                                 double(detail.v[r])};
                Vec3d middle = Vec3d::Zero();
                Mat3d gradient = Mat3d::Zero();
                for (std::size_t j = 0; j < 3; ++j) {
                    middle += b[j] * rest[cell[j]];
                    gradient += b[j] * gradients[cell[j]];
                }
                const Vec3d q = model.mesh.positions[detail.order[r]].cast<double>() - 0.5 * middle;
                for (std::size_t j = 1; j < 3; ++j)
                    squares += (shifts[cell[j]] - shifts[cell[0]] + (gradients[cell[j]] - gradients[cell[0]]) * q -
                                0.5 * (gradient * (rest[cell[j]] - rest[cell[0]])))
                                   .squaredNorm();
                ++count;
            }
    }
    const double most = error / 3 * bounds(model.mesh).diagonal();
    std::uint32_t bits = kFewest; // a step rounds by its twelfth's root
    while (bits < FLG_WEIGHT_BITS && squares / double(count) / 12 > squared_number(most * double(1u << bits))) ++bits;
    return bits;
}

std::vector<Index> numbered(const std::vector<Index>& vertices, std::span<const Index> number_of) {
    std::vector<Index> numbers;
    for (const Index v : vertices) numbers.push_back(number_of[v]);
    std::ranges::sort(numbers);
    return numbers;
}

std::optional<Error> check(const PackOptions& options) {
    if (options.bits < 10 || options.bits > 16)
        return Error{ErrorCode::usage,
                     "Positions are packed with 10 to 16 bits; " + std::to_string(options.bits) + " were asked for."};
    if (options.surface || options.keep_order || options.levels)
        return Error{ErrorCode::usage, "A model that is packed for the runtime is no stream, keeps no order, and has "
                                       "one step in all directions."};
    if (!(options.clip_error > 0 && options.clip_error <= 1))
        return Error{ErrorCode::usage, "clip_error must be above 0 and at most 1: it is a fraction of the diagonal."};
    return std::nullopt;
}

} // namespace

Result<RuntimeCode> code_for_runtime(const Model& model, const PoseSequence& poses, const PackOptions& options,
                                     const RunContext& context) {
    if (std::optional<Error> error = check(options)) return *error;
    const Mesh& mesh = model.mesh;
    const Level& driver = model.driver();
    const std::size_t vertices = mesh.vertex_count(), corners = mesh.corner_count();
    const BlendDetail& detail = model.detail;
    RuntimeCode coded;
    flg_code_sizes sizes{};
    sizes.revision = FLG_CODE_REVISION;
    const bool has_face_cells =
        detail.cells.size() * 3 == driver.corners.size() &&
        std::equal(driver.corners.begin(), driver.corners.end(), reinterpret_cast<const Index*>(detail.cells.data()));
    if (model.driver_is_behind) sizes.flags |= FLG_CODE_DRIVER_BEHIND;
    if (!has_face_cells) sizes.flags |= FLG_CODE_OTHER_CELLS;
    sizes.vertices = vertices;
    sizes.faces = mesh.face_count();
    sizes.corners = corners;
    sizes.face_size = size_of_all(mesh.face_offsets);
    sizes.driver_vertices = static_cast<std::uint32_t>(driver.vertices.size());
    sizes.driver_faces = static_cast<std::uint32_t>(driver.face_count());
    sizes.cells = static_cast<std::uint32_t>(detail.cells.size());
    sizes.bits = options.bits;
    sizes.weight_bits = weight_bits_for(model, poses, options.clip_error);
    const Box box = bounds(mesh);
    for (int k = 0; k < 3; ++k) sizes.low[k] = box.min[k];
    const double longest = box.size().maxCoeff();
    sizes.step = (longest > 0 ? longest : 1.0) / double((1u << options.bits) - 1);

    Writing writing{SymbolWriter(FLG_MESH_CONTEXTS), FaceFinder(mesh.face_offsets, mesh.corners, vertices),
                    FaceFinder(driver.face_offsets, driver.corners, driver.vertices.size())};
    flg_code_source source = source_of(writing);
    const flg_code_input memory = memory_of(writing);
    source.mesh = {mesh.corners.data(), mesh.face_offsets.data(), mesh.face_count()};
    source.driver = {driver.corners.data(), nullptr, driver.face_count()};
    std::vector<std::int32_t> places(3 * vertices);
    for (std::size_t i = 0; i < places.size(); ++i) {
        const std::size_t k = i % 3;
        const double steps = (double(mesh.positions[i / 3][Eigen::Index(k)]) - sizes.low[k]) / sizes.step;
        places[i] = std::int32_t(std::lround(std::clamp(steps, -kFarthestStep, kFarthestStep)));
        coded.report.out_of_reach += k == 0 && std::abs(steps) > kFarthestStep;
    }
    source.places = places.data();
    std::vector<Index> driver_of(vertices, kNoIndex), cell(vertices);
    for (Index i = 0; i < driver.vertices.size(); ++i) driver_of[driver.vertices[i]] = i;
    source.driver_of = driver_of.data();
    source.vertex_of = driver.vertices.data();
    if (model.driver_is_behind) coded.driver_positions = filigree::driver_positions(model);
    source.driver_rest = model.driver_is_behind ? coded.driver_positions.front().data() : nullptr;
    std::vector<float> u(vertices), v(vertices);
    std::vector<double> moved(vertices);
    for (Index c = 0; c < detail.cells.size(); ++c)
        for (Index r = detail.cell_offsets[c]; r < detail.cell_offsets[c + 1]; ++r) {
            cell[detail.order[r]] = c;
            u[detail.order[r]] = detail.u[r];
            v[detail.order[r]] = detail.v[r];
        }
    source.cells = detail.cells.front().data();
    source.cell = cell.data();
    source.u = u.data();
    source.v = v.data();
    source.anchor_tolerance = 2 * sizes.step;
    std::vector<Index> number_of(vertices), face_order(sizes.faces), corner_order(corners), read_corners(corners),
        read_offsets(sizes.faces + 1);
    source.number_of = number_of.data();
    source.face_order = face_order.data();
    source.corner_order = corner_order.data();
    source.read_corners = read_corners.data();
    source.read_offsets = read_offsets.data();
    source.moved = moved.data();
    require_written(flg_write_code(&sizes, &source, &memory));
    coded.mesh = writing.out.finish();
    if (context.is_cancelled()) return cancelled_error();

    PackReport& report = coded.report;
    report.bytes.records = coded.mesh.size();
    report.bytes.driver = sizeof(Vec3f) * coded.driver_positions.size();
    report.vertex_order.resize(model.vertex_count());
    double squares = 0, moved_squares = 0;
    for (Index s = 0; s < model.vertex_count(); ++s) {
        report.vertex_order[number_of[s]] = s;
        double off = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const float read = float(sizes.low[k] + sizes.step * places[3 * s + k]);
            off += squared_number(double(read) - double(mesh.positions[s][Eigen::Index(k)]));
        }
        squares += off;
        report.largest = std::max(report.largest, std::sqrt(off));
        moved_squares += moved[s] * moved[s];
        report.anchor_largest = std::max(report.anchor_largest, moved[s]);
    }
    report.rms = std::sqrt(squares / double(std::max<std::size_t>(model.vertex_count(), 1)));
    report.anchor_rms = std::sqrt(moved_squares / double(std::max<std::size_t>(model.vertex_count(), 1)));
    AttributeWriter(mesh, sizes, source, writing, coded).add_all();
    coded.sizes.assign(reinterpret_cast<const char*>(&sizes), sizeof sizes);
    coded.across_gap = numbered(detail.across_gap, number_of);
    coded.facing_away = numbered(detail.facing_away, number_of);
    coded.rest = rest_of(mesh);
    coded.unpacked_bytes = flg_code_bytes(&sizes) + 24.0 * double(coded.values.size()) * double(corners);
    if (!poses.empty()) {
        code_clips(model, poses, options.clip_error, coded.poses);
        report.bytes.clips = coded.poses.report.bytes.clips;
    }
    return coded;
}

void write_runtime_code(SectionWriter& out, const RuntimeCode& coded) {
    out.items("rt.par",
              std::span(reinterpret_cast<const std::array<char, sizeof(flg_code_sizes)>*>(coded.sizes.data()), 1), 0);
    write_mesh_sections(out, coded.rest, false, false);
    if (!coded.driver_positions.empty()) out.array("rt.dpos", coded.driver_positions);
    out.bytes("rt.mesh", coded.mesh, 0);
    if (!coded.values.empty())
        out.items("rt.att",
                  std::span(reinterpret_cast<const std::array<char, sizeof(flg_code_values)>*>(coded.attributes.data()),
                            coded.values.size()),
                  0);
    for (std::uint32_t k = 0; k < coded.values.size(); ++k) out.bytes("rt.val", coded.values[k], k);
    out.array("bl.gap", coded.across_gap);
    out.array("bl.away", coded.facing_away);
    if (!coded.poses.clips.empty()) {
        out.value("pose.fps", coded.poses.frames_per_second);
        out.value("rt.pose", coded.poses.clip);
    }
    for (std::uint32_t k = 0; k < coded.poses.clips.size(); ++k) out.bytes("rt.clip", coded.poses.clips[k], k);
    write_pictures(out, coded.rest.embedded_materials);
}

bool has_free_weights(const Model& model) {
    const BlendDetail& detail = model.detail;
    constexpr double kFar = 1e-4;       // of the diagonal
    constexpr std::size_t kFewOf = 100; // of so many vertices one may be off
    const std::vector<Vec3f> driver = driver_positions(model);
    std::vector<bool> is_poor(model.mesh.vertex_count()); // those are bound otherwise
    for (const std::vector<Index>* list : {&detail.across_gap, &detail.facing_away})
        for (const Index v : *list) is_poor[v] = true;
    const double far = kFar * bounds(model.mesh).diagonal();
    std::size_t off = 0;
    for (std::size_t c = 0; c < detail.cells.size(); ++c)
        for (Index r = detail.cell_offsets[c]; r < detail.cell_offsets[c + 1]; ++r) {
            if (is_poor[detail.order[r]]) continue;
            float anchor[3];
            std::array<const float*, 3> corner;
            for (std::size_t k = 0; k < 3; ++k) corner[k] = driver[detail.cells[c][k]].data();
            const Vec3f& point = model.mesh.positions[detail.order[r]];
            flg_closest_anchor(corner[0], corner[1], corner[2], point.data(), anchor);
            double moved = 0;
            for (std::size_t k = 0; k < 3; ++k)
                moved += squared_number((1 - double(detail.u[r]) - double(detail.v[r])) * double(corner[0][k]) +
                                        double(detail.u[r]) * double(corner[1][k]) +
                                        double(detail.v[r]) * double(corner[2][k]) - double(anchor[k]));
            off += moved > far * far;
        }
    return off * kFewOf > detail.order.size();
}

Packing runtime_coding_of(const SectionReader& in) {
    const auto sizes = in.value<flg_code_sizes>("rt.par");
    Packing packing;
    packing.options.bits = sizes.bits;
    packing.options.records = true;
    packing.step = sizes.step;
    packing.bytes.records = in.item_count<char>("rt.mesh");
    packing.bytes.driver = sizeof(Vec3f) * in.item_count<Vec3f>("rt.dpos");
    for (std::uint32_t k = 0; k < in.count("rt.val").first; ++k)
        packing.bytes.attributes += in.item_count<char>("rt.val", k);
    for (std::uint32_t k = 0; k < in.count("rt.clip").first; ++k)
        packing.bytes.clips += in.item_count<char>("rt.clip", k);
    return packing;
}

} // namespace filigree
