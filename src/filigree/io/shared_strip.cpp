#include "filigree/io/shared_strip.h"

#include "filigree/core/parallel_for.h"
#include "filigree/hierarchy/cluster_simplify.h"
#include "filigree/hierarchy/simplify_levels.h"
#include "filigree/hierarchy/vertex_order.h"
#include "filigree/io/array_file.h"
#include "filigree/io/file_error.h"
#include "filigree/io/model_file.h"
#include "filigree/io/shared_steps.h"
#include "filigree/io/temporary_file.h"
#include "filigree/mesh/edges.h"
#include "filigree/mesh/normals.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <tuple>

namespace filigree {

namespace {

namespace fs = std::filesystem;

using StripCounts = std::vector<std::uint64_t>;
using StripReals = std::vector<double>;

/// What lies in the files: their arrays, in this order.
namespace mesh_file {
enum { counts, positions, normals, representative, triangles, hash }; // counts: vertices, places
}
namespace cut_file {
enum { counts, reals }; // clusters, whether they get there; the share, the error allowed
}
namespace cluster_file {
enum { vertices, positions, triangles, locked };
}
namespace left_file {
enum { triangles, error, followed, dropped };
}
namespace join_file {
enum { counts, error, triangles, removed }; // counts: vertices, whether there are fewer triangles
}
namespace finish_file {
// counts: rounds, levels. Of each level three arrays from `levels` on.
enum { counts, corners, cells, nearest_left, removed, source, is_loose, levels };
} // namespace finish_file
namespace bound_file {
enum { bonds, kinds };
}

std::string task_name(const char* name, std::size_t round) { return name + ('-' + std::to_string(round)); }
std::string task_name(const char* name, std::size_t round, std::size_t cluster) {
    return task_name(name, round) + '-' + std::to_string(cluster);
}

/// What a mesh's triangles and places are, as a hash: a mesh is read twice, maybe on two machines.
std::string hash_of(const Mesh& mesh) {
    const auto bytes = [](const auto& array) {
        return std::string_view(reinterpret_cast<const char*>(array.data()), array.size() * sizeof(array[0]));
    };
    return hash_of_bytes(hash_of_bytes(bytes(mesh.positions)) + hash_of_bytes(bytes(mesh.face_offsets)) +
                         hash_of_bytes(bytes(mesh.corners)));
}

/// Some vertices, and those that they hang near directly or over others: what they can be bound with.
struct BoundTogether {
    std::size_t first = 0, count = 0; ///< the vertices in a row
    std::vector<Index> others;        ///< ascending, none of them in that row

    std::size_t size() const { return count + others.size(); }
    bool has(Index vertex) const {
        return (vertex >= first && vertex - first < count) || std::ranges::binary_search(others, vertex);
    }
    Index local(Index vertex) const {
        if (vertex >= first && vertex - first < count) return Index(vertex - first);
        return Index(count + std::size_t(std::ranges::lower_bound(others, vertex) - others.begin()));
    }
    /// An array's values for all of them.
    template <class T>
    std::vector<T> values(const ArrayReader& file, std::size_t array) const {
        std::vector<T> all = file.read<T>(array, first, count).value();
        const std::vector<T> more = file.pick<T>(array, others).value();
        all.insert(all.end(), more.begin(), more.end());
        return all;
    }
};

BoundTogether bound_together(const ArrayReader& finish, std::size_t first, std::size_t count) {
    BoundTogether part{first, count, {}};
    std::vector<Index> ask = finish.read<Index>(finish_file::nearest_left, first, count).value();
    while (!ask.empty()) {
        std::ranges::sort(ask);
        ask.erase(std::ranges::unique(ask).begin(), ask.end());
        std::erase_if(ask, [&](Index v) { return v == kNoIndex || part.has(v); });
        part.others.insert(part.others.end(), ask.begin(), ask.end());
        std::ranges::sort(part.others);
        ask = finish.pick<Index>(finish_file::nearest_left, ask).value();
    }
    return part;
}

/// The tasks, and in which order. What fails throws BadResultAccess, which `run` turns into an error.
class StripTasks {
public:
    StripTasks(const SharedStrip& strip, const SharedFolder& folder, const WorkChunk& chunk, const RunContext& context)
        : strip_(strip), folder_(folder), context_(context), steps_(folder, chunk) {}

    Result<SharedStripReport> run() {
        const Status all = told([&] { go_through_steps(); });
        if (!all && !folder_.is_finished()) return all.error(); // else another process was the last
        return SharedStripReport{steps_.made(), steps_.tasks(), steps_.waited(), steps_.seconds()};
    }

private:
    void go_through_steps() {
        if (step("mesh", {"mesh"}, [&](std::size_t) { make_mesh(); })) return;
        const StripCounts counts = file("mesh").read<std::uint64_t>(mesh_file::counts).value();
        const std::size_t vertices = counts[0], places = counts[1];
        for (unsigned round = 1;; ++round) {
            const std::optional<NextRound> next = next_round(places, strip_.options, rounds_);
            if (!next) break;
            if (step("cut", {task_name("cut", round)}, [&](std::size_t) { cut(round, *next); })) return;
            const StripCounts cut = file(task_name("cut", round)).read<std::uint64_t>(cut_file::counts).value();
            const bool gets_there = cut[1];
            if (!gets_there) break;
            std::vector<std::string> left;
            for (std::size_t c = 0; c < cut[0]; ++c) left.push_back(task_name("left", round, c));
            if (step("reduce", left, [&](std::size_t c) { reduce(round, c); })) return;
            if (step("join", {task_name("join", round)}, [&](std::size_t) { join(round, cut[0]); })) return;
            rounds_.push_back(round_left(round));
        }
        if (step("finish", {"finish"}, [&](std::size_t) { finish(); })) return;
        std::vector<std::string> bound;
        const std::size_t parts = (vertices + strip_.bound_together - 1) / strip_.bound_together;
        for (std::size_t p = 0; p < parts; ++p) bound.push_back(task_name("bound", p));
        if (step("bind", bound, [&](std::size_t p) { bind(p, vertices); })) return;
        step("write", {"model"}, [&](std::size_t) { write(parts); });
    }

    /// True: the model is there meanwhile.
    template <class Make>
    // NOLINTNEXTLINE(performance-unnecessary-value-param): names are moved
    bool step(const char* phase, std::vector<std::string> names, const Make& make) {
        return steps_
            .take({.names = std::move(names),
                   .phase = phase,
                   .make = [&](std::size_t task) { return told([&] { make(task); }); }},
                  context_)
            .value();
    }

    /// What was thrown, as an error.
    template <class Work>
    static Status told(const Work& work) {
        try {
            work();
            return Success{};
        } catch (const BadResultAccess& failed) {
            return failed.error();
        }
    }

    ArrayReader file(const std::string& name) const { return ArrayReader::open(folder_.file(name)).value(); }
    void save(const std::string& name, const ArrayFile& arrays) const { arrays.write(folder_.file(name)).value(); }
    void stop_if_cancelled() const {
        if (context_.is_cancelled()) Status(cancelled_error()).value();
    }

    /// The mesh as it is stripped, and where its vertices were.
    std::pair<Mesh, std::vector<Index>> read_mesh() const {
        Mesh mesh = strip_.read().value();
        if (const std::optional<Error> wrong = check_strip(mesh, strip_.options)) Status(*wrong).value();
        std::vector<Index> order;
        if (strip_.options.reorder) {
            order = order_by_place(mesh, context_);
            mesh = with_vertex_order(std::move(mesh), order, context_);
        }
        return {std::move(mesh), std::move(order)};
    }

    void make_mesh() const {
        std::string hash;
        const WorkingMesh work = [&] {
            const Mesh mesh = read_mesh().first;
            hash = hash_of(mesh);
            return make_working_mesh(mesh, context_).value();
        }();
        stop_if_cancelled();
        const Surface& surface = work.surface;
        check_size(surface.triangles.size()).value();
        const StripCounts counts{work.positions.size(), surface.place_count};
        const std::vector<char> hash_bytes(hash.begin(), hash.end());
        save("mesh", ArrayFile()
                         .add(counts)
                         .add(work.positions)
                         .add(work.normals)
                         .add(surface.representative)
                         .add(surface.triangles)
                         .add(hash_bytes));
    }

    /// The triangles that a round begins with.
    std::vector<Triangle> triangles_before(unsigned round) const {
        if (round == 1) return file("mesh").read<Triangle>(mesh_file::triangles).value();
        return file(task_name("join", round - 1)).read<Triangle>(join_file::triangles).value();
    }
    std::size_t triangle_count_before(unsigned round) const {
        if (round == 1) return file("mesh").count<Triangle>(mesh_file::triangles);
        return file(task_name("join", round - 1)).count<Triangle>(join_file::triangles);
    }

    void cut(unsigned round, const NextRound& next) const {
        const std::vector<Vec3f> positions = file("mesh").read<Vec3f>(mesh_file::positions).value();
        const std::vector<Triangle> triangles = triangles_before(round);
        const ClusterRound clusters(positions, triangles, round - 1, context_);
        std::vector<std::size_t> free(clusters.size());
        std::vector<Status> saved(clusters.size(), Success{});
        parallel_for(context_, clusters.size(), 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t c = begin; c < end && !context_.is_cancelled(); ++c) {
                const ClusterMesh cluster = clusters.cluster(c);
                free[c] = cluster.free_count();
                saved[c] = ArrayFile()
                               .add(cluster.vertices)
                               .add(cluster.positions)
                               .add(cluster.triangles)
                               .add(cluster.locked)
                               .write(folder_.file(task_name("cluster", round, c)));
            }
        });
        stop_if_cancelled();
        for (const Status& status : saved) status.value();
        const std::optional<double> share =
            clusters.share_left(std::accumulate(free.begin(), free.end(), std::size_t{0}), next.target);
        const StripCounts counts{clusters.size(), share.has_value()};
        const StripReals reals{share.value_or(0), next.max_error};
        save(task_name("cut", round), ArrayFile().add(counts).add(reals));
    }

    void reduce(unsigned round, std::size_t number) const {
        const StripReals cut = file(task_name("cut", round)).read<double>(cut_file::reals).value();
        const ArrayReader from = file(task_name("cluster", round, number));
        const ClusterMesh cluster{.vertices = from.read<Index>(cluster_file::vertices).value(),
                                  .positions = from.read<Vec3f>(cluster_file::positions).value(),
                                  .triangles = from.read<Triangle>(cluster_file::triangles).value(),
                                  .locked = from.read<std::uint8_t>(cluster_file::locked).value()};
        const ReducedCluster left = reduce_cluster(cluster, cut[0], cut[1]);
        const StripReals error{left.error};
        save(task_name("left", round, number),
             ArrayFile().add(left.triangles).add(error).add(left.followed).add(left.dropped));
    }

    /// All clusters of a round, end to end.
    ReducedCluster read_left(unsigned round, std::size_t clusters) const {
        ReducedCluster all;
        const auto append = [](auto& to, const auto& more) { to.insert(to.end(), more.begin(), more.end()); };
        for (std::size_t c = 0; c < clusters; ++c) {
            const ArrayReader left = file(task_name("left", round, c));
            append(all.triangles, left.read<Triangle>(left_file::triangles).value());
            append(all.followed, left.read<std::array<Index, 2>>(left_file::followed).value());
            append(all.dropped, left.read<Index>(left_file::dropped).value());
            all.error = std::max(all.error, left.read<double>(left_file::error).value().at(0));
        }
        return all;
    }

    void join(unsigned round, std::size_t clusters) const {
        ReducedCluster left = read_left(round, clusters);
        const std::size_t vertices = file("mesh").count<Vec3f>(mesh_file::positions);
        const std::vector<std::uint8_t> counts_left = count_triangles(left.triangles, vertices);
        std::erase_if(left.dropped, [&](Index v) { return counts_left[v] > 0; });
        if (!left.dropped.empty()) follow(round, counts_left, left);
        const StripCounts counts{used_vertices(counts_left), left.triangles.size() < triangle_count_before(round)};
        const StripReals error{left.error};
        save(task_name("join", round), ArrayFile().add(counts).add(error).add(left.triangles).add(left.followed));
    }

    /// Vertices that no cluster has kept or seen go, which few meshes have, follow their neighbours.
    void follow(unsigned round, std::span<const std::uint8_t> counts_left, ReducedCluster& left) const {
        std::vector<Index> nearest_left(counts_left.size(), kNoIndex);
        for (const auto& [vertex, to] : left.followed) nearest_left[vertex] = to;
        follow_neighbours(file("mesh").read<Vec3f>(mesh_file::positions).value(), triangles_before(round), counts_left,
                          nearest_left);
        std::ranges::sort(left.dropped);
        left.dropped.erase(std::ranges::unique(left.dropped).begin(), left.dropped.end());
        for (const Index vertex : left.dropped) left.followed.push_back({vertex, nearest_left[vertex]});
    }

    RoundLeft round_left(unsigned round) const {
        const ArrayReader join = file(task_name("join", round));
        const StripCounts counts = join.read<std::uint64_t>(join_file::counts).value();
        return {counts[0], join.read<double>(join_file::error).value().at(0), counts[1] > 0};
    }

    /// The rounds as they were made, one after the other.
    ClusterLevels made_rounds(unsigned& round, std::size_t vertices) const {
        return {.simplify = [&, this](std::span<const Triangle>, std::size_t, double) -> std::optional<Simplified> {
                    if (round == rounds_.size()) return std::nullopt;
                    const RoundLeft& made = rounds_[round++];
                    return Simplified{
                        .triangles = triangles_before(round + 1), .vertex_count = made.vertices, .error = made.error};
                },
                .take_removed = [this, vertices] { return removed(vertices); }};
    }

    RemovedVertices removed(std::size_t vertices) const {
        RemovedVertices all{.nearest_left = std::vector<Index>(vertices, kNoIndex),
                            .removed = std::vector<std::uint8_t>(vertices, 0),
                            .rounds = static_cast<std::uint8_t>(rounds_.size())};
        for (std::uint8_t round = 1; round <= all.rounds; ++round)
            for (const auto& [vertex, to] :
                 file(task_name("join", round)).read<std::array<Index, 2>>(join_file::removed).value()) {
                all.nearest_left[vertex] = to;
                all.removed[vertex] = round;
            }
        return all;
    }

    void finish() const {
        const ArrayReader mesh = file("mesh");
        WorkingMesh work{.positions = mesh.read<Vec3f>(mesh_file::positions).value(), .surface = {}, .normals = {}};
        work.surface.representative = mesh.read<Index>(mesh_file::representative).value();
        work.surface.place_count = mesh.read<std::uint64_t>(mesh_file::counts).value().at(1);
        work.surface.triangles = mesh.read<Triangle>(mesh_file::triangles).value();
        unsigned round = 0;
        const SimplifiedLevels simplified =
            simplify_levels(work, strip_.options, made_rounds(round, work.positions.size()), context_);
        stop_if_cancelled();
        const Level& driver = simplified.levels.front();
        NearestDriver nearest = nearest_driver_vertices(work, simplified, context_);
        nearest.is_loose.resize(nearest.vertex.size(), 0);
        for (Index& v : nearest.vertex)
            if (v != kNoIndex) v = Index(std::ranges::lower_bound(driver.vertices, v) - driver.vertices.begin());
        std::vector<Vec3f> corners;
        for (const Index v : driver.vertices) corners.push_back(work.positions[v]);
        const std::vector<Triangle> cells = driver_cells(driver);
        const StripCounts counts{simplified.removed.rounds, simplified.levels.size()};
        ArrayFile out;
        out.add(counts).add(corners).add(cells);
        out.add(simplified.removed.nearest_left)
            .add(simplified.removed.removed)
            .add(nearest.vertex)
            .add(nearest.is_loose);
        for (const Level& level : simplified.levels) out.add(level.vertices).add(level.face_offsets).add(level.corners);
        save("finish", out);
    }

    void bind(std::size_t part, std::size_t vertices) const {
        const ArrayReader mesh = file("mesh"), finish = file("finish");
        const std::size_t first = part * strip_.bound_together;
        const std::size_t count = std::min(strip_.bound_together, vertices - first);
        const bool has_rounds = finish.count<Index>(finish_file::nearest_left) > 0;
        const BoundTogether own = has_rounds ? bound_together(finish, first, count) : BoundTogether{first, count, {}};
        std::vector<Index> representative = own.values<Index>(mesh, mesh_file::representative);
        for (std::size_t i = 0; i < own.size(); ++i) {
            const std::size_t vertex = i < count ? first + i : own.others[i - count];
            representative[i] = representative[i] == vertex ? Index(i) : kNoIndex;
        }
        RemovedVertices removed;
        if (has_rounds) {
            removed = {.nearest_left = own.values<Index>(finish, finish_file::nearest_left),
                       .removed = own.values<std::uint8_t>(finish, finish_file::removed),
                       .rounds =
                           static_cast<std::uint8_t>(finish.read<std::uint64_t>(finish_file::counts).value().at(0))};
            for (Index& to : removed.nearest_left)
                if (to != kNoIndex) to = own.local(to);
        }
        const std::vector<Vec3f> corners = finish.read<Vec3f>(finish_file::corners).value();
        PlaceBonds bound = bind_places(corners, finish.read<Triangle>(finish_file::cells).value(),
                                       own.values<Vec3f>(mesh, mesh_file::positions),
                                       own.values<Vec3f>(mesh, mesh_file::normals), representative,
                                       {.vertex = own.values<Index>(finish, finish_file::source),
                                        .is_loose = own.values<std::uint8_t>(finish, finish_file::is_loose)},
                                       removed, context_);
        stop_if_cancelled();
        bound.bonds.resize(count);
        bound.kinds.resize(count);
        save(task_name("bound", part), ArrayFile().add(bound.bonds).add(bound.kinds));
    }

    /// How all vertices hang on the driver.
    Binding read_binding(std::size_t parts) const {
        PlaceBonds bound;
        for (std::size_t p = 0; p < parts; ++p) {
            const ArrayReader part = file(task_name("bound", p));
            const std::vector<Bond> bonds = part.read<Bond>(bound_file::bonds).value();
            const std::vector<BondKind> kinds = part.read<BondKind>(bound_file::kinds).value();
            bound.bonds.insert(bound.bonds.end(), bonds.begin(), bonds.end());
            bound.kinds.insert(bound.kinds.end(), kinds.begin(), kinds.end());
        }
        return binding_of(std::move(bound), file("mesh").read<Index>(mesh_file::representative).value());
    }

    void write(std::size_t parts) const {
        Model model;
        std::tie(model.mesh, model.source_order) = read_mesh();
        const std::vector<char> hash = file("mesh").read<char>(mesh_file::hash).value();
        if (hash_of(model.mesh) != std::string(hash.begin(), hash.end()))
            Status(Error{ErrorCode::mismatch, "The mesh has changed while it was stripped; delete " +
                                                  folder_.file("").parent_path().string() + " and begin again."})
                .value();
        const ArrayReader finish = file("finish");
        const std::size_t levels = finish.read<std::uint64_t>(finish_file::counts).value().at(1);
        for (std::size_t k = 0; k < levels; ++k)
            model.levels.push_back({finish.read<Index>(finish_file::levels + 3 * k).value(),
                                    finish.read<Index>(finish_file::levels + 3 * k + 1).value(),
                                    finish.read<Index>(finish_file::levels + 3 * k + 2).value()});
        model.detail = encode_blend(model.mesh.positions, model.driver().vertices,
                                    finish.read<Triangle>(finish_file::cells).value(), read_binding(parts),
                                    strip_.options.precision);
        split_shared_normals(model.mesh);
        stop_if_cancelled();
        const fs::path whole = folder_.file("whole"); // not beside the model's place: a kill leaves nothing there
        write_model(model, whole, context_).value();
        place(whole).value();
    }

    Status place(const fs::path& whole) const {
        if (!folder_.is_ours()) return cannot_write(whole, ENOENT);
        std::error_code failed, ignored;
        fs::rename(whole, strip_.path, failed);
        // Without locks another process may have written it too, and was quicker.
        const bool is_placed = failed == std::errc::no_such_file_or_directory && fs::exists(strip_.path, ignored);
        if (failed && !is_placed) return cannot_write(strip_.path, failed.value());
        sync_folder(strip_.path.parent_path());
        return folder_.end();
    }

    static Status check_size(std::size_t triangles) {
        if (triangles <= kMostListedTriangles) return Success{};
        return Error{ErrorCode::unsuitable, "The mesh has more triangles than 32-bit indices can list (" +
                                                std::to_string(kMostListedTriangles) + "); split it into parts."};
    }

    const SharedStrip& strip_;
    const SharedFolder& folder_;
    const RunContext& context_;
    SharedSteps steps_;
    std::vector<RoundLeft> rounds_;
};

} // namespace

Result<SharedStripReport> strip_in_chunks(const SharedStrip& strip, const WorkChunk& chunk, const RunContext& context) {
    if (Status right = check_chunk(chunk); !right) return right.error();
    if (strip.options.code != DetailCode::blend)
        return Error{ErrorCode::usage,
                     "A model of the reference code is made in one piece: chunks are of the blend code."};
    const SharedFolder folder(strip.path, "Filigree's model, stripped in chunks\njob " + chunk.job + "\n", [&] {
        std::error_code failed;
        return fs::exists(strip.path, failed);
    });
    const Result<bool> begun = folder.begin();
    if (!begun) return begun.error();
    if (*begun) return SharedStripReport{};
    return StripTasks(strip, folder, chunk, context).run();
}

} // namespace filigree
