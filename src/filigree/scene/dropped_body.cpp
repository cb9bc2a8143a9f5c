#include "filigree/scene/dropped_body.h"

#include "filigree/core/math.h"
#include "filigree/mesh.h"
#include "filigree/physics/body/own_weight.h"
#include "filigree/scene/particles_near.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include <fmt/format.h>

namespace filigree {

namespace {

constexpr double kEarthGravity = 9.81; // m/s^2
// Obstacles, in sizes of the body.
constexpr double kBallRadius = 0.35, kBallAside = 0.12;
constexpr double kStepHeight = 0.3, kStepWidth = 1.6;
constexpr double kSlopeDegrees = 25, kSlopeLength = 2.2, kSlopeThickness = 0.12;

/// The directions of a world whose `up` is one of the axes.
struct UpFrame {
    Vec3d up, side, front;

    explicit UpFrame(const Vec3d& upwards) : up(upwards) {
        int axis = 0;
        up.cwiseAbs().maxCoeff(&axis);
        side = Vec3d::Unit(axis == 0 ? 1 : 0);
        front = side.cross(up);
    }
};

/// Adds an obstacle whose highest point is at `top` (m along up), and says how far down it reaches.
class DropBuilder {
public:
    DropBuilder(const DropOptions& options, const Vec3d& up, const Box& box, double scale)
        : options_(options), at_(up), middle_(scale * box.centre()), size_(options.size), scale_(scale) {
        const Vec3d low = scale * box.min, high = scale * box.max;
        lowest_ = std::min(low.dot(up), high.dot(up)) - options.drop;
    }

    void build(DroppedBody& dropped) {
        dropped_ = &dropped;
        dropped.world.gravity = options_.gravity ? Vec3d(-kEarthGravity * at_.up) : Vec3d(Vec3d::Zero());
        double ground = lowest_;
        if (options_.obstacle == ObstacleChoice::ball) ground = add_ball();
        if (options_.obstacle == ObstacleChoice::step) ground = add_step();
        if (options_.obstacle == ObstacleChoice::slope) ground = add_slope();
        if (!options_.ground) return;
        add(HalfSpace{ground * at_.up, at_.up}, {});
        dropped.surroundings.has_ground = true;
        dropped.surroundings.ground_level = ground / scale_;
    }

private:
    Vec3d place(double side, double height) const {
        return middle_ - middle_.dot(at_.up) * at_.up + side * at_.side + height * at_.up;
    }
    /// Sizes along side, up and front as sizes along x, y and z.
    Vec3d along_axes(double side, double up, double front) const {
        return (side * at_.side + up * at_.up + front * at_.front).cwiseAbs();
    }

    void add(decltype(Obstacle::shape) shape, const RigidMotion& motion) {
        Obstacle obstacle;
        obstacle.shape = std::move(shape);
        obstacle.motion = motion;
        obstacle.friction = options_.friction;
        obstacle.restitution = options_.restitution;
        dropped_->world.obstacles.push_back(std::move(obstacle));
    }
    void draw(Mesh mesh, const Eigen::Isometry3d& motion) {
        for (Vec3f& p : mesh.positions) p = ((motion * p.cast<double>()) / scale_).cast<float>();
        dropped_->surroundings.obstacles.push_back(std::move(mesh));
    }

    double add_ball() {
        const double radius = kBallRadius * size_;
        const Ball ball{place(kBallAside * size_, lowest_ - radius), radius};
        add(ball, {});
        draw(make_ball(ball.centre, ball.radius), Eigen::Isometry3d::Identity());
        return lowest_ - 2 * radius;
    }
    double add_step() {
        const double height = kStepHeight * size_, width = kStepWidth * size_;
        // Its edge is under the middle, so that the body tips over it.
        const Cuboid step{place(-0.5 * width, lowest_ - 0.5 * height), along_axes(width, height, width)};
        add(step, {});
        draw(make_box(step.centre, step.size), Eigen::Isometry3d::Identity());
        return lowest_ - height;
    }
    double add_slope() {
        const double length = kSlopeLength * size_, thickness = kSlopeThickness * size_;
        const double angle = kSlopeDegrees * std::numbers::pi / 180;
        // Turned about the middle of its upper side, so far down that a body as wide as its size clears its upper half.
        const double below = 0.5 * size_ * math::tan(angle);
        const Vec3d pivot = place(0, lowest_ - below);
        const Cuboid slope{pivot - 0.5 * thickness * at_.up, along_axes(length, thickness, kStepWidth * size_)};
        RigidMotion motion;
        motion.centre = pivot;
        motion.angle.constant = angle * at_.front;
        add(slope, motion);
        const Eigen::Isometry3d turned = motion.at(0);
        Mesh mesh = make_box(slope.centre, slope.size);
        double ground = std::numeric_limits<double>::infinity();
        for (const Vec3f& p : mesh.positions) ground = std::min(ground, (turned * p.cast<double>()).dot(at_.up));
        draw(std::move(mesh), turned);
        return ground;
    }

    const DropOptions& options_;
    UpFrame at_;
    Vec3d middle_;
    double size_, scale_, lowest_;
    DroppedBody* dropped_ = nullptr;
};

void warn(BodyReport& report, const std::string& sentence) {
    report.warning += (report.warning.empty() ? "" : " ") + sentence;
}

/// Particles near the pinned vertices are held fast, where they are.
void hold_pinned(std::span<const Index> pinned, DroppedBody& dropped) {
    const std::vector<Vec3f> driver = driver_positions(*dropped.model);
    std::vector<Vec3f> points; // m
    for (const Index v : pinned) points.push_back(float(dropped.scale) * driver[v]);
    Pin pin;
    pin.particles = particles_near(*dropped.body, points);
    if (!pin.particles.empty()) dropped.world.pins.push_back(std::move(pin));
}

/// J a kilogram takes up from its start until it has melted.
double heat_of_melting(const Material& material) {
    return material.specific_heat * std::max(0.0, material.melting_to - material.temperature) + material.latent_heat;
}

/// The air, and the surface that parts and joins. A mesh that is open melts too, but neither parts nor joins.
Status let_it_melt(const DropOptions& options, const BodyLook& look, DroppedBody& dropped, const RunContext& context) {
    constexpr double kWarmer = 60; // K
    const Body& body = *dropped.body;
    World& world = dropped.world;
    world.air_temperature.constant = options.air_temperature;
    world.air_heat_transfer = kAirHeatTransfer;
    const double volume = double(body.particle_count()) * math::pow(body.spacing(), 3);
    const double area = math::cbrt(36 * std::numbers::pi * volume * volume); // of a ball of that volume
    const double seconds =
        volume * body.material.density * heat_of_melting(body.material) / (kAirHeatTransfer * area * kWarmer);
    world.heat_pace = std::max(1.0, seconds / options.melting_time);
    Result<MeltingModel> melting = MeltingModel::create(dropped.model, body, dropped.scale, look, context);
    if (melting) {
        dropped.melting = std::make_shared<const MeltingModel>(std::move(*melting));
    } else if (melting.error().code == ErrorCode::unsuitable) {
        warn(dropped.report, "The mesh is not closed, so it neither parts nor joins where it melts.");
    } else {
        return melting.error();
    }
    return Success{};
}

} // namespace

bool can_melt(const DroppedBody& dropped) {
    const Material& material = dropped.body->material;
    return material.model == MaterialModel::mpm && material.melts();
}

double torch_radius(const DroppedBody& dropped, const Torch& torch) {
    constexpr double kSpacings = 4; // less does not flow on the body's grid
    return std::max(torch.size * dropped.longest, kSpacings * dropped.body->spacing() / dropped.scale);
}

HeatSource torch_at(const DroppedBody& dropped, const Vec3d& place, const Torch& torch) {
    const Material& material = dropped.body->material;
    const double radius = dropped.scale * torch_radius(dropped, torch);
    const double mass = 2.0 / 3 * std::numbers::pi * radius * radius * radius * material.density; // of half a ball
    HeatSource source;
    source.ball = {dropped.scale * place, radius};
    source.power.constant =
        (torch.cools ? -1 : 1) * mass * heat_of_melting(material) / (torch.seconds * dropped.world.heat_pace);
    return source;
}

World world_of_drop(const DropOptions& options, const Box& box, double scale, const Vec3d& up) {
    DroppedBody dropped;
    DropBuilder(options, up, box, scale).build(dropped);
    return std::move(dropped.world);
}

Result<std::shared_ptr<const DroppedBody>> make_dropped_body(std::shared_ptr<const Model> model,
                                                             std::shared_ptr<const BreakingModel> breaking,
                                                             const BodyLook& look, const DropOptions& options,
                                                             std::span<const Index> pinned, const Vec3d& up,
                                                             const RunContext& context) {
    const Box box = bounds(model->mesh);
    const double longest = box.size().maxCoeff();
    if (!(longest > 0))
        return Error{ErrorCode::unsuitable,
                     "A body needs a mesh with a volume, and all points of this one lie at one place."};
    auto dropped = std::make_shared<DroppedBody>();
    dropped->model = std::move(model);
    dropped->longest = longest;
    dropped->scale = options.size / longest;
    BodyOptions body_options;
    body_options.scale = dropped->scale;
    body_options.cells.count = options.particles;
    const Mesh& whole = breaking ? *breaking->whole : dropped->model->mesh;
    Result<Body> body = make_body(whole, options.material, body_options, context, &dropped->report);
    if (!body) return body.error();
    dropped->body = std::make_shared<const Body>(std::move(*body));
    const Vec3d gravity = options.gravity ? Vec3d(-kEarthGravity * up) : Vec3d(Vec3d::Zero());
    if (const OwnWeight weight = own_weight(*dropped->body, Mat3d::Identity(), gravity); weight.is_too_much())
        warn(dropped->report, fmt::format("The body {}; {:.1g} m long, or with a Young's modulus of {:.0e} Pa, it can.",
                                          weight.sentence("such soft matter"), weight.size_that_does(options.size),
                                          weight.modulus_that_does()));
    dropped->coarse_driver =
        coarse_driver(measure_driver(*dropped->model, *dropped->body), *dropped->model, *dropped->body);
    if (breaking) {
        FractureMaterial material;
        const double stiffness = options.material.young_modulus;
        material.strength = options.strength * stiffness;
        material.energy = usual_fracture_energy(material.strength, stiffness, dropped->scale * box.diagonal());
        Result<Fracture> fracture = make_fracture(dropped->body, breaking->cells, dropped->scale, material, context);
        if (!fracture) return fracture.error();
        dropped->fracture = std::make_shared<const Fracture>(std::move(*fracture));
        dropped->breaking = std::move(breaking);
    }
    DropBuilder(options, up, box, dropped->scale).build(*dropped);
    hold_pinned(pinned, *dropped);
    if (can_melt(*dropped))
        if (const Status melts = let_it_melt(options, look, *dropped, context); !melts) return melts.error();
    return std::shared_ptr<const DroppedBody>(std::move(dropped));
}

Box room_of(const DroppedBody& dropped, const Vec3d& up) {
    const Vec3d origin = dropped.model->mesh.origin;
    Box room = world_bounds(dropped.model->mesh);
    const Surroundings& around = dropped.surroundings;
    if (around.has_ground) {
        int axis = 0;
        up.maxCoeff(&axis);
        Vec3d low = room.min, high = room.max;
        low[axis] = high[axis] = origin[axis] + around.ground_level;
        room.extend(low);
        room.extend(high);
    }
    for (const Mesh& obstacle : around.obstacles) {
        const Box box = bounds(obstacle.positions);
        room.extend(origin + box.min);
        room.extend(origin + box.max);
    }
    return room;
}

} // namespace filigree
