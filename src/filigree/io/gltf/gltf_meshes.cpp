// The meshes of a glTF scene: blocks of vertices, faces and their labels, node by node.
#include "filigree/io/gltf/gltf_scene.h"
#include "filigree/io/system/text_scanner.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace filigree::gltf {

namespace {

/// Faces that came from one primitive of one node.
struct FaceRun {
    std::size_t block = 0;
    std::size_t first_corner = 0, first_face = 0;
    Index material = kNoIndex, object = kNoIndex;
    UvUse uvs;                 ///< how its material takes them
    Index first_uv = kNoIndex; ///< in the values of mesh.uvs: one a vertex of the geometry; kNoIndex: it has none
};

class MeshReader {
public:
    MeshReader(Scene& scene, const RunContext& context)
        : scene_(scene), document_(*scene.document), context_(context), mesh_(scene.mesh), rest_(rest_pose(scene)) {}

    void read() {
        materials_ = read_materials(document_, scene_.warnings);
        for (const UvUse& use : materials_.uvs) uv_sets_.insert(use.set);
        describe_motions();
        walk();
        if (runs_.empty()) read_points();
        if (scene_.blocks.empty())
            throw Damage{without_area_ > 0 ? "has nothing but lines in its scene, and triangles and points are read."
                                           : "has no mesh in its scene."};
        lay_out();
        label_faces();
        finish_corners();
        collect_warnings();
        for (Geometry& geometry : scene_.geometries) // the mesh has them now
            geometry.uvs = {}, geometry.colors = {}, geometry.scalars = {};
    }

private:
    // ------------------------------------------------------------------------------------------------------- walking

    std::vector<std::size_t> roots() const {
        std::vector<std::size_t> roots;
        const std::size_t scenes = document_.count("scenes");
        const Value chosen = document_.root()["scene"];
        if (scenes == 0 && !chosen) {
            for (const std::size_t n : scene_.order)
                if (scene_.nodes[n].parent == n) roots.push_back(n);
            return roots;
        }
        const std::size_t number = chosen ? chosen.index(scenes, "scenes") : 0;
        const Value nodes = document_.item("scenes", number)["nodes"];
        std::set<std::size_t> met;
        for (std::size_t i = 0; i < nodes.size(); ++i) {
            const std::size_t n = nodes[i].index(scene_.nodes.size(), "nodes");
            if (scene_.nodes[n].parent != n) nodes[i].fail("node " + std::to_string(n) + " is a child of another.");
            if (!met.insert(n).second) nodes[i].fail("node " + std::to_string(n) + " comes twice.");
            roots.push_back(n);
        }
        return roots;
    }

    void walk() {
        std::vector<std::size_t> ahead = roots();
        std::reverse(ahead.begin(), ahead.end());
        while (!ahead.empty()) {
            const std::size_t n = ahead.back();
            ahead.pop_back();
            if (scene_.nodes[n].mesh) read_node(n);
            const std::vector<std::size_t>& children = scene_.nodes[n].children;
            ahead.insert(ahead.end(), children.rbegin(), children.rend());
        }
    }

    void read_node(std::size_t n) {
        constexpr std::size_t kPoints = 0, kLastLines = 3, kTriangles = 4, kFan = 6;
        const Value mesh = document_.item("meshes", *scene_.nodes[n].mesh), primitives = mesh["primitives"];
        if (primitives.size() == 0) primitives.fail("has no primitives.");
        for (std::size_t p = 0; p < primitives.size(); ++p) {
            const Value primitive = primitives[p];
            const std::size_t mode = primitive["mode"].whole(kTriangles);
            if (mode > kFan) primitive["mode"].fail("is " + std::to_string(mode) + ", which is not known.");
            if (mode == kPoints) points_.push_back({n, p});
            if (mode <= kLastLines) {
                ++without_area_;
                continue;
            }
            const std::size_t block = block_of(n, mesh, primitive);
            begin_run(block, n, mesh, primitive);
            add_triangles(primitive, mode, block);
        }
    }

    void read_points() {
        for (const auto& [n, p] : points_) {
            const Value mesh = document_.item("meshes", *scene_.nodes[n].mesh);
            block_of(n, mesh, mesh["primitives"][p]);
            --without_area_;
        }
    }

    // -------------------------------------------------------------------------------------------- vertices and blocks

    std::size_t geometry_of(const Value& mesh, const Value& primitive) {
        std::string key;
        for (const char* part : {"attributes", "targets"})
            if (const Value value = primitive[part]) key += value.json().dump(-1, ' ', true);
        const std::optional<Value> note = our_note(mesh);
        if (note) key += note->json().dump(-1, ' ', true);
        const auto [entry, is_new] = geometry_numbers_.try_emplace(key, scene_.geometries.size());
        if (is_new) {
            if (context_.is_cancelled()) throw Damage{"", ErrorCode::cancelled};
            scene_.geometries.push_back(read_geometry(document_, primitive, uv_sets_, scene_.warnings, notes_));
            if (note) read_repeats(*note, scene_.geometries.back());
        }
        return entry->second;
    }

    static std::optional<Value> our_note(const Value& mesh) {
        const Value extras = mesh["extras"];
        if (!extras || !extras.json().is_object()) return {};
        const Value note = extras["filigree"];
        if (!note || !note.json().is_object()) return {};
        return note;
    }

    /// Believes what our own writer says of copied vertices when it is true.
    void read_repeats(const Value& note, Geometry& geometry) {
        try {
            const std::size_t kept = note["vertices"].whole(), count = geometry.vertex_count();
            if (kept == 0 || kept > count) note["vertices"].fail("does not fit the positions.");
            std::vector<Index> repeats;
            if (const Value reference = note["repeats"]) {
                const Accessor accessor =
                    document_.accessor(reference, {.types = {"SCALAR"}, .components = {Component::uint32}});
                document_.charge(accessor.count, reference.path());
                for (std::size_t i = 0; i < accessor.count; ++i) repeats.push_back(accessor.integer(i));
            }
            if (repeats.size() != count - kept) note["repeats"].fail("does not fit the positions.");
            for (std::size_t i = 0; i < repeats.size(); ++i)
                if (repeats[i] >= kept || geometry.positions[repeats[i]] != geometry.positions[kept + i])
                    note["repeats"].fail("does not fit the positions.");
            geometry.kept = kept;
            geometry.repeats = std::move(repeats);
            geometry.is_ours = true;
        } catch (const Damage& damage) {
            scene_.warnings.push_back(damage.what + " Vertices at seams stay apart.");
        }
    }

    std::size_t block_of(std::size_t n, const Value& mesh, const Value& primitive) {
        const std::size_t geometry = geometry_of(mesh, primitive);
        const Node& node = scene_.nodes[n];
        const bool shared = scene_.geometries[geometry].is_ours && node.parent == n;
        const std::string owner = shared ? motion_of(n, mesh) : std::to_string(n);
        const auto [entry, is_new] = block_numbers_.try_emplace({geometry, owner}, scene_.blocks.size());
        if (!is_new) return entry->second;
        const std::size_t targets = scene_.geometries[geometry].targets.size();
        document_.charge(scene_.geometries[geometry].vertex_count() * (1 + targets), primitive.path());
        if (context_.is_cancelled()) throw Damage{"", ErrorCode::cancelled};
        Block& block = scene_.blocks.emplace_back();
        block.node = n;
        block.geometry = geometry;
        block.skinned = is_skinned(node, scene_.geometries[geometry], primitive);
        block.mirrored = !block.skinned && rest_.world[n].linear.determinant() < 0;
        check_weights(node, mesh, scene_.geometries[geometry]);
        return entry->second;
    }

    bool is_skinned(const Node& node, const Geometry& geometry, const Value& primitive) {
        if (!node.skin) return false;
        if (geometry.influences.empty()) {
            scene_.warnings.push_back(primitive.path() +
                                      ": has a skin but no joints and weights; it was left unskinned.");
            return false;
        }
        check_matrices(*node.skin, geometry);
        const std::size_t joints = scene_.skins[*node.skin].joints.size();
        if (geometry.influences.joints_used > joints)
            primitive.fail("has weights for joint " + std::to_string(geometry.influences.joints_used - 1) +
                           " of a skin that has " + std::to_string(joints) + ".");
        return true;
    }

    /// Some exporters leave a joint's matrix unset when no vertex has a weight for the joint.
    void check_matrices(std::size_t number, const Geometry& geometry) {
        const Skin& skin = scene_.skins[number];
        if (skin.damaged.empty()) return;
        const Value matrices = document_.item("skins", number)["inverseBindMatrices"];
        for (const Index joint : geometry.influences.joints)
            if (joint < skin.damaged.size() && skin.damaged[joint])
                matrices.fail("matrix " + std::to_string(joint) +
                              " is not finite or has a last row that is not 0 0 0 1.");
        const auto count = std::count(skin.damaged.begin(), skin.damaged.end(), true);
        const std::string warning = matrices.path() + ": " + std::to_string(count) +
                                    (count == 1 ? " matrix is damaged, of a joint that moves no vertex; left out."
                                                : " matrices are damaged, of joints that move no vertex; left out.");
        if (std::find(scene_.warnings.begin(), scene_.warnings.end(), warning) == scene_.warnings.end())
            scene_.warnings.push_back(warning);
    }

    static void check_weights(const Node& node, const Value& mesh, const Geometry& geometry) {
        const Value weights = mesh["weights"];
        for (const std::size_t count : {node.weights.size(), weights.size()})
            if (count > 0 && count != geometry.targets.size())
                mesh.fail("has " + std::to_string(geometry.targets.size()) + " morph targets and " +
                          std::to_string(count) + " weights.");
    }

    /// What decides where a root node's vertices are, as text. Nodes of one text are one mesh in our own files.
    std::string motion_of(std::size_t n, const Value& mesh) const {
        Json node = document_.item("nodes", n).json();
        for (const char* member : {"name", "mesh", "extras", "extensions", "children"}) node.erase(member);
        std::string motion = node.dump(-1, ' ', true); // begins with a brace, unlike a node's number
        if (const Value weights = mesh["weights"]) motion += weights.json().dump(-1, ' ', true);
        const auto moved = motions_.find(n);
        return moved == motions_.end() ? motion : motion + moved->second;
    }

    void describe_motions() {
        for (std::size_t a = 0; a < scene_.animations.size(); ++a)
            for (const Channel& channel : scene_.animations[a].channels) {
                const Sampler& sampler = scene_.animations[a].samplers[channel.sampler];
                for (const std::string& part :
                     {std::to_string(a), std::to_string(static_cast<int>(channel.path)), sampler.times.path,
                      sampler.values.path, std::to_string(static_cast<int>(sampler.interpolation))})
                    motions_[channel.node].append(part).append(" ");
            }
    }

    // --------------------------------------------------------------------------------------------------------- faces

    void begin_run(std::size_t block, std::size_t n, const Value& mesh, const Value& primitive) {
        FaceRun& run = runs_.emplace_back();
        run.block = block;
        run.first_corner = mesh_.corners.size();
        run.first_face = mesh_.face_count();
        if (const Value material = primitive["material"]) {
            const std::size_t number = material.index(materials_.number.size(), "materials");
            run.material = materials_.number[number];
            run.uvs = materials_.uvs[number];
        }
        std::string name = scene_.nodes[n].name;
        if (const Value mesh_name = mesh["name"]; name.empty() && mesh_name && mesh_name.json().is_string())
            name = mesh_name.text();
        if (name.empty()) name = "node_" + std::to_string(n);
        nodes_with_faces_.insert(n);
        const auto [entry, is_new] = object_numbers_.try_emplace(name, static_cast<Index>(objects_.size()));
        if (is_new) objects_.push_back(name);
        run.object = entry->second;
    }

    /// Indices of the geometry's vertices, checked.
    std::vector<Index> indices_of(const Value& primitive, std::size_t vertices) {
        std::vector<Index> indices;
        const Value reference = primitive["indices"];
        if (!reference) {
            document_.charge(vertices, primitive.path());
            indices.resize(vertices);
            for (Index i = 0; i < vertices; ++i) indices[i] = i;
            return indices;
        }
        const Accessor accessor = document_.accessor(
            reference, {.types = {"SCALAR"}, .components = {Component::uint8, Component::uint16, Component::uint32}});
        document_.charge(accessor.count, reference.path());
        indices.resize(accessor.count);
        for (std::size_t i = 0; i < accessor.count; ++i) {
            indices[i] = accessor.integer(i);
            if (indices[i] >= vertices)
                reference.fail("index " + std::to_string(i) + " refers to vertex " + std::to_string(indices[i]) +
                               ", and there are " + std::to_string(vertices) + ".");
        }
        return indices;
    }

    void add_triangles(const Value& primitive, std::size_t mode, std::size_t block_number) {
        constexpr std::size_t kTriangles = 4, kStrip = 5;
        const Block& block = scene_.blocks[block_number];
        const std::vector<Index> indices = indices_of(primitive, scene_.geometries[block.geometry].vertex_count());
        const std::size_t triangles =
            mode == kTriangles ? indices.size() / 3 : std::max<std::size_t>(indices.size(), 2) - 2;
        if (mesh_.corners.size() + 3 * triangles >= kNoIndex - 1)
            primitive.fail("gives the scene more corners than 32-bit indices can count.", ErrorCode::unsupported);
        if (mode == kTriangles && indices.size() % 3 != 0) ++cut_triangles_;
        for (std::size_t t = 0; t < triangles; ++t) {
            Triangle triangle;
            if (mode == kTriangles)
                triangle = {indices[3 * t], indices[3 * t + 1], indices[3 * t + 2]};
            else if (mode == kStrip)
                triangle = {indices[t], indices[t + 1 + t % 2], indices[t + 2 - t % 2]};
            else
                triangle = {indices[t + 1], indices[t + 2], indices[0]};
            const auto [a, b, c] = triangle;
            if (mode != kTriangles && (a == b || b == c || c == a)) continue; // strips are sewn together with these
            if (block.mirrored) std::swap(triangle[1], triangle[2]);
            mesh_.add_face(triangle);
        }
    }

    // ----------------------------------------------------------------------------------------------------- attributes

    const Geometry& geometry(const Block& block) const { return scene_.geometries[block.geometry]; }

    /// Gives every block its place in the mesh's arrays and fills them, positions apart.
    void lay_out() {
        std::size_t vertices = 0;
        for (Block& block : scene_.blocks) {
            block.first_vertex = vertices;
            vertices += geometry(block).kept;
            if (vertices >= kNoIndex)
                throw Damage{"has more vertices than 32-bit indices can count.", ErrorCode::unsupported};
        }
        mesh_.positions.resize(vertices);
        lay_out_normals();
        lay_out_uvs();
        lay_out_colors();
        lay_out_scalars();
    }

    /// One value a vertex where every block has them and no vertex has several.
    void lay_out_normals() {
        for (Block& block : scene_.blocks) {
            const Geometry& from = geometry(block);
            block.first_normal = mesh_.normals.values.size();
            mesh_.normals.values.insert(mesh_.normals.values.end(), from.normals.begin(), from.normals.end());
            if (from.normals.empty() || !from.repeats.empty()) normals_of_corners_ = true;
        }
        if (mesh_.normals.values.empty()) normals_of_corners_ = false;
    }

    /// The same, where a block's faces also take their UVs in one way.
    void lay_out_uvs() {
        std::vector<std::vector<std::size_t>> laid(scene_.blocks.size()); // runs whose values are new, by block
        std::set<std::pair<std::size_t, std::size_t>> used;               // geometry and set
        for (std::size_t r = 0; r < runs_.size(); ++r) {
            FaceRun& run = runs_[r];
            std::vector<std::size_t>& known = laid[run.block];
            const auto same = std::find_if(known.begin(), known.end(),
                                           [&](std::size_t other) { return runs_[other].uvs == run.uvs; });
            if (same != known.end()) {
                run.first_uv = runs_[*same].first_uv;
                continue;
            }
            known.push_back(r);
            used.insert({scene_.blocks[run.block].geometry, run.uvs.set});
            run.first_uv = add_uvs(scene_.blocks[run.block], run.uvs);
            if (run.first_uv == kNoIndex && run.uvs.set > 0) ++without_set_;
            if (known.size() > 1) uvs_of_corners_ = true;
        }
        if (runs_.empty()) // points
            for (const Block& block : scene_.blocks) add_uvs(block, {}), used.insert({block.geometry, 0});
        if (mesh_.uvs.values.empty()) uvs_of_corners_ = false;
        for (std::size_t g = 0; g < scene_.geometries.size(); ++g)
            for (const auto& [set, values] : scene_.geometries[g].uvs)
                if (!used.contains({g, set})) notes_.left_out.insert("TEXCOORD_" + std::to_string(set));
    }

    /// A block's UVs as a material takes them, behind the others; their place; kNoIndex where the block lacks them.
    Index add_uvs(const Block& block, const UvUse& use) {
        const Geometry& from = geometry(block);
        const auto values = from.uvs.find(use.set);
        if (values == from.uvs.end() || !from.repeats.empty()) uvs_of_corners_ = true;
        if (values == from.uvs.end()) return kNoIndex;
        const std::size_t first = mesh_.uvs.values.size();
        document_.charge(values->second.size(), "the UVs of a material");
        if (first + values->second.size() >= kNoIndex)
            throw Damage{"has more UVs than 32-bit indices can count.", ErrorCode::unsupported};
        for (const Vec2f& uv : values->second) mesh_.uvs.values.push_back(use.apply(uv));
        return static_cast<Index>(first);
    }

    void lay_out_colors() {
        const auto has_colors = [&](const Block& block) { return !geometry(block).colors.empty(); };
        if (std::none_of(scene_.blocks.begin(), scene_.blocks.end(), has_colors)) return;
        mesh_.colors.resize(mesh_.positions.size(), Vec4f::Ones());
        for (const Block& block : scene_.blocks) {
            const Geometry& from = geometry(block);
            if (from.colors.empty()) continue;
            std::copy_n(from.colors.begin(), from.kept,
                        mesh_.colors.begin() + static_cast<std::ptrdiff_t>(block.first_vertex));
            mesh_.colors_have_alpha |= from.colors_have_alpha;
        }
    }

    void lay_out_scalars() {
        std::map<std::string, std::size_t> numbers;
        for (const Block& block : scene_.blocks)
            for (const VertexScalar& scalar : geometry(block).scalars) {
                const auto [entry, is_new] = numbers.try_emplace(scalar.name, mesh_.scalars.size());
                if (is_new) {
                    document_.charge(mesh_.positions.size(), "the attribute _" + scalar.name);
                    mesh_.scalars.push_back({scalar.name, std::vector<float>(mesh_.positions.size())});
                }
                std::copy_n(scalar.values.begin(), geometry(block).kept,
                            mesh_.scalars[entry->second].values.begin() +
                                static_cast<std::ptrdiff_t>(block.first_vertex));
            }
    }

    void label_faces() {
        const bool has_materials =
            std::any_of(runs_.begin(), runs_.end(), [](const FaceRun& run) { return run.material != kNoIndex; });
        const bool has_objects = nodes_with_faces_.size() > 1;
        if (has_materials) {
            for (const MeshMaterial& material : materials_.materials) mesh_.materials.names.push_back(material.name);
            mesh_.embedded_materials = std::move(materials_.materials);
        }
        if (has_objects) mesh_.objects.names = objects_;
        for (std::size_t r = 0; r < runs_.size(); ++r) {
            const std::size_t end = r + 1 < runs_.size() ? runs_[r + 1].first_face : mesh_.face_count();
            if (has_materials) mesh_.materials.of_face.resize(end, runs_[r].material);
            if (has_objects) mesh_.objects.of_face.resize(end, runs_[r].object);
        }
    }

    /// Corners so far are vertices of the geometry of their run's block.
    void finish_corners() {
        if (normals_of_corners_) mesh_.normals.corners.resize(mesh_.corners.size(), kNoIndex);
        if (uvs_of_corners_) mesh_.uvs.corners.resize(mesh_.corners.size(), kNoIndex);
        for (std::size_t r = 0; r < runs_.size(); ++r) {
            const std::size_t end = r + 1 < runs_.size() ? runs_[r + 1].first_corner : mesh_.corners.size();
            const Block& block = scene_.blocks[runs_[r].block];
            const Geometry& from = geometry(block);
            const bool normals = normals_of_corners_ && !from.normals.empty();
            const Index first_uv = uvs_of_corners_ ? runs_[r].first_uv : kNoIndex;
            for (std::size_t c = runs_[r].first_corner; c < end; ++c) {
                Index& corner = mesh_.corners[c];
                if (normals) mesh_.normals.corners[c] = static_cast<Index>(block.first_normal + corner);
                if (first_uv != kNoIndex) mesh_.uvs.corners[c] = first_uv + corner;
                corner = static_cast<Index>(block.first_vertex + from.source(corner));
            }
        }
    }

    void collect_warnings() {
        const auto warn = [&](std::size_t count, const std::string& what) {
            if (count > 0) scene_.warnings.push_back(std::to_string(count) + " " + what);
        };
        warn(without_area_, "primitives of points or lines were left out.");
        warn(cut_triangles_, "primitives end within a triangle, which was left out.");
        warn(without_set_, "primitives lack the set of UVs that their material's picture is laid by; they have none.");
        warn_of("Attributes that are not read were left out: ", notes_.left_out, ".");
        warn_of("Attributes whose numbers are of a kind that glTF does not have for them were left out: ",
                notes_.unsuited, ".");
        warn_of("Integers without \"normalized\" were taken as normalized (the largest of their type is 1): ",
                notes_.as_normalized, ".");
        warn_of("Integers without \"normalized\" were taken as they are, as none is beyond 1: ", notes_.as_they_are,
                ".");
        warn_of("Joints whose numbers are of a kind that glTF does not have for them were taken as whole numbers: ",
                notes_.whole_numbers, ".");
    }

    void warn_of(const std::string& before, const std::set<std::string>& names, const std::string& end) {
        constexpr std::size_t kMostNames = 5;
        if (names.empty()) return;
        std::string list;
        std::size_t count = 0;
        for (const std::string& name : names)
            if (count++ < kMostNames) list += (list.empty() ? "" : ", ") + in_quotes(name);
        scene_.warnings.push_back(
            before + list + (count > kMostNames ? " and " + std::to_string(count - kMostNames) + " more" : "") + end);
    }

    Scene& scene_;
    Document& document_;
    const RunContext& context_;
    Mesh& mesh_;
    ScenePose rest_;
    Materials materials_;
    std::map<std::string, std::size_t> geometry_numbers_;
    std::map<std::pair<std::size_t, std::string>, std::size_t> block_numbers_;
    std::map<std::size_t, std::string> motions_; ///< of animated nodes
    std::vector<FaceRun> runs_;
    std::set<std::size_t> nodes_with_faces_;
    std::vector<std::string> objects_;
    std::map<std::string, Index> object_numbers_;
    std::vector<std::pair<std::size_t, std::size_t>> points_; ///< node and primitive
    std::set<std::size_t> uv_sets_ = {0};
    AttributeNotes notes_;
    std::size_t without_area_ = 0, cut_triangles_ = 0, without_set_ = 0;
    bool normals_of_corners_ = false, uvs_of_corners_ = false;
};

} // namespace

void read_meshes(Scene& scene, const RunContext& context) { MeshReader(scene, context).read(); }

} // namespace filigree::gltf
