#include "filigree/scene/world_setup.h"

#include "filigree/core/math.h"
#include "filigree/file.h"
#include "filigree/flesh.h"
#include "filigree/flesh/skin_map.h"
#include "filigree/fracture.h"
#include "filigree/fracture/broken_model.h"
#include "filigree/io/model/model_file.h"
#include "filigree/io/system/file.h"
#include "filigree/mesh.h"
#include "filigree/mesh/closest_point.h"
#include "filigree/mesh/mesh_map.h"
#include "filigree/physics/body/own_weight.h"
#include "filigree/physics/grid/grid_limits.h"
#include "filigree/scene/particles_near.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>
#include <fmt/ranges.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace filigree {

namespace {

namespace fs = std::filesystem;

const Vec3f kBodyColors[] = {
    {0.86f, 0.52f, 0.36f}, {0.42f, 0.60f, 0.80f}, {0.55f, 0.70f, 0.45f}, {0.80f, 0.68f, 0.38f}, {0.62f, 0.50f, 0.72f}};
const Vec3f kObstacleColor{0.62f, 0.63f, 0.65f};

[[noreturn]] void fail_in_scene(const SceneFile& scene, unsigned line, ErrorCode code, const std::string& what) {
    throw BadResultAccess(scene_error(scene, line, code, what));
}

/// A failure inside `work` gets the scene's line.
template <class Work>
auto at_line(const SceneFile& scene, unsigned line, const Work& work) -> decltype(work()) {
    try {
        return work();
    } catch (const BadResultAccess& failure) {
        if (failure.error().code == ErrorCode::cancelled) throw;
        fail_in_scene(scene, line, failure.error().code, failure.error().message);
    }
}

class Hash {
public:
    Hash() { XXH3_64bits_reset(&state_); }
    template <class T>
    void add(const std::vector<T>& items) {
        XXH3_64bits_update(&state_, items.data(), items.size() * sizeof(T));
    }
    void add(const std::string& text) { XXH3_64bits_update(&state_, text.data(), text.size()); }
    std::uint64_t value() const { return XXH3_64bits_digest(&state_); }

private:
    XXH3_state_t state_;
};

constexpr double kOpen = 0.02; ///< spacings between a crack's two sides, from which on it is seen

Box body_box(const ReadyBody& body) { return bounds(body.model.mesh); }

class Builder {
public:
    Builder(const SceneFile& scene, const RunContext& context, KnownMeshes known)
        : scene_(scene), context_(context), known_(std::move(known)) {}

    ReadyScene build() {
        hash_.add(scene_.content);
        for (const std::string& warning : scene_.warnings) warn(warning);
        result_.world = scene_.world;
        result_.bodies.reserve(scene_.bodies.size());
        for (const SceneBody& body : scene_.bodies) add_body(body);
        choose_origin();
        for (const SceneFracture& fracture : scene_.fractures) add_fracture(fracture);
        for (const SceneObstacle& obstacle : scene_.obstacles) add_obstacle(from_origin(obstacle));
        for (const ScenePin& pin : scene_.pins) add_pin(pin);
        for (const SceneForce& force : scene_.forces)
            result_.world.forces.push_back(
                {force.body, particles_of(force.body, force.region, force.line), force.newtons});
        for (const SceneHand& hand : scene_.hands) add_hand(hand);
        warn_of_what_mpm_does_not_feel();
        for (HeatSource& source : result_.world.heat_sources) source.ball.centre -= result_.origin;
        result_.hash = hash_.value();
        return std::move(result_);
    }

private:
    void warn(std::string sentence) { result_.warnings.push_back(std::move(sentence)); }

    void warn_of_what_mpm_does_not_feel() {
        if (std::string sentence = why_models_do_not_meet(result_.actors); !sentence.empty()) warn(std::move(sentence));
        for (const SlenderObstacle& slender : find_slender_obstacles(result_.world, result_.actors)) {
            const SceneObstacle& obstacle = scene_.obstacles[slender.obstacle];
            const std::string& name = obstacle.mesh.empty() ? obstacle.shape : obstacle.mesh;
            warn(slender.sentence(fmt::format("obstacle '{}' (line {})", name, obstacle.line)));
        }
    }

    Mesh mesh_of(const std::string& bytes, const std::string& path) {
        MeshFile file = read_mesh(bytes, path, context_).value();
        for (std::string& warning : file.warnings) warn(std::move(warning));
        return std::move(file.mesh);
    }

    /// A model, or one without levels where there is only a mesh.
    Model model_of(const SceneBody& body) {
        Model model;
        if (body.mesh.empty()) {
            model.mesh = make_shape(body.shape, body.shape_options).value();
            return model;
        }
        if (const auto known = known_.find(body.mesh); known != known_.end()) {
            model.mesh = std::move(known->second);
            known_.erase(known); // bodies alike are made once
            return model;
        }
        const std::string bytes = read_file(path_of(body.mesh)).value();
        if (is_model_file(bytes)) return read_model(bytes, body.mesh, context_).value();
        model.mesh = mesh_of(bytes, body.mesh);
        return model;
    }

    Model stripped(Mesh mesh, const SceneBody& from, const Body& body) const {
        StripOptions options;
        if (from.driver)
            options.base = std::min(*from.driver, std::max<std::size_t>(mesh.vertex_count(), 3));
        else
            options = body_driver_options(mesh, body);
        return strip(std::move(mesh), options, context_).value().model;
    }

    Mesh obstacle_mesh(const std::string& path) {
        const std::string bytes = read_file(path_of(path)).value();
        if (!is_model_file(bytes)) return mesh_of(bytes, path);
        throw BadResultAccess(
            {ErrorCode::bad_file, path + ": is a model where a mesh belongs; write one of its levels as a mesh."});
    }

    void add_body(const SceneBody& from) {
        const auto alike = std::ranges::find(result_.bodies, from.group, &ReadyBody::group);
        const bool is_another = !from.group.empty() && alike != result_.bodies.end();
        const SceneFollow* const follow = follow_of(from);
        ReadyBody body = is_another ? *alike : follow ? ready_flesh(from, *follow) : ready(from);
        body.name = from.name;
        body.color = from.color.value_or(kBodyColors[result_.bodies.size() % std::size(kBodyColors)]);
        body.has_own_color = !from.color;
        const Vec3d middle = body.scale * body_box(body).centre();
        Actor actor{.body = body.body, .velocity = from.velocity, .spin = from.spin, .may_sleep = from.may_sleep};
        const Vec3d centre = from.centre.value_or(middle + body.scale * body.origin) + from.aside;
        actor.placement.linear() = math::matrix(from.rotation);
        actor.placement.translation() = centre - actor.placement.linear() * middle;
        if (!is_another && !follow) warn_of_weight(from, *body.body, actor.placement.linear());
        result_.actors.push_back(std::move(actor));
        result_.bodies.push_back(std::move(body));
    }

    /// What a body is made of and from, wherever it stands.
    ReadyBody ready(const SceneBody& from) {
        ReadyBody body;
        body.group = from.group;
        body.mesh_path = from.mesh;
        body.model = at_line(scene_, from.line, [&] { return model_of(from); });
        Mesh& mesh = body.model.mesh;
        body.origin = std::exchange(mesh.origin, Vec3d::Zero());
        hash_.add(mesh.positions);
        hash_.add(mesh.corners);
        BodyOptions options = from.body;
        options.fields = fields_of(from, [&](std::string_view name) { return mesh_map(mesh, name); });
        body.body = at_line(scene_, from.line, [&] {
            return std::make_shared<const Body>(
                make_body(mesh, from.material, options, context_, &body.report).value());
        });
        body.scale = body.body->scale;
        if (!body.report.warning.empty()) warn(called(from) + ": " + body.report.warning);
        const bool has_own_driver = !body.model.levels.empty();
        if (!has_own_driver)
            body.model = at_line(scene_, from.line, [&] { return stripped(std::move(mesh), from, *body.body); });
        hash_.add(body.model.driver().vertices);
        body.driver = measure_driver(body.model, *body.body);
        if (!has_own_driver) return body;
        if (const std::optional<CoarseDriver> coarse = coarse_driver(body.driver, body.model, *body.body))
            warn(fmt::format("{}: {} (stripped with base {} and max_edge {:.2g}).", called(from), coarse->sentence(),
                             coarse->base, coarse->max_edge));
        return body;
    }

    const SceneFollow* follow_of(const SceneBody& body) const {
        const auto number = std::size_t(&body - scene_.bodies.data());
        const auto found = std::ranges::find(scene_.follows, number, &SceneFollow::body);
        return found == scene_.follows.end() ? nullptr : &*found;
    }

    /// The skin that a body follows; its mesh is the body's, in the bind pose.
    SkinnedMesh skin_of(const SceneFollow& follow, const Mesh& mesh, const std::string& mesh_path) {
        const std::string& path = follow.animation.empty() ? mesh_path : follow.animation;
        if (!fs::is_directory(path_of(path))) hash_.add(read_file(path_of(path)).value());
        CharacterOptions options;
        const Result<MeshFormat> format = mesh_format(path_of(path));
        if (!follow.animation.empty() && !(format && *format == MeshFormat::gltf)) options.rest = &mesh;
        SkinnedMesh skin = read_character(path_of(path), options, context_).value();
        for (const std::string& warning : skin.warnings) warn(warning);
        if (skin.mesh.vertex_count() != mesh.vertex_count())
            throw BadResultAccess(
                {ErrorCode::mismatch, fmt::format("{}: has {} vertices, and the body's mesh has {}", path,
                                                  skin.mesh.vertex_count(), mesh.vertex_count())});
        return skin;
    }

    std::size_t clip_of(const SceneFollow& follow, const SkinnedMesh& skin) const {
        std::vector<std::string_view> names;
        for (std::size_t c = 0; c < skin.clips.size(); ++c) {
            const bool is_it = follow.clip.empty() ? skin.clips[c].seconds > 0 : skin.clips[c].name == follow.clip;
            if (is_it) return c;
            names.push_back(skin.clips[c].name);
        }
        throw BadResultAccess(
            {ErrorCode::bad_file,
             follow.clip.empty()
                 ? std::string("the clips of its animation are single poses, and nothing moves")
                 : fmt::format("there is no clip '{}'; there are {}", follow.clip, fmt::join(names, ", "))});
    }

    /// A body that is the flesh of a character.
    ReadyBody ready_flesh(const SceneBody& from, const SceneFollow& follow) {
        ReadyBody body;
        body.group = from.group;
        body.mesh_path = from.mesh;
        body.follow = follow;
        body.model = at_line(scene_, from.line, [&] { return model_of(from); });
        SkinnedMesh skin = at_line(scene_, follow.line, [&] { return skin_of(follow, body.model.mesh, from.mesh); });
        std::vector<VertexField> fields = fields_of(from, [&](std::string_view name) { return skin_map(skin, name); });
        body.flesh = at_line(scene_, follow.line, [&] {
            body.clip = clip_of(follow, skin);
            FleshOptions options = follow.flesh;
            options.material = from.material;
            options.particles = from.body.cells.count;
            if (from.body.cells.spacing > 0) options.spacing = from.body.cells.spacing;
            options.separate = from.body.separate;
            options.scale = from.body.size ? *from.body.size / bounds(skin.mesh).size().maxCoeff() : from.body.scale;
            options.fields = std::move(fields);
            options.gravity = math::matrix(from.rotation).transpose() * scene_.world.gravity;
            options.sculpted_gravity = follow.is_sculpted;
            for (const SceneFollowJoint& joint : follow.joints) options.soft.push_back(joint.soft);
            for (const SceneFollowContact& contact : follow.contacts) options.contacts.push_back(contact.limbs);
            if (!follow.loose_from.empty())
                options.loose = in_range(skin_map(skin, follow.loose_from).value(), follow.loose_values, {0, 1});
            const std::array clips = {body.clip};
            return std::make_shared<const Flesh>(Flesh::create(std::move(skin), options, clips, context_).value());
        });
        for (const std::string& warning : body.flesh->report().warnings) warn(called(from) + ": " + warning);
        body.body = body.flesh->body();
        body.report = body.flesh->report().body;
        body.scale = body.flesh->scale();
        const bool has_own_driver = !body.model.levels.empty();
        if (!has_own_driver) body.model.mesh = body.flesh->skin().mesh; // in the bind pose
        Mesh& mesh = body.model.mesh;
        body.origin = std::exchange(mesh.origin, Vec3d::Zero());
        hash_.add(mesh.positions);
        hash_.add(mesh.corners);
        if (!has_own_driver)
            body.model = at_line(scene_, from.line, [&] { return stripped(std::move(mesh), from, *body.body); });
        hash_.add(body.model.driver().vertices);
        body.driver = measure_driver(body.model, *body.body);
        return body;
    }

    /// What the maps say of a body. numbers_called: those of its mesh.
    std::vector<VertexField> fields_of(const SceneBody& from, const auto& numbers_called) {
        std::vector<VertexField> fields;
        const auto number = std::size_t(&from - scene_.bodies.data());
        for (const SceneMap& map : scene_.maps) {
            if (map.body != number) continue;
            VertexField& field = fields.emplace_back();
            field.of = map.of;
            field.values = at_line(scene_, map.line,
                                   [&] { return in_range(numbers_called(map.from).value(), map.values, map.range); });
            hash_.add(field.values);
        }
        return fields;
    }

    static std::string called(const SceneBody& body) {
        return fmt::format("body '{}'", body.group.empty() ? body.name : body.group);
    }

    void warn_of_weight(const SceneBody& from, const Body& body, const Mat3d& turn) {
        const OwnWeight weight = own_weight(body, turn, scene_.world.gravity);
        if (weight.is_too_much())
            warn(fmt::format("{} {}: {} = {:.1g}, or young_modulus = {:.0e}?", called(from),
                             weight.sentence(from.material_name), from.body.size ? "size" : "scale",
                             weight.size_that_does(from.body.size.value_or(body.scale)), weight.modulus_that_does()));
    }

    /// The middle of the bodies where it is far from the world's origin, rounded so that taking it off is exact.
    void choose_origin() {
        constexpr double kFar = 100; // sizes of the scene
        Box box;
        for (std::size_t b = 0; b < result_.bodies.size(); ++b) {
            const ReadyBody& body = result_.bodies[b];
            const Box own = body_box(body);
            const Vec3d middle = result_.actors[b].placement * (body.scale * own.centre());
            const double reach = 0.5 * body.scale * own.diagonal();
            box.extend(middle.array() - reach);
            box.extend(middle.array() + reach);
        }
        if (box.centre().norm() > kFar * box.diagonal()) {
            const double step = math::exp2(std::ceil(math::log2(box.diagonal())));
            result_.origin = step * (box.centre() / step).array().round();
            for (Actor& actor : result_.actors) actor.placement.pretranslate(-result_.origin);
        }
        for (std::size_t b = 0; b < result_.bodies.size(); ++b) warn_of_distance(b);
    }

    void warn_of_distance(std::size_t b) {
        constexpr double kMost = 1e4; // spacings: beyond, a float's last digits are seen in the strain
        const ReadyBody& body = result_.bodies[b];
        const Vec3d middle = result_.actors[b].placement * (body.scale * body_box(body).centre());
        if (middle.norm() <= kMost * body.body->spacing()) return;
        warn(fmt::format("body '{}' is {:.3g} m from the scene's origin, too far for float positions of "
                         "particles {:.3g} m apart; bring the bodies nearer to each other by centre",
                         body.name, middle.norm(), body.body->spacing()));
    }

    // What the file says in the world, as seen from the scene's origin.
    void move_to_origin(std::optional<Vec3d>& point) const {
        if (point) *point -= result_.origin;
    }
    SceneObstacle from_origin(SceneObstacle obstacle) const {
        obstacle.ground.point -= result_.origin;
        obstacle.ball.centre -= result_.origin;
        obstacle.box.centre -= result_.origin;
        move_to_origin(obstacle.centre);
        move_to_origin(obstacle.pivot);
        return obstacle;
    }
    SceneRegion from_origin(SceneRegion region) const {
        if (region.box) region.box = Box{region.box->min - result_.origin, region.box->max - result_.origin};
        if (region.ball) region.ball->centre -= result_.origin;
        return region;
    }

    void add_fracture(const SceneFracture& from) {
        ReadyBody& body = result_.bodies[from.body];
        Actor& actor = result_.actors[from.body];
        FracturePattern pattern = from.pattern;
        for (const Vec3d& at : from.at)
            pattern.at.emplace_back(actor.placement.inverse() * (at - result_.origin) / body.scale);
        RunContext seeded = context_;
        seeded.seed = from.material.seed;
        FractureMaterial material = from.material;
        const double diagonal = body.scale * body_box(body).diagonal();
        material.energy =
            from.energy.value_or(usual_fracture_energy(material.strength, body.body->material.young_modulus, diagonal));
        std::shared_ptr<Fracture> fracture;
        at_line(scene_, from.line, [&] {
            body.cells =
                std::make_shared<const FractureCells>(make_fracture_cells(body.model.mesh, pattern, seeded).value());
            fracture = std::make_shared<Fracture>(
                make_fracture(body.body, body.cells, body.scale, material, context_, &body.broken).value());
        });
        for (const SceneCrack& crack : scene_.cracks) {
            if (crack.body != from.body) continue;
            for (const Index piece : crack.pieces)
                if (piece >= body.cells->pieces())
                    fail_in_scene(scene_, crack.line, ErrorCode::bad_file,
                                  fmt::format("there is no piece {} of '{}', which has {}", piece, body.name,
                                              body.cells->pieces()));
            const SceneRegion& region = crack.region;
            const bool everywhere = !region.box && !region.ball && region.vertices.empty();
            fracture->events.push_back(
                {crack.time, crack.pieces,
                 everywhere ? std::vector<Index>() : particles_of(from.body, region, crack.line)});
        }
        actor.fracture = std::move(fracture);
        // The body and its particles stay as they are.
        at_line(scene_, from.line, [&] {
            ModelInPieces cut = cut_model(body.model, *body.cells, body.body->spacing() / body.scale, context_).value();
            body.model = std::move(cut.model);
            body.pieces = std::move(cut.carried);
            body.keeps_closed_cracks = from.keep_closed;
        });
    }

    void add_obstacle(const SceneObstacle& from) {
        Obstacle obstacle = from.obstacle;
        ShownObstacle drawn;
        Vec3d middle = Vec3d::Zero();
        if (from.shape == "ground") {
            middle = from.ground.point;
            HalfSpace plane = from.ground;
            if (!result_.origin.isZero()) plane.point = plane.normal.dot(plane.point) * plane.normal; // what is nearest
            obstacle.shape = plane;
            drawn.is_ground = true;
            drawn.plane = plane;
        } else if (from.shape == "ball") {
            obstacle.shape = from.ball;
            middle = from.ball.centre;
            drawn.mesh = make_ball(from.ball.centre, from.ball.radius);
        } else if (from.shape == "box") {
            obstacle.shape = from.box;
            middle = from.box.centre;
            drawn.mesh = make_box(from.box.centre, from.box.size);
        } else {
            drawn.mesh = at_line(scene_, from.line, [&] { return obstacle_mesh(from.mesh); });
            Mesh& mesh = drawn.mesh;
            hash_.add(mesh.positions);
            hash_.add(mesh.corners);
            OutwardReport outward;
            MeshObstacle shape = at_line(scene_, from.line, [&] {
                return make_mesh_obstacle(mesh, from.scale, from.spacing, context_, &outward).value();
            });
            if (const std::string turned = outward_sentence(outward); !turned.empty())
                warn("obstacle '" + from.mesh + "': " + turned);
            const Vec3d own = from.scale * bounds(mesh).centre();
            middle = from.centre.value_or(own + from.scale * mesh.origin - result_.origin);
            shape.offset = middle - own;
            obstacle.shape = shape;
            for (Vec3f& p : mesh.positions) p = (from.scale * p.cast<double>() + shape.offset).cast<float>();
            mesh.origin = Vec3d::Zero();
        }
        obstacle.motion.centre = from.pivot.value_or(middle);
        drawn.motion = obstacle.motion;
        drawn.moves = obstacle.motion.moves();
        result_.world.obstacles.push_back(std::move(obstacle));
        drawn.color = from.color.value_or(kObstacleColor);
        if (from.visible) result_.drawn.push_back(std::move(drawn));
    }

    /// Particles of a region at the start; all where it names nothing.
    std::vector<Index> particles_of(std::size_t number, const SceneRegion& in_world, unsigned line) const {
        const SceneRegion region = from_origin(in_world);
        const Actor& actor = result_.actors[number];
        const Body& body = *actor.body;
        std::vector<Index> chosen;
        if (!region.vertices.empty()) {
            chosen = particles_at(number, region.vertices, line);
        } else {
            for (Index i = 0; i < body.particle_count(); ++i) {
                const Vec3d p = actor.placement * body.rest[i].cast<double>();
                const bool is_outside = (region.box && ((p.array() < region.box->min.array()).any() ||
                                                        (p.array() > region.box->max.array()).any())) ||
                                        (region.ball && (p - region.ball->centre).norm() > region.ball->radius);
                if (!is_outside) chosen.push_back(i);
            }
        }
        if (chosen.empty())
            fail_in_scene(
                scene_, line, ErrorCode::bad_file,
                fmt::format("the region holds no particle of '{}' at the start; make it larger (particles are "
                            "{:.3g} m apart)",
                            result_.bodies[number].name, body.spacing()));
        return chosen;
    }

    std::vector<Index> particles_at(std::size_t number, std::span<const Index> vertices, unsigned line) const {
        const ReadyBody& body = result_.bodies[number];
        std::vector<Vec3f> points;
        for (const Index vertex : vertices) {
            check_vertex(body, vertex, line);
            points.push_back(float(body.scale) * body.model.mesh.positions[vertex]);
        }
        return particles_near(*body.body, points);
    }

    void check_vertex(const ReadyBody& body, Index vertex, unsigned line) const {
        const std::size_t count = body.model.vertex_count();
        if (vertex >= count)
            fail_in_scene(scene_, line, ErrorCode::bad_file,
                          fmt::format("there is no vertex {} in '{}', which has {}", vertex, body.name, count));
    }

    void add_pin(const ScenePin& from) {
        Pin pin{from.body, particles_of(from.body, from.region, from.line), {}};
        const Actor& actor = result_.actors[from.body];
        Vec3d middle = Vec3d::Zero();
        for (const Index i : pin.particles)
            middle += actor.placement * actor.body->rest[i].cast<double>() / double(pin.particles.size());
        pin.motion = from.motion;
        pin.motion.centre = from.pivot ? Vec3d(*from.pivot - result_.origin) : middle;
        result_.world.pins.push_back(std::move(pin));
    }

    void add_hand(const SceneHand& from) {
        const ReadyBody& body = result_.bodies[from.body];
        const Mesh& mesh = body.model.mesh;
        Hand hand = from.hand;
        hand.target.constant -= result_.origin;
        for (Vec3d& target : hand.target.values) target -= result_.origin;
        if (from.vertex) {
            check_vertex(body, *from.vertex, from.line);
            hand.point = float(body.scale) * mesh.positions[*from.vertex];
        } else {
            const std::vector<Triangle> triangles = triangulate(mesh, context_).value().triangles;
            const ClosestPointTree tree(mesh.positions, triangles, context_);
            const Vec3d at =
                result_.actors[from.body].placement.inverse() * (*from.point - result_.origin) / body.scale;
            hand.point = float(body.scale) * tree.closest(at.cast<float>()).position;
        }
        result_.world.hands.push_back(std::move(hand));
    }

    const SceneFile& scene_;
    const RunContext& context_;
    KnownMeshes known_;
    ReadyScene result_;
    Hash hash_;
};

} // namespace

std::vector<Vec3f> ReadyBody::in_metres(std::vector<Vec3f> points) const {
    for (Vec3f& p : points) p *= float(scale);
    return points;
}

void leave_out_closed_cracks(ReadyBody& body, std::span<const Pose> poses) {
    if (body.pieces.empty() || body.keeps_closed_cracks) return;
    const std::vector<std::uint8_t> is_open =
        open_cracks(body.model, body.pieces.driver, body.pieces.driver_is_on_crack, body.pieces.pieces_of_crack, poses,
                    kOpen * body.body->spacing());
    drop_closed_cracks(body.model.mesh, body.pieces.crack_of_face, is_open);
    std::erase_if(body.pieces.crack_of_face, [&](Index crack) { return crack != kNoIndex && !is_open[crack]; });
}

Result<ReadyScene> set_up(const SceneFile& scene, const RunContext& context, KnownMeshes known) {
    try {
        return Builder(scene, context, std::move(known)).build();
    } catch (const BadResultAccess& failure) {
        return failure.error();
    }
}

} // namespace filigree
