#include "handles_file.h"

#include "filigree/io/file.h"
#include "filigree/mesh/normals.h"
#include "filigree/mesh/triangulate.h"
#include "filigree/mesh/weld.h"

#include <algorithm>
#include <map>
#include <numbers>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace filigree::cli {

namespace {

using HandlesJson = nlohmann::ordered_json;

struct BadHandle {
    std::string what;
};

Vec3d read_vec(const HandlesJson& json, const std::string& key) {
    const HandlesJson& value = json.at(key);
    if (!value.is_array() || value.size() != 3) throw BadHandle{"\"" + key + "\" must be three numbers"};
    return {value[0].get<double>(), value[1].get<double>(), value[2].get<double>()};
}

std::vector<Index> read_vertices(const HandlesJson& json) {
    if (!json.is_array()) throw BadHandle{"\"vertices\" must be a list of vertex ids"};
    std::vector<Index> vertices;
    for (const HandlesJson& id : json) {
        if (!id.is_number_unsigned() || id.get<std::uint64_t>() >= kNoIndex)
            throw BadHandle{"\"vertices\" must be whole numbers from 0 up, and " + id.dump() + " is no vertex id"};
        vertices.push_back(id.get<Index>());
    }
    return vertices;
}

HandleEntry read_entry(const HandlesJson& json) {
    static const std::array<std::string_view, 9> known = {"name", "vertices", "box",    "sphere", "move",
                                                          "axis", "degrees",  "centre", "comment"};
    for (const auto& [key, value] : json.items())
        if (std::find(known.begin(), known.end(), key) == known.end())
            throw BadHandle{"\"" + key + "\" is not a word of a handle (docs/handles.md lists them)"};
    HandleEntry entry;
    entry.name = json.value("name", "");
    if (json.contains("vertices")) entry.vertices = read_vertices(json.at("vertices"));
    if (json.contains("box")) entry.box = Box{read_vec(json.at("box"), "min"), read_vec(json.at("box"), "max")};
    if (json.contains("sphere"))
        entry.sphere = {read_vec(json.at("sphere"), "centre"), json.at("sphere").at("radius").get<double>()};
    if (json.contains("vertices") + json.contains("box") + json.contains("sphere") != 1)
        throw BadHandle{"a handle needs exactly one of \"vertices\", \"box\" and \"sphere\""};
    if (json.contains("move")) entry.move = read_vec(json, "move");
    if (json.contains("axis") != json.contains("degrees")) throw BadHandle{"\"axis\" and \"degrees\" go together"};
    if (json.contains("axis")) {
        const Vec3d axis = read_vec(json, "axis");
        if (!(axis.norm() > 0)) throw BadHandle{"\"axis\" must not be zero"};
        entry.rotation =
            Eigen::AngleAxisd(json.at("degrees").get<double>() * std::numbers::pi / 180, axis.normalized());
    }
    if (json.contains("centre")) entry.centre = read_vec(json, "centre");
    return entry;
}

std::string handle_name(const HandleEntry& entry, std::size_t number) {
    return entry.name.empty() ? fmt::format("handle {}", number + 1) : "handle '" + entry.name + "'";
}

/// Target of each handle vertex, by vertex id. world: positions of the vertices to choose from. nearest: for ids given
/// one by one, which of those vertices stands for it.
std::map<Index, Vec3d> handle_targets(const HandlesFile& file, const std::vector<Vec3d>& world,
                                      const std::function<Index(Index)>& nearest, std::size_t id_count) {
    std::map<Index, Vec3d> targets;
    for (std::size_t number = 0; number < file.handles.size(); ++number) {
        const HandleEntry& entry = file.handles[number];
        const std::string name = file.path + ": " + handle_name(entry, number);
        std::vector<Index> chosen;
        for (Index id : entry.vertices) {
            if (id >= id_count)
                throw BadHandle{fmt::format("{} names vertex {}, and there are {}", name, id, id_count)};
            chosen.push_back(nearest(id));
        }
        for (Index v = 0; v < world.size(); ++v) {
            const bool in_box = entry.box && (world[v].array() >= entry.box->min.array()).all() &&
                                (world[v].array() <= entry.box->max.array()).all();
            const bool in_sphere = entry.sphere && (world[v] - entry.sphere->first).norm() <= entry.sphere->second;
            if (in_box || in_sphere) chosen.push_back(v);
        }
        std::sort(chosen.begin(), chosen.end());
        chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
        if (chosen.empty())
            throw BadHandle{name + " holds no vertex of what is moved: make its region larger, or the driver finer "
                                   "(strip --base)"};
        Vec3d centre = Vec3d::Zero();
        for (Index v : chosen) centre += world[v] / double(chosen.size());
        centre = entry.centre.value_or(centre);
        for (Index v : chosen)
            if (!targets.emplace(v, centre + entry.rotation * (world[v] - centre) + entry.move).second)
                throw BadHandle{name + " shares a vertex with an earlier handle: keep their regions apart"};
    }
    return targets;
}

Result<Pose> solve(std::span<const Vec3f> positions, std::span<const Triangle> triangles, const Vec3d& origin,
                   const std::map<Index, Vec3d>& targets, const RunContext& context) {
    std::vector<Index> handles;
    std::vector<Vec3f> target_positions;
    for (const auto& [vertex, target] : targets) {
        handles.push_back(vertex);
        target_positions.push_back((target - origin).cast<float>());
    }
    Result<HandleSolver> solver = HandleSolver::create(positions, triangles, handles, context);
    if (!solver) return solver.error();
    Result<HandleResult> result = solver->solve(target_positions, {}, context);
    if (!result) return result.error();
    return std::move(result->pose);
}

std::vector<Vec3d> world_positions(std::span<const Vec3f> positions, const Vec3d& origin) {
    std::vector<Vec3d> world;
    for (const Vec3f& p : positions) world.push_back(origin + p.cast<double>());
    return world;
}

/// Runs `work`, and makes what it throws an Error.
template <class Work>
auto guarded(const std::string& path, const Work& work) -> decltype(work()) {
    try {
        return work();
    } catch (const BadHandle& bad) {
        return Error{ErrorCode::usage, bad.what + "."};
    } catch (const HandlesJson::exception& error) {
        const std::string what = error.what(); // "[json.exception.type_error.302] type must be number, ..."
        const std::size_t bracket = what.find("] ");
        return Error{ErrorCode::bad_file, path + ": " + what.substr(bracket == std::string::npos ? 0 : bracket + 2) +
                                              " (see docs/handles.md)."};
    }
}

} // namespace

Result<HandlesFile> read_handles(const std::string& path) {
    Result<std::string> bytes = read_file(path);
    if (!bytes) return bytes.error();
    HandlesFile file{path, {}};
    const Status status = guarded(path, [&]() -> Status {
        const HandlesJson json = HandlesJson::parse(*bytes);
        for (const HandlesJson& entry : json.at("handles")) try {
                file.handles.push_back(read_entry(entry));
            } catch (const BadHandle& bad) {
                throw BadHandle{fmt::format("{}: handle {}: {}", path, file.handles.size() + 1, bad.what)};
            }
        if (file.handles.empty()) throw BadHandle{path + ": there are no handles"};
        return Success{};
    });
    if (!status) return status.error();
    return file;
}

Result<Mesh> move_mesh_by_handles(Mesh mesh, const HandlesFile& file, const RunContext& context) {
    return guarded(file.path, [&]() -> Result<Mesh> {
        // Vertices at one place move together: the solve is over the first of each place.
        const std::vector<Index> representative = weld_map(mesh.positions);
        const auto targets = handle_targets(
            file, world_positions(mesh.positions, mesh.origin), [](Index v) { return v; }, mesh.vertex_count());
        std::map<Index, Vec3d> welded;
        for (const auto& [vertex, target] : targets)
            if (const auto known = welded.emplace(representative[vertex], target).first; known->second != target)
                throw BadHandle{fmt::format("{}: two handles move vertices {} and {}, which lie at one place, to "
                                            "different places: name them in one handle",
                                            file.path, known->first, vertex)};
        std::vector<Triangle> triangles = triangulate(mesh).triangles;
        for (Triangle& t : triangles)
            for (Index& v : t) v = representative[v];
        Result<Pose> pose = solve(mesh.positions, triangles, mesh.origin, welded, context);
        if (!pose) return pose.error();
        const std::vector<Index> vertex_of_normal = split_shared_normals(mesh);
        for (std::size_t i = 0; i < vertex_of_normal.size(); ++i)
            if (vertex_of_normal[i] != kNoIndex)
                mesh.normals.values[i] = pose->gradients[representative[vertex_of_normal[i]]] * mesh.normals.values[i];
        for (Index v = 0; v < mesh.vertex_count(); ++v) mesh.positions[v] = pose->positions[representative[v]];
        return std::move(mesh);
    });
}

Result<Pose> pose_by_handles(const Model& model, const HandlesFile& file, const RunContext& context) {
    return guarded(file.path, [&]() -> Result<Pose> {
        const Mesh driver = level_mesh(model, 0);
        const std::vector<Vec3d> world = world_positions(driver.positions, driver.origin);
        const auto nearest = [&](Index id) {
            const Vec3d p = model.mesh.world_position(id);
            Index best = 0;
            for (Index v = 1; v < world.size(); ++v)
                if ((world[v] - p).squaredNorm() < (world[best] - p).squaredNorm()) best = v;
            return best;
        };
        const auto targets = handle_targets(file, world, nearest, model.mesh.vertex_count());
        return solve(driver.positions, triangulate(driver).triangles, driver.origin, targets, context);
    });
}

} // namespace filigree::cli
